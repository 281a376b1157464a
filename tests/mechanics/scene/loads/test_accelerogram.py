"""Accelerograms: integration, baseline, filter, and shaking with them; all records here are synthetic."""

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.scene.loads.accelerogram import Accelerogram
from mechanics.scene.loads.ground_motion import Component, GroundMotion, braking_time
from mechanics.scene.loads.record_processing import band_pass, without_drift

DT = 0.005


def record(function, duration=20.0, dt=DT):
    time = np.arange(round(duration / dt) + 1) * dt
    return Accelerogram(dt, function(time), "synthetic", "synthetic")


def wave(hertz, amplitude=1.0):
    return lambda time: amplitude * np.cos(2 * np.pi * hertz * time)


def test_a_harmonic_acceleration_integrates_to_its_closed_form():
    """a = A cos ωt: v = A/ω sin ωt, d = A/ω² (1 - cos ωt); the trapezoid errs by (ω dt)²/12."""
    omega = 2 * np.pi * 0.5
    found = record(wave(0.5, 2.0))
    error = (omega * DT) ** 2 / 6
    np.testing.assert_allclose(found.velocity, 2 / omega * np.sin(omega * found.time), atol=error * 2 / omega)
    closed = 2 / omega**2 * (1 - np.cos(omega * found.time))
    np.testing.assert_allclose(found.displacement, closed, atol=2 * error * 2 / omega**2)
    assert found.peak == 2.0
    assert found.duration == pytest.approx(20.0)
    assert len(found) == len(found.time) == 4001


def test_a_constant_acceleration_integrates_exactly():
    found = record(lambda time: np.full_like(time, 3.0), 1.0)
    np.testing.assert_allclose(found.velocity, 3 * found.time, rtol=1e-12)
    np.testing.assert_allclose(found.displacement, 1.5 * found.time**2, rtol=1e-12, atol=1e-15)


def test_a_wrong_baseline_is_taken_away_and_the_shaking_kept():
    """c₀ + c₁t makes a drift of c₀t²/2 + c₁t³/6, here 10 m of which less than 1 mm may stay; PGA within 1 %."""
    wanted = record(lambda time: 2.0 * np.cos(2 * np.pi * time) * np.sin(np.pi * time / 20) ** 2)
    drifting = Accelerogram(DT, wanted.acceleration + 0.03 + 0.003 * wanted.time, "drifting", "synthetic")
    assert drifting.displacement[-1] == pytest.approx(10.0, rel=0.01)
    found = without_drift(drifting)
    np.testing.assert_allclose(found.displacement, wanted.displacement, atol=1e-3)
    assert found.velocity[-1] == pytest.approx(0.0, abs=1e-3)
    assert found.peak == pytest.approx(wanted.peak, rel=0.01)
    assert found.source == "synthetic, baseline corrected (degree 6)"
    with pytest.raises(SceneError, match="degree = 1"):
        without_drift(drifting, degree=1)


@pytest.mark.parametrize(("hertz", "gain"), [(0.02, 0.0), (0.2, 0.5), (2.0, 1.0), (20.0, 0.5), (60.0, 0.0)])
def test_the_filter_keeps_its_band_and_halves_the_corners(hertz, gain):
    """Both ways |H|² = 1/(1 + (f/f_c)^2n): one half at a corner (the other corner is far away)."""
    bell = record(lambda time: wave(hertz)(time - 100) * np.exp(-(((time - 100) / 30) ** 2)), 200.0)
    found = band_pass(bell, 0.2, 20.0)
    pad = (len(found) - len(bell)) // 2
    middle = found.acceleration[pad + 16000 : pad + 24000]
    assert np.abs(middle).max() == pytest.approx(gain * bell.peak, abs=0.02)
    if gain == 1.0:  # no phase is shifted
        np.testing.assert_allclose(middle, bell.acceleration[16000:24000], atol=0.02)


def test_the_zeros_around_a_filtered_record_let_it_begin_and_end_at_rest():
    """Pads of 0.75 order/low on each side; PGA within 2 % and a velocity at the end below 0.1 % of its peak."""
    pulse = record(lambda time: 3.0 * np.cos(2 * np.pi * 2 * (time - 10)) * np.exp(-((time - 10) ** 2)))
    found = band_pass(pulse, low=0.2, high=25.0)
    assert len(found) - len(pulse) == 2 * round(0.75 * 4 / 0.2 / DT)
    assert found.peak == pytest.approx(pulse.peak, rel=0.02)
    assert abs(found.velocity[-1]) < 1e-3 * np.abs(found.velocity).max()
    assert found.source == "synthetic, Butterworth 0.2 to 25 Hz (order 4, both ways)"


def test_one_corner_is_enough():
    slow, fast = record(wave(0.05), 100.0), record(wave(40.0), 100.0)
    assert np.abs(band_pass(slow, low=0.5).acceleration[8000:12000]).max() < 1e-3
    assert np.abs(band_pass(fast, high=10.0).acceleration[8000:12000]).max() < 1e-3


@pytest.mark.parametrize(("low", "high"), [(None, None), (0.0, 10.0), (10.0, 1.0), (1.0, 1.0), (1.0, 100.0)])
def test_impossible_bands_are_refused(low, high):
    with pytest.raises(SceneError, match=r"synthetic: band .* below 100 Hz, half the sampling rate"):
        band_pass(record(wave(1.0)), low, high)
    with pytest.raises(SceneError, match="order = 0"):
        band_pass(record(wave(1.0)), 1.0, 10.0, order=0)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"dt": 0.0}, "dt = 0.0"),
        ({"acceleration": [1.0]}, "less than two samples"),
        ({"acceleration": [1.0, np.nan]}, "not finite"),
    ],
)
def test_impossible_records_are_refused(changed, said):
    with pytest.raises(SceneError, match=said):
        Accelerogram(**{"dt": 0.1, "acceleration": [0.0, 1.0], "name": "a", "source": "a.csv"} | changed)


def test_the_ground_moves_as_its_records_say_from_the_start_on():
    along, up = record(wave(0.5, 2.0)), record(wave(1.0), 10.0, dt=0.01)
    motion = GroundMotion(
        frozenset({"G"}),
        (Component((0.0, 5.0, 0.0), along), Component((0.0, 0.0, 1.0), up)),
        scale=0.5,
        start=3.0,
    )
    assert not motion.pose(0.0).displacement.any()
    assert not motion.pose(3.0).displacement.any()
    for sample in (1, 7, 500):
        expected = [0.0, 0.5 * along.displacement[2 * sample], 0.5 * up.displacement[sample]]
        np.testing.assert_allclose(
            motion.pose(3.0 + sample * 0.01).displacement, expected, rtol=1e-9, atol=1e-12
        )
    np.testing.assert_array_equal(motion.pose(5.0).rotation, np.eye(3))


def test_after_a_record_the_ground_stays_where_it_is():
    """2 m/s² for 1 s leave 2 m/s, which 0.2 m/s² take away within 10 s and 10 m."""
    push = record(lambda time: np.full_like(time, 2.0), 1.0)
    motion = GroundMotion(frozenset({"G"}), (Component((1.0, 0.0, 0.0), push),))
    assert motion.until == pytest.approx(11.0)
    last = motion.pose(11.0).displacement[0]
    assert last == pytest.approx(11.0, rel=1e-12)
    assert motion.pose(50.0).displacement[0] == pytest.approx(last, rel=1e-14)


@pytest.mark.parametrize("scale", [1.0, -0.3])
def test_a_pulse_ends_without_a_blow(scale):
    """A half sine of 1.5 m/s² and 0.25 s leaves v = 2 A T/π = 0.24 m/s; the ground then brakes with A/10 until 1.84 s.

    Stones under a record with no velocity left, or hardly any, see no more than its peak either.
    """
    pulse = record(lambda time: 1.5 * np.sin(np.pi * time / 0.25), 0.25)
    left = 2 * 1.5 * 0.25 / np.pi
    motion = GroundMotion(frozenset({"G"}), (Component((1.0, 0.0, 0.0), pulse),), scale=scale)
    assert motion.until == pytest.approx(0.25 + left / 0.15, rel=1e-3)
    time = np.arange(1, 400) * DT
    place = np.array([motion.pose(float(t)).displacement[0] for t in (0.0, *time, time[-1] + DT)])
    acceleration = np.diff(place, 2) / DT**2
    assert np.abs(acceleration[time < 0.25]).max() == pytest.approx(abs(scale) * 1.5, rel=1e-3)
    assert np.abs(acceleration[time > 0.25 + DT]).max() <= abs(scale) * 0.15 * (1 + 1e-6)
    assert braking_time(pulse) == pytest.approx(left / 0.15, rel=1e-3)


def test_a_record_that_ends_at_rest_needs_one_step_more():
    assert braking_time(record(lambda time: np.sin(2 * np.pi * time), 2.0)) == DT
    assert braking_time(record(np.zeros_like, 2.0)) == DT


@pytest.mark.parametrize(
    ("directions", "changed"),
    [
        ([], {}),
        ([(1, 0, 0), (2, 0, 0)], {}),
        ([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0)], {}),
        ([(1, 0, 0)], {"start": -1.0}),
        ([(1, 0, 0)], {"scale": np.nan}),
    ],
)
def test_impossible_ground_motions_are_refused(directions, changed):
    parts = tuple(Component(direction, record(wave(1.0))) for direction in directions)
    with pytest.raises(SceneError, match="ground motion: "):
        GroundMotion(frozenset({"G"}), parts, **changed)


def test_a_component_needs_a_direction():
    with pytest.raises(SceneError, match="direction"):
        Component((0.0, 0.0, 0.0), record(wave(1.0)))


def test_the_peak_is_the_largest_acceleration_of_either_sign():
    assert Accelerogram(0.01, np.array([0.0, 1.0, -3.0, 2.0]), "pulse", "by hand").peak == 3.0
    assert Accelerogram(0.01, np.array([0.0, 1.0, -3.0, 4.0]), "pulse", "by hand").peak == 4.0
