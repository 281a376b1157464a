"""Collapses that are remembered, what lies when the time is over, and runs that are given up."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.verdicts.doubt import UnsolvedSteps
from mechanics.dynamics.verdicts.lasting import balance_of
from mechanics.dynamics.verdicts.watch import Watch
from mechanics.model.model import build_model
from mechanics.scene.loads.load import Course, Loads, Pose
from mechanics.scene.scene import SolverSettings
from mechanics.simulate import simulate
from tests.mechanics.shapes import brick, ground, scene


class Jerk:
    """Ground that moves by one versed sine along x from the start on; its record ends at `until` [s]."""

    def __init__(self, size, period, until):
        self.size, self.period, self.until = size, period, until
        self.stones = frozenset({"ground"})
        self.course = Course("jerk", 0.0, period, until)

    def pose(self, time):
        part = min(time / self.period, 1.0)
        away = 0.5 * self.size * (1.0 - np.cos(np.pi * part))
        return Pose(np.array([away, 0.0, 0.0]), np.eye(3), np.zeros(3))


def shaken(*stones, duration, size=0.35, until=5.0, **time):
    """Slender blocks on ground that jerks for .3 s."""
    one = scene(ground((-3, -3, -1), (6, 3, 0)), *stones, step=8e-3, theta=0.5, duration=duration, **time)
    return replace(one, loads=Loads(motions=(Jerk(size, 0.3, until),)))


def slender(code="a", x=0.0, width=0.2):
    return brick(code, (x, 0, 0), (x + width, 0.2, 0.8))


GOES_ON = "the run ends at {} s, before the jerk does; its peak is at 0 s, and it goes on until 5 s"


@pytest.mark.parametrize("duration", [1.6, pytest.param(2.4, marks=pytest.mark.slow)])
def test_a_block_that_has_toppled_has_collapsed_though_its_record_goes_on(duration):
    result = simulate(shaken(slender(), duration=duration, stop_at_equilibrium=False))
    assert result.outcome is Outcome.COLLAPSED
    assert result.reason.startswith("stone a had sunk by ")
    assert result.reason.endswith("at the end it is 300 mm lower")
    assert GOES_ON.format(f"{duration:g}") in result.cautions


@pytest.mark.slow
def test_a_collapse_ends_a_run_that_stops_without_a_word_on_its_record():
    result = simulate(shaken(slender(), duration=2.4))
    assert result.outcome is Outcome.COLLAPSED
    assert result.reason.startswith("stone a has sunk by ")
    assert not result.cautions


@pytest.mark.slow
def test_a_block_that_rocks_and_stays_upright_is_not_decided_before_its_record_ends():
    result = simulate(shaken(slender(width=0.6), duration=0.8, stop_at_equilibrium=False))
    assert result.outcome is Outcome.MOVING
    assert GOES_ON.format("0.8") in result.cautions


@pytest.mark.slow
def test_of_two_blocks_the_one_that_topples_is_named():
    stones = slender("stays", 2.0, 0.8), slender("falls")
    result = simulate(shaken(*stones, duration=2.0, stop_at_equilibrium=False))
    assert result.outcome is Outcome.COLLAPSED
    assert result.reason.startswith("stone falls had sunk by ")


def test_stones_that_contradict_each_other_are_given_up_and_named():
    """Two stones are driven into each other: no step can be solved."""
    stones = (
        brick("a", (0, 0, 0), (1, 1, 1)),
        brick("b", (0, 0, 1), (1, 1, 2)),
        brick("c", (2, 2, 0), (3, 3, 1)),
    )
    solver = SolverSettings(tolerance=1e-17, velocity_tolerance=1e-17, max_iterations=20)
    one = scene(ground(), *stones, step=5e-3, duration=2.0, stop_at_equilibrium=False)
    result = simulate(replace(one, solver=solver))
    assert result.outcome is Outcome.UNDECIDED
    assert result.steps == 20
    assert result.reason.startswith("the run was given up, as 20 of 20 steps were not solved")
    assert "contacts of the stones " in result.reason


@pytest.mark.parametrize(
    ("count", "steps", "total", "hopeless"),
    [(20, 20, 1.0, True), (19, 19, 1.0, False), (20, 21, 1.0, False), (20, 20, 0.4, False)],
)
def test_a_run_is_given_up_where_no_step_at_all_was_solved_and_errors_may_be_its_motion(
    count, steps, total, hopeless
):
    """Of a fastest motion of 1 m/s, errors of half as much may be the cause."""
    doubt = UnsolvedSteps(build_model(scene(ground()))[0])
    doubt.count, doubt.steps, doubt.total = count, steps, total
    assert doubt.hopeless(1.0) is hopeless


@pytest.mark.parametrize(
    ("speed", "errors", "outcomes"),
    [(0.0, 0.0, "moving collapsed"), (0.05, 0.0, "moving moving"), (0.0, 1e3, "moving moving")],
)
def test_what_lies_lower_when_the_time_is_over_has_collapsed(speed, errors, outcomes):
    """A block lies a metre below where it began, as a watch sees it that did not see it fall; a record goes on.

    Not so what slides there, or may have come there by the errors of steps that were not solved [m/s].
    """
    stone = brick("a", (0, 0, 0), (0.5, 0.5, 0.5), velocity=(speed, 0, 0, 0, 0, 0))
    one = scene(ground(), stone, friction=0.0, step=1e-3, duration=8e-3)
    one = replace(one, loads=Loads(motions=(Jerk(0.0, 0.3, 5.0),)))
    model, state = build_model(one)
    higher = state.centre.copy()
    higher[1, 2] += 1.0
    watch = Watch(model, replace(state, centre=higher))
    watch._unsolved.total = errors
    simulation = Simulation(model, state)
    seen = []
    for _ in range(one.time.steps):
        step = simulation.step()
        seen.append(str(watch(step, balance_of(model, step))))
    assert seen[-2:] == outcomes.split()
