"""Memory of a long run: it grows by the history of its steps, not by what observers keep of each."""

import gc
import tracemalloc

import pytest

from mechanics.simulate import simulate
from tests.mechanics.shapes import brick, ground, scene

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
