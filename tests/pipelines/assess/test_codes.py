"""Checks of a wall that overturns by the two Italian codes, against their formulas by hand."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.limit.kinematic import Kinematics
from pipelines.assess.codes import check as check_module
from pipelines.assess.codes.check import check_code, floor_acceleration, floor_displacement, floor_spectrum
from pipelines.scene.site import Site

G = 9.81
SITE = Site(ag=0.15, f0=2.5, tc_star=0.35, confidence=1.0)
CAPACITY = 0.15  # d0* of a wall of 0.3 x 3 m [m]


def overturning(multiplier=0.1):
    """A wall that turns about its edge: e* = 1, λ falls straight to 0 at d0*."""
    line = np.array([0.0, CAPACITY])
    return Kinematics(
        np.zeros(1, int), multiplier, 1e4, 1e4 / G, 1.0, line, np.array([multiplier, 0.0]), CAPACITY
    )


def values(found):
    return {one["symbol"]: one["value"] for one in found.values}


def named(found, name):
    (one,) = [check for check in found.checks if check.name == name]
    return one


def test_the_circular_of_2009_has_the_secant_period_at_two_fifths_of_the_ultimate_displacement():
    """L3: du* 0.06, ds* 0.024 m, as* 0.084 g, Ts 1.072 s; SDe = ag S F0 TC T/4π² of the falling branch."""
    found = check_code("ntc2008", SITE, overturning())
    told = values(found)
    assert told["du*"] == pytest.approx(0.06)
    assert told["ds*"] == pytest.approx(0.024)
    assert told["as*"] == pytest.approx(0.084 * G)
    assert told["Ts"] == pytest.approx(1.072, abs=1e-3)
    demand = 0.15 * G * 2.5 * 0.35 * told["Ts"] / (4 * np.pi**2)
    assert named(found, "nonlinear, at the ground").demand == pytest.approx(demand)
    assert not found.caution


def test_the_circular_of_2019_has_a_longer_period_and_a_damping_of_8_percent():
    """T_SLV = 1.68 π √(d_SLV/a(d_SLV)) with d_SLV = 0.4 d0 and a = 0.6 a0; η = √(10/13)."""
    found = check_code("ntc2018", SITE, overturning())
    told, nonlinear = values(found), named(found, "nonlinear, at the ground")
    period = 1.68 * np.pi * np.sqrt(0.06 / (0.6 * 0.1 * G))
    assert told["Ts"] == pytest.approx(period)
    demand = 0.15 * G * np.sqrt(10 / 13) * 2.5 * 0.35 * period / (4 * np.pi**2)
    assert nonlinear.demand == pytest.approx(demand)
    assert nonlinear.article == "C8.7.1.2.1.8"
    assert nonlinear.demand > 1.3 * named(check_code("ntc2008", SITE, overturning()), nonlinear.name).demand
    assert named(found, "linear, at the ground").demand == pytest.approx(0.15 * G / 2.0)
    assert "transcription of circular 7/2019" in found.caution
    assert "above the ground" not in found.caution


HIGH = replace(SITE, height=6.0, building_height=12.0, period=0.4, storeys=3)
RULES = {"first": 0.8, "last": 1.1, "peak": 1.1, "rise": 1.6, "fall": 1.2}


def test_above_the_ground_the_circular_of_2009_couples_the_periods():
    found = check_code("ntc2008", HIGH, overturning())
    assert not found.caution
    share = values(found)["Ts"] / 0.4
    spectral = 0.15 * G * 2.5 * 0.35 / 0.4 * (0.4 / (2 * np.pi)) ** 2
    demand = spectral * 0.5 * 9 / 7 * share**2 / np.sqrt((1 - share) ** 2 + 0.02 * share)
    assert named(found, "nonlinear, above the ground").demand == pytest.approx(demand)


def test_above_the_ground_the_circular_of_2019_has_floor_spectra():
    """By hand: Se(T1) 3.2189, aZ 3.2189 · 9/14 · √1.01 = 2.0796 m/s²; f = 4.9193 · 0.87706 = 4.3145;
    Ts 1.6851 s: x = 2.8298^1.2 = 3.484, SeZ = 8.9726/(1 + 3.3145 x) = 0.7151 m/s² above Se 0.670, times Ts²/4π².
    """
    found = check_code("ntc2018", HIGH, overturning())
    assert named(found, "linear, above the ground").demand == pytest.approx(2.0796 / 2, rel=1e-4)
    nonlinear = named(found, "nonlinear, above the ground")
    assert nonlinear.demand == pytest.approx(0.7151 * 1.6851**2 / (4 * np.pi**2), rel=1e-3)
    assert nonlinear.article == "C8.7.1.2.1.8, C7.2.3"
    assert "transcription of circular 7/2019" in found.caution
    assert "ξ1 as a ratio" in found.caution


def test_a_floor_spectrum_begins_at_the_acceleration_of_the_floor_and_peaks_at_the_period_of_the_building():
    """A rigid mechanism feels aZ; between 0.8 and 1.1 T1 it resonates; a slow one feels the ground."""
    rigid = floor_acceleration(HIGH, G)
    assert floor_spectrum(HIGH, 0.0, 5.0, G, RULES) == pytest.approx(rigid)
    for period in (0.32, 0.4, 0.44):
        assert floor_spectrum(HIGH, period, 5.0, G, RULES) == pytest.approx(1.1 / np.sqrt(0.05) * rigid)
    # by hand: 1 + 3.9193 · 0.5^1.6, and 1 + 3.9193 · 1^1.2
    assert floor_spectrum(HIGH, 0.16, 5.0, G, RULES) == pytest.approx(4.91935 * rigid / 2.29290, rel=1e-4)
    assert floor_spectrum(HIGH, 0.88, 5.0, G, RULES) == pytest.approx(rigid)
    low = replace(HIGH, height=0.5)
    assert floor_spectrum(low, 1.0, 5.0, G, RULES) == low.acceleration(1.0, G)
    assert floor_spectrum(low, 0.3, 5.0, G, RULES) < low.acceleration(0.3, G)


def test_the_displacement_at_a_height_is_no_less_than_at_resonance_for_longer_periods():
    """[C8.7.1.12]: SeZ(T1) (1.1 T1)²/4π² for all T > 1.1 T1, and more as soon as the spectrum gives more."""
    peak = 1.1 / np.sqrt(0.05) * np.sqrt(10 / 13) * floor_acceleration(HIGH, G)
    least = peak * (1.1 * 0.4 / (2 * np.pi)) ** 2
    assert floor_displacement(HIGH, 0.44, 8.0, G, RULES) == pytest.approx(least)
    assert floor_displacement(HIGH, 0.6, 8.0, G, RULES) == pytest.approx(least)
    assert floor_displacement(HIGH, 0.4, 8.0, G, RULES) < least < floor_displacement(HIGH, 3.0, 8.0, G, RULES)


def test_above_the_ground_the_secant_is_that_of_the_floor(tmp_path, monkeypatch):
    """Another secant and period there: ds* = 0.3 du*, Ts = 3 π √(ds*/as*)."""
    text = (check_module._FOLDER / "ntc2008.toml").read_text(encoding="utf-8")
    ground, floor = text.split("[above]")
    floor = floor.replace("secant = 0.4", "secant = 0.3").replace("period = 2.0", "period = 3.0")
    (tmp_path / "ntc2008.toml").write_text(f"{ground}[above]{floor}", encoding="utf-8")
    monkeypatch.setattr(check_module, "_FOLDER", tmp_path)
    at = 0.3 * 0.4 * CAPACITY
    slowed = 0.1 * G * (1.0 - at / CAPACITY)
    share = 3.0 * np.pi * np.sqrt(at / slowed) / 0.4
    spectral = 0.15 * G * 2.5 * 0.35 / 0.4 * (0.4 / (2 * np.pi)) ** 2
    demand = spectral * 0.5 * 9 / 7 * share**2 / np.sqrt((1 - share) ** 2 + 0.02 * share)
    found = named(check_code("ntc2008", HIGH, overturning()), "nonlinear, above the ground")
    assert found.demand == pytest.approx(demand)


def test_the_linear_check_above_the_ground_of_2009_has_the_first_mode_of_the_building():
    """ψ = 6/12, γ = 3·3/(2·3 + 1), and Se(T1) of the plateau or beyond it over q = 2."""
    found = named(check_code("ntc2008", HIGH, overturning()), "linear, above the ground")
    # T1 = 0.4 s lies beyond TC = 0.35 s
    spectrum = 0.15 * G * 2.5 * 0.35 / 0.4
    assert found.demand == pytest.approx(spectrum * 0.5 * (9.0 / 7.0) / 2.0)
