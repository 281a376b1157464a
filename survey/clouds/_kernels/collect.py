"""Numba kernel that sorts the points of a cloud into the patches of stones."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Frames(NamedTuple):
    """Planes of outlines.

    origins : (n, 3) float64 [m]
    axes : (n, 3, 3) float64, rows: two in the plane of the outline, the third along the line of sight
    slab : float64, largest distance along the third [m]
    """

    origins: NDArray[np.float64]
    axes: NDArray[np.float64]
    slab: float


class Rings(NamedTuple):
    """Polygons of outlines.

    start : (n + 1,) int64, first corner of each
    corners : (m, 2) float64, in the plane of each outline [m]
    margins : (n,) float64, width along the edges that is left out [m]
    """

    start: NDArray[np.int64]
    corners: NDArray[np.float64]
    margins: NDArray[np.float64]


class Patches(NamedTuple):
    """Squares into which the faces are divided, row by row.

    first : (n + 1,) int64, number of the first patch of each outline
    columns : (n,) int64, patches in a row
    low : (n, 2) float64, lower corner of the first patch [m]
    high : (n, 2) float64, upper corner of the outline [m]
    side : (n,) float64, of a patch [m]
    """

    first: NDArray[np.int64]
    columns: NDArray[np.int64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    side: NDArray[np.float64]


class Grid(NamedTuple):
    """Cubes of space, each with the outlines whose slab reaches into it.

    low : (3,) float64 [m]
    side : float64, of a cube [m]
    shape : (3,) int64
    start : (cubes + 1,) int64, first member of each cube
    members : int32, numbers of outlines
    """

    low: NDArray[np.float64]
    side: float
    shape: NDArray[np.int64]
    start: NDArray[np.int64]
    members: NDArray[np.int32]


class Samples(NamedTuple):
    """Random samples of the points of each patch.

    counts : (patches,) int64, points that fell into each
    places : (patches, kept, 3) float32, in the frame of the outline [m]
    """

    counts: NDArray[np.int64]
    places: NDArray[np.float32]


@njit(cache=True, nogil=True)
def _mixed(number):
    """Return a random-looking 64-bit number (splitmix64) for a number."""
    number = (number + np.uint64(0x9E3779B97F4A7C15)) & np.uint64(0xFFFFFFFFFFFFFFFF)
    number = (number ^ (number >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    number = (number ^ (number >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return number ^ (number >> np.uint64(31))


@njit(cache=True, nogil=True)
def _inside(u, v, corners, first, last, margin):
    """Return whether a place lies inside a polygon, farther from its sides than a margin."""
    inside, near = False, margin * margin
    bu, bv = corners[last - 1, 0], corners[last - 1, 1]
    for k in range(first, last):
        au, av = corners[k, 0], corners[k, 1]
        du, dv = bu - au, bv - av
        pu, pv = u - au, v - av
        if (av > v) != (bv > v) and pu < du * pv / dv:
            inside = not inside
        along = (pu * du + pv * dv) / (du * du + dv * dv)
        along = min(max(along, 0.0), 1.0)
        eu, ev = pu - along * du, pv - along * dv
        if eu * eu + ev * ev < near:
            return False
        bu, bv = au, av
    return inside


@njit(cache=True, nogil=True)
def collect(points, frames, rings, patches, grid, samples):
    """Sort points into the patches of stones, and keep a random sample of each patch.

    A patch keeps its first points, then each later one takes the place of a kept one with the probability that leaves
    every point the same chance (Vitter 1985). The choice depends on the order of the points alone.

    Inputs: points (n, 3) float64, relative to the origin of the frames [m].
    Outputs: the number of points that lie in an outline, int64; `samples` are added to.
    """
    kept, found = samples.places.shape[1], 0
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        cx, cy, cz = (
            (x - grid.low[0]) / grid.side,
            (y - grid.low[1]) / grid.side,
            (z - grid.low[2]) / grid.side,
        )
        # written so that what is not a number is outside
        if not (cx >= 0.0 and cx < grid.shape[0] and cy >= 0.0 and cy < grid.shape[1]):
            continue
        if not (cz >= 0.0 and cz < grid.shape[2]):
            continue
        cube = (int(cx) * grid.shape[1] + int(cy)) * grid.shape[2] + int(cz)
        for m in range(grid.start[cube], grid.start[cube + 1]):
            k = grid.members[m]
            a, o = frames.axes[k], frames.origins[k]
            dx, dy, dz = x - o[0], y - o[1], z - o[2]
            w = a[2, 0] * dx + a[2, 1] * dy + a[2, 2] * dz
            if abs(w) > frames.slab:
                continue
            u = a[0, 0] * dx + a[0, 1] * dy + a[0, 2] * dz
            v = a[1, 0] * dx + a[1, 1] * dy + a[1, 2] * dz
            if (
                u < patches.low[k, 0]
                or u > patches.high[k, 0]
                or v < patches.low[k, 1]
                or v > patches.high[k, 1]
            ):
                continue
            if not _inside(u, v, rings.corners, rings.start[k], rings.start[k + 1], rings.margins[k]):
                continue
            found += 1
            column, row = (
                int((u - patches.low[k, 0]) / patches.side[k]),
                int((v - patches.low[k, 1]) / patches.side[k]),
            )
            p = patches.first[k] + row * patches.columns[k] + min(column, patches.columns[k] - 1)
            p = min(p, patches.first[k + 1] - 1)
            slot = samples.counts[p]
            samples.counts[p] += 1
            if slot >= kept:
                drawn = _mixed(np.uint64(p) * np.uint64(0x9E3779B1) + np.uint64(slot))
                slot = np.int64(drawn % np.uint64(slot + 1))
                if slot >= kept:
                    continue
            samples.places[p, slot, 0] = u
            samples.places[p, slot, 1] = v
            samples.places[p, slot, 2] = w
    return found
