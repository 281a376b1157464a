"""Tracing of masks: the boundary of a stone in a picture, and the few corners that describe it."""

import math

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array, Bools
from survey.conventions import CORNERS, PARALLEL
from survey.geometry.polygons import ring_area

_SHARP = math.sin(PARALLEL)  # sine of the angle between sides below which they do not meet in a corner
DENSE = 12  # corners beyond which an outline was traced or drawn as a curve, and is described by fewer
_SPAN = 0.15  # part of a side at either end that rounds its corners off, and does not count for its line


def trace(mask: Bools) -> tuple[Array, int, float]:
    """Trace the largest piece of a mask.

    Parameters
    ----------
    mask : (h, w)

    Returns
    -------
    ring : (n, 2) column and row of its boundary, midway between pixels inside and outside; pixel centres are whole
    pieces : number of its pieces
    share : of the largest piece in the area of all
    """
    from contourpy import contour_generator

    if not mask.any():
        return np.empty((0, 2)), 0, 0.0
    padded = np.zeros((mask.shape[0] + 2, mask.shape[1] + 2))
    padded[1:-1, 1:-1] = mask
    rings = [np.asarray(line)[:-1] - 1.0 for line in contour_generator(z=padded).lines(0.5)]
    areas = np.array([abs(ring_area(ring)) for ring in rings])
    outer = [k for k, ring in enumerate(rings) if _is_outer(ring, mask)]
    if not outer:
        return np.empty((0, 2)), 0, 0.0
    best = max(outer, key=lambda k: areas[k])
    return rings[best], len(outer), float(areas[best] / areas[outer].sum())


def _is_outer(ring: Array, mask: NDArray[np.bool_]) -> bool:
    """Return whether a ring bounds a piece from outside: its topmost vertex has the mask below it."""
    column, row = ring[np.argmin(ring[:, 1])]
    inside = math.floor(row) + 1, round(column)
    return inside[0] < mask.shape[0] and 0 <= inside[1] < mask.shape[1] and bool(mask[inside])


def few_corners(ring: Array, tolerance: float) -> Array:
    """Describe a dense ring by few corners, where straight lines fitted to its sides meet.

    The corners are first those of Douglas and Peucker (1973). Lines fitted to the points of each side then average the
    steps of the pixels, and meet nearer the true corner than any pixel.

    Parameters
    ----------
    ring : (n, 2) dense boundary
    tolerance : largest distance of the boundary from the sides

    Returns
    -------
    (m, 2) m ≥ 3, whose sides do not cross; the ring itself if it has three corners or fewer, or winds too closely
    """
    if len(ring) <= CORNERS:
        return ring
    for finer in (1.0, 0.5, 0.25):
        douglas_peucker = _douglas_peucker(ring, finer * tolerance)
        if len(douglas_peucker) < CORNERS:
            return ring[_extreme(ring)]
        for corners in (_met(ring, douglas_peucker, tolerance), ring[douglas_peucker]):
            if not _crosses(corners):
                return corners
    return ring


def _met(ring: Array, corners: list[int], tolerance: float) -> Array:
    """Return the corners where lines fitted to neighbouring sides meet, near those of the ring."""
    lines = [_line(_side(ring, corners[k], corners[(k + 1) % len(corners)])) for k in range(len(corners))]
    out = ring[corners].copy()
    for k, index in enumerate(corners):
        (p, a), (q, b) = lines[k - 1], lines[k]
        turn = a[0] * b[1] - a[1] * b[0]
        if abs(turn) < _SHARP:
            continue
        along = ((q[0] - p[0]) * b[1] - (q[1] - p[1]) * b[0]) / turn
        meet = p + along * a
        if math.dist(meet, ring[index]) <= 2.5 * tolerance:
            out[k] = meet
    return out


def _crosses(ring: Array) -> bool:
    """Return whether two sides of a polygon that are no neighbours meet."""
    a, b = ring, np.roll(ring, -1, axis=0)
    (dx, dy), (ax, ay) = (b - a).T, a.T
    # side of each start and end from each line
    start = dx[:, None] * (ay[None] - ay[:, None]) - dy[:, None] * (ax[None] - ax[:, None])
    stop = np.roll(start, -1, axis=1)
    apart = start * stop < 0.0
    return bool((apart & apart.T).any())


def _extreme(ring: Array) -> NDArray[np.intp]:
    """Return three or more indices that span a small ring."""
    extremes = {
        int(np.argmin(ring[:, 0])),
        int(np.argmax(ring[:, 0])),
        int(np.argmin(ring[:, 1])),
        int(np.argmax(ring[:, 1])),
    }
    return np.array(sorted(extremes) if len(extremes) >= CORNERS else range(len(ring)))


def _douglas_peucker(ring: Array, tolerance: float) -> list[int]:
    """Return the indices of the corners of a closed ring, in order."""
    first = int(np.argmax(((ring - ring.mean(axis=0)) ** 2).sum(axis=1)))
    turned = np.roll(ring, -first, axis=0)
    closed = np.concatenate([turned, turned[:1]])
    farthest = int(np.argmax(((turned - turned[0]) ** 2).sum(axis=1)))
    corners, stack = {0, farthest}, [(0, farthest), (farthest, len(ring))]
    while stack:
        start, stop = stack.pop()
        if stop - start < 2:
            continue
        inner = closed[start + 1 : stop] - closed[start]
        side = closed[stop] - closed[start]
        length = math.hypot(side[0], side[1])
        if length > 0.0:
            apart = np.abs(inner[:, 0] * side[1] - inner[:, 1] * side[0]) / length
        else:
            apart = np.hypot(inner[:, 0], inner[:, 1])
        worst = int(np.argmax(apart))
        if apart[worst] > tolerance:
            middle = start + 1 + worst
            corners.add(middle)
            stack += [(start, middle), (middle, stop)]
    return [(k + first) % len(ring) for k in sorted(corners)]


def _side(ring: Array, start: int, stop: int) -> Array:
    """Return the points of a side, without its ends if there are enough."""
    count = (stop - start) % len(ring)
    rows = np.arange(start, start + count + 1) % len(ring)
    cut = int(_SPAN * count)
    return ring[rows[cut : len(rows) - cut]] if count - 2 * cut >= 2 else ring[rows]


def _line(points: Array) -> tuple[Array, Array]:
    """Fit a line: a point of it, and its unit direction."""
    middle = points.mean(axis=0)
    (a, b), (_, c) = (points - middle).T @ (points - middle)
    angle = 0.5 * math.atan2(2.0 * b, a - c)
    return middle, np.array([math.cos(angle), math.sin(angle)])
