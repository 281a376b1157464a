"""Dry-stone walls on a tilting table, in their plane.

A multiplier λ of the weight at each centroid is a table tilted by atan λ. With friction and without dilatancy the
load of collapse is not unique: the associative linear program is an upper bound, published values the lowest found.
So each test asks for a band: standing at its lower end and falling at its upper. Contact points: sharp corners, or
inset where it says so.
"""

import pytest

from mechanics.scene.shapes import bond
from tests.validation.masonry import running_bond
from tests.validation.statics.limit_analysis import joints, multiplier, without_dilatancy
from tests.validation.statics.verdict import falls, hold, report, stands

STONE = (0.4, 0.175)
FRICTION = 0.65
# (courses, stones, joints, associative, published without dilatancy)
FERRIS_TIN_LOI = [(6, 33, 83, 0.64286, 0.64), (10, 55, 141, 0.58, 0.563)]
# (courses, lower end, upper end) with contact points 20 mm from the corners: 0.95 of the lower of LMGC90 (0.578, 0.512)
# and UDEC (0.577, 0.495), 1.05 of HybriDFEM (0.586, 0.525)
INSET = [(6, 0.95 * 0.577, 1.05 * 0.586), (10, 0.95 * 0.495, 1.05 * 0.525)]
# (stones, courses, friction, associative λ)
PANELS = [
    (5, 6, 0.65, 0.58446),
    (5, 10, 0.65, 0.53003),
    (4, 8, 0.6, 0.53602),
    (10, 5, 0.6, 0.58376),
    (3, 12, 0.6, 0.39833),
    (6, 6, 0.3, 0.3),
]
# courses from the bottom of a square of 4 x 4 units
GRIDS = {
    "classical": [[2, 2], [1, 2, 1], [2, 2], [1, 2, 1]],
    "efficient": [[2, 2], [2, 2], [1, 2, 1], [2, 2]],
}


def ferris_tin_loi(courses, inset=0.0):
    """Half stones in the bottom course: [½ 1 1 1 1 ½], then [1 1 1 1 1], and so on."""
    return running_bond(bond(5, courses, halves_first=True), *STONE, inset=inset)


def panel(stones, courses):
    """Stones of 0.2 x 0.1 m. The listed multipliers come out with half stones in the bottom course, and only so."""
    return running_bond(bond(stones, courses, halves_first=True), 0.2, 0.1)


def some(cases, quick):
    return [pytest.param(*c, marks=() if c in quick else pytest.mark.slow) for c in cases]


@pytest.mark.parametrize(("courses", "stones", "interfaces", "associative", "published"), FERRIS_TIN_LOI)
def test_limit_analysis_finds_the_bound_of_ferris_and_tin_loi(
    courses, stones, interfaces, associative, published
):
    """W01, W02: associative 0.64286 and 0.58 (Ferris & Tin-Loi 2001 via HybriDFEM), to the digits given."""
    wall = ferris_tin_loi(courses)
    assert len(wall) - 1 == stones
    assert len(joints(wall).point) == 4 * interfaces
    assert multiplier(wall, FRICTION) == pytest.approx(associative, rel=2e-5)
    assert published < associative


@pytest.mark.parametrize(("stones", "courses", "friction", "limit"), PANELS)
def test_limit_analysis_finds_the_bound_of_the_panels(stones, courses, friction, limit):
    """W08: to the digits given (own linear program)."""
    assert multiplier(panel(stones, courses), friction) == pytest.approx(limit, rel=2e-5)


@pytest.mark.slow
@pytest.mark.parametrize(("courses", "stones", "interfaces", "associative", "published"), FERRIS_TIN_LOI)
def test_limit_analysis_without_dilatancy_finds_the_published_loads(
    courses, stones, interfaces, associative, published
):
    """W01, W02: 0.64 and 0.563 (Ferris & Tin-Loi 2001, Gilbert et al. 2006), within half a unit of the last digit."""
    wall = ferris_tin_loi(courses)
    assert without_dilatancy(wall, FRICTION) == pytest.approx(published, abs=6e-4)


@pytest.mark.parametrize(("courses", "stones", "interfaces", "associative", "published"), FERRIS_TIN_LOI)
def test_the_walls_of_ferris_and_tin_loi_stand_at_0_97_of_their_published_load(
    courses, stones, interfaces, associative, published
):
    """W01, W02: band [0.97 non-associative, 1.01 associative], lower end: stands at λ = 0.6208 and 0.5461."""
    result = hold(ferris_tin_loi(courses), FRICTION, 0.97 * published)
    assert stands(result), report(result)


@pytest.mark.parametrize(
    ("courses", "stones", "interfaces", "associative", "published"),
    some(FERRIS_TIN_LOI, FERRIS_TIN_LOI[:1]),
)
def test_the_walls_of_ferris_and_tin_loi_fall_at_1_01_of_their_associative_load(
    courses, stones, interfaces, associative, published
):
    """W01, W02: band [0.97 non-associative, 1.01 associative], upper end: falls at λ = 0.6493 and 0.5858."""
    result = hold(ferris_tin_loi(courses), FRICTION, 1.01 * associative)
    assert falls(result), report(result)


@pytest.mark.parametrize(("courses", "low", "high"), some(INSET, INSET[:1]))
def test_contact_points_20_mm_inside_lower_the_load(courses, low, high):
    """W01, W02 inset: band [0.95 min(LMGC90, UDEC), 1.05 HybriDFEM]; the corners of the stones are cut by 20 mm."""
    wall = ferris_tin_loi(courses, inset=0.02)
    below, above = hold(wall, FRICTION, low), hold(wall, FRICTION, high)
    assert stands(below), report(below)
    assert falls(above), report(above)


@pytest.mark.parametrize(("stones", "courses", "friction", "limit"), some(PANELS, PANELS[4:5]))
def test_panels_fall_within_minus_6_and_plus_1_percent_of_their_bound(stones, courses, friction, limit):
    """W08: NSCD within -6/+1 % of the associative λ."""
    wall = panel(stones, courses)
    below, above = hold(wall, friction, 0.94 * limit), hold(wall, friction, 1.01 * limit)
    assert stands(below), report(below)
    assert falls(above), report(above)


@pytest.mark.parametrize("layout", GRIDS)
def test_a_square_panel_slides_before_it_cracks(layout):
    """W12: λ = μ = 0.58 within 1 % (mosek_optim's reproduction of Portioli 2019: 4 x 4 units, both layouts)."""
    wall = running_bond(GRIDS[layout], 0.25, 0.25)
    assert multiplier(wall, 0.58) == pytest.approx(0.58, rel=1e-9)
    below, above = hold(wall, 0.58, 0.99 * 0.58), hold(wall, 0.58, 1.01 * 0.58)
    assert stands(below), report(below)
    assert falls(above), report(above)
