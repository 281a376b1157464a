"""The registry of solvers, and what every solver owes on whole problems."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SolverError
from mechanics.problem.problem import ContactStart
from mechanics.problem.residual import natural_map
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import ContactSettings, Method, Placement, SolverSettings
from mechanics.solvers.auto import Auto
from mechanics.solvers.chain import Chain
from mechanics.solvers.choice import choose_planar_solver, choose_solver
from mechanics.solvers.first_order.body_admm import BodyADMM
from mechanics.solvers.first_order.disk_admm import DiskADMM
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.second_order.newton import Newton
from tests.mechanics.shapes import brick, ground, posed, scene
from tests.mechanics.solvers.problems import BACK, FORWARD, RIGID, SOFT, cold, stack, velocity_of

METHODS = [(method, RIGID) for method in Method] + [(m, SOFT) for m in Method if m is not Method.ADMM]
EVERY = pytest.mark.parametrize(("method", "fidelity"), METHODS)


def solver(method, eta, iterations=100_000, fidelity=RIGID):
    return choose_solver(SolverSettings(method, eta, 1e-3, iterations), fidelity is SOFT)


def sliding(fidelity, law=None, **contact):
    """A stone pushed along the ground, with a rigid one on it that slides."""
    one = stack(fidelity, below=FORWARD, above=BACK)
    settings = ContactSettings(law, **contact) if law else replace(one.contact, **contact)
    return posed(replace(one, contact=settings))


def resultants(one, impulse):
    """Impulses on each body, world axes."""
    contacts = one.contacts
    world = np.einsum("cij,ci->cj", contacts.frame, impulse)
    total = np.zeros((len(one.model.mass), 3))
    np.add.at(total, contacts.bodies[:, 0], world)
    np.subtract.at(total, contacts.bodies[:, 1], world)
    return total


# --- the registry ---


@pytest.mark.parametrize(
    ("method", "deformable", "expected"),
    [
        (Method.AUTO, False, Auto),
        (Method.AUTO, True, Auto),
        (Method.NSGS, True, NSGS),
        (Method.ADMM, False, BodyADMM),
        (Method.INTERIOR_POINT, True, Chain),
        (Method.NEWTON, True, Newton),
    ],
)
def test_the_scene_chooses_the_solver(method, deformable, expected):
    chosen = choose_solver(SolverSettings(method, 1e-5, 1e-3, 77), deformable)
    assert isinstance(chosen, expected)
    assert (chosen.tolerance, chosen.velocity_tolerance, chosen.max_iterations) == (1e-5, 1e-3, 77)


@pytest.mark.parametrize(
    ("method", "expected"),
    [
        (Method.AUTO, Auto), (Method.NSGS, NSGS), (Method.ADMM, DiskADMM), (Method.NEWTON, Newton)
    ],
)  # fmt: skip
def test_disks_of_the_plane_have_methods_of_their_own(method, expected):
    chosen = choose_planar_solver(SolverSettings(method, 1e-5, 1e-3, 77))
    assert isinstance(chosen, expected)
    assert (chosen.tolerance, chosen.velocity_tolerance, chosen.max_iterations) == (1e-5, 1e-3, 77)


@pytest.mark.parametrize(
    ("method", "scene_", "said"),
    [
        (Method.NSGS, {"sprung": True}, 'the method nsgs is for rigid joints; use "auto" where a law has'),
        (Method.ADMM, {"deformable": True}, 'the method admm is for rigid stones; use "auto" where stones'),
    ],
)
def test_a_method_that_does_not_suit_the_scene_is_refused_with_a_remedy(method, scene_, said):
    with pytest.raises(SolverError, match=said):
        choose_solver(SolverSettings(method), **scene_)


def test_interior_points_are_refused_in_the_plane():
    with pytest.raises(SolverError, match='interior-point is for three dimensions; use "newton"'):
        choose_planar_solver(SolverSettings(Method.INTERIOR_POINT))


def test_errors_of_a_motion_that_are_allowed_are_shared_over_its_time():
    exact, loose = (choose_solver(SolverSettings(motion_error=one), duration=2.0) for one in (None, 1e-3))
    assert exact.motion_speed is None
    assert loose.motion_speed == pytest.approx(1e-3 / (8.0 * 2.0))


# --- every solver ---


@pytest.mark.parametrize("fidelity", [RIGID, SOFT])
def test_all_solvers_agree_where_the_answer_is_unique(fidelity):
    """Rigid stones in three points each: in four the forces, and with them the friction that turns, would be free."""
    one = sliding(fidelity, points=3, placement=Placement.INERTIA)
    problem = one.problem
    answers = [
        solver(method, 1e-10, fidelity=fidelity)(problem, cold(problem))
        for method, which in METHODS
        if which is fidelity
    ]
    assert all(a.converged and a.natural_map <= 1e-10 for a in answers)
    for answer in answers[1:]:
        # single impulses need not agree, where more contacts carry a rigid stone than it has freedoms
        u = [velocity_of(problem, a) for a in (answers[0], answer)]
        np.testing.assert_allclose(u[0], u[1], atol=1e-7 * np.abs(problem.u_free).max())
        pushed = [resultants(one, a.impulse) for a in (answers[0], answer)]
        np.testing.assert_allclose(pushed[0], pushed[1], atol=1e-7 * np.abs(pushed[0]).max())


@EVERY
@pytest.mark.parametrize("law", [None, MortarJoint(0.4, 200.0, 1000.0)], ids=["dry", "mortar"])
def test_the_solution_obeys_the_laws_at_every_contact(method, fidelity, law):
    problem = sliding(fidelity, law).problem
    assert (problem.cohesion.max() > 0) == (law is not None)
    answer = solver(method, 1e-9, fidelity=fidelity)(problem, cold(problem))
    assert answer.converged
    r, u = answer.impulse, velocity_of(problem, answer)
    normal, slip = u[:, 0] + problem.bias, np.linalg.norm(u[:, 1:], axis=1)
    force, speed = np.abs(r).max(), np.abs(problem.u_free).max()
    limit = problem.friction * r[:, 0] + problem.cohesion
    assert r[:, 0].min() >= -1e-7 * force
    assert normal.min() > -1e-6 * speed
    assert np.abs(normal * r[:, 0]).max() < 1e-6 * force * speed
    assert (np.linalg.norm(r[:, 1:], axis=1) <= limit + 1e-7 * force).all()
    opposed = r[:, 1:] * slip[:, None] + limit[:, None] * u[:, 1:]
    assert np.abs(opposed).max() < 1e-6 * force * speed
    assert slip.max() > 0.1 * speed  # something slides


@EVERY
def test_a_warm_start_from_the_solution_needs_no_iteration(method, fidelity):
    problem = sliding(fidelity).problem
    # looser the second time: rounding may decide on the very limit
    first = solver(method, 1e-9, fidelity=fidelity)(problem, cold(problem))
    again = solver(method, 1e-8, fidelity=fidelity)(problem, ContactStart(first.impulse, first.velocity))
    assert first.iterations > 0
    assert again.iterations == 0
    np.testing.assert_allclose(again.impulse, first.impulse, atol=1e-9 * np.abs(first.impulse).max())


@EVERY
def test_a_step_left_unsolved_is_reported_with_its_true_residual(method, fidelity):
    problem = sliding(fidelity).problem
    answer = solver(method, 1e-12, 2, fidelity)(problem, cold(problem))
    assert not answer.converged
    assert answer.natural_map > 1e-12
    assert answer.natural_map == pytest.approx(natural_map(problem, answer.impulse), rel=1e-9)
    assert 1 <= answer.iterations <= 2


@EVERY
def test_no_solver_writes_on_what_it_is_given(method, fidelity):
    problem = sliding(fidelity).problem
    start = ContactStart(np.full_like(problem.u_free, 0.1), np.full_like(problem.u_free, 0.2))
    before = problem.u_free.copy()
    solver(method, 1e-8, fidelity=fidelity)(problem, start)
    np.testing.assert_array_equal(start.impulse, 0.1)
    np.testing.assert_array_equal(start.velocity, 0.2)
    np.testing.assert_array_equal(problem.u_free, before)


@pytest.mark.parametrize("method", Method)
def test_a_problem_without_contacts_is_solved(method):
    problem = posed(scene(ground(), brick("a", (0, 0, 5), (1, 1, 6)))).problem
    answer = solver(method, 1e-8)(problem, cold(problem))
    assert answer.converged
    assert (answer.iterations, answer.natural_map, answer.impulse.shape) == (0, 0.0, (0, 3))


@EVERY
def test_a_result_repeats_bit_for_bit(method, fidelity):
    problem = sliding(fidelity).problem
    one, other = (solver(method, 1e-8, fidelity=fidelity)(problem, cold(problem)) for _ in range(2))
    np.testing.assert_array_equal(one.impulse, other.impulse)
