"""Numba kernel that removes corners from the outline of a face, one by one, within bounds."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from survey.conventions import ALIKE, VANISHING

_STRAIGHT = math.sin(ALIKE)  # sine of 20°: turn of a corner below which it may lie half-way along a side


class Bounds(NamedTuple):
    """Limits of one round of corner removal.

    Attributes
    ----------
    shift : distance by which a measured corner may end up off the outline [m]
    restored : distance by which a worn corner may be restored [m]
    straight : sine of the turn below which a corner may be removed; 0: any corner [-]
    """

    shift: float
    restored: float
    straight: float


@njit(cache=True)
def square(flat, worn, limits):
    """Reduce a polygon to four corners, or to as few as the limits allow; see ``squaring.square_face``.

    Inputs
    ------
    flat : (n, 2) float64, corners, counter-clockwise [m]
    worn : (n,) bool, whether each corner's place is not to be trusted
    limits : (5,) float64, max_shift [m], shift_share [-], max_restored [m], restored_share [-], tolerance [m]

    Outputs
    -------
    polygon, source : (m, 2) float64 [m], (m,) int64, index of each corner (-1: restored); returned
    width : float, smallest distance between two parallels that enclose the polygon [m]; returned
    depth : float, depth of a corner inside its convex hull beyond the limits, in which case the polygon is the
        hull; 0: none [m]; returned
    """
    n = len(flat)
    source = _hull(flat)
    m = len(source)
    polygon, labels = np.empty((n, 2)), np.empty(n, np.int64)
    for k in range(m):
        polygon[k, 0], polygon[k, 1], labels[k] = flat[source[k], 0], flat[source[k], 1], source[k]
    width = _width(polygon, m) if m > 2 else 0.0
    tolerance = limits[4]
    shift = min(limits[0], max(limits[1] * width, min(tolerance, 0.25 * width)))
    restored = min(limits[2], max(limits[3] * width, shift))
    depth = _deepest(flat, worn, polygon, m, shift, restored)
    if depth > 0.0:
        return polygon[:m].copy(), source, width, depth
    little = min(tolerance, limits[1] * width)
    # corners half-way along a side first: neither of two short pieces of a side is a good one to extend
    m = _reduce(flat, worn, polygon, labels, m, np.int64(3), Bounds(little, little, _STRAIGHT))
    m = _reduce(flat, worn, polygon, labels, m, np.int64(4), Bounds(shift, restored, 0.0))
    first = 0
    for k in range(m):
        if _apart(polygon[k], flat[0]) < _apart(polygon[first], flat[0]):
            first = k
    out, names = np.empty((m, 2)), np.empty(m, np.int64)
    for k in range(m):
        j = (first + k) % m
        out[k, 0], out[k, 1], names[k] = polygon[j, 0], polygon[j, 1], labels[j]
    return out, names, width, 0.0


@njit(cache=True)
def _apart(a, b):
    return math.hypot(a[0] - b[0], a[1] - b[1])


@njit(cache=True)
def _reduce(flat, worn, polygon, source, m, few, bounds):
    """Remove corners of a convex polygon, always by the smallest allowed change of area; return how many are left."""
    shift, restored, straight = bounds
    n = len(flat)
    trial, labels = np.empty((n, 2)), np.empty(n, np.int64)
    best, best_labels = np.empty((n, 2)), np.empty(n, np.int64)
    while m > few:
        smallest = math.inf
        for k in range(m):
            if straight > 0.0 and _turn(polygon, m, k) > straight:
                continue
            for way in range(1 if straight > 0.0 else 2):
                area = _change(polygon, m, k, way, trial, source, labels)
                if area < smallest and _allowed(flat, worn, trial, labels, m - 1, shift, restored):
                    smallest = area
                    _put(best, best_labels, trial, labels)
        if smallest == math.inf:
            break
        m -= 1
        _put(polygon, source, best, best_labels)
    return m


@njit(cache=True)
def _put(polygon, source, corners, labels):
    """Replace a polygon and its sources; in a loop, which numba compiles in a tenth of the time of an assignment."""
    for k in range(len(corners)):
        polygon[k, 0], polygon[k, 1], source[k] = corners[k, 0], corners[k, 1], labels[k]


@njit(cache=True)
def _turn(polygon, m, k):
    """Return the sine of the angle by which an outline turns at corner k; 1 where it turns back."""
    ux, uy = _side(polygon, m, k - 1)
    vx, vy = _side(polygon, m, k)
    if ux * vx + uy * vy <= 0.0:
        return 1.0
    return abs(ux * vy - uy * vx) / (math.hypot(ux, uy) * math.hypot(vx, vy))


@njit(cache=True)
def _side(polygon, m, k):
    """Return the vector from corner k to the next."""
    i, j = (k + m) % m, (k + 1) % m
    return polygon[j, 0] - polygon[i, 0], polygon[j, 1] - polygon[i, 1]


@njit(cache=True)
def _change(polygon, m, k, way, trial, source, labels):
    """Remove corner k (way 0), or side k by extending the sides beside it (way 1); return the change of area."""
    ux, uy = _side(polygon, m, k - 1)
    wx, wy = _side(polygon, m, k)
    gone, area, share = k, 0.5 * abs(ux * wy - uy * wx), 0.0
    if way == 1:
        gone = (k + 1) % m
        vx, vy = _side(polygon, m, k + 1)
        turn = ux * vy - uy * vx
        if turn < VANISHING * math.hypot(ux, uy) * math.hypot(vx, vy):
            return math.inf  # they do not meet beyond side k
        share = (wx * vy - wy * vx) / turn  # of the side before, to be added to it
        area = 0.5 * share * abs(ux * wy - uy * wx)
    j = 0
    for i in range(m):
        if i != gone:
            trial[j, 0], trial[j, 1], labels[j] = polygon[i, 0], polygon[i, 1], source[i]
            if way == 1 and i == k:
                trial[j, 0], trial[j, 1], labels[j] = (
                    polygon[k, 0] + share * ux,
                    polygon[k, 1] + share * uy,
                    -1,
                )
            j += 1
    return area


@njit(cache=True)
def _allowed(flat, worn, polygon, source, m, shift, restored):
    """Return whether all measured corners are near enough to a polygon, and restored ones not too far outside."""
    for k in range(m):
        if source[k] < 0 and _away(polygon[k], flat, len(flat)) > restored:
            return False
    return _deepest(flat, worn, polygon, m, shift, restored) == 0.0


@njit(cache=True)
def _deepest(flat, worn, polygon, m, shift, restored):
    """Return the largest distance of a corner from a polygon's sides that is not allowed; 0 if all are."""
    deepest = 0.0
    for i in range(len(flat)):
        distance = _away(flat[i], polygon, m)
        if distance > (restored if worn[i] else shift):
            deepest = max(deepest, distance)
    return deepest


@njit(cache=True)
def _away(point, polygon, m):
    """Return the distance of a point from the nearest side of a polygon."""
    nearest = math.inf
    for k in range(m):
        ax, ay = polygon[k]
        ux, uy = polygon[(k + 1) % m, 0] - ax, polygon[(k + 1) % m, 1] - ay
        wx, wy = point[0] - ax, point[1] - ay
        square_length = ux * ux + uy * uy
        along = 0.0
        if square_length > 0.0:
            along = min(max((wx * ux + wy * uy) / square_length, 0.0), 1.0)
        nearest = min(nearest, math.hypot(wx - along * ux, wy - along * uy))
    return nearest


@njit(cache=True)
def _width(polygon, m):
    """Return the smallest distance between two parallel lines that enclose a convex polygon."""
    smallest = math.inf
    for k in range(m):
        ux, uy = _side(polygon, m, k)
        highest = 0.0
        for i in range(m):
            highest = max(
                highest, ux * (polygon[i, 1] - polygon[k, 1]) - uy * (polygon[i, 0] - polygon[k, 0])
            )
        smallest = min(smallest, highest / math.hypot(ux, uy))
    return smallest


@njit(cache=True)
def _hull(flat):
    """Return the indices of the convex hull, counter-clockwise (Andrew's monotone chain)."""
    n = len(flat)
    order = np.arange(n)
    for i in range(1, n):  # few corners: sort by x, then y, by insertion
        one, j = order[i], i
        while j > 0 and _after(flat, order[j - 1], one):
            order[j] = order[j - 1]
            j -= 1
        order[j] = one
    chain, count = np.empty(2 * n, np.int64), 0
    for way in range(2):
        start = count
        for i in range(n):
            one = order[i] if way == 0 else order[n - 1 - i]
            while count - start > 1 and _bend(flat, chain[count - 2], chain[count - 1], one) <= 0.0:
                count -= 1
            chain[count] = one
            count += 1
        count -= 1  # the last is the first of the way back
    return chain[:count].copy()


@njit(cache=True)
def _after(flat, i, j):
    return flat[i, 0] > flat[j, 0] or (flat[i, 0] == flat[j, 0] and flat[i, 1] > flat[j, 1])


@njit(cache=True)
def _bend(flat, i, j, k):
    """Return twice the area of a triangle of three corners, positive if they turn to the left."""
    ux, uy, vx, vy = (
        flat[j, 0] - flat[i, 0],
        flat[j, 1] - flat[i, 1],
        flat[k, 0] - flat[j, 0],
        flat[k, 1] - flat[j, 1],
    )
    return ux * vy - uy * vx
