"""Stones that overlap as a run begins, as surveyed and rounded ones do: they touch, and nothing moves because of it."""

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.scene.scene import Fidelity, Start
from mechanics.simulate import simulate
from tests.mechanics.shapes import brick, ground, scene

OVERLAPS = [1e-4, 1e-3]  # [m]


def tower(overlap, **time):
    """Three stones, each that much within the one below."""
    levels = [0.3 * k - (k + 1) * overlap for k in range(3)]
    stones = (brick(f"S{k}", (-0.3, -0.2, z), (0.3, 0.2, z + 0.3)) for k, z in enumerate(levels))
    return scene(ground(), *stones, step=1e-3, **time)


@pytest.mark.parametrize("overlap", OVERLAPS)
@pytest.mark.parametrize(("relaxation", "theta"), [(True, 1.0), (False, 1.0), (False, 0.5)])
@pytest.mark.parametrize("start", Start)
def test_stones_that_overlap_at_the_start_are_not_expelled(overlap, relaxation, theta, start):
    """Pushed out within a step of 1 ms, 1 mm would be 1 m/s: a jump of 5 cm."""
    result = simulate(tower(overlap, relaxation=relaxation, theta=theta, start=start))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.history.kinetic.max() < 1e-15  # [J]
    assert max(np.abs(stone.displacement).max() for stone in result.bodies) < 1e-9
    assert result.errors.reaction < 1e-6


@pytest.mark.parametrize("overlap", OVERLAPS)
@pytest.mark.parametrize("relaxation", [True, False])
@pytest.mark.parametrize("start", Start)
def test_an_overlap_with_walls_on_both_sides_holds_no_stone(overlap, relaxation, start):
    """It falls as if there were no walls: g h² (1 + 2 + … + 10) in ten steps of θ = 1."""
    walls = (
        brick(code, (x, -0.2, -1.0), (x + 1.0, 0.2, 1.0), Fidelity.FIXED)
        for code, x in (("L", -1), ("R", 0.5))
    )
    stone = brick("S", (-overlap, -0.2, -0.15), (0.5 + overlap, 0.2, 0.15))
    time = {"relaxation": relaxation, "start": start, "theta": 1.0, "step": 1e-3, "duration": 0.01}
    result = simulate(scene(*walls, stone, **time))
    assert result.outcome is not Outcome.EQUILIBRIUM
    np.testing.assert_allclose(result.bodies[2].displacement[:, 2], -55 * 9.81 * 1e-6, rtol=1e-6)
    np.testing.assert_allclose(result.bodies[2].displacement[:, :2], 0.0, atol=1e-9)


def test_what_overlaps_deeper_later_is_pushed_out_to_where_it_began():
    """In a relaxation: a stone put a tenth of a millimetre lower than it began returns by that much, and no more."""
    one = tower(1e-3, relaxation=True)
    model, state = build_model(one)
    run = Simulation(model, state)
    run.step()
    below = run.state.centre[1, 2]
    run.state.centre[1:, 2] -= 1e-4
    run.step()
    assert run.state.centre[1, 2] == pytest.approx(below, abs=1e-9)


def test_corners_that_appear_later_touch_at_the_overlap_of_their_joint():
    """A stone that overlaps by a millimetre slides over the edge of the one below, and gets new contacts there."""
    overlap = 1e-3
    table = brick("T", (-1.0, -1.0, -0.3), (1.0, 1.0, 0.0), Fidelity.FIXED)
    slider = brick("S", (0.6, -0.2, -overlap), (1.0, 0.2, 0.3), velocity=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    one = scene(table, slider, friction=0.0, relaxation=True, step=1e-3)
    model, state = build_model(one)
    run = Simulation(model, state)
    for _ in range(50):
        run.step()
    assert run.state.centre[1, 0] > state.centre[1, 0] + 0.04
    assert run.state.centre[1, 2] == pytest.approx(state.centre[1, 2], abs=1e-7)


@pytest.mark.parametrize("overlap", OVERLAPS)
def test_friction_across_an_overlap_leaves_a_stone_in_balance(overlap):
    """A stone on a slope: friction acts half-way between both faces, on both stones in the same point."""
    stone = brick("S", (-0.3, -0.2, -overlap), (0.3, 0.2, 0.3))
    one = scene(ground(), stone, gravity=(3.0, 0.0, -9.0), step=1e-3, duration=0.1)
    result = simulate(one)
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.errors.balance < 1e-6
