"""Rests whose steps are solved as exactly as a rest asks: high stacks, and heavy stones on small ones."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.limit.dead_load import self_stress_alone_holds
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.scene import ContactSettings, Method, SolverSettings
from mechanics.simulate import simulate
from tests.mechanics.dynamics.test_stopping import between_walls
from tests.mechanics.shapes import brick, ground, scene

SPRINGS = ElasticJoint(0.7, normal_stiffness=1e6, shear_stiffness=4e5)
FAST = SolverSettings(tolerance=1e-5, velocity_tolerance=1e-5, motion_error=1e-3)


def fast(*stones, **time):
    one = scene(ground((-8, -8, -1), (8, 8, 0)), *stones, friction=0.7, step=0.01, **time)
    return replace(one, solver=FAST)


def stack(count, **time):
    return fast(*(brick(str(k), (0, 0, 0.2 * k), (0.6, 0.6, 0.2 * (k + 1))) for k in range(count)), **time)


def on_cubes(rows, gap=0.0):
    """A block of 65 t on cubes of 5 cm."""
    at = np.linspace(0.0, 2.95, rows)
    cubes = (brick(f"{x}-{y}", (x, y, 0), (x + 0.05, y + 0.05, 0.05)) for x in at for y in at)
    return fast(*cubes, brick("block", (0, 0, 0.05 + gap), (3, 3, 0.05 + gap + 65 / 18)))


@pytest.mark.parametrize("count", [17, 18, 19, pytest.param(20, marks=pytest.mark.slow)])
def test_a_stack_rests_whatever_error_its_motion_may_have(count):
    result = simulate(stack(count))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.steps == 5


@pytest.mark.slow
def test_all_lower_stacks_rest_too():
    assert {simulate(stack(count)).outcome for count in range(2, 17)} == {Outcome.EQUILIBRIUM}


@pytest.mark.parametrize(("rows", "gap"), [(2, 0.0), (3, 0.0), (3, 1e-4)])
def test_a_heavy_block_rests_on_small_cubes(rows, gap):
    assert simulate(on_cubes(rows, gap)).outcome is Outcome.EQUILIBRIUM


def open_between_walls(gap):
    """The same bar, with a gap to one of its walls that counts as closed [m]."""
    one = between_walls(Method.AUTO)
    blocks = list(one.blocks)
    blocks[0] = replace(blocks[0], vertices=blocks[0].vertices - [gap, 0.0, 0.0])
    return replace(one, blocks=tuple(blocks))


def test_only_what_forces_from_nothing_surely_move_is_held_by_self_stress():
    assert self_stress_alone_holds(between_walls(Method.AUTO))


@pytest.mark.parametrize(
    "one",
    [
        stack(2, duration=0.02),
        stack(19),
        replace(stack(2), contact=ContactSettings(SPRINGS)),
        fast(brick("a", (0, 0, 2e-5), (0.5, 0.5, 0.5))),
        open_between_walls(2e-4),
        replace(between_walls(Method.AUTO), contact=ContactSettings(SPRINGS)),
    ],
    ids=["short", "high", "springs", "gap", "gap between walls", "springs between walls"],
)
def test_what_time_springs_or_gaps_explain_is_not_laid_on_self_stress(one):
    assert not self_stress_alone_holds(one)
