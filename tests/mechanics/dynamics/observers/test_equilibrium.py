"""Balance, reactions and settlement against statics and kinematics by hand, wherever supports stand in the list."""

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest

from mechanics.dynamics.observers.equilibrium import displacement, imbalance, seen_from_supports, speed
from mechanics.dynamics.outcome import Outcome
from mechanics.model.model import build_model
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Fidelity
from mechanics.simulate import simulate
from tests.mechanics.shapes import brick, detected, ground, scene

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
    # what pulls a stone is borne less, and no error
    assert result.errors.reaction < 1e-6
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


@pytest.mark.parametrize("lift", [1.0, 0.0])
def test_a_stone_whose_forces_balance_is_out_of_balance_by_their_moment(lift):
    """Held by its weight at one corner, √½ m beside its middle: a moment of √½ m W, over its width of 0.5 m.

    Without any force at the corner it is out of balance by its weight.
    """
    model, state, contacts = detected(scene(ground(), STONE))
    point = contacts.bodies[:, 0].argmax()
    force = np.zeros((len(contacts), 3))
    force[point, 2] = lift * WEIGHT
    load = np.zeros((2, 6))
    load[1, 2] = -WEIGHT
    found = imbalance(model, state, contacts, force, load)
    assert found == pytest.approx([0.0, np.sqrt(0.5) / 0.5 if lift else 1.0], rel=1e-6)


def test_what_moves_with_its_support_stands_still_on_it():
    """The ground goes by 0.1 m at 2 m/s, and a stone with it, which turns besides."""
    drift = ImposedMotion(frozenset({"ground"}), History.constant([2.0, 0.0, 0.0]))
    model, start = build_model(replace(scene(ground(), STONE), loads=Loads(motions=(drift,))))
    state = replace(
        start,
        centre=start.centre + np.array([0.1, 0.0, 0.0]),
        velocity=np.array([[2.0, 0, 0, 0, 0, 0], [2.0, 0, 0, 0, 0, 0.5]]),
    )
    seen = seen_from_supports(model, start, state)
    assert displacement(model, start, seen) == pytest.approx([0.0, 0.0], abs=1e-12)
    # its corners are √½ m from its axis
    assert speed(model, seen) == pytest.approx([0.0, 0.5 * np.sqrt(0.5)], abs=1e-12)


def test_without_weight_a_stone_is_out_of_balance_by_the_largest_force():
    """Four corners pressed by 1, 2, 3 and 4 N: the resultant is 10 N."""
    model, state, contacts = detected(scene(ground(), STONE, gravity=(0.0, 0.0, 0.0)))
    force = np.outer(np.arange(1.0, 5.0), [0.0, 0.0, 1.0])
    found = imbalance(model, state, contacts, force, np.zeros((2, 6)))
    assert found == pytest.approx([0.0, 10.0 / 4.0])


def test_without_gravity_reactions_count_upwards_and_settlement_downwards():
    """A stone that is pressed down by 100 N; and one that sinks by 1 m/s for 0.1 s."""
    press = StoneForce(frozenset({"stone"}), History.constant(np.array([0.0, 0.0, -100.0])))
    pressed = scene(ground(), STONE, gravity=(0.0, 0.0, 0.0), step=5e-3)
    result = simulate(replace(pressed, loads=Loads(forces=(press,))))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert (result.reaction, result.weight) == (pytest.approx(100.0, rel=1e-6), 0.0)
    sinking = brick("sinking", (0, 0, 1), (1, 1, 1.5), velocity=(0.0, 0.0, -1.0, 0.0, 0.0, 0.0))
    drift = scene(ground(), sinking, gravity=(0.0, 0.0, 0.0), step=0.01, duration=0.1)
    assert simulate(drift).history.settlement[-1] == pytest.approx(0.1)


@pytest.mark.parametrize("down", [(0.0, 0.0, -1.0), (1.0, 0.0, 0.0)])
def test_settlement_is_along_gravity_and_of_the_stone_that_sank_most(down):
    """One stone falls for 0.1 s, by g t²/2; another is thrown against gravity as fast as it gains speed."""
    g, time = 9.81, 0.1
    up = (*(-g * time * one for one in down), 0.0, 0.0, 0.0)
    stones = [brick("falls", (0, 0, 2), (1, 1, 2.5)), brick("rises", (5, 0, 2), (6, 1, 2.5), velocity=up)]
    falling = scene(
        *stones,
        gravity=tuple(g * np.array(down)),
        step=1e-3,
        theta=0.5,
        duration=time,
        stop_at_equilibrium=False,
    )
    assert simulate(falling).history.settlement[-1] == pytest.approx(g * time**2 / 2, rel=1e-6)
