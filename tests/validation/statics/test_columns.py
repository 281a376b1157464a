"""Stacks and columns: hyperstatic piles of stones whose totals are known, and their overturning on a tilted table."""

import numpy as np
import pytest

from tests.validation.masonry import drums, overhanging_stack, tapered_column
from tests.validation.statics.limit_analysis import multiplier
from tests.validation.statics.verdict import falls, hold, report, stands

FRICTION = 0.7
# (drums, diameter, height of a drum)
STACKS = [(5, 1.0, 1.0), (10, 1.0, 0.6)]
CORNER = (1.0, 0.0, 0.0)
FACE = (float(np.cos(np.pi / 8)), float(np.sin(np.pi / 8)), 0.0)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_a_stack_overhangs_by_the_harmonic_series(count):
    """R05: the largest overhang is L/2 (1 + 1/2 + … + 1/n): stands at 0.99 of it, falls at 1.01 (closed form)."""
    largest = {1: 0.5, 2: 0.75, 3: 0.916667, 4: 1.041667, 5: 1.141667}[count]
    below, above = overhanging_stack(count, 0.99), overhanging_stack(count, 1.01)
    assert below[-1].vertices[:, 0].max() == pytest.approx(0.99 * largest, rel=1e-6)
    low, high = hold(below, 0.6), hold(above, 0.6)
    assert stands(low), report(low)
    assert falls(high), report(high)


@pytest.mark.parametrize(("count", "diameter", "height"), STACKS)
@pytest.mark.parametrize(("toward", "part"), [(CORNER, 1.0), (FACE, np.cos(np.pi / 8))])
def test_drums_overturn_at_their_width_over_their_height(count, diameter, height, toward, part):
    """T01: λ = D/H = 0.2 and 1/6 within 1 %, for drums of eight sides towards a corner; towards a face D cos(π/8)/H.

    Eight contact points a joint, at the corners.
    """
    stack, limit = drums(count, diameter, height, sides=8), part * diameter / (count * height)
    assert multiplier(stack, FRICTION, toward) == pytest.approx(limit, rel=1e-9)
    low, high = (hold(stack, FRICTION, f * limit, toward, points=8) for f in (0.99, 1.01))
    assert stands(low), report(low)
    assert falls(high), report(high)


def test_a_tapered_column_overturns_as_a_whole():
    """T02: λ = 0.193286 within 1 % (own linear program; geometry from HybriDFEM's column of Dimitri et al. 2011).

    Width 1.11 m at the foot to 0.90 m at 5.95 m, seven drums and a capital of 0.21 m: half the foot over the height
    of the centre of mass is 0.193286.
    """
    column = tapered_column()
    assert multiplier(column, FRICTION) == pytest.approx(0.193286, rel=5e-6)
    low, high = (hold(column, FRICTION, f * 0.193286) for f in (0.99, 1.01))
    assert stands(low), report(low)
    assert falls(high), report(high)
