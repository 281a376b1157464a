"""Walls at rest: forces that hold them are kept, whatever the number of steps."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.generated import running_bond
from benchmarks.scenes import engine_scene
from mechanics.contact.contacts import gaps
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.problem.problem import ContactStart
from mechanics.solvers.strategies.auto import Auto
from mechanics.solvers.strategies.settled import settled


@pytest.fixture(scope="module")
def rest():
    """Wall of 10 courses of 10 bricks on a slab for 80 steps of 1 ms."""
    wall = engine_scene(running_bond(10, 10), step=1e-3, theta=0.5, tolerance=1e-6, sweeps=2000)
    simulation = Simulation(*build_model(wall))
    return [simulation.step() for _ in range(80)]


def test_a_settled_wall_keeps_its_forces(rest):
    # they are balanced again in few steps, each by a few iterations on the factors of the first
    work = [step.solution.iterations for step in rest[1:]]
    assert all(step.solution.converged for step in rest)
    assert max(work) <= 10
    assert np.count_nonzero(work) <= 10


def test_a_settled_wall_neither_speeds_up_nor_opens(rest):
    free = 9.81 * 1e-3
    for step in rest[1:]:
        assert np.abs(step.after.velocity[:, :3]).max() <= 1e-8 * free
    last = rest[-1]
    # contacts may break their law by 10⁻⁵ g h, which is an ångström in a step: gaps stay far below
    assert np.abs(gaps(last.contacts, last.after)).max() <= 1e-6 * free * 1e-3


def test_a_push_is_no_rest(rest):
    last = rest[-1]
    problem, warm = last.problem, ContactStart(last.solution.impulse, last.solution.velocity)
    pushed = replace(problem, u_free=problem.u_free + np.array([0.0, 1e-3, 0.0]))
    assert settled(pushed, warm, (1e-6, 1e-5), Auto()) is None
    kept = settled(problem, warm, (1e-6, 1e-5), Auto())
    assert kept is not None
    assert kept.impulse is warm.impulse
