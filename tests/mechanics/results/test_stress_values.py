"""Stress of one stone in a few numbers: closed forms of simple states of stress."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.results.stress_values import stress_values, utilisation, volume_quantile
from mechanics.stones.materials import Material

STONE = Material("stone", 2000.0, 1e10, 0.2)
STRONG = replace(STONE, tensile_strength=2e6, compressive_strength=20e6)
POINT = np.array([[x, 0.0, 0.0] for x in (0.0, 1.0, 2.0, 3.0)])
VOLUME = np.array([1.0, 2.0, 3.0, 4.0])


def state(**components):
    """The same stress in four points."""
    order = ("xx", "yy", "zz", "xy", "yz", "zx")
    return np.tile([components.get(name, 0.0) for name in order], (4, 1))


def values_of(stress, material=STONE, error=0.0):
    return stress_values(stress, POINT, VOLUME, material, error)


def test_uniaxial_compression():
    values = values_of(state(zz=-3e6))
    assert (values.von_mises_max, values.von_mises_mean, values.von_mises_p99) == pytest.approx((3e6,) * 3)
    assert values.principal_tension == pytest.approx(0.0, abs=1e-6)
    assert values.principal_compression == pytest.approx(-3e6)
    assert abs(values.compression_direction) == pytest.approx([0, 0, 1])
    assert values.mean_pressure == pytest.approx(1e6)
    assert values.tension_zone == 0.0


def test_pressure_from_all_sides_has_no_von_mises_and_no_tension():
    values = values_of(state(xx=-2e6, yy=-2e6, zz=-2e6), STRONG)
    assert values.von_mises_max == pytest.approx(0.0, abs=1e-6)
    assert values.mean_pressure == pytest.approx(2e6)
    assert values.principal_tension == pytest.approx(-2e6)
    assert values.utilisation_tension == 0.0
    assert values.utilisation_compression == pytest.approx(0.1)


def test_pure_shear_pulls_along_one_diagonal_and_presses_along_the_other():
    """σ1 = τ, σ3 = -τ under 45°; σ_vm = √3 τ."""
    values = values_of(state(xy=1e6), STRONG)
    assert values.principal_tension == pytest.approx(1e6)
    assert values.principal_compression == pytest.approx(-1e6)
    assert abs(values.tension_direction @ [1, 1, 0]) == pytest.approx(np.sqrt(2))
    assert abs(values.compression_direction @ [1, -1, 0]) == pytest.approx(np.sqrt(2))
    assert values.von_mises_max == pytest.approx(np.sqrt(3) * 1e6)
    assert values.mean_pressure == pytest.approx(0.0, abs=1e-6)
    assert values.tension_zone == pytest.approx(1.0)
    assert (values.utilisation, values.governing) == (pytest.approx(0.5), "tension")


def test_the_worst_place_is_named_and_zones_are_parts_of_the_volume():
    stress = state()
    stress[:, 2] = [-30e6, -1e6, 1e6, 3e6]  # volumes 1, 2, 3, 4
    values = values_of(stress, STRONG)
    assert values.tension_point == pytest.approx([3.0, 0.0, 0.0])
    assert values.compression_point == pytest.approx([0.0, 0.0, 0.0])
    assert values.tension_zone == pytest.approx(0.7)
    assert values.overstressed_zone == pytest.approx(0.4)
    assert values.utilisation_tension == pytest.approx(1.5)
    assert values.utilisation_compression == pytest.approx(1.5)
    assert values.von_mises_mean == pytest.approx((30e6 + 2e6 + 3e6 + 12e6) / 10)
    assert values.von_mises_p99 == pytest.approx(30e6)  # in a tenth of the volume


def test_what_governs_is_the_larger_utilisation():
    stress = state(zz=-15e6)
    stress[3, 2] = 1e6
    values = values_of(stress, STRONG)
    assert (values.utilisation, values.governing) == (pytest.approx(0.75), "compression")
    only_tension = values_of(stress, replace(STRONG, compressive_strength=None))
    assert (only_tension.utilisation, only_tension.governing) == (pytest.approx(0.5), "tension")
    unknown = values_of(stress)
    assert (unknown.utilisation, unknown.governing, unknown.overstressed_zone) == (None, None, None)


def test_tension_within_the_error_of_the_stress_is_no_tension_zone():
    """Root mean square of σ: √(0.9 · 9 + 0.1 · 0.01) MPa; 10 % of it is more than 0.1 MPa, 1 % is not."""
    stress = state(zz=-3e6)
    stress[0, 2] = 0.1e6
    rough, fine = values_of(stress, error=0.1), values_of(stress, error=0.01)
    assert rough.tension_threshold == pytest.approx(0.1 * np.sqrt(0.9 * 9 + 0.1 * 0.01) * 1e6)
    assert rough.tension_zone == 0.0
    assert fine.tension_zone == pytest.approx(0.1)
    noise = state(zz=-3e6)
    noise[:, 0] = 1e-3  # rounding
    assert values_of(noise).tension_zone == 0.0


def test_a_quantile_counts_volume_not_nodes():
    values, volume = np.array([4.0, 1.0, 3.0, 2.0]), np.array([0.005, 0.5, 0.3, 0.195])
    assert volume_quantile(values, volume, 0.99) == 3.0
    assert volume_quantile(values, volume, 0.5) == 1.0
    assert volume_quantile(values, volume, 1.0) == 4.0


def test_the_utilisation_of_a_point_is_that_of_the_strengths_that_are_known():
    stresses = np.array([[1e6, 0, -30e6], [-1e6, -2e6, -3e6], [np.nan] * 3])
    assert utilisation(stresses, STRONG) == pytest.approx([1.5, 0.15, np.nan], nan_ok=True)
    assert utilisation(stresses, replace(STRONG, compressive_strength=None)) == pytest.approx(
        [0.5, 0.0, np.nan], nan_ok=True
    )
    assert np.isnan(utilisation(stresses, STONE)).all()
