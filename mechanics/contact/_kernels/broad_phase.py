"""Broad phase: bodies put in place, their boxes, and the pairs of boxes that overlap."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mechanics.contact._kernels.vectors import row, write_row

_MANY_CELLS = 64  # a box that spans more cells than this is compared with all others instead


@njit(cache=True)
def _placed(centre, rotation, local):
    """Return centre + rotation · local."""
    return (
        centre[0] + rotation[0, 0] * local[0] + rotation[0, 1] * local[1] + rotation[0, 2] * local[2],
        centre[1] + rotation[1, 0] * local[0] + rotation[1, 1] * local[1] + rotation[1, 2] * local[2],
        centre[2] + rotation[2, 0] * local[0] + rotation[2, 1] * local[1] + rotation[2, 2] * local[2],
    )


@njit(cache=True)
def place(pointer, local, centre, rotation):  # pragma: no cover - compiled
    """Transform points of bodies to world axes: centre + rotation · local.

    Inputs
    ------
    pointer : (nb+1,) int64, rows of each body
    local : (n, 3) float64, points in body axes [m]
    centre : (nb, 3) float64 [m]; zero for directions
    rotation : (nb, 3, 3) float64 [-]

    Outputs
    -------
    (n, 3) float64 [m]
    """
    out = np.empty_like(local)
    for b in range(pointer.shape[0] - 1):
        c, r = centre[b], rotation[b]
        for k in range(pointer[b], pointer[b + 1]):
            write_row(out, k, _placed(c, r, row(local, k)))
    return out


@njit(cache=True)
def boxes(pointer, vertex, margin):  # pragma: no cover - compiled
    """Draw axis-parallel boxes around bodies.

    Inputs
    ------
    pointer : (nb+1,) int64, vertices of each body
    vertex : (nv, 3) float64 [m]
    margin : (nb,) float64, by which the boxes are widened [m]

    Outputs
    -------
    low, high : (nb, 3) float64 [m]
    """
    nb = pointer.shape[0] - 1
    low, high = np.full((nb, 3), np.inf), np.full((nb, 3), -np.inf)
    for b in range(nb):
        for k in range(pointer[b], pointer[b + 1]):
            for d in range(3):
                low[b, d] = min(low[b, d], vertex[k, d])
                high[b, d] = max(high[b, d], vertex[k, d])
        for d in range(3):
            low[b, d] -= margin[b]
            high[b, d] += margin[b]
    return low, high


@njit(cache=True)
def _overlap(i, j, low, high):
    apart = False
    for d in range(low.shape[1]):
        apart = apart or low[j, d] > high[i, d] or low[i, d] > high[j, d]
    return not apart


@njit(cache=True)
def _push(pairs, count, i, j):
    if count == pairs.shape[0]:
        grown = np.empty((2 * count, 2), dtype=np.int64)
        for k in range(count):
            grown[k, 0], grown[k, 1] = pairs[k, 0], pairs[k, 1]
        pairs = grown
    pairs[count, 0], pairs[count, 1] = min(i, j), max(i, j)
    return pairs


@njit(cache=True)
def _cell_size(low, high):
    """Return the median of the boxes' largest extents [m]: most boxes span at most two cells in each direction."""
    nb, d = low.shape
    extent = np.empty(nb)
    for b in range(nb):
        e = 0.0
        for k in range(d):
            e = max(e, high[b, k] - low[b, k])
        extent[b] = e
    return max(_median(extent, nb), 1e-300)


@njit(cache=True)
def _median(values, count):
    """Return the median of the first values, which are reordered (Hoare 1961); np.median takes a second to compile."""
    low, high, half = 0, count - 1, count // 2
    while low < high:
        pivot, i, j = values[half], low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i, j = i + 1, j - 1
        if j < half:
            low = i
        if i > half:
            high = j
    if count % 2:
        return values[half]
    lower = values[0]
    for k in range(1, half):
        lower = max(lower, values[k])
    return 0.5 * (lower + values[half])


@njit(cache=True)
def _cells_of(low, high, origin, cell):
    """Return first cell and number of cells of each box along each axis, and boxes that are too large for the grid."""
    nb, d = low.shape
    first, span = np.empty((nb, d), dtype=np.int64), np.empty((nb, d), dtype=np.int64)
    large = np.zeros(nb, dtype=np.bool_)
    for b in range(nb):
        total = 1.0
        for k in range(d):
            total *= (high[b, k] - low[b, k]) / cell + 1.0
        if total > _MANY_CELLS:
            large[b] = True
            span[b] = 0
            first[b] = 0
            continue
        for k in range(d):
            first[b, k] = np.int64(np.floor((low[b, k] - origin[k]) / cell))
            span[b, k] = np.int64(np.floor((high[b, k] - origin[k]) / cell)) - first[b, k] + 1
    return first, span, large


@njit(cache=True)
def _slot_of(x, y, z, mask):
    return (x * 73856093 ^ y * 19349663 ^ z * 83492791) & mask


@njit(cache=True)
def _fill(first, span, mask):
    """Sort boxes by the slot of each cell that they touch; return slot pointers, box and cell of each entry."""
    nb, d = first.shape
    start = np.zeros(mask + 2, dtype=np.int64)
    total = 0
    for pass_ in range(2):
        if pass_ == 1:
            for s in range(mask + 1):
                start[s + 1] += start[s]
            total = start[mask + 1]
            box, cell = np.empty(total, dtype=np.int64), np.empty((total, 3), dtype=np.int64)
            cursor = start[: mask + 1].copy()
        for b in range(nb):
            deep = span[b, 2] if d == 3 else min(1, span[b, 0])
            base = first[b, 2] if d == 3 else 0
            for x in range(first[b, 0], first[b, 0] + span[b, 0]):
                for y in range(first[b, 1], first[b, 1] + span[b, 1]):
                    for z in range(base, base + deep):
                        s = _slot_of(x, y, z, mask)
                        if pass_ == 0:
                            start[s + 1] += 1
                        else:
                            n = cursor[s]
                            box[n] = b
                            cell[n, 0], cell[n, 1], cell[n, 2] = x, y, z
                            cursor[s] += 1
    return start, box, cell


class Grid(NamedTuple):
    """Boxes by the cells of a uniform, hashed grid that they touch.

    Attributes
    ----------
    first : (n, d) int64, first cell of each box
    large : (n,) bool, boxes much larger than most, which lie in no cell
    start : (ns+1,) int64, where the entries of each slot begin
    box : (ne,) int64, box of each entry
    cell : (ne, 3) int64, and its cell
    """

    first: NDArray[np.int64]
    large: NDArray[np.bool_]
    start: NDArray[np.int64]
    box: NDArray[np.int64]
    cell: NDArray[np.int64]


@njit(cache=True)
def grid_of(low, high):  # pragma: no cover - compiled
    """Sort boxes into a grid, d = 2 or 3: the cost is linear in their number, whatever the space between.

    Inputs
    ------
    low, high : (n, d) float64 [m]

    Outputs
    -------
    Grid
    """
    nb, d = low.shape
    origin, size = (low[0].copy(), _cell_size(low, high)) if nb else (np.zeros(d), 1.0)
    first, span, large = _cells_of(low, high, origin, size)
    entries = 0
    for b in range(nb):
        e = 1
        for k in range(d):
            e *= span[b, k]
        entries += e
    mask = 1
    while mask < 2 * entries:
        mask *= 2
    start, box, cell = _fill(first, span, mask - 1)
    return Grid(first, large, start, box, cell)


@njit(cache=True, nogil=True)
def close_pairs(low, high, owner, fixed, grid, begin, end):  # pragma: no cover - compiled
    """Find pairs of overlapping boxes, from a share of the grid's slots and of the large boxes.

    Large boxes are compared with all others. Shares that cover 0 to n find each pair once.

    Inputs
    ------
    low, high : (n, d) float64 [m]
    owner : (n,) int64; boxes of one owner make no pair
    fixed : (n,) bool; two fixed boxes make no pair
    grid : Grid
    begin, end : int64, the share, from 0 to n

    Outputs
    -------
    (np, 2) int64, smaller index first
    """
    nb, d = low.shape
    first, large, start, box, cell = grid
    pairs, count = np.empty((8 * (end - begin) + 8, 2), dtype=np.int64), np.int64(0)  # not a literal type
    slots = start.shape[0] - 1
    for s in range(begin * slots // max(nb, 1), end * slots // max(nb, 1)):
        for a in range(start[s], start[s + 1]):
            i = box[a]
            for b in range(a + 1, start[s + 1]):
                j = box[b]
                # only in the lowest cell that both touch
                here = cell[a, 0] == cell[b, 0] and cell[a, 1] == cell[b, 1]
                here = here and cell[a, 2] == cell[b, 2]
                for k in range(d):
                    here = here and cell[a, k] == max(first[i, k], first[j, k])
                if not here or owner[i] == owner[j] or (fixed[i] and fixed[j]):
                    continue
                if _overlap(i, j, low, high):
                    pairs = _push(pairs, count, i, j)
                    count += 1
    for i in range(begin, end):
        if large[i]:
            for j in range(nb):
                if i == j or (large[j] and j < i) or owner[i] == owner[j] or (fixed[i] and fixed[j]):
                    continue
                if _overlap(i, j, low, high):
                    pairs = _push(pairs, count, i, j)
                    count += 1
    return pairs[:count]


@njit(cache=True, nogil=True)
def single_points(shapes, place, point, owner, centre, rotation):  # pragma: no cover - compiled
    """Transform single contact points to the axes of their bodies.

    Inputs
    ------
    shapes : (np, 2) int64, of each pair
    place : (nc, 3) int64, pair, candidate (0 or 1 of the pair), name within the pair
    point : (nc, 2, 3) float64, on candidate and antagonist [m]
    owner : (ns,) int64, body of each shape
    centre : (nb, 3) float64 [m]
    rotation : (nb, 3, 3) float64 [-]

    Outputs
    -------
    body : (nc, 2) int64, candidate and antagonist
    arm : (nc, 2, 3) float64, from the centres of mass in body axes [m]
    """
    nc = place.shape[0]
    body, arm = np.empty((nc, 2), dtype=np.int64), np.empty_like(point)
    for c in range(nc):
        pair, first = shapes[place[c, 0]], place[c, 1]
        for s in range(2):
            b = owner[pair[first if s == 0 else 1 - first]]
            body[c, s] = b
            r, o = rotation[b], centre[b]
            x, y, z = point[c, s, 0] - o[0], point[c, s, 1] - o[1], point[c, s, 2] - o[2]
            for i in range(3):
                arm[c, s, i] = r[0, i] * x + r[1, i] * y + r[2, i] * z
    return body, arm


@njit(cache=True)
def points_of(body, arm, centre, rotation):  # pragma: no cover - compiled
    """Put the material points of contacts in place.

    Inputs
    ------
    body : (nc, 2) int64
    arm : (nc, 2, 3) float64, points in body axes [m]
    centre : (nb, 3) float64 [m]
    rotation : (nb, 3, 3) float64 [-]

    Outputs
    -------
    (nc, 2, 3) float64 [m]
    """
    out = np.empty_like(arm)
    for c in range(arm.shape[0]):
        for s in range(2):
            b = body[c, s]
            a = _placed(centre[b], rotation[b], (arm[c, s, 0], arm[c, s, 1], arm[c, s, 2]))
            out[c, s, 0], out[c, s, 1], out[c, s, 2] = a
    return out
