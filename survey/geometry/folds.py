"""Folding of warped polygons along the diagonals that leave the least warp.

A polygon of a mesh with more than three corners defines its edges, not the surface between them. Where its corners
are not coplanar it is cut along the diagonal that leaves its two halves flattest, and these again, until all are
flat. Of equally good diagonals the shortest is taken, so that two stones that share a side fold it alike.
"""

from collections.abc import Iterator

import numpy as np

from survey.arrays import Array
from survey.conventions import SAME
from survey.geometry.solids import area_vector

Polygon = tuple[int, ...]


def warp(corners: Array) -> float:
    """Return the largest distance of the corners (n, 3) from their mean plane [m]; infinite if the area is zero."""
    if len(corners) == 3:
        return 0.0
    normal = area_vector(corners)
    length = float(np.linalg.norm(normal))
    if not length > 0.0:
        return float("inf")
    return float(np.abs((corners - corners.mean(axis=0)) @ normal).max()) / length


def fold(vertices: Array, polygon: Polygon, tolerance: float) -> list[Polygon]:
    """Cut a polygon into flat polygons.

    Parameters
    ----------
    vertices : (nv, 3) [m]
    polygon : vertex indices, in order
    tolerance : largest warp of a flat polygon [m]

    Returns
    -------
    Polygons wound like the original, which share the diagonals along which it was cut
    """
    if len(polygon) == 3 or warp(vertices[list(polygon)]) <= tolerance:
        return [polygon]
    size = float(np.linalg.norm(np.ptp(vertices[list(polygon)], axis=0)))
    best, score = None, (float("inf"), float("inf"))
    for halves in _halves(vertices, polygon):
        warped = max(warp(vertices[list(half)]) for half in halves)
        across = float(np.linalg.norm(vertices[halves[0][0]] - vertices[halves[0][-1]]))
        candidate = (
            SAME * size * round(warped / (SAME * size)) if np.isfinite(warped) else warped,
            across,
        )
        if candidate < score:
            best, score = halves, candidate
    if best is None:  # no diagonal lies within it: it crosses itself, or is seen from the side everywhere
        return [(polygon[0], polygon[k], polygon[k + 1]) for k in range(1, len(polygon) - 1)]
    return [flat for half in best for flat in fold(vertices, half, tolerance)]


def _halves(vertices: Array, polygon: Polygon) -> Iterator[tuple[Polygon, Polygon]]:
    """Yield both sides of each diagonal within the polygon, seen square to its mean plane."""
    corners = vertices[list(polygon)]
    normal = area_vector(corners)
    if not float(np.linalg.norm(normal)) > 0.0:
        return
    u = np.linalg.svd(normal[None, :])[2][1]
    flat = np.column_stack([corners @ u, corners @ np.cross(normal / np.linalg.norm(normal), u)])
    n = len(polygon)
    for i in range(n - 2):
        for j in range(i + 2, n - (i == 0)):
            if _within(flat, i, j):
                yield polygon[i : j + 1], polygon[j:] + polygon[: i + 1]


def _within(flat: Array, i: int, j: int) -> bool:
    """Return whether the diagonal from corner i to corner j crosses no side and runs inside."""
    n = len(flat)
    for k in range(n):
        following = (k + 1) % n
        if {k, following} & {i, j}:
            continue
        if (
            _turn(flat[i], flat[j], flat[k]) * _turn(flat[i], flat[j], flat[following]) <= 0.0
            and _turn(flat[k], flat[following], flat[i]) * _turn(flat[k], flat[following], flat[j]) <= 0.0
        ):
            return False
    before, here, after = flat[i - 1], flat[i], flat[(i + 1) % n]
    left_of_next = _turn(here, after, flat[j]) > 0.0
    left_of_last = _turn(before, here, flat[j]) > 0.0
    if _turn(before, here, after) > 0.0:
        return left_of_next and left_of_last
    return left_of_next or left_of_last


def _turn(a: Array, b: Array, c: Array) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
