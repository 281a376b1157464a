"""Tiles of a picture overlap and give each stone once, in the place of the whole picture."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from survey.clouds.pictures import channels, proposal
from survey.clouds.pictures.joints import DIRECTION, Strength
from survey.clouds.pictures.photograph import Photograph
from survey.clouds.pictures.suitability import Findings
from survey.clouds.world import PixelPlace

FIT = Findings(False, (), 1.0)


def box(left, low, right, high):
    return np.array([[left, low], [right, low], [right, high], [left, high]], dtype=float)


def stone(ring, *borders, score=0.9, sigma=0.5):
    return proposal._Found(ring, sigma, score, tuple(borders))


@pytest.mark.parametrize(("length", "count"), [(90, 1), (100, 1), (101, 2), (180, 2), (181, 3), (1000, 13)])
def test_parts_of_a_side_are_as_few_as_overlap_by_as_much_as_stated(length, count):
    parts = proposal._overlapping(length, 100, 20)
    assert len(parts) == count
    assert (parts[0].start, parts[-1].stop) == (0, length)
    for before, after in pairwise(parts):
        assert before.stop - after.start == 20
    sizes = [part.stop - part.start for part in parts]
    assert max(sizes) <= 100
    assert max(sizes) - min(sizes) <= 1 or count == 1


def test_a_stone_of_two_tiles_is_one_and_the_less_cut_stays():
    first = [stone(box(0, 0, 50, 40), (1, 0.8, (50.0, 20.0), 40.0)), stone(box(50, 0, 80, 40))]
    # the next tile begins at 60: it sees the rest of the second stone, and two more
    second = [
        stone(box(60, 0, 100, 40), (1, 0.7, (100.0, 20.0), 40.0)),
        stone(box(100, 0, 150, 40), (0, 0.7, (100.0, 20.0), 40.0), (2, 0.6, (150.0, 20.0), 40.0)),
        stone(box(150, 0, 200, 40)),
    ]
    found = proposal._together(first, second)
    assert [one.ring[:, 0].tolist()[:2] for one in found] == [[0, 50], [60, 100], [100, 150], [150, 200]]
    assert [[border[0] for border in one.borders] for one in found] == [[1], [2], [1, 3], []]
    assert proposal._together([], second) is second


@pytest.mark.parametrize(("left", "same"), [(33, True), (37, False)])
def test_outlines_that_share_three_tenths_of_the_smaller_are_the_same_stone(left, same):
    found = proposal._together([stone(box(0, 0, 50, 40))], [stone(box(left, 0, left + 50, 40))])
    assert len(found) == (1 if same else 2)


@pytest.mark.parametrize(("size", "replaced"), [(50.0, False), (51.5, True), (40.0, False)])
def test_of_two_outlines_of_a_stone_the_larger_by_two_percent_stays(size, replaced):
    (found,) = proposal._together([stone(box(0, 0, 50, 40))], [stone(box(1, 0, 1 + size, 40))])
    assert found.ring[0, 0] == (1.0 if replaced else 0.0)


def test_a_border_to_a_stone_that_is_not_there_leads_nowhere():
    (_, found) = proposal._together(
        [stone(box(0, 0, 9, 9))], [stone(box(50, 0, 90, 40), (-1, 0.5, (0.0, 0.0), 9.0))]
    )
    assert found.borders[0][0] == -1


def strength_at(*angles):
    """Joints of directions in degrees, each as strong as the others."""
    evidence = np.zeros((len(angles), 10), np.float32)
    evidence[:, ::2] = 1.0
    angle = np.zeros_like(evidence)
    angle[:] = np.round(np.radians(angles)[:, None] / DIRECTION) * DIRECTION
    return Strength(evidence, evidence, evidence, angle)


@pytest.mark.parametrize(
    ("angles", "kind"),
    [
        ((0, 90, 0, 45), "coursed"),  # directions that are square to each other count as one
        ((22.5, 112.5, 90), "coursed"),
        ((0, 90, 45, 30), "rubble"),
        ((0, 90, 45, 30, 157.5), "rubble"),
        ((), "coursed"),
    ],
)
def test_joints_of_one_direction_or_square_to_it_are_courses(angles, kind):
    strength = strength_at(*angles) if angles else strength_at(0, 45, 20, 70)
    if not angles:
        strength.evidence[:] *= 0.5  # nothing is sure
    assert proposal._kind_of(strength) == kind


def test_a_stone_of_a_tile_moves_to_its_place_in_the_picture():
    # pixels of the work are twice as large: the middle of the first lies between the first two of the tile
    found = proposal._moved(
        stone(box(0, 0, 10, 5), (3, 0.8, (4.0, 2.0), 7.0)), np.array([100.0, 40.0]), np.array([2.0, 2.0]), 2.0
    )
    assert found.ring[0].tolist() == [100.5, 40.5]
    assert found.ring[2].tolist() == [120.5, 50.5]
    assert found.sigma == 1.0
    assert found.borders == ((3, 0.8, (108.5, 44.5), 14.0),)


@pytest.mark.parametrize(("size", "found"), [(18, False), (19, True)])
def test_openings_are_boxes_of_what_is_open_if_they_are_large(size, found):
    void = np.zeros((60, 80), bool)
    void[10 : 10 + size, 20:60] = True
    boxes = proposal._boxes(void, np.array([100.0, 0.0]), np.array([2.0, 2.0]))
    assert len(boxes) == found
    if found:  # by the edges of its pixels
        assert boxes[0].tolist() == [[139.5, 19.5], [219.5, 57.5]]


def assembled(stones, voids=(), kind="coursed", width=3.0, shape=(100, 200)):
    places = PixelPlace(np.diag([0.01, -0.01]), np.array([0.005, shape[0] * 0.01 - 0.005]))
    picture = Photograph(Path("wall.png"), np.zeros((*shape, 3), np.uint8), None, None, places, True)
    return proposal._assembled(picture, stones, list(voids), kind, width, FIT)


# two courses of two stones; rows go down
FOUR = (box(5, 50, 95, 95), box(105, 50, 195, 95), box(5, 5, 95, 45), box(105, 5, 195, 45))


def test_stones_are_placed_upwards_and_ordered_from_the_ground():
    found = assembled([stone(FOUR[k], sigma=0.5) for k in (3, 0, 2, 1)])
    assert [one.named.code for one in found.stones] == ["C01-01", "C01-02", "C02-01", "C02-02"]
    assert found.stones[0].ring.min(axis=0) == pytest.approx([0.055, 0.045])
    assert found.stones[0].ring.max(axis=0) == pytest.approx([0.955, 0.495])
    for one in found.stones:
        x, y = one.ring.T
        assert 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) > 0.0  # counter-clockwise
        assert one.sigma == pytest.approx(0.005)
        assert not one.cut
    assert found.joint == (3.0, pytest.approx(0.03))
    assert found.masonry == "coursed"


def test_borders_follow_their_stones_and_are_named_once():
    a = stone(FOUR[3], (1, 0.8, (100.0, 25.0), 40.0))
    b = stone(
        FOUR[2], (0, 0.8, (100.0, 25.0), 40.0), (-1, 0.9, (1.0, 1.0), 5.0), (2, 0.6, (50.0, 47.0), 90.0)
    )
    c = stone(FOUR[0], (1, 0.6, (50.0, 47.0), 90.0))
    found = assembled([a, b, c, stone(FOUR[1])])
    borders = {border.stones: border for border in found.borders}
    # the stones from the ground are c, the fourth, b and a
    assert set(borders) == {(2, 3), (0, 2)}
    assert borders[2, 3].probability == 0.8
    assert borders[2, 3].place == pytest.approx((1.005, 0.745))
    assert borders[2, 3].length == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("ring", "cut"),
    [
        (box(1, 50, 95, 95), True),
        (box(2, 50, 95, 95), False),
        (box(105, 50, 198, 95), True),
        (box(105, 50, 197, 95), False),
        (box(105, 50, 195, 98), True),
        (box(105, 50, 195, 97), False),
        (box(105, 1, 195, 45), True),
    ],
    ids=str,
)
def test_a_stone_within_half_a_joint_of_the_edge_of_the_picture_is_cut(ring, cut):
    found = assembled([stone(ring), *(stone(one) for one in FOUR if abs(one[0] - ring[0]).max() > 5)])
    (chosen,) = (
        one for one in found.stones if np.ptp(one.ring, axis=0) == pytest.approx(0.01 * np.ptp(ring, axis=0))
    )
    assert chosen.cut == cut


def test_openings_lie_upwards_too():
    (found,) = assembled([stone(ring) for ring in FOUR], [np.array([[19.5, 29.5], [59.5, 89.5]])]).openings
    assert found == pytest.approx(np.array([[0.20, 0.10], [0.60, 0.70]]))


def test_a_wall_that_is_refused_has_no_stones():
    found = assembled([stone(ring, score=0.1) for ring in FOUR])
    assert (found.stones, found.borders, found.findings.refused) == ((), (), True)
    assert assembled([stone(ring) for ring in FOUR], kind="rubble").masonry == "rubble"


def test_relief_is_in_millimetres_from_the_faces_and_bounded():
    depth = np.array([[0.1, 0.1, 0.1, 0.105, 0.09, 0.3, -0.2, np.nan]], np.float32)
    assert channels._relief(depth)[0] == pytest.approx([0, 0, 0, 5, -10, 40, -40, 0], abs=1e-4)
    assert channels._relief(np.full((2, 2), np.nan, np.float32)).tolist() == [[0, 0], [0, 0]]


def test_what_stands_before_the_wall_or_is_greener_hides_it():
    green = np.zeros((40, 60), np.float32)
    green[:10, :10] = -12.0
    green[:10, 20:30] = -10.0
    depth = np.full((40, 60), 0.2, np.float32)
    depth[20:30, :10] += 0.04
    depth[20:30, 20:30] += 0.03
    depth[35:, 50:] = np.nan
    before = channels._before(green, depth)
    assert before[:10, :10].all()
    assert before[20:30, :10].all()
    assert before.sum() == 200
    assert channels._before(green, None).sum() == 100


def test_what_lies_deep_behind_the_faces_or_was_not_scanned_is_open():
    depth = np.full((80, 120), 0.1, np.float32)
    depth[10:50, 20:60] = -0.05
    depth[10:50, 80:115] = np.nan
    found = channels.openings(np.full((80, 120), 70.0, np.float32), depth)
    assert found[20:40, 30:50].all()
    assert found[20:40, 85:110].all()
    assert not found[60:].any()
    depth[10:50, 20:60] = 0.0  # joints are as deep
    assert not channels.openings(np.full((80, 120), 5.0, np.float32), depth)[:, :70].any()


def test_hidden_pixels_take_the_value_of_the_nearest_that_is_seen():
    field = np.arange(60, dtype=np.float32).reshape(6, 10)
    where = np.zeros((6, 10), bool)
    where[:, 4:6] = True
    (found,) = channels._without([field], where)
    assert found[2].tolist() == [20, 21, 22, 23, 23, 26, 26, 27, 28, 29]
    nothing, everything = channels._without([field], where & False), channels._without([field], where | True)
    assert nothing[0] is everything[0] is field


def test_white_grey_and_the_primaries_have_their_published_colours():
    # CIE L*a*b* of sRGB under D65
    pixels = np.array(
        [[[255, 255, 255], [119, 119, 119], [255, 0, 0], [0, 255, 0], [0, 0, 255], [4, 4, 4]]], np.uint8
    )
    found = np.stack(channels.lightness(pixels), axis=-1)[0]
    true = [
        (100.0, 0.0, 0.0),
        (50.0, 0.0, 0.0),
        (53.24, 80.09, 67.20),
        (87.73, -86.18, 83.18),
        (32.30, 79.19, -107.86),
        (1.1, 0.0, 0.0),
    ]
    assert found == pytest.approx(np.array(true), abs=0.15)
