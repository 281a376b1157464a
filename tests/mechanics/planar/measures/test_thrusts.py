"""Thrusts are found again where bands of shear were put."""

import numpy as np
import pytest

from mechanics.planar.measures.thrusts import thrusts_of

X, Y = np.meshgrid(np.arange(0.0, 40.0, 0.2), np.arange(0.1, 2.0, 0.2))
PLACES = np.column_stack([X.ravel(), Y.ravel()])
RADII = np.full(len(PLACES), 0.1)


def bands(places, dip):
    """Shear that falls off from lines which start at the base and dip to the left."""
    away = [PLACES[:, 0] - place - PLACES[:, 1] / np.tan(dip) for place in places]
    return 0.01 + sum(np.exp(-((one * np.sin(dip) / 0.15) ** 2)) for one in away)


def test_bands_are_found_with_their_spacing_and_dip():
    found = thrusts_of(PLACES, PLACES, bands((8.0, 16.0, 24.0), np.radians(35.0)), RADII, 2.0)
    assert found.place == pytest.approx(np.array([8.0, 16.0, 24.0]) + 1.0 / np.tan(np.radians(35.0)), abs=0.8)
    assert found.spacing == pytest.approx(8.0, abs=0.3)
    assert np.degrees(found.dip) == pytest.approx(35.0, abs=4.0)


def test_without_a_layer_there_is_no_thrust():
    found = thrusts_of(PLACES, PLACES, bands((8.0,), 0.6), RADII, 0.0)
    assert len(found.place) == 0
    assert np.isnan(found.spacing)
