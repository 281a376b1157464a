"""The strategy for rigid scenes of many bodies: penalties in turn where forces change steadily."""

from dataclasses import replace

import numpy as np
import pytest
from mechanics.solvers.strategies import rigid
from mechanics.solvers.strategies.compliant import Compliant

from benchmarks.tower import tower_scene
from mechanics.delassus.compliant import CompliantDelassus
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.problem.problem import ContactStart
from mechanics.problem.residual import residual
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.scene import ContactSettings, Scene, SolverSettings, TimeSettings
from mechanics.scene.shapes import bond, wall
from mechanics.solvers.first_order.body_admm import BodyADMM, Stage
from mechanics.solvers.second_order.interior_point import InteriorPoint

_LIMITS = 1e-5, 1e-2
_STEP = 5e-3  # [s]
_MOVING = 14  # steps after which the tower moves
_STRONG = 26  # steps after which it has been shaken for a while


def shaken(steps, motion=_MOVING):
    """Return the steps of a tower of 300 blocks that comes to rest and is shaken for so many steps."""
    tolerance, velocity = _LIMITS
    scene = tower_scene(
        300,
        _STEP,
        motion,
        SolverSettings(tolerance=tolerance, velocity_tolerance=velocity, max_iterations=4000),
    )
    simulation = Simulation(*build_model(scene))
    return [simulation.step() for _ in range(steps)]


@pytest.fixture
def many(monkeypatch):
    """Count a few hundred bodies as many."""
    monkeypatch.setattr(rigid, "_MANY", 100)


def test_a_tower_of_many_blocks_comes_to_rest_and_is_followed_by_iterations_of_bodies_alone(many):
    steps = shaken(_MOVING)
    assert all(step.solution.converged for step in steps)
    assert all(step.solution.natural_map <= _LIMITS[0] for step in steps)
    assert {step.solution.why.split(":")[0] for step in steps} <= {"admm of bodies", "sweeps"}
    assert steps[0].solution.why.startswith("admm of bodies: cold start")


def test_penalties_by_what_a_contact_does_save_nearly_half_of_the_iterations(many):
    # 3,914 here; 4,860 with 0.01 of contacts that stick in all turns, which were longer; two penalties in turn for all
    # contacts alike: 7,620 (0.5 and 0.01), 9,547 (0.5 and 0.02, longer turns)
    moving = shaken(_STRONG, 40)[10:]
    assert all(step.solution.converged for step in moving)
    assert sum(step.solution.iterations for step in moving) < 4500


def on_springs(steps, stiffness=1e10):
    """Return the steps of a tower of 300 blocks with elastic joints, as `shaken`."""
    tolerance, velocity = _LIMITS
    settings = SolverSettings(tolerance=tolerance, velocity_tolerance=velocity, max_iterations=4000)
    law = ElasticJoint(0.6, stiffness, 0.5 * stiffness, 2e-3)
    simulation = Simulation(*build_model(tower_scene(300, _STEP, 40, settings, law)))
    return [simulation.step() for _ in range(steps)]


def test_many_bodies_on_springs_move_as_newton_finds_it_in_a_hundred_iterations_a_step(monkeypatch):
    exact = on_springs(_STRONG)
    monkeypatch.setattr(rigid, "_MANY", 100)
    steps = on_springs(_STRONG)
    assert {step.solution.why for step in exact} == {"compliant joints, Newton"}
    assert {step.solution.why for step in steps} == {"compliant joints, admm of bodies"}
    assert all(step.solution.converged for step in steps)
    # 74 in the mean
    assert sum(step.solution.iterations for step in steps) < 100 * _STRONG
    ends = [one[-1].after.centre - one[0].after.centre for one in (exact, steps)]
    moved = np.abs(ends[0]).max()
    assert moved > 1e-3
    assert np.abs(ends[1] - ends[0]).max() < 0.02 * moved


def test_joints_that_hardly_yield_are_left_to_newton(monkeypatch):
    monkeypatch.setattr(rigid, "_MANY", 100)
    assert {step.solution.why for step in on_springs(3, 1e12)} == {"compliant joints, Newton"}


def test_few_bodies_that_wedge_take_turns_where_one_penalty_does_not_end():
    # 4,720 here; two penalties for all contacts alike and then Newton's method: 9,240, ten times as dear
    moving = shaken(_STRONG, 40)[10:]
    assert all(step.solution.converged for step in moving)
    assert sum(step.solution.iterations for step in moving) < 6000


def test_penalties_in_turn_are_those_of_a_stage_with_factors_of_its_own(many):
    problem = shaken(_MOVING)[-1].problem
    zero = np.zeros_like(problem.u_free)
    start = rigid.ContactStart(zero, zero)
    stages = tuple(Stage(penalty, 20, False) for penalty in (0.5, 0.02, 0.5, 0.02))
    found = BodyADMM(1e-12, 1e-12, 80, stages)(problem, start)
    # the same penalties by name of another number of the same size: no factors are known twice
    near = tuple(Stage(p * (1.0 + k * 1e-14), 20, False) for k, p in enumerate((0.5, 0.02, 0.5, 0.02)))
    again = BodyADMM(1e-12, 1e-12, 80, near)(problem, start)
    np.testing.assert_allclose(found.impulse, again.impulse, atol=1e-6 * np.abs(found.impulse).max())


def test_three_equal_penalties_are_one(many):
    problem = shaken(_MOVING)[-1].problem
    zero = np.zeros_like(problem.u_free)
    start = rigid.ContactStart(zero, zero)
    one, three = (
        BodyADMM(1e-12, 1e-12, 60, (Stage(1.0, 20, False), Stage(penalty, 40, False)))(problem, start)
        for penalty in (0.05, (0.05, 0.05, 0.05))
    )
    np.testing.assert_array_equal(one.impulse, three.impulse)


def test_a_contact_that_sticks_has_the_last_of_three_penalties(many):
    # the first step of a tower at rest: nearly all contacts stick, and find their forces by their small penalty alone
    problem = shaken(1)[0].problem
    zero = np.zeros_like(problem.u_free)
    start = rigid.ContactStart(zero, zero)
    sticking, opening = (
        BodyADMM(*_LIMITS, 400, (Stage(1e-2, 20, False), Stage(penalty, 380, False)))(problem, start)
        for penalty in ((1.0, 1.0, 1e-3), (1e-3, 1.0, 1.0))
    )
    assert sticking.iterations < opening.iterations


def leaning(sideways):
    """A wall of 334 stones, pushed along its courses by a part of its weight, at rest or not."""
    blocks = wall(bond(18, 18), 0.5, 0.25, 0.3)
    gravity = (9.81 * sideways, 0.0, -9.81)
    time = TimeSettings(step=_STEP, duration=_STEP, relaxation=True)
    return Scene("leaning wall", blocks, gravity, ContactSettings(law=DryJoint(0.65)), time=time)


def cold(scene):
    """Return the problem of the first step, and nothing to begin with."""
    step = Simulation(*build_model(scene)).step()
    nothing = np.zeros_like(step.solution.impulse)
    return step.problem, ContactStart(nothing, nothing)


def test_forces_of_rest_are_found_from_nothing_without_the_interior_point(monkeypatch):
    problem, nothing = cold(leaning(0.3))
    path = InteriorPoint()(problem, nothing)
    monkeypatch.setattr(rigid, "InteriorPoint", None)
    found = rigid.Alternating()(problem, nothing)
    assert found.why.startswith("admm of bodies: admm, small penalty stood at")
    left = residual(problem, found.impulse)
    assert left.within(3e-8, 3e-7)
    assert found.iterations < 150
    weigh = problem.delassus.rigid_change
    assert weigh(found.impulse) == pytest.approx(weigh(path.impulse), abs=1e-5 * _STEP * 9.81)


def test_where_they_are_in_vain_the_interior_point_has_its_iterations(monkeypatch):
    problem, nothing = cold(leaning(0.4))
    found = rigid.Alternating(max_iterations=rigid._INTERIOR + 12)(problem, nothing)
    assert found.why.startswith("interior point: admm of bodies stood at")
    assert found.converged


@pytest.mark.parametrize("most", [100, 2000])
def test_compliant_joints_of_some_hundred_bodies_are_solved_within_the_iterations(most):
    problem, nothing = cold(leaning(0.4))
    share = np.full((len(nothing.impulse), 3), 1e-3 * problem.delassus.scale)
    soft = replace(problem, delassus=CompliantDelassus(problem.delassus, share))
    found = Compliant(max_iterations=most)(soft, nothing)
    assert found.iterations <= most
    assert found.converged == (most == 2000)
    if found.converged:
        # further than ADMM goes: what it leaves would be a creep
        assert residual(soft, found.impulse).within(1e-9, 1e-8)
