"""The horizontal load, as a part of the weight, at which arches fall: hinges only, so the limit is exact.

Contact points: sharp corners. A multiplier λ is a table tilted by atan λ.
"""

import pytest

from tests.validation.masonry import buttressed_arch, semicircular_arch
from tests.validation.statics.limit_analysis import multiplier
from tests.validation.statics.verdict import falls, hold, report, stands

FRICTION = 0.7
# (t/R, voussoirs, λ); the last is the arch that Lemos shook with 3DEC
ARCHES = [
    (0.15, 16, 0.14997),
    (0.15, 27, 0.14534),
    (0.2, 16, 0.28749),
    (0.2, 27, 0.28434),
    (0.125, 17, 0.069111),
]
SOME = [pytest.param(*c, marks=() if c[1] == 16 else pytest.mark.slow) for c in ARCHES]


@pytest.mark.parametrize(("thickness", "count", "limit"), ARCHES)
def test_limit_analysis_finds_the_multiplier(thickness, count, limit):
    """A07: to the digits given (own linear program)."""
    assert multiplier(semicircular_arch(count, thickness), FRICTION) == pytest.approx(limit, rel=5e-5)


@pytest.mark.parametrize(("thickness", "count", "limit"), SOME)
def test_the_arch_stands_below_its_multiplier_and_falls_above(thickness, count, limit):
    """A07: λ within 3 %."""
    arch = semicircular_arch(count, thickness)
    low, high = hold(arch, FRICTION, 0.97 * limit), hold(arch, FRICTION, 1.03 * limit)
    assert stands(low), report(low)
    assert falls(high), report(high)


@pytest.mark.parametrize("friction", [0.5, 1.0])
def test_limit_analysis_finds_the_multiplier_of_the_arch_on_buttresses(friction):
    """A08: λ = 0.11307, no sliding for μ ≥ 0.5 (own linear program; geometry of Dimitri et al. 2011 from HybriDFEM)."""
    assert multiplier(buttressed_arch(), friction) == pytest.approx(0.11307, rel=5e-5)


def test_the_arch_on_buttresses_stands_below_its_multiplier():
    """A08: stands at 0.98 of λ = 0.11307. The buttresses weigh 55 times as much as a voussoir."""
    result = hold(buttressed_arch(), FRICTION, 0.98 * 0.11307)
    assert stands(result), report(result)


def test_the_arch_on_buttresses_falls_above_its_multiplier():
    """A08: falls at 1.02 of λ = 0.11307. A skewback is a part of its buttress: stones that are not convex."""
    result = hold(buttressed_arch(), FRICTION, 1.02 * 0.11307, step=2e-2, duration=10.0)
    assert falls(result), report(result)
