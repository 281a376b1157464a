"""Overlaps and moments of many polygons against the slow ones of tests.mechanics.polygons, and closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from mechanics.stones.convex_polygons import following, moments, overlaps
from tests.mechanics.contact import polygons


def packed(many):
    """Polygons as rows of one array; what is behind the last corner must not matter."""
    count = np.array([len(one) for one in many])
    rows = np.full((len(many), count.max(), 2), 7.7)
    for row, one in zip(rows, many, strict=True):
        row[: len(one)] = one
    return rows, count


def random_polygon(rng, centre):
    points = rng.normal(size=(rng.integers(4, 9), 2))
    return points[ConvexHull(points).vertices] + centre


@given(st.integers(0, 10_000))
def test_overlaps_are_those_of_the_slow_algorithm(seed):
    rng = np.random.default_rng(seed)
    first = [random_polygon(rng, rng.normal(size=2)) for _ in range(5)]
    second = [random_polygon(rng, rng.normal(size=2)) for _ in range(5)]
    common, count = overlaps(*packed(first), *packed(second))
    area, centroid, spread = moments(common, count)
    for row, (one, other) in enumerate(zip(first, second, strict=True)):
        lifted = [np.column_stack([p, np.zeros(len(p))]) for p in (other, one)]
        expected = polygons.overlap(*lifted, np.array([0.0, 0.0, 1.0]))
        if len(expected) < 3:
            assert area[row] == pytest.approx(0.0, abs=1e-12)
            continue
        whole, mean, second_moment = polygons.moments(expected[:, :2])
        assert area[row] == pytest.approx(whole, abs=1e-12)
        if whole > 1e-9:
            np.testing.assert_allclose(centroid[row], mean / whole, atol=1e-6)
            np.testing.assert_allclose(
                spread[row], second_moment - np.outer(mean, mean) / whole, atol=1e-9 * (1 + whole)
            )


def test_moments_of_a_rectangle_and_of_a_triangle():
    """b h³/12 for a rectangle, b h³/36 for a triangle, far from the origin."""
    away = np.array([1e3, -2e3])
    rectangle = away + np.array([[0, 0], [3, 0], [3, 2], [0, 2]], dtype=float)
    triangle = away + np.array([[0, 0], [3, 0], [1, 2]], dtype=float)
    area, centroid, second = moments(*packed([rectangle, triangle]))
    assert area == pytest.approx([6.0, 3.0])
    np.testing.assert_allclose(centroid - away, [[1.5, 1.0], [4 / 3, 2 / 3]], atol=1e-9)
    assert second[0] == pytest.approx(np.diag([2 * 27 / 12, 3 * 8 / 12]), abs=1e-9)
    assert second[1, 1, 1] == pytest.approx(3 * 8 / 36)


def test_polygons_apart_have_nothing_in_common():
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
    common, count = overlaps(
        *packed([square, square]), *packed([square + 2.0, square + np.array([0.5, 0.0])])
    )
    assert count.tolist() == [0, 4]
    assert moments(common, count)[0] == pytest.approx([0.0, 0.5])


def test_the_last_corner_is_followed_by_the_first():
    assert following(np.array([3, 4]), 4).tolist() == [[1, 2, 0, 0], [1, 2, 3, 0]]
