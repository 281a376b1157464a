"""Overlaps, areas and moments of many convex plane polygons at once.

A polygon is a row of corners (m, 2), counter-clockwise, of which the first `count` are valid.
"""

import numpy as np

from mechanics.arrays import Array, Bools, Ints


def following(count: Ints, most: int) -> Ints:
    """Return the corner after each one (n, most), for polygons with `count` (n,) corners."""
    place = np.arange(most)
    return np.where(place + 1 < count[:, None], place + 1, 0)


def overlaps(first: Array, first_count: Ints, second: Array, second_count: Ints) -> tuple[Array, Ints]:
    """Intersect two rows of polygons, pair by pair (Sutherland & Hodgman 1974)."""
    polygon, count = first, first_count
    rows = np.arange(len(second))
    for k in range(second.shape[1]):
        a = second[:, k]
        b = second[rows, np.where(k + 1 < second_count, k + 1, 0)]
        polygon, count = _clipped(polygon, count, a, b, k < second_count)
    return polygon, count


def _clipped(polygon: Array, count: Ints, a: Array, b: Array, wanted: Bools) -> tuple[Array, Ints]:
    """Keep the parts to the left of the lines a → b (n, 2), in the wanted rows."""
    number, most = polygon.shape[:2]
    place = np.arange(most)
    meant = place < count[:, None]
    after = following(count, most)
    along, away = (b - a)[:, None], polygon - a[:, None]
    side = np.where(wanted[:, None], along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0], 1.0)
    rows = np.arange(number)[:, None]
    ahead = side[rows, after]
    crosses = meant & (side * ahead < 0)
    fraction = np.where(crosses, side, 0.0) / np.where(crosses, side - ahead, 1.0)
    crossing = polygon + fraction[..., None] * (polygon[rows, after] - polygon)
    # each corner gives itself, if it is kept, and then the point where its edge crosses the line
    corners = np.stack([polygon, crossing], axis=2).reshape(number, 2 * most, 2)
    inside = np.stack([meant & (side >= 0), crosses], axis=2).reshape(number, 2 * most)
    order = np.argsort(~inside, axis=1, kind="stable")
    left_over = inside.sum(axis=1)
    return corners[rows, order][:, : max(int(left_over.max(initial=0)), 1)], left_over


def moments(polygon: Array, count: Ints) -> tuple[Array, Array, Array]:
    """Return area (n,), centroid (n, 2) and second moments ∫(x-c)(x-c)ᵀ (n, 2, 2) of each; zeros for empty polygons."""
    rows, place = np.arange(len(polygon))[:, None], np.arange(polygon.shape[1])
    origin = polygon[:, :1]
    meant = (place < count[:, None])[..., None]
    p = np.where(meant, polygon - origin, 0.0)
    q = np.where(meant, p[rows, following(count, polygon.shape[1])], 0.0)
    # each edge spans a triangle with the first corner
    twice = p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]
    area = 0.5 * twice.sum(axis=1)
    safe = np.where(area > 0, area, 1.0)
    middle = np.einsum("nk,nki->ni", twice, p + q) / (6.0 * safe[:, None])
    second = np.einsum("nk,nki,nkj->nij", twice, p, p) + np.einsum("nk,nki,nkj->nij", twice, q, q)
    second += np.einsum("nk,nki,nkj->nij", twice, p + q, p + q)
    second = second / 24.0 - area[:, None, None] * middle[:, :, None] * middle[:, None, :]
    return area, origin[:, 0] + middle, second
