"""Grids in which disks are found.

Disks are sorted into grids of square cells, one for each class of sizes: a cell is at least as wide as the reach of
each disk in it, and at most about twice. A disk looks for partners in its own grid and in the coarser ones, each time
in nine cells, so the cost is linear whatever the sizes.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mechanics.arrays import Array, Ints

# half width over the mean up to which disks are in the class of the mean
_SIMILAR = 1.25
# width of a cell over the half width of a disk; a little more than two, so that rounding cannot put two disks in reach
# two cells apart
_WIDER = 2.0 * (1.0 + 1e-9)


class DiskGrid(NamedTuple):
    """Disks sorted into cells.

    A class with few empty cells has one bucket for each cell; one with many shares buckets by a hash, and the cell of
    each disk says to which cell it belongs.

    Attributes
    ----------
    origin : (2,) float64, corner of cell (0, 0) of all classes [m]
    width : (nl,) float64, cells of each class [m]
    low, cells : (nl, 2) int64, first cell in use and number of cells along x and y
    base, buckets : (nl,) int64, first bucket and number of buckets
    start : (nbuckets+1,) int64, disks order[start[b]:start[b+1]] of each bucket
    order : (nd,) int64
    level : (nd,) int64, class of each disk
    cell : (nd, 2) int64
    """

    origin: Array
    width: Array
    low: Ints
    cells: Ints
    base: Ints
    buckets: Ints
    start: Ints
    order: Ints
    level: Ints
    cell: Ints


@njit(cache=True)
def bucket(cell_x, cell_y, level, low, count, base, buckets):
    """Return the bucket of a cell; -1 outside the cells in use."""
    x, y = cell_x - low[level, 0], cell_y - low[level, 1]
    if x < 0 or y < 0 or x >= count[level, 0] or y >= count[level, 1]:
        return -1
    if count[level, 0] * count[level, 1] == buckets[level]:
        return base[level] + y * count[level, 0] + x
    mixed = np.uint64(x) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(y) * np.uint64(0xC2B2AE3D27D4EB4F)
    mixed ^= mixed >> np.uint64(29)
    return base[level] + np.int64(mixed % np.uint64(buckets[level]))


@njit(cache=True)
def _size_classes(extent):
    """Return the class (nd,) of each disk by its half width, and the cell width (nl,) of each class in use.

    One of the classes is made for disks of the mean half width, so that those of similar sizes are in one.
    """
    nd = extent.shape[0]
    smallest, largest, mean = np.inf, 0.0, 0.0
    for i in range(nd):
        smallest, largest = min(smallest, extent[i]), max(largest, extent[i])
        mean += extent[i] / nd
    similar = min(_SIMILAR * mean, largest)
    finest = _WIDER * (similar if np.isfinite(similar) else smallest)
    while 0.5 * finest >= _WIDER * smallest:
        finest *= 0.5
    classes = 1
    while finest * 2.0 ** (classes - 1) < _WIDER * largest:
        classes += 1
    occupied = np.zeros(classes, dtype=np.int64)
    level = np.zeros(nd, dtype=np.int64)
    for i in range(nd):
        while finest * 2.0 ** level[i] < _WIDER * extent[i]:
            level[i] += 1
        occupied[level[i]] = 1
    width = np.empty(occupied.sum())
    nl = 0
    for k in range(classes):
        if occupied[k]:
            width[nl] = finest * 2.0**k
            occupied[k] = nl
            nl += 1
    for i in range(nd):
        level[i] = occupied[level[i]]
    return level, width


@njit(cache=True)
def _cells_in_use(centre, level, width):
    """Return origin, cell of each disk (nd, 2), and lowest (nl, 2) and number (nl, 2) of the cells of each class."""
    nd, nl = centre.shape[0], width.shape[0]
    origin = np.array([centre[:, 0].min(), centre[:, 1].min()])
    cell = np.empty((nd, 2), dtype=np.int64)
    low = np.full((nl, 2), np.iinfo(np.int64).max)
    high = np.full((nl, 2), np.iinfo(np.int64).min)
    for i in range(nd):
        k = level[i]
        for axis in range(2):
            at = np.int64(np.floor((centre[i, axis] - origin[axis]) / width[k]))
            cell[i, axis] = at
            low[k, axis], high[k, axis] = min(low[k, axis], at), max(high[k, axis], at)
    return origin, cell, low, high - low + 1


@njit(cache=True)
def build_grid(centre, extent):  # pragma: no cover - compiled
    """Sort disks, one at least, into grids.

    Inputs
    ------
    centre : (nd, 2) float64 [m]
    extent : (nd,) float64, half widths [m]

    Outputs
    -------
    DiskGrid
    """
    level, width = _size_classes(extent)
    origin, cell, low, count = _cells_in_use(centre, level, width)
    nd, nl = centre.shape[0], width.shape[0]
    members = np.zeros(nl, dtype=np.int64)
    for i in range(nd):
        members[level[i]] += 1
    base, buckets = np.zeros(nl, dtype=np.int64), np.zeros(nl, dtype=np.int64)
    total = 0
    for k in range(nl):
        base[k] = total
        # compared as floats: the product may not fit an integer
        dense = float(count[k, 0]) * float(count[k, 1]) <= 4.0 * members[k] + 64.0
        buckets[k] = count[k, 0] * count[k, 1] if dense else 2 * members[k] + 1
        total += buckets[k]
    start = np.zeros(total + 1, dtype=np.int64)
    where = np.empty(nd, dtype=np.int64)
    for i in range(nd):
        where[i] = bucket(cell[i, 0], cell[i, 1], level[i], low, count, base, buckets)
        start[where[i] + 1] += 1
    for b in range(total):
        start[b + 1] += start[b]
    order, filled = np.empty(nd, dtype=np.int64), start[:-1].copy()
    for i in range(nd):
        order[filled[where[i]]] = i
        filled[where[i]] += 1
    return DiskGrid(origin, width, low, count, base, buckets, start, order, level, cell)


@njit(cache=True)
def cells_along(ends, far, k, grid, near):  # pragma: no cover - compiled
    """Write the disks of class k in the cells within a distance of a wall; return how many, -1 for too many cells.

    Inputs
    ------
    ends : (2, 2) float64, of the wall [m]
    far : float64, the distance [m]
    k : int64, the class
    grid : Grid
    near : (nd,) int64, to which the disks are written
    """
    origin, widths, low, count, base, buckets, start, order, _, cell = grid
    width, nd = widths[k], order.shape[0]
    ax, ay = ends[0, 0] - origin[0], ends[0, 1] - origin[1]
    bx, by = ends[1, 0] - origin[0], ends[1, 1] - origin[1]
    if ax > bx:
        ax, ay, bx, by = bx, by, ax, ay
    first = max(np.floor((ax - far) / width), float(low[k, 0]))
    last = min(np.floor((bx + far) / width), float(low[k, 0] + count[k, 0] - 1))
    bottom, top = float(low[k, 1]), float(low[k, 1] + count[k, 1] - 1)
    seen, found = 0.0, 0
    if last - first > nd:
        return -1
    column = first
    while column <= last:
        # the part of the wall whose neighbourhood meets this column of cells
        left, right = max(column * width - far, ax), min((column + 1.0) * width + far, bx)
        y0, y1 = ay, by
        if bx > ax:
            y0, y1 = ay + (by - ay) * (left - ax) / (bx - ax), ay + (by - ay) * (right - ax) / (bx - ax)
        row = max(np.floor((min(y0, y1) - far) / width), bottom)
        end = min(np.floor((max(y0, y1) + far) / width), top)
        seen += max(end - row + 1.0, 0.0)
        if seen > nd:
            return -1
        while row <= end:
            b = bucket(np.int64(column), np.int64(row), k, low, count, base, buckets)
            for e in range(start[b], start[b + 1]):
                j = order[e]
                if cell[j, 0] == column and cell[j, 1] == row:
                    near[found] = j
                    found += 1
            row += 1.0
        column += 1.0
    return found
