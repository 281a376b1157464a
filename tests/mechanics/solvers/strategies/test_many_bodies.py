"""The strategy for rigid scenes of many bodies: penalties in turn where forces change steadily."""

import numpy as np
import pytest

from benchmarks.tower import tower_scene
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.scene import SolverSettings
from mechanics.solvers.first_order.body_admm import BodyADMM, Stage
from mechanics.solvers.strategies import rigid

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
