"""The contact laws at one contact, the solvers on whole problems, and the residual that judges them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from mechanics.contact.assembly import delassus, sparse_form
from mechanics.problem import ContactProblem, ContactStart, Delassus
from mechanics.residual import natural_map, project_on_cone
from mechanics.scene import Fidelity, Method, SolverSettings
from mechanics.solvers._kernels import apply_delassus, local_factors, solve_contact
from mechanics.solvers.admm import ADMM
from mechanics.solvers.choice import choose_solver
from mechanics.solvers.nsgs import NSGS
from mechanics.stepping import compliances, contact_problem, free_motion
from moma.errors import SceneError, SolverError
from tests.mechanics.shapes import brick, detected, ground, scene

STEP = 2e-3
number = st.integers(-1000, 1000).map(lambda i: i / 500)


def solve_one(w, b, mu):
    r = np.full(3, np.nan)
    solve_contact(local_factors(w[None])[0], b, mu, r)
    return r, w @ r + b


def assert_signorini_coulomb(w, b, mu, r, u):
    force, speed = np.linalg.norm(b) / np.linalg.norm(w, 2), np.linalg.norm(b)
    ease = 1e-10 * np.linalg.cond(w)
    assert r[0] >= 0
    assert u[0] >= -ease * speed
    assert r[0] * u[0] <= ease * force * speed
    tangential, slip = np.linalg.norm(r[1:]), np.linalg.norm(u[1:])
    assert tangential <= mu * r[0] + ease * force
    # r_T ‖u_T‖ = -μ r_N u_T: sliding is opposed by the whole friction, and what does not slide satisfies it
    np.testing.assert_allclose(r[1:] * slip, -mu * r[0] * u[1:], atol=ease * force * speed * (1 + mu))


@settings(max_examples=300, deadline=None)
@given(
    st.lists(number, min_size=9, max_size=9),
    st.lists(number, min_size=3, max_size=3),
    st.sampled_from([0.0, 1e-3, 0.3, 0.6, 1.0, 3.0]),
    st.sampled_from([1e-6, 1.0, 1e6]),
)
def test_one_contact_obeys_signorini_and_coulomb(root, b, mu, scale):
    root, b = np.array(root).reshape(3, 3), np.array(b)
    w = scale * (root @ root.T + 0.05 * np.trace(root @ root.T) * np.eye(3))
    assume(np.linalg.norm(w) > 1e-3 * scale)
    # friction that wedges (μ W_NT over W_NN too large) may have no solution or several: another matter
    assume(mu * np.linalg.norm(w[0, 1:]) < w[0, 0])
    r, u = solve_one(w, b, mu)
    assert_signorini_coulomb(w, b, mu, r, u)


W = np.array([[2.0, 0.3, -0.2], [0.3, 1.5, 0.1], [-0.2, 0.1, 1.0]])


def test_a_contact_that_separates_is_open():
    r, u = solve_one(W, np.array([0.1, 5.0, 5.0]), 0.6)
    np.testing.assert_array_equal(r, 0)
    np.testing.assert_array_equal(u, [0.1, 5, 5])


def test_a_contact_pressed_straight_sticks():
    r, u = solve_one(W, -W @ [1.0, 0.3, 0.4], 0.6)
    np.testing.assert_allclose(r, [1.0, 0.3, 0.4], rtol=1e-12)
    np.testing.assert_allclose(u, 0, atol=1e-14)


def test_a_contact_pushed_sideways_slides_against_the_whole_friction():
    r, u = solve_one(W, np.array([-1.0, 2.0, -1.0]), 0.6)
    assert np.linalg.norm(r[1:]) == pytest.approx(0.6 * r[0], rel=1e-12)
    assert u[0] == pytest.approx(0, abs=1e-13)
    np.testing.assert_allclose(u[1:] / np.linalg.norm(u[1:]), -r[1:] / np.linalg.norm(r[1:]), rtol=1e-11)


def test_without_friction_the_impulse_is_normal():
    r, u = solve_one(W, np.array([-1.0, 2.0, -1.0]), 0.0)
    np.testing.assert_allclose(r, [0.5, 0, 0])
    assert u[0] == pytest.approx(0, abs=1e-15)


@settings(max_examples=200, deadline=None)
@given(number, number, number, st.sampled_from([0.0, 0.3, 1.0, 5.0]))
@example(0.0, 0.0, 0.0, 0.6)
@example(-1.0, 0.0, 0.0, 0.6)
def test_projection_on_the_cone_is_the_nearest_point(n, t1, t2, mu):
    """Moreau: x = P + Q with P in the cone, Q in its polar, P·Q = 0."""
    x = np.array([n, t1, t2])
    p = project_on_cone(x[None], np.array([mu]))[0]
    q = x - p
    assert np.linalg.norm(p[1:]) <= mu * p[0] + 1e-12
    assert mu * np.linalg.norm(q[1:]) <= -q[0] + 1e-12
    assert abs(p @ q) < 1e-12


def problem_of(one, theta=1.0):
    """The first step's problem of a scene."""
    model, state, contacts = detected(one)
    compliance = compliances(model, STEP, theta)
    operator = delassus(model, state, contacts, compliance)
    sparse = sparse_form(model, state, contacts, operator, compliance) if compliance else None
    free = free_motion(model, state, compliance, STEP, theta)
    return model, contacts, contact_problem(model, state, contacts, operator, sparse, free, STEP, theta)


def cold(problem):
    zero = np.zeros_like(problem.u_free)
    return ContactStart(zero, zero.copy())


def small(unit=1.0, soft=Fidelity.DEFORMABLE):
    """An elastic stone pushed along the ground, with a rigid one on it that slides."""
    push = (0.3, 0.1, 0, 0, 0, 0)
    return scene(
        ground(),
        brick("soft", (0, 0, 0), (0.6, 0.4, 0.3), soft, mesh_size=0.3, velocity=push),
        brick("hard", (0.1, 0, 0.3), (0.6, 0.4, 0.6), velocity=(-1.0, 0, 0, 0, 0, 0)),
        step=STEP,
        friction=0.4,
    )


def resultants(model, contacts, impulse):
    world = np.einsum("cij,ci->cj", contacts.frame, impulse)
    total = np.zeros((len(model.mass), 3))
    np.add.at(total, contacts.bodies[:, 0], world)
    np.subtract.at(total, contacts.bodies[:, 1], world)
    return total


def test_gauss_seidel_and_admm_agree_where_the_answer_is_unique():
    model, contacts, problem = problem_of(small())
    answers = [s(problem, cold(problem)) for s in (NSGS(1e-10, 50000), ADMM(1e-10, 20000))]
    assert all(a.converged and a.natural_map <= 1e-10 for a in answers)
    u = [apply_delassus(a.impulse, *problem.delassus.arrays)[0] + problem.u_free for a in answers]
    # single impulses need not agree, where more contacts carry a rigid stone than it has freedoms
    np.testing.assert_allclose(u[0], u[1], atol=1e-7 * np.abs(problem.u_free).max())
    pushed = [resultants(model, contacts, a.impulse) for a in answers]
    np.testing.assert_allclose(pushed[0], pushed[1], atol=1e-7 * np.abs(pushed[0]).max())


@pytest.mark.parametrize("solver", [NSGS(1e-9, 50000), ADMM(1e-9, 20000)])
def test_the_solution_obeys_the_laws_at_every_contact(solver):
    _, _, problem = problem_of(small())
    r = solver(problem, cold(problem)).impulse
    u = apply_delassus(r, *problem.delassus.arrays)[0] + problem.u_free
    normal, slip = u[:, 0] + problem.bias, np.linalg.norm(u[:, 1:], axis=1)
    force, speed = np.abs(r).max(), np.abs(problem.u_free).max()
    assert (r[:, 0] >= 0).all()
    assert normal.min() > -1e-6 * speed
    assert np.abs(normal * r[:, 0]).max() < 1e-6 * force * speed
    assert (np.linalg.norm(r[:, 1:], axis=1) <= problem.friction * r[:, 0] + 1e-7 * force).all()
    opposed = r[:, 1:] * slip[:, None] + (problem.friction * r[:, 0])[:, None] * u[:, 1:]
    assert np.abs(opposed).max() < 1e-6 * force * speed


def test_a_warm_start_from_the_solution_needs_no_iteration():
    _, _, problem = problem_of(small())
    for solver in (NSGS(1e-8, 50000), ADMM(1e-8, 20000)):
        first = solver(problem, cold(problem))
        again = solver(problem, ContactStart(first.impulse, first.velocity))
        assert first.iterations > 0
        assert again.iterations == 0
        np.testing.assert_allclose(again.impulse, first.impulse, atol=1e-12 * np.abs(first.impulse).max())


@pytest.mark.parametrize("solver", [NSGS(1e-12, 3), ADMM(1e-12, 3)])
def test_a_step_left_unsolved_is_reported_with_its_true_residual(solver):
    _, _, problem = problem_of(small())
    answer = solver(problem, cold(problem))
    assert not answer.converged
    assert answer.natural_map > 1e-12
    assert answer.natural_map == natural_map(problem, answer.impulse)
    assert 3 <= answer.iterations <= 4


def test_admm_refuses_a_problem_without_elastic_stones():
    _, _, problem = problem_of(small(soft=Fidelity.RIGID))
    with pytest.raises(SolverError, match="nsgs"):
        ADMM()(problem, cold(problem))


@pytest.mark.parametrize(
    ("method", "deformable", "expected"),
    [
        (Method.AUTO, False, NSGS),
        (Method.AUTO, True, ADMM),
        (Method.NSGS, True, NSGS),
        (Method.ADMM, True, ADMM),
    ],
)
def test_the_scene_chooses_the_solver(method, deformable, expected):
    solver = choose_solver(SolverSettings(method, 1e-5, 77), deformable)
    assert isinstance(solver, expected)
    assert (solver.tolerance, solver.max_iterations) == (1e-5, 77)


def test_admm_on_rigid_stones_alone_is_refused_with_the_remedy():
    with pytest.raises(SceneError, match="admm needs a deformable block"):
        choose_solver(SolverSettings(Method.ADMM), deformable=False)


# --- the natural map ---


def test_natural_map_is_one_without_impulses_and_zero_at_the_solution():
    _, _, problem = problem_of(small())
    assert natural_map(problem, np.zeros_like(problem.u_free)) == pytest.approx(1.0, rel=1e-14)
    solved = NSGS(1e-13, 200000)(problem, cold(problem))
    assert solved.natural_map <= 1e-13


def test_natural_map_is_zero_where_nothing_touches_or_nothing_presses():
    _, _, problem = problem_of(scene(ground(), brick("a", (0, 0, 5), (1, 1, 6)), step=STEP))
    assert natural_map(problem, np.zeros((0, 3))) == 0.0
    lifted = brick("a", (0, 0, 0), (1, 1, 1), velocity=(0, 0, 1.0, 0, 0, 0))
    _, _, problem = problem_of(scene(ground(), lifted, step=STEP))
    assert natural_map(problem, np.zeros((4, 3))) == 0.0


def scaled(problem, mass, speed):
    """The same problem with masses and velocities in other units."""
    d: Delassus = problem.delassus
    w = replace(d, response=d.response / mass, block=d.block / mass, diagonal=d.diagonal / mass)
    return ContactProblem(w, problem.u_free * speed, problem.bias * speed, problem.friction)


@pytest.mark.parametrize(("mass", "speed"), [(1e3, 1.0), (1.0, 1e-3), (1e-6, 1e4)])
def test_natural_map_does_not_depend_on_the_units(mass, speed):
    _, _, problem = problem_of(small())
    r = NSGS(0.0, 5)(problem, cold(problem)).impulse
    other = scaled(problem, mass, speed)
    assert natural_map(other, r * mass * speed) == pytest.approx(natural_map(problem, r), rel=1e-9)
    assert natural_map(problem, r) > 1e-6


def test_natural_map_sees_a_wrong_impulse():
    _, _, problem = problem_of(small())
    r = NSGS(1e-12, 200000)(problem, cold(problem)).impulse
    assert natural_map(problem, 1.01 * r) > 1e-4
    assert natural_map(problem, -r) > 0.5
