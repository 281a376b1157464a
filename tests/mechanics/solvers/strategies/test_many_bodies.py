"""The strategy for rigid scenes of many bodies: penalties in turn where forces change steadily."""

import numpy as np
import pytest

from benchmarks.tower import tower_scene
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.scene.scene import SolverSettings
from mechanics.solvers.first_order.body_admm import BodyADMM, Stage
from mechanics.solvers.strategies import rigid

_LIMITS = 1e-5, 1e-2
_STEP = 5e-3  # [s]
_MOVING = 14  # steps after which the tower moves


def shaken(steps):
    """Return the steps of a tower of 300 blocks that comes to rest and is shaken."""
    tolerance, velocity = _LIMITS
    scene = tower_scene(
        300,
        _STEP,
        _MOVING,
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
