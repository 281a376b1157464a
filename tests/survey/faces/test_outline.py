"""The outline of a face: its measures, the order of its corners, and corners measured twice."""

import math
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground.errors import GeometryError
from survey.faces import outline as module
from survey.faces.outline import level_direction, measure_outline, outline_polygon

LEVEL = np.array([1.0, 0.0])
RECTANGLE = np.array([[0.0, 0.0], [0.6, 0.0], [0.6, 0.3], [0.0, 0.3]])
# an L: 2 × 1 and a block of 1 × 1 on its left half
L_SHAPE = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], dtype=float)


def turned(flat, angle):
    c, s = math.cos(angle), math.sin(angle)
    return flat @ np.array([[c, s], [-s, c]])


def regular(count, radius=0.5):
    angles = 2.0 * np.pi * np.arange(count) / count
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def dented(seed, count):
    """A star-shaped polygon, counter-clockwise: simple whatever its radii are."""
    rng = np.random.default_rng(seed)
    angles = 2.0 * np.pi * (np.arange(count) + rng.uniform(-0.4, 0.4, count)) / count
    radii = rng.uniform(0.2, 1.0, count)
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])


@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0, -1.1])
@pytest.mark.parametrize("place", [(0.0, 0.0), (650_000.0, 6_860_000.0)])
def test_a_rectangle_measures_what_it_is_wherever_it_stands(angle, place):
    size = measure_outline(turned(RECTANGLE, angle) + place, turned(LEVEL, angle))
    assert size.area == pytest.approx(0.18, abs=2e-9)
    assert (size.length, size.height) == pytest.approx((0.6, 0.3), abs=3e-9)
    assert size.skew == pytest.approx(0.0, abs=1e-8)


def test_of_a_tilted_rectangle_length_and_height_are_extents_level_and_upwards():
    a = math.radians(20.0)
    size = measure_outline(turned(RECTANGLE, a), LEVEL)
    assert size.length == pytest.approx(0.6 * math.cos(a) + 0.3 * math.sin(a))
    assert size.height == pytest.approx(0.6 * math.sin(a) + 0.3 * math.cos(a))
    assert size.area == pytest.approx(0.18)


@pytest.mark.parametrize("degrees", [0.0, 5.0, 20.0, 45.0])
def test_a_sheared_rectangle_is_as_skew_as_it_was_sheared(degrees):
    shear = math.tan(math.radians(degrees))
    flat = RECTANGLE + np.outer(RECTANGLE[:, 1], [shear, 0.0])
    size = measure_outline(flat, LEVEL)
    assert abs(size.skew) == pytest.approx(math.radians(degrees), abs=1e-12)
    assert size.area == pytest.approx(0.18)


@given(st.integers(0, 2**32 - 1))
def test_which_corner_comes_first_changes_no_measure(seed):
    rng = np.random.default_rng(seed)
    flat = RECTANGLE + rng.uniform(-0.1, 0.1, (4, 2))
    sizes = [measure_outline(np.roll(flat, k, axis=0), LEVEL) for k in range(4)]
    for size in sizes[1:]:
        for name in ("area", "length", "height", "skew"):
            assert getattr(size, name) == pytest.approx(getattr(sizes[0], name), abs=1e-12), name


def test_an_l_shaped_face_has_the_area_of_its_three_squares_and_no_skew():
    size = measure_outline(L_SHAPE, LEVEL)
    assert (size.area, size.length, size.height, size.skew) == (3.0, 2.0, 2.0, None)


@given(st.integers(3, 60), st.floats(0.01, 100.0), st.floats(-3.0, 3.0))
def test_regular_polygons_have_their_closed_form_area(count, radius, angle):
    size = measure_outline(turned(regular(count, radius), angle), LEVEL)
    assert size.area == pytest.approx(0.5 * count * radius**2 * math.sin(2 * math.pi / count), rel=1e-12)


@pytest.mark.parametrize("angle", [0.0, 0.5, 1.5])
def test_of_a_level_face_the_length_is_the_larger_extent(angle):
    size = measure_outline(turned(RECTANGLE[:, ::-1][::-1], angle), None)
    assert (size.length, size.height) == pytest.approx((0.6, 0.3))
    # corners that crowd at the ends of the short direction make that the direction of largest spread
    crowded = [(x, y) for x in (-1.0, 1.0) for y in np.linspace(-0.4, 0.4, 9) * x]
    lens = np.array([*crowded[:9], (0.0, 1.5), *crowded[9:], (0.0, -1.5)])[::-1]
    size = measure_outline(turned(lens, angle), None)
    assert (size.length, size.height) == pytest.approx((3.0, 2.0), rel=1e-6)


def test_a_wall_has_a_level_direction_and_a_floor_has_none():
    axes = np.array([[0.0, 0.6, 0.8], [1.0, 0.0, 0.0]])
    np.testing.assert_allclose(np.abs(level_direction(np.array([0.0, -0.8, 0.6]), axes)), [0.0, 1.0])
    assert level_direction(np.array([0.0, 0.0, 1.0]), np.eye(3)[:2]) is None
    assert level_direction(np.array([0.04, 0.0, -0.9992]), np.eye(3)[:2]) is None


@given(st.integers(0, 2**32 - 1), st.integers(3, 60), st.booleans(), st.integers(0, 59))
def test_a_simple_outline_keeps_its_order_and_runs_counter_clockwise(seed, count, backwards, first):
    flat = np.roll(dented(seed, count), first, axis=0)
    given_order = flat[::-1] if backwards else flat
    outline = outline_polygon(given_order, 1e-6, keep_order=True)
    assert not outline.reordered
    assert outline.merged == ()
    assert measure_outline(outline.corners, LEVEL).area > 0.0
    expected = range(count)[::-1] if backwards else range(count)
    assert outline.source == tuple(expected)
    np.testing.assert_array_equal(outline.corners, given_order[list(outline.source)])


@pytest.mark.parametrize("order", list(permutations(range(4))))
def test_four_corners_that_stand_out_go_around_in_one_way_whatever_their_order(order):
    kite = np.array([[0.0, 0.0], [0.5, 0.1], [0.6, 0.4], [0.1, 0.3]])
    outline = outline_polygon(kite[list(order)], 0.001)
    around = [order[i] for i in outline.source]
    start = around.index(0)
    assert around[start:] + around[:start] == [0, 1, 2, 3]
    steps = {(b - a) % 4 for a, b in zip(order, order[1:] + order[:1], strict=True)}
    assert outline.reordered == (steps not in ({1}, {3}))


def test_corners_of_a_dented_face_out_of_order_are_refused_because_two_orders_are_possible():
    wrong = L_SHAPE[[0, 2, 1, 3, 4, 5]]
    with pytest.raises(GeometryError, match=r"crosses itself after corners \d and \d.*list the corners"):
        outline_polygon(wrong, 0.001)


def test_an_order_that_tells_the_outside_is_not_guessed():
    with pytest.raises(GeometryError, match="crosses itself after corners 1 and 3"):
        outline_polygon(RECTANGLE[[0, 2, 1, 3]], 0.001, keep_order=True)


@pytest.mark.parametrize(
    ("rows", "merged", "source"),
    [
        ([0, 1, 1, 2, 3], (2,), (0, 1, 3, 4)),
        ([0, 1, 2, 3, 0], (4,), (0, 1, 2, 3)),
        ([0, 0, 1, 2, 2, 3, 0], (1, 4, 6), (0, 2, 3, 5)),
    ],
)
def test_a_corner_measured_again_is_one_corner_and_the_first_counts(rows, merged, source):
    noise = 4e-4 * np.random.default_rng(5).uniform(-1.0, 1.0, (len(rows), 2))
    outline = outline_polygon(RECTANGLE[rows] + noise, 1e-5)
    assert (outline.merged, outline.source) == (merged, source)


def test_corners_nearer_than_twice_their_precision_are_one():
    cut = np.vstack([RECTANGLE[:3], [[0.006, 0.3], [0.0, 0.294]]])  # a bevel of 6 mm, 8.5 mm long
    assert len(outline_polygon(cut, 0.003).corners) == 5
    assert len(outline_polygon(cut, 0.005).corners) == 4


@pytest.mark.parametrize("rows", [[0, 2, 1, 0, 3], [1, 3, 1, 0, 2], [0, 1, 2, 0, 3]])
def test_a_corner_measured_again_later_on_is_one_corner_when_the_order_is_found(rows):
    shaken = RECTANGLE[rows].copy()
    shaken[[k for k in range(1, 5) if rows[k] in rows[:k]]] += [2e-4, -1e-4]
    outline = outline_polygon(shaken, 1e-5)
    assert len(outline.corners) == 4
    assert outline.reordered == (rows != [0, 1, 2, 0, 3])
    assert len(outline.merged) == 1
    assert measure_outline(outline.corners, LEVEL).area == pytest.approx(0.18, rel=2e-3)


@pytest.mark.parametrize(
    ("flat", "words"),
    [
        (RECTANGLE[[0, 0, 1, 1]], "its outline has 2 distinct corners"),
        (RECTANGLE[[0, 0, 0]], "its outline has 1 distinct corners"),
        (np.array([[0, 0], [0.5, 0.0], [1.0, 1e-6]]), "encloses 0.25 mm²"),
    ],
)
def test_what_is_no_polygon_is_refused_with_its_numbers(flat, words):
    with pytest.raises(GeometryError, match=words) as caught:
        outline_polygon(flat, 0.001)
    assert caught.value.remedy


def crosses(points, i, j):
    """Return whether two segments cross, by the sides on which the ends of each lie."""

    def side(a, b, c):
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    n = len(points)
    a, b, c, d = points[i], points[(i + 1) % n], points[j], points[(j + 1) % n]
    return side(a, b, c) * side(a, b, d) <= 0 and side(c, d, a) * side(c, d, b) <= 0


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(4, 70), st.integers(0, 3))
def test_crossings_are_found_alike_by_the_small_and_the_large_test(seed, count, exchanges):
    rng = np.random.default_rng(seed)
    flat = dented(seed, count)
    for _ in range(exchanges):
        i, j = rng.integers(0, count, 2)
        flat[[i, j]] = flat[[j, i]]
    pairs = [(i, j) for i in range(count) for j in range(i + 2, count - (i == 0)) if crosses(flat, i, j)]
    expected = pairs[0] if pairs else None
    assert module._first_crossing_of_many(flat) == expected
    assert module._first_crossing([tuple(one) for one in flat.tolist()]) == expected
