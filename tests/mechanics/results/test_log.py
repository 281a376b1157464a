"""Record of a run: what it counts, of the last five steps and stones that may move, and the memory it takes."""

import gc
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import settlement
from mechanics.scene.scene import Method, SolverSettings
from mechanics.simulate import simulate
from tests.mechanics.shapes import brick, ground, scene


def test_the_error_of_the_solver_is_the_largest_of_the_last_five_steps():
    """A slab slides to a stop on another: the error falls with its speed."""
    stones = (
        brick("a", (0, 0, 0), (1, 1, 0.3)),
        brick("b", (0, 0, 0.3), (1, 1, 0.6), velocity=(0.3, 0, 0, 0, 0, 0)),
    )
    one = scene(ground(), *stones, step=4e-3, duration=0.04, stop_at_equilibrium=False)
    result = simulate(replace(one, solver=SolverSettings(Method.NSGS, tolerance=1e-3, max_iterations=50)))
    errors = result.history.natural_map
    assert len(errors) == 10
    assert errors[-1] < 0.8 * errors[-5:].max() < errors.max()
    assert result.errors.natural_map == errors[-5:].max()


def test_a_support_that_sinks_is_no_stone_that_settles():
    """Beside it a block stands on ground that stays."""
    sinking = ground((5.0, -2.0, -1.0), (8.0, 3.0, 0.0), "sinking")
    one = scene(ground(), sinking, brick("a", (0, 0, 0), (1, 1, 0.5)), step=5e-3, duration=0.1)
    result = simulate(replace(one, loads=Loads(motions=(settlement(["sinking"], (0, 0, -0.02), 0.05),))))
    assert result.bodies[1].displacement[:, 2] == pytest.approx(-0.02)
    assert np.abs(result.history.settlement).max() < 1e-5


PER_STEP = 450
"""Bytes: nine numbers of the history, each an object of 24 bytes in a tuple, take 350 with their row."""


@pytest.mark.slow
def test_a_step_adds_its_row_of_the_history_and_no_more():
    """From the 500th of 2,000 steps on, when memories that save time are full."""
    cube = brick("cube", (0, 0, 0), (0.5, 0.5, 0.5))
    one = scene(ground(), cube, step=1e-3, duration=2.0, stop_at_equilibrium=False)
    sizes = {}

    def listen(progress):
        if progress.stage == "step" and progress.done in (500, 1900):
            gc.collect()
            sizes[progress.done] = tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        simulate(one, listen)
    finally:
        tracemalloc.stop()
    grown = (sizes[1900] - sizes[500]) / 1400
    assert grown < PER_STEP
