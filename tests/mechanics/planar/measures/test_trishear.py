"""Trishear keeps areas, follows its limits, and is found again from the motion that it makes."""

import numpy as np
import pytest

from mechanics.planar.measures.trishear import Trishear, trishear_fit
from mechanics.planar.measures.trishear_gain import trishear_gain

TIP, DIP = (2.0, 1.0), np.radians(30.0)


def grid(step=0.8, ahead=12.0):
    x, y = np.meshgrid(np.arange(-4.0, ahead, step), np.arange(-3.0, 8.0, step))
    return np.column_stack([x.ravel(), y.ravel()])


def test_hanging_wall_moves_with_the_slip_and_the_footwall_rests():
    fault = Trishear(TIP, DIP, np.radians(25.0), 1.5)
    along, up = np.array([np.cos(DIP), np.sin(DIP)]), np.array([-np.sin(DIP), np.cos(DIP)])
    velocity = fault.velocity(
        np.array(TIP) + np.array([5 * up, -5 * up, along + 5 * up, -along + 0.1 * up]), 0.7
    )
    assert velocity == pytest.approx(np.array([0.7 * along, 0 * along, 0.7 * along, 0.7 * along]), abs=1e-12)


def test_the_triangle_keeps_areas():
    """The divergence by differences vanishes within the triangle."""
    fault = Trishear((0.0, 0.0), 0.3, np.radians(35.0), 0.0)
    points = grid() + 0.013
    local = points @ np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    within = np.abs(local[:, 1]) < 0.95 * np.tan(np.radians(35.0)) * local[:, 0]
    points, h = points[within & (local[:, 0] > 0.3)], 1e-5
    x, y = np.array([h, 0.0]), np.array([0.0, h])
    spread = (fault.velocity(points + x) - fault.velocity(points - x))[:, 0]
    spread += (fault.velocity(points + y) - fault.velocity(points - y))[:, 1]
    assert len(points) > 50
    assert np.abs(spread / (2 * h)).max() < 1e-6


@pytest.mark.parametrize(("half", "ratio"), [(20.0, 2.5), (35.0, 0.5), (50.0, 0.0)])
def test_the_fit_finds_angle_and_ratio_again(half, ratio):
    places = grid()
    made = Trishear(TIP, DIP, np.radians(half), ratio).moved(places, 2.0, increments=400)
    rng = np.random.default_rng(5)
    fit = trishear_fit(places, made + rng.normal(scale=0.01, size=made.shape), TIP, DIP, 2.0)
    assert np.degrees(fit.model.half_angle) == pytest.approx(half, abs=1.0)
    assert fit.model.ratio == pytest.approx(ratio, abs=0.1)
    # noise of 1.4 cm, and a few places that the tip just passes or just does not
    assert fit.residual < 0.1


def test_a_rigid_block_is_explained_badly():
    """Where everything moves alike, the footwall of every trishear rests."""
    places = grid()
    fit = trishear_fit(places, places + 2.0 * np.array([np.cos(DIP), np.sin(DIP)]), TIP, DIP, 2.0)
    assert fit.relative > 0.3


def test_a_trishear_gains_over_a_plain_fault_and_its_angle_is_determined():
    places = grid(0.3)
    made = Trishear(TIP, DIP, np.radians(30.0), 1.0).moved(places, 2.0)
    made = made + np.random.default_rng(5).normal(scale=0.02, size=made.shape)
    gain = trishear_gain(trishear_fit(places, made, TIP, DIP, 2.0), places, made, 2.0, 0.3)
    assert gain.gain > 0.9
    assert gain.interval[0] < gain.gain < gain.interval[1]
    assert gain.half_angles[0] <= np.radians(30.0) <= gain.half_angles[1]
    assert gain.half_angles[1] - gain.half_angles[0] < np.radians(10.0)
    assert gain.ratios[0] <= 1.0 <= gain.ratios[1]


def test_a_plain_fault_that_is_smeared_leaves_a_trishear_without_gain():
    """A zone of constant width along a line is no triangle: what trishear explains of it, a step explains as well."""
    places = grid(0.3)
    along, up = np.array([np.cos(DIP), np.sin(DIP)]), np.array([-np.sin(DIP), np.cos(DIP)])
    across = (places - TIP) @ up
    rng = np.random.default_rng(5)
    share = np.where(np.abs(across) < 1.0, rng.uniform(0.05, 0.95, len(places)), across > 0)
    made = places + 2.0 * share[:, None] * along
    gain = trishear_gain(trishear_fit(places, made, TIP, DIP, 2.0), places, made, 2.0, 0.3)
    assert gain.gain < 0.5


def test_where_nothing_shears_there_is_no_gain():
    places = grid(0.3)
    made = places + 2.0 * ((places - TIP) @ [-np.sin(DIP), np.cos(DIP)] > 0)[:, None] * [
        np.cos(DIP),
        np.sin(DIP),
    ]
    fit = trishear_fit(places, made, TIP, DIP, 2.0)
    assert trishear_gain(fit, places, made, 2.0, 0.3) is None
