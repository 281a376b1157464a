"""The solvers on whole problems, and the residual that judges them."""

from dataclasses import replace
from types import FunctionType

import numpy as np
import pytest
from mechanics.solvers.first_order.admm import ADMM
from mechanics.solvers.first_order.apgd import APGD
from mechanics.solvers.second_order.cone_program import ConeProgram
from mechanics.solvers.strategies.auto import Auto
from mechanics.solvers.strategies.planar import Planar
from mechanics.solvers.strategies.rigid import Alternating
from mechanics.solvers.strategies.rigid_first import RigidFirst

from mechanics.delassus.rigid import RigidDelassus
from mechanics.problem.problem import ContactStart
from mechanics.problem.residual import natural_map, residual
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import ContactSettings, Fidelity, Method, Placement, SolverSettings, TimeSettings
from mechanics.solvers.choice import choose_planar_solver, choose_solver, choose_solvers
from mechanics.solvers.first_order.anderson import Anderson
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.newton import Newton
from moma.errors import SolverError
from tests.mechanics.dense_operator import products_alone
from tests.mechanics.shapes import brick, ground, posed, scene

HARD, SOFT = Fidelity.RIGID, Fidelity.DEFORMABLE
SOLVERS = {
    "sweeps": lambda eta: NSGS(eta, 1e-3, 50000),
    "extrapolated": lambda eta: NSGS(eta, 1e-3, 50000, 5, 10),
    "admm": lambda eta: ADMM(eta, 1e-3, 20000),
    "balanced": lambda eta: ADMM(eta, 1e-3, 20000, 0.03, hold=10, balanced=True),
    "in turn": lambda eta: Alternating(eta, 1e-3, 20000),
}
EVERY = pytest.mark.parametrize("solver", SOLVERS.values(), ids=SOLVERS)
BOTH = pytest.mark.parametrize("fidelity", [HARD, SOFT])


def cold(problem):
    zero = np.zeros_like(problem.u_free)
    return ContactStart(zero, zero.copy())


def small(fidelity=SOFT, law=None):
    """A stone pushed along the ground, with a rigid one on it that slides."""
    push = (0.3, 0.1, 0, 0, 0, 0)
    one = scene(
        ground(),
        brick(
            "lower",
            (0, 0, 0),
            (0.6, 0.4, 0.3),
            fidelity,
            velocity=push,
            mesh_size=0.3 if fidelity is SOFT else None,
        ),
        brick("upper", (0.1, 0, 0.3), (0.6, 0.4, 0.6), velocity=(-1.0, 0, 0, 0, 0, 0)),
        friction=0.4,
    )
    return one if law is None else replace(one, contact=ContactSettings(law))


def resultants(one, impulse):
    """Impulses on each body, world axes."""
    contacts = one.contacts
    world = np.einsum("cij,ci->cj", contacts.frame, impulse)
    total = np.zeros((len(one.model.mass), 3))
    np.add.at(total, contacts.bodies[:, 0], world)
    np.subtract.at(total, contacts.bodies[:, 1], world)
    return total


def velocity_after(problem, impulse):
    return problem.delassus.apply(impulse) + problem.u_free


@BOTH
def test_all_solvers_agree_where_the_answer_is_unique(fidelity):
    """Rigid stones in three points each: in four the forces, and with them the friction that turns, would be free."""
    one = small(fidelity)
    one = posed(replace(one, contact=replace(one.contact, points=3, placement=Placement.INERTIA)))
    problem = one.problem
    answers = [make(1e-10)(problem, cold(problem)) for make in SOLVERS.values()]
    assert all(a.converged and a.natural_map <= 1e-10 for a in answers)
    for answer in answers[1:]:
        # single impulses need not agree, where more contacts carry a rigid stone than it has freedoms
        u = [velocity_after(problem, a.impulse) for a in (answers[0], answer)]
        np.testing.assert_allclose(u[0], u[1], atol=1e-7 * np.abs(problem.u_free).max())
        pushed = [resultants(one, a.impulse) for a in (answers[0], answer)]
        np.testing.assert_allclose(pushed[0], pushed[1], atol=1e-7 * np.abs(pushed[0]).max())


@EVERY
@BOTH
@pytest.mark.parametrize("law", [None, MortarJoint(0.4, 200.0, 1000.0)], ids=["dry", "mortar"])
def test_the_solution_obeys_the_laws_at_every_contact(solver, fidelity, law):
    problem = posed(small(fidelity, law)).problem
    assert (problem.cohesion.max() > 0) == (law is not None)
    answer = solver(1e-9)(problem, cold(problem))
    assert answer.converged
    r = answer.impulse
    u = velocity_after(problem, r)
    normal, slip = u[:, 0] + problem.bias, np.linalg.norm(u[:, 1:], axis=1)
    force, speed = np.abs(r).max(), np.abs(problem.u_free).max()
    limit = problem.friction * r[:, 0] + problem.cohesion
    assert (r[:, 0] >= 0).all()
    assert normal.min() > -1e-6 * speed
    assert np.abs(normal * r[:, 0]).max() < 1e-6 * force * speed
    assert (np.linalg.norm(r[:, 1:], axis=1) <= limit + 1e-7 * force).all()
    opposed = r[:, 1:] * slip[:, None] + limit[:, None] * u[:, 1:]
    assert np.abs(opposed).max() < 1e-6 * force * speed
    assert slip.max() > 0.1 * speed  # something slides


@EVERY
@BOTH
def test_a_warm_start_from_the_solution_needs_no_iteration(solver, fidelity):
    problem = posed(small(fidelity)).problem
    first = solver(1e-8)(problem, cold(problem))
    again = solver(1e-8)(problem, ContactStart(first.impulse, first.velocity))
    assert first.iterations > 0
    assert again.iterations == 0
    np.testing.assert_allclose(again.impulse, first.impulse, atol=1e-12 * np.abs(first.impulse).max())


@pytest.mark.parametrize(
    "solver",
    [NSGS(1e-12, 1e-12, 3), NSGS(1e-12, 1e-12, 3, 1, 4), ADMM(1e-12, 1e-12, 3), Alternating(1e-12, 1e-12, 3)],
)
@BOTH
def test_a_step_left_unsolved_is_reported_with_its_true_residual(solver, fidelity):
    problem = posed(small(fidelity)).problem
    answer = solver(problem, cold(problem))
    assert not answer.converged
    assert answer.natural_map > 1e-12
    assert answer.natural_map == natural_map(problem, answer.impulse)
    assert 3 <= answer.iterations <= 4


@EVERY
def test_no_solver_writes_on_what_it_is_given(solver):
    problem = posed(small(HARD)).problem
    start = ContactStart(np.full_like(problem.u_free, 0.1), np.full_like(problem.u_free, 0.2))
    before = problem.u_free.copy()
    solver(1e-8)(problem, start)
    np.testing.assert_array_equal(start.impulse, 0.1)
    np.testing.assert_array_equal(start.velocity, 0.2)
    np.testing.assert_array_equal(problem.u_free, before)


@EVERY
def test_a_problem_without_contacts_is_solved(solver):
    problem = posed(scene(ground(), brick("a", (0, 0, 5), (1, 1, 6)))).problem
    answer = solver(1e-8)(problem, cold(problem))
    assert answer.converged
    assert answer.impulse.shape == (0, 3)


@pytest.mark.parametrize("eta", [1e-4, 1e-8])
def test_the_dual_velocity_is_that_of_the_impulse(eta):
    problem = posed(small(HARD)).problem
    answer = NSGS(eta, 1.0, 50000)(problem, cold(problem))
    u = velocity_after(problem, answer.impulse)
    u[:, 0] += problem.bias + problem.friction * np.linalg.norm(u[:, 1:], axis=1)
    np.testing.assert_allclose(answer.velocity, u, atol=1e-13)


def test_both_tolerances_count():
    problem = posed(small(HARD)).problem
    loose, tight = (NSGS(1e-2, limit, 50000, 1)(problem, cold(problem)) for limit in (1.0, 1e-9))
    assert loose.iterations < tight.iterations
    assert residual(problem, loose.impulse).velocity > 1e-9
    assert residual(problem, tight.impulse).velocity <= 1e-9


def test_admm_without_a_sparse_form_says_what_to_do():
    problem = products_alone(posed(small(HARD)).problem)
    with pytest.raises(SolverError, match='ADMM: the problem has no sparse form; use the method "nsgs"'):
        ADMM()(problem, cold(problem))


def test_solving_in_turn_does_without_a_sparse_form():
    problem = products_alone(posed(small(HARD)).problem)
    assert Alternating(1e-9, 1.0, 20000)(problem, cold(problem)).converged


@pytest.mark.parametrize(
    ("method", "deformable", "expected"),
    [
        (Method.AUTO, False, Auto),
        (Method.AUTO, True, Auto),
        (Method.NSGS, False, NSGS),
        (Method.NSGS, True, NSGS),
        (Method.ADMM, False, ADMM),
        (Method.ADMM, True, ADMM),
        (Method.APGD, False, APGD),
        (Method.INTERIOR_POINT, True, InteriorPoint),
        (Method.NEWTON, True, Newton),
        (Method.CONE, False, ConeProgram),
    ],
)
def test_the_scene_chooses_the_solver(method, deformable, expected):
    solver = choose_solver(SolverSettings(method, 1e-5, 1e-3, 77), deformable)
    assert isinstance(solver, expected)
    assert (solver.tolerance, solver.velocity_tolerance, solver.max_iterations) == (1e-5, 1e-3, 77)


@pytest.mark.parametrize(
    ("elastic", "rigid", "early", "yields"),
    [
        (0, 5000, Auto, True),
        (3, 2, None, False),
        (3, 0, None, False),
        (3, 200, Auto, True),
        (20, 5000, Auto, True),
        (100, 200, Auto, True),
        (100, 5000, FunctionType, True),
    ],
)
def test_joints_may_yield_on_the_way_to_a_rest_where_more_stones_are_rigid(elastic, rigid, early, yields):
    rest, motion = TimeSettings(relaxation=True), TimeSettings(relaxation=False)
    chosen = choose_solvers(SolverSettings(), elastic, rigid, rest)
    assert bool(chosen.compliant) == yields
    assert early is None or isinstance(chosen.early, early)
    assert not elastic or all(isinstance(one, RigidFirst) for _, one in chosen.compliant)
    assert not choose_solvers(SolverSettings(), elastic, rigid, motion).compliant
    assert not choose_solvers(SolverSettings(joint_compliance=0.0), elastic, rigid, rest).compliant


@pytest.mark.parametrize("method", [one for one in Method if one is not Method.INTERIOR_POINT])
def test_disks_of_the_plane_have_a_strategy_of_their_own_where_nothing_else_is_asked_for(method):
    solver = choose_planar_solver(SolverSettings(method, 1e-5, 1e-3, 77))
    other = Planar if method is Method.AUTO else type(choose_solver(SolverSettings(method), False))
    assert isinstance(solver, other)
    assert solver.max_iterations == 77


# --- extrapolation ---


def test_anderson_solves_a_linear_fixed_point_in_as_many_steps_as_it_has_directions():
    """x ← A x + b with four eigenvalues: exact after four differences (Walker & Ni 2011)."""
    rng = np.random.default_rng(0)
    basis = np.linalg.qr(rng.normal(size=(12, 12)))[0]
    a = basis @ np.diag(np.repeat([0.99, 0.9, 0.7, -0.5], 3)) @ basis.T
    b = rng.normal(size=12)
    exact = np.linalg.solve(np.eye(12) - a, b)
    anderson, x = Anderson(6), np.zeros(12)
    errors = []
    for _ in range(9):
        image = a @ x + b
        extrapolated = anderson(x, image)
        x = image if extrapolated is None else extrapolated
        errors.append(np.linalg.norm(x - exact) / np.linalg.norm(exact))
    assert errors[3] > 1e-3
    assert errors[-1] < 1e-5  # plain: 0.99⁹ is still 0.9


def test_anderson_needs_two_steps_and_keeps_still_at_a_fixed_point():
    anderson, x = Anderson(3), np.ones(3)
    assert anderson(x, x) is None
    assert anderson(x, x) is None
    anderson.forget()
    assert anderson(x, 0.5 * x) is not None


# --- the natural map ---


@BOTH
def test_natural_map_is_one_without_impulses_and_zero_at_the_solution(fidelity):
    problem = posed(small(fidelity)).problem
    assert natural_map(problem, np.zeros_like(problem.u_free)) == pytest.approx(1.0, rel=1e-14)
    solved = NSGS(1e-13, 1.0, 200000)(problem, cold(problem))
    assert solved.natural_map <= 1e-13


def test_natural_map_is_zero_where_nothing_touches_or_nothing_presses():
    problem = posed(scene(ground(), brick("a", (0, 0, 5), (1, 1, 6)))).problem
    assert natural_map(problem, np.zeros((0, 3))) == 0.0
    lifted = brick("a", (0, 0, 0), (1, 1, 1), velocity=(0, 0, 1.0, 0, 0, 0))
    problem = posed(scene(ground(), lifted)).problem
    assert natural_map(problem, np.zeros((4, 3))) == 0.0


def scaled(problem, mass, speed):
    """The same problem with masses and velocities in other units."""
    w = problem.delassus
    if isinstance(w, RigidDelassus):
        w = replace(w, inertia=w.inertia / mass)
    else:
        parts = {name: getattr(w, name) / mass for name in ("response", "block", "diagonal", "scale")}
        w = replace(w, **parts)
    return replace(
        problem,
        delassus=w,
        u_free=problem.u_free * speed,
        bias=problem.bias * speed,
        cohesion=problem.cohesion * mass * speed,
        adhesion=problem.adhesion * mass * speed,
    )


@BOTH
@pytest.mark.parametrize("law", [None, MortarJoint(0.4, 200.0, 1000.0)], ids=["dry", "mortar"])
@pytest.mark.parametrize(("mass", "speed"), [(1e3, 1.0), (1.0, 1e-3), (1e-6, 1e4)])
def test_the_residual_does_not_depend_on_the_units(fidelity, law, mass, speed):
    problem = posed(small(fidelity, law)).problem
    r = NSGS(0.0, 0.0, 5)(problem, cold(problem)).impulse
    one, other = residual(problem, r), residual(scaled(problem, mass, speed), r * mass * speed)
    assert other.natural_map == pytest.approx(one.natural_map, rel=1e-9)
    assert other.velocity == pytest.approx(one.velocity, rel=1e-9)
    np.testing.assert_allclose(
        other.error, one.error * mass * speed, rtol=1e-9, atol=1e-12 * one.error.max() * mass * speed
    )
    np.testing.assert_allclose(other.dual, one.dual * speed, rtol=1e-9, atol=1e-12 * speed)
    assert one.natural_map > 1e-6


@BOTH
def test_natural_map_sees_a_wrong_impulse(fidelity):
    problem = posed(small(fidelity)).problem
    r = NSGS(1e-12, 1.0, 200000)(problem, cold(problem)).impulse
    assert natural_map(problem, 1.01 * r) > 1e-4
    assert natural_map(problem, -r) > 0.5
