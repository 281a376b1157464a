"""Every method on a small problem of every law: the same motion and sums of forces, and those of closed forms.

This proves the table of methods and laws in docs/theory.md; the last test holds that table to this file.
"""

import re
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from mechanics.planar.delassus import PlanarDelassus
from mechanics.problem.problem import ContactProblem
from mechanics.problem.residual import natural_map
from mechanics.scene.laws.cohesive_zone import CohesiveZone
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.lennard_jones import LennardJones
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import ContactSettings, Fidelity, Method, Placement, SolverSettings
from mechanics.solvers.choice import choose_planar_solver, choose_solver
from tests.mechanics.shapes import brick, ground, posed, scene
from tests.mechanics.solvers.cone_program import ConeProgram
from tests.mechanics.solvers.problems import cold, velocity_of
from tests.paths import ROOT

RIGID, SOFT = Fidelity.RIGID, Fidelity.DEFORMABLE
STEP, G = 2e-3, 9.81
SIDE = 0.5
MASS = 2000.0 * SIDE**3
WEIGHT = MASS * G * STEP
# each is held to the same as the method that a scene gets where it asks for none
METHODS = list(Method)
DEFORMABLE = [one for one in METHODS if one is not Method.ADMM]
# η that a method is asked for, and iterations
GOAL, ITERATIONS = 1e-9, 2000
HARD, HELD, TORN = 4e5, 2e3, 1e3


@dataclass(frozen=True)
class Case:
    """A cube of 250 kg on the ground, one step of 2 ms.

    Attributes
    ----------
    law : between the cube and the ground
    velocity : (3,) of the cube before the step [m/s]
    total : (3,) impulse on it by momentum, if it is rigid [N s]
    """

    law: object
    velocity: tuple[float, float, float]
    total: tuple[float, float, float]


def stopped(velocity, limit=np.inf):
    """What friction takes from a cube that slides: all its momentum, or the limit."""
    slide = np.array(velocity[:2])
    speed = np.linalg.norm(slide)
    return -slide / max(speed, 1e-300) * min(MASS * speed, limit)


def falls(velocity):
    return -MASS * velocity[2] + WEIGHT


SLIDES, CREEPS, DROPS, PULLED = (0.6, 0.8, 0.0), (3e-3, 4e-3, 0.0), (0.1, 0.0, -1.0), (0.0, 0.0, 0.05)
PRESSED = 0.4 * WEIGHT
CASES = {
    "Signorini": Case(DryJoint(0.0), (0.6, 0.8, -1.0), (0.0, 0.0, falls((0, 0, -1.0)))),
    "Coulomb, stick": Case(DryJoint(0.4), CREEPS, (*stopped(CREEPS), WEIGHT)),
    "Coulomb, slip": Case(DryJoint(0.4), SLIDES, (*stopped(SLIDES, PRESSED), WEIGHT)),
    # it leaves at 0.5 m/s
    "restitution": Case(
        DryJoint(0.4, restitution=0.5), (0, 0, -1.0), (0.0, 0.0, MASS * (0.5 + 1.0) + WEIGHT)
    ),
    # the mortar carries h c_t A more than friction does
    "cohesion": Case(
        MortarJoint(0.4, 0.0, HELD), SLIDES, (*stopped(SLIDES, PRESSED + STEP * HELD * SIDE**2), WEIGHT)
    ),
    "adhesion, held": Case(MortarJoint(0.4, HARD, HARD), PULLED, (0.0, 0.0, falls(PULLED))),
    "adhesion, torn": Case(MortarJoint(0.4, TORN, TORN), (0, 0, 0.5), (0.0, 0.0, -STEP * TORN * SIDE**2)),
    # the pull of the opening h v / 2 in the middle of the step, of 2 G/σ at which the bond is gone
    "cohesive zone": Case(
        CohesiveZone(0.4, TORN, TORN, 10.0, 10.0),
        (0, 0, 0.5),
        (0.0, 0.0, -STEP * TORN * SIDE**2 * (1.0 - 0.5 * STEP * 0.5 / (2.0 * 10.0 / TORN))),
    ),
    # each of the four points pulls with h γ
    "Lennard-Jones": Case(LennardJones(0.4, 50.0, 0.01), (0, 0, 0.5), (0.0, 0.0, -4 * STEP * 50.0)),
}  # fmt: skip


@cache
def posed_case(name, fidelity):
    case = CASES[name]
    cube = brick("a", (0, 0, 0), (SIDE,) * 3, fidelity, velocity=(*case.velocity, 0, 0, 0), mesh_size=SIDE)
    cube = cube if fidelity is SOFT else replace(cube, mesh_size=None)
    return posed(replace(scene(ground(), cube, step=STEP), contact=ContactSettings(case.law)), STEP)


@cache
def reference_of(name, fidelity):
    problem = posed_case(name, fidelity).problem
    return ConeProgram(GOAL, 1e-6)(problem, cold(problem))


@cache
def answer_of(method, name, fidelity):
    problem = posed_case(name, fidelity).problem
    settings = SolverSettings(method, GOAL, 1e-6, ITERATIONS)
    return choose_solver(settings, fidelity is SOFT)(problem, cold(problem))


def total(one, impulse):
    """The sum of r (3,) on the cube, without the shift, world axes."""
    real = impulse.copy()
    if one.problem.adhesion is not None:
        real[:, 0] -= one.problem.adhesion
    return np.einsum("cij,ci->j", one.contacts.frame, real)


EVERY_LAW = pytest.mark.parametrize("name", CASES)
EVERY_METHOD = pytest.mark.parametrize("method", METHODS)
EITHER = pytest.mark.parametrize(
    ("method", "fidelity"), [*((one, RIGID) for one in METHODS), *((one, SOFT) for one in DEFORMABLE)]
)


@EVERY_METHOD
@EVERY_LAW
def test_a_rigid_cube_gets_the_impulse_that_momentum_asks_for(method, name):
    one, answer = posed_case(name, RIGID), answer_of(method, name, RIGID)
    assert answer.converged
    assert answer.natural_map == natural_map(one.problem, answer.impulse) <= GOAL
    size = max(np.linalg.norm(CASES[name].total), WEIGHT)
    # η is over all impulses; where few of many act, the sum is some hundred times less exact
    np.testing.assert_allclose(total(one, answer.impulse), CASES[name].total, atol=1e-6 * size)


@EVERY_LAW
@EITHER
def test_all_methods_find_the_same_motion_and_sum_of_forces(method, name, fidelity):
    one = posed_case(name, fidelity)
    reference, answer = reference_of(name, fidelity), answer_of(method, name, fidelity)
    assert reference.converged
    assert answer.converged
    u = [velocity_of(one.problem, a) for a in (reference, answer)]
    np.testing.assert_allclose(u[1], u[0], atol=1e-6 * np.abs(one.problem.u_free).max())
    sums = [total(one, a.impulse) for a in (reference, answer)]
    np.testing.assert_allclose(sums[1], sums[0], atol=1e-6 * max(np.linalg.norm(sums[0]), WEIGHT))


# --- a stack whose forces are not unique ---


@cache
def wall():
    """Two bricks and one across them, each on four points: 24 impulses for 18 velocities."""
    stones = (
        brick("left", (0, 0, 0), (0.3, 0.3, 0.2)),
        brick("right", (0.3, 0, 0), (0.6, 0.3, 0.2)),
        brick("upper", (0.1, 0, 0.2), (0.5, 0.3, 0.4)),
    )
    return posed(scene(ground(), *stones, friction=0.6, step=STEP), STEP)


@EVERY_METHOD
def test_a_hyperstatic_stack_stands(method):
    """Its forces are not unique; that each stone is at rest, and that the ground carries all three, is."""
    one = wall()
    answer = choose_solver(SolverSettings(method, GOAL, 1e-6, ITERATIONS), False)(
        one.problem, cold(one.problem)
    )
    assert answer.converged
    u = velocity_of(one.problem, answer)
    np.testing.assert_allclose(u, 0.0, atol=1e-6 * G * STEP)
    on_ground = (one.contacts.bodies == 0).any(axis=1)
    sign = np.where(one.contacts.bodies[on_ground, 0] == 0, -1.0, 1.0)
    world = np.einsum("c,cij,ci->j", sign, one.contacts.frame[on_ground], answer.impulse[on_ground])
    weight = 2000.0 * (2 * 0.3 * 0.3 * 0.2 + 0.4 * 0.3 * 0.2) * G * STEP
    np.testing.assert_allclose(world, [0, 0, weight], atol=1e-6 * weight)


# --- points inside the face ---


@EITHER
def test_placement_and_turn_change_nothing(method, fidelity):
    """Points inside the face, and a cube that turns about its axis: the friction is not parallel any more."""
    cube = brick("a", (0, 0, 0), (SIDE,) * 3, fidelity, velocity=(0.2, 0.1, 0, 0, 0, 3.0), mesh_size=SIDE)
    cube = cube if fidelity is SOFT else replace(cube, mesh_size=None)
    contact = ContactSettings(DryJoint(0.4), points=3, placement=Placement.INERTIA)
    one = posed(replace(scene(ground(), cube), contact=contact), STEP)
    problem = one.problem
    settings = SolverSettings(method, GOAL, 1e-6, ITERATIONS)
    solvers = choose_solver(settings, fidelity is SOFT), ConeProgram(GOAL, 1e-6)
    answers = [solver(problem, cold(problem)) for solver in solvers]
    assert all(a.converged for a in answers)
    u = [velocity_of(problem, a) for a in answers]
    np.testing.assert_allclose(u[0], u[1], atol=1e-6 * np.abs(problem.u_free).max())


# --- the plane ---

PLANAR = [one for one in METHODS if one is not Method.INTERIOR_POINT]
PLANAR_CASES = {
    # velocity along and up, μ, bias, k and s of each of two points, total impulse (n, t)
    "Signorini": ((0.5, -1.0), 0.0, 0.0, 0.0, 0.0, (1.0, 0.0)),
    "Coulomb, stick": ((0.2, -1.0), 0.5, 0.0, 0.0, 0.0, (1.0, -0.2)),
    "Coulomb, slip": ((0.7, -1.0), 0.5, 0.0, 0.0, 0.0, (1.0, -0.5)),
    "restitution": ((0.0, -1.0), 0.5, -0.5, 0.0, 0.0, (1.5, 0.0)),
    "cohesion": ((0.9, -1.0), 0.5, 0.0, 0.1, 0.0, (1.0, -0.7)),
    "adhesion, held": ((0.0, 0.4), 0.5, 0.0, 0.0, 0.3, (-0.4, 0.0)),
    "adhesion, torn": ((0.0, 1.0), 0.5, 0.0, 0.0, 0.3, (-0.6, 0.0)),
}


def planar_problem(along, up, friction, bias, cohesion, adhesion):
    """A square of 1 kg, flat, far below its centre on two points of a fixed floor: four impulses, three velocities."""
    lever = np.array([[-0.5, 0.01, 0.0, 0.0], [0.5, 0.01, 0.0, 0.0]])
    inertia = np.array([[1.0, 6.0], [0.0, 0.0]])
    operator = PlanarDelassus(np.array([[0, 1], [0, 1]]), np.tile([0.0, 1.0], (2, 1)), lever, inertia)
    # the tangent is n turned by +90°: to the left
    u_free = np.tile([up, -along], (2, 1))
    pull = np.tile([adhesion, 0.0], (2, 1))
    return ContactProblem(
        operator,
        u_free - operator.apply(pull),
        np.full(2, bias),
        np.full(2, friction),
        np.full(2, cohesion),
        np.full(2, adhesion),
    )


@pytest.mark.parametrize("method", PLANAR)
@pytest.mark.parametrize("name", PLANAR_CASES)
def test_the_same_laws_hold_in_the_plane(method, name):
    (along, up), friction, bias, cohesion, adhesion, expected = PLANAR_CASES[name]
    problem = planar_problem(along, up, friction, bias, cohesion, adhesion)
    answer = choose_planar_solver(SolverSettings(method, GOAL, 1e-6, ITERATIONS))(problem, cold(problem))
    assert answer.converged
    sums = answer.impulse.sum(axis=0) - [2 * adhesion, 0.0]
    # the friction acts below the centre, so the square may tip; it does not within this lever
    np.testing.assert_allclose(sums, [expected[0], -expected[1]], atol=1e-6)


# --- the documented table ---


def test_the_table_of_methods_is_that_of_these_tests():
    text = (ROOT / "docs/theory.md").read_text(encoding="utf-8")
    rows = {m[1]: m[0] for m in re.finditer(r"^\| `([a-z-]+)` \|.*$", text, re.MULTILINE)}
    assert set(rows) == {str(one) for one in METHODS if one is not Method.AUTO}
    for name, row in rows.items():
        cells, method = [cell.strip() for cell in row.strip("|").split("|")], Method(name)
        # rigid, deformable, plane, then the laws
        proven = [method in which for which in (METHODS, DEFORMABLE, PLANAR)]
        assert [cell == "yes" for cell in cells[1:4]] == proven
        assert set(cells[4:10]) == {"yes"}
