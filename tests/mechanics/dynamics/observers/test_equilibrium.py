"""Support reactions against statics by hand, wherever the supports stand in the list of stones."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Fidelity
from mechanics.simulate import simulate
from tests.mechanics.shapes import brick, ground, scene

WEIGHT = 2000.0 * 0.5 * 9.81
STONE = brick("stone", (0, 0, 0), (1, 1, 0.5))
LID = brick("lid", (-1, -1, 0.5), (2, 2, 1.5), Fidelity.FIXED)


def reaction(blocks, pull=0.0):
    """Support reaction of a scene at rest whose stone is pulled upwards by a part of its weight."""
    up = History.constant(np.array([0.0, 0.0, pull * WEIGHT]))
    loads = Loads(forces=(StoneForce(frozenset({"stone"}), up),)) if pull else Loads()
    result = simulate(replace(scene(*blocks, step=5e-3), loads=loads))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.weight == pytest.approx(WEIGHT)
    return result.reaction


@pytest.mark.parametrize("blocks", [(ground(), STONE), (STONE, ground())], ids=["below", "above"])
def test_a_support_carries_the_weight_wherever_it_is_listed(blocks):
    assert reaction(blocks) == pytest.approx(WEIGHT, rel=1e-6)
    assert reaction(blocks, 0.25) == pytest.approx(0.75 * WEIGHT, rel=1e-6)


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_a_lid_against_which_a_stone_is_pulled_holds_it_down(order):
    """Pulled up by 1.5 W, the stone presses against the lid by W/2: the supports pull it down by as much."""
    blocks = (ground(), STONE, LID)
    assert reaction([blocks[k] for k in order], 1.5) == pytest.approx(-0.5 * WEIGHT, rel=1e-6)
