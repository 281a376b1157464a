"""Outlines are straight where stones are, keep their corners, and leave out as much mortar as there is."""

import numpy as np
import pytest

from survey.clouds.pictures import shapes
from survey.clouds.pictures.joints import WIDTH
from survey.clouds.pictures.shapes import outline_shapes, without_mortar

SHAPE = (60, 90)
SEEN = np.zeros(SHAPE, bool)


def halves():
    out = np.ones(SHAPE, np.int64)
    out[:, 45:] = 2
    return out


def mortar(width, high=1.0):
    """A picture in which an upright joint of a width between two halves is high."""
    out = np.zeros(SHAPE, np.float32)
    out[:, 45 - width // 2 : 45 + (width + 1) // 2] = high
    return out


@pytest.mark.parametrize("width", [4, 6, 8])
def test_mortar_is_left_out_as_wide_as_it_is(width):
    stone = without_mortar(halves(), mortar(width), SEEN, 6.0)
    assert (~stone).sum(axis=1) == pytest.approx(np.full(60, width), abs=1)
    assert stone[:, : 45 - width].all()
    assert stone[:, 45 + width :].all()


def test_mortar_lies_no_farther_from_the_middle_of_a_joint_than_stated():
    # distances count from the pixels on both sides of the border
    stone = without_mortar(halves(), mortar(20), SEEN, 1.0)
    assert np.flatnonzero(~stone[30]).tolist() == list(range(44 - round(WIDTH), 46 + round(WIDTH)))


def test_a_joint_that_does_not_show_is_two_pixels_and_a_hidden_one_four():
    nothing = np.zeros(SHAPE, np.float32)
    assert (~without_mortar(halves(), nothing, SEEN, 1.0)).sum(axis=1).tolist() == [2] * 60
    hidden = np.broadcast_to(np.arange(60)[:, None] < 30, SHAPE)
    assert (~without_mortar(halves(), nothing, hidden, 1.0)).sum(axis=1).tolist() == [4] * 30 + [2] * 30
    # what is no region is no stone
    assert not without_mortar(halves() * 0, nothing, SEEN, 1.0).any()


def test_a_faint_edge_of_mortar_is_none():
    faint = without_mortar(halves(), mortar(6, 0.2), SEEN, 6.0)
    assert (~faint).sum(axis=1).tolist() == [2] * 60


def test_mortar_is_told_by_the_stones_beside_it():
    # the right stone is as high as the mortar of a lower picture; its joint is higher
    field = mortar(6)
    field[:, 48:] += 0.8
    field[:, 42:48] += 0.4
    stone = without_mortar(halves(), field, SEEN, 6.0)
    assert stone[:, 55:85].all()
    assert not stone[:, 43:47].any()


def shape_of(mask, hidden=SEEN):
    (shape,) = outline_shapes(np.ones(SHAPE, np.int64), mask, hidden)
    return shape


def rectangle(top=10, bottom=50, left=15, right=75):
    out = np.zeros(SHAPE, bool)
    out[top:bottom, left:right] = True
    return out


def test_a_rectangle_has_its_four_corners_and_a_pixel_of_scatter():
    shape = shape_of(rectangle())
    # at the edges of its pixels
    corners = np.array(sorted(map(tuple, shape.ring.tolist())))
    assert corners == pytest.approx(np.array([(14.5, 9.5), (14.5, 49.5), (74.5, 9.5), (74.5, 49.5)]), abs=0.6)
    # that of two straight sides, and next to nothing of the traced boundary
    assert shape.sigma == pytest.approx(0.75, abs=0.1)
    assert shape.number == 1


def test_corners_are_less_sure_where_sides_are_rough():
    rough = rectangle()
    rough[48:50, 16:75:8] = rough[48:50, 17:75:8] = rough[48:50, 18:75:8] = rough[48:50, 19:75:8] = False
    assert shape_of(rough).sigma > shape_of(rectangle()).sigma + 0.05


def test_holes_and_specks_change_no_outline_and_small_regions_have_none():
    spotted = rectangle()
    spotted[20:24, 30:34] = False
    spotted[2, 2] = True
    assert shape_of(spotted).ring == pytest.approx(shape_of(rectangle()).ring)
    assert outline_shapes(np.ones(SHAPE, np.int64), rectangle(10, 14, 15, 19), SEEN) == []
    assert outline_shapes(np.ones(SHAPE, np.int64), SEEN, SEEN) == []
    assert len(outline_shapes(np.ones(SHAPE, np.int64), rectangle(10, 16, 15, 21), SEEN)) == 1


def test_each_region_has_its_outline_where_it_lies():
    regions = np.zeros(SHAPE, np.int64)
    regions[5:25, 5:40] = 2
    regions[30:55, 50:85] = 5
    found = outline_shapes(regions, regions > 0, SEEN)
    assert [shape.number for shape in found] == [2, 5]
    ends = np.array([[shape.ring.min(axis=0), shape.ring.max(axis=0)] for shape in found])
    assert ends == pytest.approx(
        np.array([[[4.5, 4.5], [39.5, 24.5]], [[49.5, 29.5], [84.5, 54.5]]]), abs=0.6
    )


BEVELLED = np.array([[0.0, 3.0], [0.0, 30.0], [40.0, 30.0], [40.0, 0.0], [3.0, 0.0]])


@pytest.mark.parametrize("turns", range(5))
def test_a_short_side_between_two_long_ones_is_a_corner_that_was_cut_off(turns):
    found = shapes._sharp(np.roll(BEVELLED, turns, axis=0))
    assert sorted(map(tuple, found.tolist())) == [(0.0, 0.0), (0.0, 30.0), (40.0, 0.0), (40.0, 30.0)]


def test_a_cut_corner_between_sides_that_lean_is_where_they_meet():
    # the left side leans: it passes (1, 3) and (10, 30), and so meets the ground at the origin
    ring = np.array([[1.0, 3.0], [10.0, 30.0], [40.0, 30.0], [40.0, 0.0], [3.0, 0.0]])
    found = shapes._sharp(ring)
    assert len(found) == 4
    assert np.hypot(*(found - [0.0, 0.0]).T).min() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    "ring",
    [
        BEVELLED * 2.0,  # the side is longer than a bevel
        BEVELLED[[0, 1, 2, 4]],  # no corner to spare
        # sides that go about the same way do not meet at a corner
        np.array([[0.0, 10.0], [0.0, 30.0], [40.0, 30.0], [40.0, 0.0], [2.0, 0.0], [1.0, 4.0]]) * [1.0, 1.0],
        # one beside is hardly longer
        np.array([[0.0, 3.0], [0.0, 7.0], [2.0, 30.0], [40.0, 30.0], [40.0, 0.0], [3.0, 0.0]]),
    ],
    ids=["long side", "four corners", "same way", "short beside"],
)
def test_other_corners_stay(ring):
    assert shapes._sharp(ring).tolist() == ring.tolist()


def test_the_scatter_is_the_root_mean_square_of_distances_from_the_sides():
    ring = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 50.0], [0.0, 50.0]])
    along = np.arange(5.0, 95.0, 5.0)
    dense = np.concatenate(
        [np.column_stack([along, np.full(18, 3.0)]), np.column_stack([along, np.full(18, -4.0)])]
    )
    assert shapes._scatter(dense, ring) == pytest.approx(np.sqrt((9.0 + 16.0) / 2.0))
    # beyond the end of a side its corner is nearest
    assert shapes._scatter(np.array([[103.0, -4.0]]), ring) == pytest.approx(5.0)


def test_a_line_has_the_direction_of_its_points_and_their_largest_distance():
    points = np.array([[10.0, 4.0], [8.0, 4.0], [6.0, 4.0], [4.0, 4.0]])
    middle, direction, apart = shapes._line(points)
    assert middle.tolist() == [7.0, 4.0]
    assert direction == pytest.approx([-1.0, 0.0])
    assert apart == pytest.approx(0.0, abs=1e-12)
    zigzag = np.array([[0.0, 1.0], [10.0, -1.0], [20.0, 1.0], [30.0, -1.0], [40.0, 1.0]])
    assert shapes._line(zigzag)[2] == pytest.approx(1.2, abs=0.01)


def line(start, stop, count=20):
    return np.linspace(start, stop, count)


VEIL = np.ones(SHAPE, bool)
STRAY = np.array([[50.0, 30.0], [52.0, 33.0]])


@pytest.mark.parametrize(
    ("before", "after", "between"),
    [
        # one side that goes on
        (((5, 10), (24, 10)), ((60, 10), (79, 10)), []),
        # sides that meet square at a corner
        (((5, 10), (24, 10)), ((60, 25), (60, 44)), [[60, 10]]),
        # parallel sides too far from each other to be one
        (((5, 10), (24, 10)), ((60, 20), (79, 20)), STRAY.tolist()),
        # a corner that is seen not to be there
        (((5, 10), (24, 10)), ((88, 70), (88, 99)), STRAY.tolist()),
    ],
    ids=["one side", "corner", "apart", "outside"],
)
def test_what_is_hidden_between_two_sides_is_nothing_or_their_corner(before, after, between):
    veil = VEIL.copy()
    veil[:, 85:] = False
    found = shapes._between(line(*before), STRAY, line(*after), veil)
    assert found == pytest.approx(np.array(between, dtype=float).reshape(-1, 2))


def test_a_hidden_end_is_square_to_its_sides_and_as_far_as_what_shows_of_it():
    hidden = np.array([[70.0, 12.0], [80.0, 20.0], [75.0, 28.0]])
    found = shapes._between(line((5, 10), (24, 10)), hidden, line((24, 30), (5, 30)), VEIL)
    assert found == pytest.approx(np.array([[80.0, 10.0], [80.0, 30.0]]))


def test_short_or_crooked_sides_tell_nothing_of_what_is_hidden():
    short = line((5, 10), (15, 10), 11)
    assert shapes._between(short, STRAY, line((60, 10), (79, 10)), VEIL) is STRAY
    crooked = line((5, 10), (24, 10)) + np.outer(np.sin(np.arange(20)), [0.0, 4.0])
    assert shapes._between(crooked, STRAY, line((60, 10), (79, 10)), VEIL) is STRAY
    assert shapes._between(line((60, 10), (79, 10)), STRAY, crooked, VEIL) is STRAY
