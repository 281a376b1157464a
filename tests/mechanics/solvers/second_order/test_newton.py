"""Newton's method: its derivatives, its equations against dense ones, its convergence, and what it leaves."""

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground.errors import SolverError
from mechanics.planar.delassus import PlanarDelassus
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import natural_map, residual
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import ContactSettings
from mechanics.solvers._kernels import body_newton as bodies
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.second_order.newton import Newton
from mechanics.solvers.second_order.newton_equations import equations_of
from mechanics.solvers.second_order.scaling import equilibrated
from tests.mechanics.dense_operator import products_alone
from tests.mechanics.planar.shapes import random_problem
from tests.mechanics.shapes import brick, ground, posed, scene
from tests.mechanics.solvers.problems import (
    BACK,
    FORWARD,
    RIGID,
    SOFT,
    STEP,
    G,
    by_path,
    carried,
    cold,
    column,
    few_deformable,
    stack,
    velocity_of,
    yielding,
)

BLOCK = 0.5 * 0.5 * 0.25  # volume of a block of a column [m³]


@cache
def pushed(law=None):
    """An elastic stone that slides along the ground, and a rigid one on it that slides the other way."""
    one = stack(below=FORWARD, above=BACK)
    return posed(one if law is None else replace(one, contact=ContactSettings(law))).problem


@cache
def solved(law=None):
    problem = pushed(law)
    answer = NSGS(1e-13, 1.0, 200_000)(problem, cold(problem))
    assert answer.natural_map <= 1e-12
    return answer


# --- derivatives ---


def projected_form(r, u, mu, k, rho):
    """Alart and Curnier's F, as it is written."""
    pressed = np.maximum(r[0] - rho[0] * u[0], 0.0)
    point, radius = r[1:] - rho[1] * u[1:], mu * pressed + k
    size = np.linalg.norm(point)
    return r - np.append(pressed, point if size <= radius else radius * point / size)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.4, 5.0]), st.sampled_from([0.0, 0.7]))
def test_derivatives_of_alart_and_curniers_function(seed, mu, k):
    rng = np.random.default_rng(seed)
    r, u, rho = rng.normal(size=(1, 3)), rng.normal(size=(1, 3)), rng.uniform(0.5, 2.0, (1, 2))
    error, first, second = np.empty((1, 3)), np.empty((1, 3, 3)), np.empty((1, 3, 3))
    merit = bodies.alart_curnier(r, u, np.array([mu]), np.array([k]), rho, error, first, second)
    wanted = projected_form(r[0], u[0], mu, k, rho[0])
    assert error[0] == pytest.approx(wanted, abs=1e-13)
    assert merit == pytest.approx(0.5 * (wanted**2).sum())
    tiny = 1e-7
    for matrix, by_r in ((first[0], True), (second[0], False)):
        for j in range(3):
            step = np.zeros(3)
            step[j] = tiny
            change = (step, 0.0 * step) if by_r else (0.0 * step, step)
            ahead = projected_form(r[0] + change[0], u[0] + change[1], mu, k, rho[0])
            behind = projected_form(r[0] - change[0], u[0] - change[1], mu, k, rho[0])
            # kinks are met by chance alone
            assert matrix[:, j] == pytest.approx((ahead - behind) / (2 * tiny), abs=1e-5)


def test_blocks_are_inverted_one_by_one():
    rng = np.random.default_rng(2)
    first, second = rng.normal(size=(2, 20, 3, 3))
    inverse, gain = np.empty((2, 20, 3, 3))
    assert bodies.inverse_blocks(first, second, np.full((20, 3), 0.3), inverse, gain)
    assert inverse == pytest.approx(np.linalg.inv(first + 0.3 * second), rel=1e-9)
    assert gain == pytest.approx(inverse @ second, rel=1e-9)
    assert not bodies.inverse_blocks(0 * first, 0 * second, np.full((20, 3), 0.3), inverse, gain)


# --- equations ---


def plane():
    bodies_, normal, lever, inertia = random_problem(5, 6, 9)
    none = np.zeros(9)
    free = np.random.default_rng(5).normal(size=(9, 2))
    return ContactProblem(PlanarDelassus(bodies_, normal, lever, inertia), free, none, none + 0.4, none)


RIGID_COLUMN = column([2000.0, 1500.0, 2500.0], [0.5, 0.3, 0.4])
# a problem, and the error to which equations are solved over their right side [-]
SYSTEMS = {
    "rigid": (lambda: RIGID_COLUMN, 1e-8),
    "on springs": (lambda: yielding(RIGID_COLUMN, 0.1), 1e-8),
    "deformable": (pushed, 1e-5),
    "few deformable, joints yield": (lambda: yielding(few_deformable(), 1e-2), 2e-2),
    "in the plane": (plane, 1e-5),
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_equations_of_a_step_are_those_of_w(name):
    """A Δr + B (W + α) Δr = -F, whatever the kind of bodies, by products with W; again with the same pattern."""
    make, tolerance = SYSTEMS[name]
    problem, _ = equilibrated(make())
    (nc, d), rng = problem.u_free.shape, np.random.default_rng(1)
    equations, alpha = equations_of(problem, np.ones((nc, 2))), 0.7
    for _ in range(2):
        # open, sliding and sticking contacts: A + B is the unit, and both are nearly positive
        share = rng.choice([0.1, 0.5, 0.9], (nc, 1, 1))
        turned = 0.02 * rng.normal(size=(nc, d, d))
        first, second = share * np.eye(d) + turned, (1.0 - share) * np.eye(d) - turned
        error = rng.normal(size=(nc, d))
        step = equations.step(first, second, error, alpha)
        u = problem.delassus.apply(step) + alpha * step
        left = np.einsum("cij,cj->ci", first, step) + np.einsum("cij,cj->ci", second, u) + error
        assert np.linalg.norm(left) <= tolerance * np.linalg.norm(error)


def test_w_that_is_known_by_its_products_alone_is_refused():
    with pytest.raises(SolverError, match="Newton's method: the problem has no sparse form"):
        Newton()(products_alone(pushed()), cold(pushed()))


# --- convergence ---


@pytest.mark.parametrize("law", [None, MortarJoint(0.4, 200.0, 1000.0)], ids=["dry", "mortar"])
def test_from_nearby_it_converges_faster_than_linearly(law):
    """η falls from 1e-4 to 1e-11 within five steps, each at least as good as a power of 1.3 of the last."""
    problem, exact = pushed(law), solved(law)
    rng = np.random.default_rng(0)
    size = np.abs(exact.impulse).max()
    start = ContactStart(exact.impulse + 1e-4 * size * rng.normal(size=exact.impulse.shape), exact.velocity)
    eta = [natural_map(problem, start.impulse)]
    for count in range(1, 6):
        eta.append(Newton(0.0, 0.0, count)(problem, start).natural_map)
        if eta[-1] < 1e-11:
            break
    assert eta[0] > 1e-5
    assert eta[-1] < 1e-11
    for last, new in itertools.pairwise(eta):
        assert new < max(last**1.3, 1e-11)


def test_from_nearby_it_finds_the_velocities_of_sweeps():
    problem, exact = pushed(), solved()
    rng = np.random.default_rng(1)
    near = exact.impulse * (1.0 + 1e-2 * rng.normal(size=exact.impulse.shape))
    answer = Newton(1e-10, 1.0)(problem, ContactStart(near, exact.velocity))
    assert answer.converged
    assert answer.natural_map == pytest.approx(natural_map(problem, answer.impulse), rel=1e-6)
    u = [velocity_of(problem, one) for one in (answer, exact)]
    np.testing.assert_allclose(u[0], u[1], atol=1e-7 * np.abs(problem.u_free).max())


def test_a_column_of_100_takes_a_few_steps_from_nothing():
    problem = column([2000.0] * 100)
    solution = Newton(1e-9, 1e-7)(problem, cold(problem))
    assert solution.converged
    assert solution.iterations <= 20
    weight = 2000.0 * BLOCK * G
    assert carried(problem, solution.impulse) == pytest.approx(weight * np.arange(100, 0, -1), rel=1e-5)


@pytest.mark.parametrize("heavy", [0, 4, 9])
def test_a_mass_ratio_of_a_million_is_solved(heavy):
    densities = [2.0] * 10
    densities[heavy] = 2e6
    problem = column(densities)
    solution = Newton(1e-8, 1e-8)(problem, cold(problem))
    assert solution.converged
    assert solution.iterations <= 30
    above = np.cumsum(densities[::-1])[::-1] * BLOCK * G
    assert carried(problem, solution.impulse) == pytest.approx(above, rel=1e-5)


def test_rigid_stones_on_more_contacts_than_they_have_freedoms():
    """W is singular: a block on four points, of which it needs three, pushed along the ground."""
    block = brick("a", (0, 0, 0), (1, 1, 1), velocity=(1.0, 0, 0, 0, 0, 0))
    one = posed(scene(ground(), block, friction=0.3))
    answer = Newton(1e-10, 1.0)(one.problem, cold(one.problem))
    assert answer.converged
    # weight and friction over one step of 2 ms: r_N = m g h, and it slides on against μ r_N
    weight = 2000.0 * G * 2e-3
    total = np.einsum("cij,ci->j", one.contacts.frame, answer.impulse)
    np.testing.assert_allclose(total, [-0.3 * weight, 0.0, weight], atol=1e-6 * weight)


@pytest.mark.parametrize("share", [1e-4, 1.0])
def test_few_deformable_stones_on_joints_that_yield_are_solved_as_by_the_interior_point(share):
    """Factors in simple terms lead, of single precision and of earlier steps where these do: the step is that of W."""
    problem = yielding(few_deformable(), share)
    exact = by_path(problem, cold(problem))
    found = Newton(1e-8, 1e-7, 60)(problem, ContactStart(0.9 * exact.impulse, exact.velocity))
    assert exact.converged
    assert found.converged
    # with joints that yield forces are determined, but for what slides
    np.testing.assert_allclose(found.impulse, exact.impulse, atol=1e-3 * np.abs(exact.impulse).max())


# --- from nothing, and where it fails ---


@pytest.mark.parametrize("fidelity", [RIGID, SOFT])
def test_from_nothing_a_stone_that_forces_without_cause_could_hold_falls(fidelity):
    """Between two rough walls, without a ground: friction could hold it, if anything pressed the walls together."""
    walls = [ground((x, -0.2, -1.0), (x + 1.0, 0.2, 1.0), f"wall at {x}") for x in (-1.0, 0.5)]
    stone = brick("S", (0.0, -0.2, -0.15), (0.5, 0.2, 0.15), fidelity, mesh_size=0.3)
    problem = posed(scene(*walls, stone, friction=5.0), STEP).problem
    # where no force is needed, η counts rounding against 10⁻⁸ of the impulse that would stop the fall
    found = Newton(1e-6, 1e-6)(problem, cold(problem))
    assert found.converged
    assert np.abs(found.impulse).max() <= 1e-4 * 2000.0 * 0.5 * 0.4 * 0.3 * G * STEP


def test_at_the_solution_nothing_is_done():
    problem, exact = pushed(), solved()
    answer = Newton(1e-10, 1.0)(problem, ContactStart(exact.impulse, exact.velocity))
    assert answer.iterations == 0
    np.testing.assert_allclose(answer.impulse, exact.impulse, rtol=1e-12)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("count", [1, 3, 12])
def test_where_it_fails_it_gives_back_its_best(seed, count):
    problem = pushed()
    rng = np.random.default_rng(seed)
    size = np.abs(problem.u_free).max() / np.abs(problem.delassus.diagonal).mean()
    start = ContactStart(size * rng.normal(size=problem.u_free.shape), np.zeros_like(problem.u_free))
    before = start.impulse.copy()
    answer = Newton(1e-15, 0.0, count)(problem, start)
    np.testing.assert_array_equal(start.impulse, before)
    assert not answer.converged
    assert 1 <= answer.iterations <= count
    assert answer.natural_map == pytest.approx(natural_map(problem, answer.impulse), rel=1e-9)
    assert answer.natural_map <= natural_map(problem, start.impulse) * (1 + 1e-9)
    # more steps never give a worse one
    assert answer.natural_map * (1 + 1e-9) >= Newton(1e-15, 0.0, count + 5)(problem, start).natural_map


def test_impulses_that_are_no_numbers_never_count_as_solved():
    problem = pushed()
    wrong = np.full_like(problem.u_free, np.nan)
    with np.errstate(all="ignore"):
        answer = Newton(1e-8, 1e-6, 5)(problem, ContactStart(wrong, wrong))
    assert not answer.converged
    assert not residual(problem, wrong).within(1e-8, 1e-6)
