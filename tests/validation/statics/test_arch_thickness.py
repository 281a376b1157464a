"""Least thickness of the semicircular arch under its own weight. Hinges only, so the limit is exact for any
friction law.

Contact points: sharp corners of straight-faced voussoirs, at the intrados and the extrados of each radial joint.
"""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from tests.validation.masonry import semicircular_arch
from tests.validation.statics.limit_analysis import stands as can_stand
from tests.validation.statics.verdict import falls, hold, report, stands

FRICTION = 0.7

# least t/R of N voussoirs, R the mean radius
LEAST = {
    7: 0.0957,
    8: 0.09997,
    9: 0.10153,
    15: 0.10607,
    16: 0.10708,
    17: 0.10546,
    20: 0.10735,
    21: 0.1067,
    25: 0.10696,
    26: 0.10735,
    27: 0.10672,
    28: 0.10671,
    40: 0.10743,
    60: 0.10745,
    100: 0.10746,
    200: 0.10746,
}
QUICK = (7, 16, 27)
CASES = [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in LEAST if n <= 100]


def crown_thrust(angle, thickness, lever):
    """H over the weight of the half arch that holds the part up to `angle` above its intrados hinge there; R = 1."""
    inner, outer = 1 - thickness / 2, 1 + thickness / 2
    moment = angle * inner * np.sin(angle) - lever * (1 - np.cos(angle))
    return moment / (outer - inner * np.cos(angle)) / (np.pi / 2)


def springing_thrust(thickness, lever):
    """H over the weight of the half arch at which the thrust leaves the extrados at the springing."""
    return 1 - lever / (np.pi / 2) / (1 + thickness / 2)


def rupture(thickness, lever):
    """The angle from the crown at which the arch needs the largest H."""
    found = minimize_scalar(lambda a: -crown_thrust(a, thickness, lever), bounds=(0.5, 1.5), method="bounded")
    return found.x


@pytest.mark.parametrize(
    ("weight_at", "least", "angle", "thrust"),
    [
        # on the centre line (Cocchetti, Colasante & Rizzi 2011)
        (lambda t: 1.0, 0.107426, 54.496, 0.39583),
        # in the true centre of each slice (Milankovitch 1907)
        (lambda t: 1 + t**2 / 12, 0.107478, 54.484, 0.39527),
    ],
)
def test_the_continuous_arch_has_the_published_thickness(weight_at, least, angle, thrust):
    """A01: t/R = 0.107426 and 0.107478, tolerance 1e-5; closed form: what a section needs is all it has."""

    def margin(t):
        return springing_thrust(t, weight_at(t)) - crown_thrust(rupture(t, weight_at(t)), t, weight_at(t))

    found = brentq(margin, 0.09, 0.12, xtol=1e-12)
    assert found == pytest.approx(least, abs=1e-5 * least)
    assert np.degrees(rupture(found, weight_at(found))) == pytest.approx(angle, abs=1e-2)
    assert springing_thrust(found, weight_at(found)) == pytest.approx(thrust, abs=1e-5)


def test_heymans_safe_thickness_is_smaller():
    """A01: Heyman 1969, force tangent to the arch: t/R = 0.105965 at 58.829°, H = 0.39541 W/2, tolerance 1e-5."""

    def tangent(angle, t):
        return crown_thrust(angle, t, 1.0) - angle / np.tan(angle) / (np.pi / 2)

    def hinge(t):
        return brentq(tangent, 0.7, 1.4, args=(t,), xtol=1e-13)

    def margin(t):
        return springing_thrust(t, 1.0) - crown_thrust(hinge(t), t, 1.0)

    found = brentq(margin, 0.09, 0.12, xtol=1e-12)
    assert found == pytest.approx(0.105965, abs=1e-6)
    assert np.degrees(hinge(found)) == pytest.approx(58.829, abs=1e-3)
    assert springing_thrust(found, 1.0) == pytest.approx(0.39541, abs=1e-5)


@pytest.mark.parametrize("count", LEAST)
def test_limit_analysis_finds_the_least_thickness(count):
    """A02: t/R of N straight-faced voussoirs, to the digits given (linear program; Gilbert et al. 2006 for N = 27)."""
    assert can_stand(semicircular_arch(count, LEAST[count] * (1 + 2e-4)), 10.0)
    assert not can_stand(semicircular_arch(count, LEAST[count] * (1 - 2e-4)), 10.0)


@pytest.mark.parametrize("count", CASES)
def test_an_arch_a_little_thicker_than_the_least_stands(count):
    """A02: stable at 1.03 of the least thickness."""
    result = hold(semicircular_arch(count, 1.03 * LEAST[count]), FRICTION)
    assert stands(result), report(result)


@pytest.mark.parametrize("count", CASES)
def test_an_arch_a_little_thinner_than_the_least_falls(count):
    """A02: collapses at 0.97 of the least thickness, by hinges: a thicker arch of the same friction stands."""
    result = hold(semicircular_arch(count, 0.97 * LEAST[count]), FRICTION)
    assert falls(result), report(result)


@pytest.mark.parametrize("count", [27, pytest.param(60, marks=pytest.mark.slow)])
def test_friction_does_not_matter_to_hinges(count):
    """A02 with a friction of 10, at 1.03 and 0.97 of the least thickness."""
    up, down = (hold(semicircular_arch(count, f * LEAST[count]), 10.0) for f in (1.03, 0.97))
    assert stands(up), report(up)
    assert falls(down), report(down)
