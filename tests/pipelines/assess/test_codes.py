"""Checks of a wall that overturns by the two Italian codes, against their formulas by hand."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.limit.kinematic import Kinematics
from pipelines.assess.codes.check import check_code
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


def test_above_the_ground_both_have_the_formulas_of_2009_and_the_later_says_so():
    high = replace(SITE, height=6.0, building_height=12.0, period=0.4, storeys=3)
    early, late = (check_code(code, high, overturning()) for code in ("ntc2008", "ntc2018"))
    name = "nonlinear, above the ground"
    assert named(late, name).demand == pytest.approx(named(early, name).demand)
    assert "circular 617/2009" in late.caution
    assert not early.caution
    share = values(early)["Ts"] / 0.4
    spectral = 0.15 * G * 2.5 * 0.35 / 0.4 * (0.4 / (2 * np.pi)) ** 2
    demand = spectral * 0.5 * 9 / 7 * share**2 / np.sqrt((1 - share) ** 2 + 0.02 * share)
    assert named(early, name).demand == pytest.approx(demand)
