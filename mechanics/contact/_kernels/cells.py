"""Cells of the common face of two stones: a grid that stays with one of the two faces, cut to their overlap."""

import numpy as np
from numba import njit

from mechanics.contact._kernels.vectors import along, cross, dot, minus, norm, over, row

_EQUAL = 1.0 - 1e-6  # of lengths and areas that are equal but for rounding, the first counts [-]
_WHOLE = 1e-6  # part of a cell that a face may be longer than whole cells [-]
_NARROW = 0.25  # a cell of which the overlap reaches over less of its width belongs to its neighbour [-]
_SLIVER = 1e-3  # a cell of which the overlap takes less of its area belongs to the next one [-]
_ON_LINE = 1e-6  # of a cell: a corner nearer than this to a line of the grid lies beyond it, whatever the rounding [-]
# part of a cell's area that its corners take: with a quarter at its corner and the rest where the centroid stays, a
# rectangular cell keeps its second moments, f/(1 - f) b²/4 = b²/12 along each side b [-]
_AT_CORNERS = 0.25


@njit(cache=True)
def face_grid(face, spacing, vertex, cptr, corner, normal):  # pragma: no cover - compiled
    """Return the grid of a face along its longest edge: a corner of its box, two axes, and cells along each.

    Inputs
    ------
    face : int64
    spacing : float64, largest width of a cell [m]
    vertex, cptr, corner, normal : of `Polyhedra`

    Outputs
    -------
    origin, e1, e2 : three float64 each, in the axes of the vertices [m], [-]
    n1, n2 : int64, number of cells along e1 and e2, two or more
    p1, p2 : float64, their widths [m]
    """
    start, stop = cptr[face], cptr[face + 1]
    longest, edge = -1.0, (0.0, 0.0, 0.0)
    for v in range(start, stop):
        side = minus(row(vertex, corner[v + 1 if v + 1 < stop else start]), row(vertex, corner[v]))
        if norm(side) * _EQUAL > longest:
            longest, edge = norm(side), side
    n, o = row(normal, face), row(vertex, corner[start])
    edge = along(edge, -dot(edge, n), n)
    e1 = over(edge, norm(edge))
    e2 = cross(n, e1)
    u0 = v0 = np.inf
    u1 = v1 = -np.inf
    for c in range(start, stop):
        arm = minus(row(vertex, corner[c]), o)
        u, v = dot(e1, arm), dot(e2, arm)
        u0, u1, v0, v1 = min(u0, u), max(u1, u), min(v0, v), max(v1, v)
    n1 = max(2, int(np.ceil((u1 - u0) / spacing - _WHOLE)))
    n2 = max(2, int(np.ceil((v1 - v0) / spacing - _WHOLE)))
    return along(along(o, u0, e1), v0, e2), e1, e2, n1, n2, (u1 - u0) / n1, (v1 - v0) / n2


@njit(cache=True)
def _cut(ring, count, axis, bound, sign, kept):
    """Write what lies below (sign 1) or above (-1) a bound of a coordinate of a convex ring; return its corners."""
    k = 0
    for p in range(count):
        q = p + 1 if p + 1 < count else 0
        dp, dq = sign * (ring[p, axis] - bound), sign * (ring[q, axis] - bound)
        if dp <= 0.0 and k < kept.shape[0]:
            kept[k] = ring[p]
            k += 1
        if dp * dq < 0.0 and k < kept.shape[0]:
            t = dp / (dp - dq)
            for c in range(4):
                kept[k, c] = ring[p, c] + t * (ring[q, c] - ring[p, c])
            k += 1
    return k


@njit(cache=True)
def _range(ring, count, axis, pitch, cells):
    """Return the first and last cell that an overlap covers along one axis, and its middle."""
    low, high = np.inf, -np.inf
    for p in range(count):
        low, high = min(low, ring[p, axis]), max(high, ring[p, axis])
    first = min(max(int(np.floor(low / pitch)), 0), cells - 1)
    last = min(max(int(np.floor(high / pitch)), 0), cells - 1)
    if first < last and (first + 1) * pitch - low < _NARROW * pitch:
        first += 1
    if first < last and high - last * pitch < _NARROW * pitch:
        last -= 1
    return first, last, 0.5 * (low + high)


@njit(cache=True)
def _part(number, first, last, middle, pitch):
    """Return the bounds of a cell, infinite at the ends, and its name; of a single cell there are two halves."""
    if first == last:
        return (-np.inf, middle, 3 * first + 1) if number == 0 else (middle, np.inf, 3 * first + 2)
    cell = first + number
    low = -np.inf if cell == first else cell * pitch
    high = np.inf if cell == last else (cell + 1) * pitch
    return low, high, 3 * cell


@njit(cache=True)
def _cell_of(place, first, last, middle, pitch):
    """Return the number of the cell, counted from the first, that a coordinate lies in."""
    if first == last:
        return 0 if place < middle else 1
    return min(max(int(np.floor(place / pitch + _ON_LINE)), first), last) - first


@njit(cache=True)
def _within(ring, count, axis, low, high, scratch, kept):
    """Write the part of a ring between two bounds; return its corners."""
    k = _cut(ring, count, axis, high, 1.0, scratch)
    return _cut(scratch, k, axis, low, -1.0, kept)


@njit(cache=True)
def _area(ring, count):
    """Return area [m²] and first moments about the origin [m³] of a ring in its last two coordinates."""
    area = mx = my = 0.0
    for p in range(1, count - 1):
        ax, ay = ring[p, 2] - ring[0, 2], ring[p, 3] - ring[0, 3]
        bx, by = ring[p + 1, 2] - ring[0, 2], ring[p + 1, 3] - ring[0, 3]
        a = 0.5 * (ax * by - ay * bx)
        area += a
        mx += a * (ring[0, 2] + (ax + bx) / 3.0)
        my += a * (ring[0, 3] + (ay + by) / 3.0)
    return (area, mx, my) if area >= 0.0 else (-area, -mx, -my)


@njit(cache=True)
def cell_points(ring, count, grid, rings, points, taker):  # pragma: no cover - compiled
    """Find the centroids of the cells of an overlap, with their areas; both add up to those of the overlap.

    The cells are those of the grid, cut to the overlap. Narrow ones at its ends belong to their neighbours, and so do
    slivers. Where one cell would be all along an axis, its two halves are.

    Inputs
    ------
    ring : (≥ count, 4) float64, corners of a convex overlap in the axes of the grid, from its origin, and in those in
        which the points are wanted [m]
    count : int64
    grid : n1, n2, p1, p2 of `face_grid`
    rings : (4, room, 4) float64, scratch; there is room for four corners more than the overlap has
    points : x, y, label, share, each (≥ n1 n2,), to which points [m], names below 9 n1 n2 and areas [m²] are written
    taker : (≥ count,) int64, to which the point of the cell is written that each corner of the overlap belongs to

    Outputs
    -------
    int64, number of points
    """
    n1, n2, p1, p2 = grid
    x, y, label, share = points
    a, b, u = _range(ring, count, 0, p1, n1)
    c, d, v = _range(ring, count, 1, p2, n2)
    k = np.int64(0)  # of no literal type
    area = mx = my = 0.0
    taker[:count] = 0
    for i in range(max(b - a + 1, 2)):
        low, high, row_name = _part(i, a, b, u, p1)
        strip = _within(ring, count, 0, low, high, rings[0], rings[1])
        for j in range(max(d - c + 1, 2)):
            low, high, name = _part(j, c, d, v, p2)
            corners = _within(rings[1], strip, 1, low, high, rings[2], rings[3])
            own = _area(rings[3], corners)
            for q in range(count):
                if _cell_of(ring[q, 0], a, b, u, p1) == i and _cell_of(ring[q, 1], c, d, v, p2) == j:
                    taker[q] = k
            area, mx, my = area + own[0], mx + own[1], my + own[2]
            if area >= _SLIVER * p1 * p2:
                x[k], y[k], share[k], label[k] = mx / area, my / area, area, row_name * 3 * n2 + name
                k += 1
                area = mx = my = 0.0
    if area > 0.0 and k == 0:
        x[0], y[0], share[0], label[0] = mx / area, my / area, area, 3 * (a * 3 * n2 + c)
        return np.int64(1)
    if area > 0.0:
        # what slivers at the end leave belongs to the last point
        q = k - 1
        for p in range(count):
            taker[p] = min(taker[p], q)
        whole = share[q] + area
        x[q], y[q] = (share[q] * x[q] + mx) / whole, (share[q] * y[q] + my) / whole
        share[q] = whole
    return k


@njit(cache=True)
def corner_points(x_corner, y_corner, taker, cells, stride, points):  # pragma: no cover - compiled
    """Add corners of an overlap to the points of its cells, so that a stone rocks about the true edge of its joint.

    The corners of a cell share a quarter of its area, and its point moves so that area and centroid of each cell stay.
    They are named after their cell, not after corners of either face, since rounding would choose between faces that
    end together.

    Inputs
    ------
    x_corner, y_corner : (n,) float64 [m]
    taker : (n,) int64, point of the cell of each corner
    cells, stride : int64, number of points of cells, and a number above all their names
    points : x, y, label, share, each (≥ cells + n,): points of the cells, behind which the corners are written

    Outputs
    -------
    int64, number of points
    """
    x, y, label, share = points
    count = taker.shape[0]
    for k in range(cells):
        among, mx, my = 0, 0.0, 0.0
        for q in range(count):
            if taker[q] == k:
                label[cells + q] = among * stride + label[k]
                among, mx, my = among + 1, mx + x_corner[q], my + y_corner[q]
        if among == 0:
            continue
        for q in range(count):
            if taker[q] == k:
                x[cells + q], y[cells + q] = x_corner[q], y_corner[q]
                share[cells + q] = _AT_CORNERS * share[k] / among
        x[k] = (x[k] - _AT_CORNERS * mx / among) / (1.0 - _AT_CORNERS)
        y[k] = (y[k] - _AT_CORNERS * my / among) / (1.0 - _AT_CORNERS)
        share[k] *= 1.0 - _AT_CORNERS
    return cells + count
