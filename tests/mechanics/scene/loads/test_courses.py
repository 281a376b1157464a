"""Courses of loads: their peaks and strong parts, beside the end of a run."""

import numpy as np
import pytest

from mechanics.scene.loads.accelerogram import Accelerogram
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.gravity import GravityRamp, TiltingTable
from mechanics.scene.loads.ground_motion import Component, GroundMotion
from mechanics.scene.loads.load import Course, Loads
from mechanics.scene.loads.motions import ImposedMotion, settlement
from mechanics.scene.loads.record_processing import band_pass
from mechanics.scene.loads.time_series import History
from mechanics.simulate import simulate
from pipelines.results.summary import headline, summarise
from tests.validation.scenes import box, dynamic, ground

BLOCK = frozenset({"block"})


def burst(before=1.0, after=3.0):
    """A record of 1 m/s² that shakes for one second after `before`."""
    time = np.arange(0.0, before + 1.0 + after, 0.01)
    shakes = np.where((time >= before) & (time <= before + 1.0), np.sin(4 * np.pi * (time - before)), 0.0)
    return Accelerogram(0.01, shakes, "burst", "burst.csv")


def shaken(record, start=0.0):
    return GroundMotion(frozenset({"ground"}), (Component((1.0, 0.0, 0.0), record),), start=start)


def test_a_filtered_record_peaks_later_than_the_one_that_was_read():
    record = band_pass(burst(), 0.1)
    course = shaken(record, start=2.0).course
    assert course.peak == pytest.approx(2.0 + 30.0 + 1.0 + 0.125, abs=0.6)
    assert course.peak <= course.strong <= 2.0 + 30.0 + 3.0
    loads = Loads(motions=(shaken(record, start=2.0),))
    (said,) = loads.unfinished(32.0, True)
    assert said.startswith("the run ends at 32 s, before the peak of the ground motion at 33")
    assert said.endswith(f"and it goes on until {course.until:.4g} s")
    assert loads.unfinished(32.0, False) == ()
    assert loads.unfinished(course.until, True) == loads.unfinished(course.until, False) == ()


def test_between_peak_and_end_the_strong_part_or_the_rest_is_missed():
    loads = Loads(motions=(shaken(burst()),))
    (course,) = loads.courses
    # sin² has its 95 % of the integral at 0.95 to 0.99 of its second
    assert 1.9 < course.strong < 1.99
    (said,) = loads.unfinished(1.5, True)
    assert said.startswith("the run ends at 1.5 s, before the strong part of the ground motion does at 1.9")
    assert loads.unfinished(2.5, True) == ()
    (said,) = loads.unfinished(2.5, False)
    assert said.startswith("the run ends at 2.5 s, before the ground motion does; its peak is at")


@pytest.mark.parametrize(
    ("load", "name"),
    [
        (StoneForce(BLOCK, History([5.0, 6.0], [[0.0, 0, 0], [9.0, 0, 0]])), "force on block at 6 s"),
        (settlement(BLOCK, (0, 0, -0.01), 2.0, 4.0), "motion of block at 4.2 s"),
        (ImposedMotion(BLOCK, spin=History([0.0, 5.0], [0.0, 1.0])), "motion of block at 5 s"),
        (TiltingTable.at_rate_degrees((0, 1, 0), 1.0, 7.0), "tilt at 7 s"),
        (GravityRamp(4.0), "ramp of gravity at 4 s"),
    ],
)
def test_every_load_that_changes_names_its_peak_and_no_constant_one_does(load, name):
    kind = "forces" if isinstance(load, StoneForce) else "motions" if hasattr(load, "pose") else "gravity"
    (said,) = Loads(**{kind: (load,)}).unfinished(3.0, True)
    assert f"before the peak of the {name}" in said


def test_constant_loads_have_no_course():
    still = Loads(forces=(StoneForce(BLOCK, History.constant((1.0, 0, 0))),), motions=(ImposedMotion(BLOCK),))
    assert still.courses == ()


def test_the_strong_part_of_few_instants_is_that_of_the_lines_between_them():
    """A triangle of two seconds: what is left of ∫ is (1 - x)³/2 at 1 + x, a twentieth at x = 1 - 10^(-1/3)."""
    course = Course.of("pulse", np.array([0.0, 1.0, 2.0]), np.array([0.0, 3.0, 0.0]), 2.0)
    assert course.strong == pytest.approx(2.0 - 10 ** (-1 / 3), abs=1e-4)


def test_a_load_without_any_value_is_strong_nowhere():
    assert Course.of("pause", np.array([1.0, 2.0]), np.zeros(2), 2.0).strong == 1.0


def test_a_run_that_ends_before_the_shaking_says_so_first():
    loads = Loads(motions=(shaken(burst()),))
    scene = dynamic(
        "still", (ground(), box("block", [0, 0, 0], [1, 1, 1])), step=0.02, duration=0.2, loads=loads
    )
    result = simulate(scene)
    assert result.cautions[0].startswith("the run ends at 0.2 s, before the peak of the ground motion at 1.1")
    assert result.cautions[0] in headline(result)
    assert summarise(result, version="0", seconds={})["loads"][0]["name"] == "ground motion"
