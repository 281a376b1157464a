"""Limit loads by the rule of runs: closed forms, published walls, and what `simulate` says just below and above."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.limit import WALLS
from mechanics.dynamics.outcome import Outcome
from mechanics.limit import held
from mechanics.limit.assembly import assembly
from mechanics.limit.held import WIDTH, held_limit
from mechanics.limit.limit_load import limit_load
from mechanics.limit.live_loads import Acceleration, PointForce
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import ContactSettings
from mechanics.simulate import simulate
from tests.mechanics.shapes import brick, ground, scene

ALONG = Acceleration((1.0, 0.0, 0.0))
SQUAT, TALL = brick("squat", (0, 0, 0), (1.0, 1.0, 0.5)), brick("tall", (0, 0, 0), (0.2, 0.2, 0.8))


def limit_of(on, live=ALONG):
    return held_limit(on, live, limit_load(on, live))


def within(found, value):
    """Hold a bracket of the asked width around a value, half a unit wider next to a bound, known to 10⁻⁶ of itself."""
    assert 0.0 < found.lost - found.held <= 1.5 * WIDTH * found.lost
    assert found.held <= value * (1 + 1e-5)
    assert found.lost >= value * (1 - 1e-5)


@pytest.mark.parametrize(("stone", "friction", "value"), [(SQUAT, 0.3, 0.3), (TALL, 0.7, 0.25)])
def test_a_block_slides_or_tips(stone, friction, value):
    within(limit_of(assembly(scene(ground(), stone, friction=friction))), value)


@pytest.mark.parametrize("load", [0.7, 1.0, 3.0])
def test_a_step_that_slides_tells_at_which_load_it_would_stop(load):
    trial = held._Steps(assembly(scene(ground(), SQUAT, friction=0.6)), ALONG)(load)
    assert not trial.holds
    assert trial.stops == pytest.approx(0.6, rel=1e-4)


def test_mortar_and_point_forces_count():
    """λ W = μ W + c A; a force twice as high up tips a block by half as much."""
    law = MortarJoint(0.5, tension=5e3, shear=4e3)
    on = assembly(replace(scene(ground(), SQUAT), contact=ContactSettings(law)))
    within(limit_of(on, PointForce("squat", (on.weight, 0, 0), (0.5, 0.5, 0.0))), 0.5 + 4e3 / on.weight)
    on = assembly(scene(ground(), TALL, friction=0.7))
    within(limit_of(on, PointForce("tall", (on.weight, 0, 0), (0.1, 0.1, 0.8))), 0.125)


def test_what_falls_by_itself_has_none_and_what_nothing_limits_has_no_end():
    leaning = brick("over", (4.0, 0, 0), (6.5, 0.8, 1.0))
    found = limit_of(assembly(scene(ground(high=(5.0, 3.0, 0.0)), leaning)))
    assert (found.held, found.lost) == (0.0, 0.0)
    assert found.mechanism.velocity.any()
    found = limit_of(assembly(scene(ground(), TALL)), Acceleration((0.0, 0.0, -1.0)))
    assert np.isinf(found.held)
    assert found.mechanism is None


class Scattered:
    """Steps from rest under loads of which some fall by chance."""

    def __init__(self, limit, *falls, error=0.0):
        self.limit, self.falls, self.error, self.tried = limit, falls, error, []

    def __call__(self, load):
        self.tried.append(load)
        none = np.zeros((0, 3))
        holds = load < self.limit and load not in self.falls
        return held._Trial(holds, 0.9 * self.limit, none, np.zeros((0, 6)), self.error)

    def released(self, load):
        """Say that forces from nothing bring about each rest."""


@pytest.mark.parametrize(
    ("limit", "falls", "value", "lost"),
    [(0.66, (), 0.659, 0.66), (0.66, (0.657,), 0.656, 0.657), (0.66, (0.658, 0.655), 0.654, 0.655)],
)
def test_a_load_that_falls_next_below_the_limit_lowers_it(monkeypatch, limit, falls, value, lost):
    """All that is tried below what is said to be held is held, and the least that falls is said to be lost."""
    steps = Scattered(limit, *falls)
    monkeypatch.setattr(held, "_Steps", lambda *_: steps)
    monkeypatch.setattr(held, "_falling", lambda *_: "falls")
    on = assembly(scene(ground(), SQUAT))
    for candidate in (None, 0.6):
        steps.tried.clear()
        found = held.held_limit(on, ALONG, replace(limit_load(on, ALONG), multiplier=0.8), candidate)
        assert (found.held, found.lost) == (value, lost)
        assert {value - 0.001, value - 0.002, value - 0.004} <= {round(one, 6) for one in steps.tried} | {0.0}


@pytest.mark.parametrize(("error", "sure"), [(0.003, 0.659), (0.03, 0.594)])
def test_a_step_that_is_not_solved_leaves_the_limit_sure_up_to_where_its_motion_would_stop(
    monkeypatch, error, sure
):
    monkeypatch.setattr(held, "_Steps", lambda *_: Scattered(0.66, error=error))
    monkeypatch.setattr(held, "_falling", lambda *_: "falls")
    on = assembly(scene(ground(), SQUAT))
    found = held.held_limit(on, ALONG, replace(limit_load(on, ALONG), multiplier=0.8))
    assert (found.held, found.lost) == (0.659, 0.66)
    assert found.sure == pytest.approx(sure)


def test_loads_that_are_tried_are_round():
    for bound, unit in ((0.676063, 1e-3), (0.2381, 2e-4), (0.999, 1e-3), (5e4, 100.0), (0.25, 5e-4)):
        assert held._unit(bound) == pytest.approx(unit, rel=1e-12)


@pytest.mark.slow
def test_the_step_that_falls_shows_how():
    """Without dilatancy a wall with windows falls at less than the bound; its base course stays."""
    one = WALLS["W04"]
    on = one.assembly()
    found = limit_of(on)
    assert 0.995 * one.candidate < found.held < found.lost < 1.02 * one.candidate
    assert found.mechanism.opening.any()
    assert found.mechanism.velocity[on.free, 0].max() > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", WALLS)
def test_walls_lie_up_to_two_hundredths_above_the_lowest_published_loads(name):
    one = WALLS[name]
    found = limit_of(one.assembly())
    assert 0.998 * one.candidate < found.held <= found.lost < 1.02 * one.candidate


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "step", "above"),
    [("W03", 1e-4, 1.01), ("W03", 1e-2, 1.0), ("W05", 1e-4, 1.005), ("W05", 1e-2, 1.0)],
)
def test_runs_hold_below_and_fall_above(name, step, above):
    """In short steps walls slide by micrometres and rest again, up to half a per cent above the lost load."""
    one = WALLS[name]
    on = one.assembly()
    found = limit_of(on)
    for multiplier, rests in ((found.held, True), (above * found.lost, False)):
        load = ALONG.applied(on, multiplier)
        time = replace(load.time, step=step, duration=max(0.2, 60 * step))
        run = simulate(replace(load, time=time, contact=ContactSettings(DryJoint(one.friction))))
        assert run.outcome.rests == rests
        assert rests or run.outcome in (Outcome.COLLAPSED, Outcome.MOVING)
