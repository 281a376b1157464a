"""Newton's method on the natural map: its derivative, its convergence, and what it does where it fails."""

import itertools
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mechanics.problem.problem import ContactStart
from mechanics.problem.residual import natural_map, project_on_cone
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import ContactSettings, Fidelity
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.second_order.newton import Newton, projection_derivative
from moma.errors import SolverError
from tests.mechanics.dense_operator import products_alone
from tests.mechanics.shapes import brick, ground, posed, scene

SOFT = Fidelity.DEFORMABLE


@cache
def pushed(law=None, friction=0.4):
    """An elastic stone that slides along the ground, and a rigid one on it that slides the other way."""
    one = scene(
        ground(),
        brick("lower", (0, 0, 0), (0.6, 0.4, 0.3), SOFT, velocity=(0.3, 0.1, 0, 0, 0, 0), mesh_size=0.25),
        brick("upper", (0.1, 0, 0.3), (0.6, 0.4, 0.6), velocity=(-1.0, 0, 0, 0, 0, 0)),
        friction=friction,
    )
    return posed(one if law is None else replace(one, contact=ContactSettings(law))).problem


def cold(problem):
    zero = np.zeros_like(problem.u_free)
    return ContactStart(zero, zero.copy())


@cache
def solved(law=None):
    problem = pushed(law)
    answer = NSGS(1e-13, 1.0, 200000)(problem, cold(problem))
    assert answer.natural_map <= 1e-12
    return answer


# --- the derivative of the projection ---


def difference(point, mu, k, step=1e-6):
    """Central differences of the projection (3, 3)."""
    columns = []
    for axis in range(3):
        shift = np.zeros((1, 3))
        shift[0, axis] = step
        ahead, behind = (project_on_cone(point + sign * shift, mu, k) for sign in (1, -1))
        columns.append((ahead - behind)[0] / (2 * step))
    return np.stack(columns, axis=-1)


CASES = {
    "inside": ((1.0, 0.2, 0.1), 0.5, 0.0),
    "inside, with cohesion": ((0.5, 0.6, -0.3), 0.5, 0.5),
    "open": ((-1.0, 0.2, 0.1), 0.5, 0.0),
    "open without friction": ((-1.0, 0.2, 0.1), 0.0, 0.0),
    "below, held by cohesion": ((-1.0, 0.2, 0.1), 0.5, 0.4),
    "below, no friction, held": ((-1.0, 0.2, 0.1), 0.0, 0.4),
    "sliding": ((1.0, 1.5, -0.4), 0.5, 0.0),
    "sliding from below": ((-0.1, 1.5, -0.4), 0.5, 0.0),
    "sliding with cohesion": ((1.0, 1.5, -0.4), 0.5, 0.3),
    "sliding without friction": ((1.0, 1.5, -0.4), 0.0, 0.0),
    "sliding at a constant limit": ((1.0, 1.5, -0.4), 0.0, 0.3),
    "edge": ((-1.0, 0.9, 0.1), 0.3, 0.4),
    "edge, no friction": ((-1.0, 0.9, 0.1), 0.0, 0.4),
    "steep cone": ((1.0, 9.0, 2.0), 3.0, 0.0),
}


@pytest.mark.parametrize(("point", "mu", "k"), CASES.values(), ids=CASES)
def test_the_derivative_of_the_projection_is_that_of_differences(point, mu, k):
    point, mu, k = np.array([point]), np.array([mu]), np.array([k])
    exact = projection_derivative(point, mu, k)[0]
    np.testing.assert_allclose(exact, difference(point, mu, k), atol=1e-8)


@given(
    st.tuples(*[st.floats(-2, 2)] * 3),
    st.sampled_from([0.0, 0.3, 0.8, 2.0]),
    st.sampled_from([0.0, 0.5, 1.0]),
)
@settings(max_examples=300, deadline=None)
def test_it_is_so_everywhere_but_at_kinks(point, mu, k):
    point, mu, k = np.array([point]), np.array([mu]), np.array([k])
    n, t = point[0, 0], np.linalg.norm(point[0, 1:])
    # kinks: r_N = 0 inside the disc, the cone's surface, and where the foot reaches r_N = 0; the axis has no direction
    kinks = n, t - k[0], t - mu[0] * n - k[0], n + mu[0] * (t - k[0])
    assume(min(map(abs, kinks)) > 1e-3)
    assume(t > 1e-2)  # the difference itself is wrong by (1e-5 / t)² near the axis
    exact = projection_derivative(point, mu, k)[0]
    np.testing.assert_allclose(exact, difference(point, mu, k, 1e-5), atol=1e-6)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_it_is_symmetric_and_shortens(seed):
    """As a projection on a convex set has it: symmetric, eigenvalues from 0 to 1, at kinks too."""
    rng = np.random.default_rng(seed)
    point = np.round(rng.normal(size=(40, 3)), 1)
    mu, k = rng.choice([0.0, 0.5, 1.0], 40), rng.choice([0.0, 0.5], 40)
    derivative = projection_derivative(point, mu, k)
    np.testing.assert_allclose(derivative, derivative.transpose(0, 2, 1), atol=1e-15)
    values = np.linalg.eigvalsh(derivative)
    assert values.min() > -1e-12
    assert values.max() < 1 + 1e-12


# --- the method ---


@pytest.mark.parametrize("law", [None, MortarJoint(0.4, 200.0, 1000.0)], ids=["dry", "mortar"])
def test_from_nearby_it_converges_quadratically(law):
    """η falls from 1e-4 to 1e-12 within four steps, each at least as good as a power of 1.5 of the last."""
    problem, exact = pushed(law), solved(law)
    rng = np.random.default_rng(0)
    size = np.abs(exact.impulse).max()
    start = ContactStart(exact.impulse + 1e-4 * size * rng.normal(size=exact.impulse.shape), exact.velocity)
    eta = [natural_map(problem, start.impulse)]
    for count in range(1, 5):
        eta.append(Newton(0.0, 0.0, count)(problem, start).natural_map)
        if eta[-1] < 1e-12:
            break
    assert eta[0] > 1e-5
    assert eta[-1] < 1e-12
    for last, new in itertools.pairwise(eta):
        assert new < max(last**1.5, 1e-12)


def test_it_finds_the_solution_of_sweeps():
    problem, exact = pushed(), solved()
    rng = np.random.default_rng(1)
    start = exact.impulse * (1.0 + 1e-2 * rng.normal(size=exact.impulse.shape))
    answer = Newton(1e-11, 1.0)(problem, ContactStart(start, exact.velocity))
    assert answer.converged
    assert answer.natural_map == natural_map(problem, answer.impulse)
    u = [problem.delassus.apply(r) for r in (answer.impulse, exact.impulse)]
    np.testing.assert_allclose(u[0], u[1], atol=1e-8 * np.abs(problem.u_free).max())


def test_at_the_solution_nothing_is_done():
    problem, exact = pushed(), solved()
    answer = Newton(1e-10, 1.0)(problem, ContactStart(exact.impulse, exact.velocity))
    assert answer.iterations == 0
    np.testing.assert_array_equal(answer.impulse, exact.impulse)


@pytest.mark.parametrize("seed", range(5))
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
    assert answer.natural_map == natural_map(problem, answer.impulse)
    assert answer.natural_map <= natural_map(problem, start.impulse)
    # more steps never give a worse one
    assert answer.natural_map >= Newton(1e-15, 0.0, count + 5)(problem, start).natural_map


def test_no_contacts_are_no_work():
    problem = posed(scene(ground(), brick("a", (0, 0, 5), (1, 1, 6)))).problem
    answer = Newton()(problem, cold(problem))
    assert answer.converged
    assert answer.iterations == 0


def test_a_problem_that_cannot_be_factorised_is_refused():
    with pytest.raises(SolverError, match="Newton: the problem has no sparse form"):
        Newton()(products_alone(pushed()), cold(pushed()))


def test_rigid_stones_on_more_contacts_than_they_have_freedoms():
    """W is singular: a block on four points, of which it needs three, pushed along the ground."""
    one = posed(
        scene(ground(), brick("a", (0, 0, 0), (1, 1, 1), velocity=(1.0, 0, 0, 0, 0, 0)), friction=0.3)
    )
    problem = one.problem
    nearly = NSGS(1e-3, 1.0)(problem, cold(problem))
    answer = Newton(1e-12, 1.0)(problem, ContactStart(nearly.impulse, nearly.velocity))
    assert answer.converged
    # weight and friction over one step of 2 ms: r_N = m g h, and it slides on against μ r_N
    weight = 2000.0 * 9.81 * 2e-3
    total = np.einsum("cij,ci->j", one.contacts.frame, answer.impulse)
    np.testing.assert_allclose(total, [-0.3 * weight, 0.0, weight], atol=1e-9 * weight)
