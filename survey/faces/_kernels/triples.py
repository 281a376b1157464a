"""Numba kernels that start the search for a face: its compact part, and the planes through three of its points.

Arrays are as in `_kernels_planes`.
"""

import math

import numpy as np
from numba import njit

__all__ = ["STARTS", "beside_the_rest", "cost", "search_triples", "smallest"]

STARTS = 6  # planes of least truncated squares that are kept

_CRITICAL = 3.29  # two-sided normal quantile of Baarda's α₀ = 0.1 %
_ALL_TRIPLES = 26  # up to so many points all triples are tried; beyond, a fixed draw of _DRAWS
_DRAWS = 3000
_EROSION = 0.03  # how far behind a face its eroded edges and its mortar lie [m]
_IN_FRONT = _CRITICAL**2  # how much more a blunder less than that in front counts, in squares of sigma
_FARTHEST = 2.5  # distance from the middle of a face, over that of its third quartile, beyond which no point is its own
_ALONE = 0.7  # distance from the nearest other point, over that limit, that such a point has at least
_BALANCED = 0.4  # mean of directions, below which points lie all around
_ALIKE = 2.0  # largest over smallest distance of corners from the middle of their face


@njit(cache=True)
def smallest(values, size):
    """The `size`-th smallest value (Hoare 1961)."""
    heap = values.copy()
    low, high, k = 0, heap.shape[0] - 1, size - 1
    while low < high:
        pivot, i, j = heap[k], low, high
        while i <= j:
            while heap[i] < pivot:
                i += 1
            while heap[j] > pivot:
                j -= 1
            if i <= j:
                heap[i], heap[j] = heap[j], heap[i]
                i, j = i + 1, j - 1
        if j < k:
            low = i
        if i > k:
            high = j
    return heap[k]


@njit(cache=True)
def cost(test, root, side):
    """What a point counts, in squares of sigma; `side` is 1 if the normal looks to the observer, -1 if away from him.

    No blunder counts more than the limit, but one that lies a little in front of the face counts twice: there edges
    erode and mortar recedes, so such points are a sign that the plane is tilted into what lies behind.
    """
    if test * test <= _CRITICAL**2:
        return test * test
    height = test / root * side
    return _CRITICAL**2 + (_IN_FRONT if 0.0 < height < _EROSION else 0.0)


@njit(cache=True)
def _triple(number, n, i, j, k):
    """The triple after (i, j, k): the next of all, or a drawn one, the same for every face of n points."""
    if n <= _ALL_TRIPLES:
        k += 1
        if k == n:
            j += 1
            if j == n - 1:
                i += 1
                j = i + 1
            k = j + 1
        return i, j, k
    # the R3 sequence of Roberts (2018) spreads evenly over the cube
    along = 0.5 + (number + 1) * 0.8191725133961645
    across = 0.5 + (number + 1) * 0.6710436067037893
    up = 0.5 + (number + 1) * 0.5497004779019703
    return int(n * (along % 1.0)), int(n * (across % 1.0)), int(n * (up % 1.0))


@njit(cache=True)
def _normal_of(local, i, j, k, normal):
    """Twice the area of a triangle, and its unit normal."""
    ax, ay, az = local[0, i], local[1, i], local[2, i]
    bx, by, bz = local[0, j] - ax, local[1, j] - ay, local[2, j] - az
    cx, cy, cz = local[0, k] - ax, local[1, k] - ay, local[2, k] - az
    nx, ny, nz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    area = math.sqrt(nx * nx + ny * ny + nz * nz)
    if area > 0.0:
        normal[0], normal[1], normal[2] = nx / area, ny / area, nz / area
    return area


@njit(cache=True)
def _keep(truncated, distances, scores, best):
    """Sort a plane in among the best, and out those with the same points within the limit."""
    n, last = distances.shape[0], STARTS
    for rank in range(1, 1 + STARTS):
        same = True
        for m in range(n):
            same = same and (best[rank, m] <= _CRITICAL) == (distances[m] <= _CRITICAL)
        if same:
            if scores[rank] <= truncated:
                return
            last = rank
            break
    while last > 1 and scores[last - 1] > truncated:
        scores[last] = scores[last - 1]
        best[last, :] = best[last - 1]
        last -= 1
    scores[last] = truncated
    best[last, :] = distances


@njit(cache=True)
def search_triples(local, root, size, known, view):
    """Distances from planes through three points (1 + STARTS, n), inf where there are fewer.

    First the plane of least median distance, then, with a known precision, those of least truncated squares, each with
    a different set of points within the limit, best first.
    """
    n = root.shape[0]
    count = n * (n - 1) * (n - 2) // 6 if n <= _ALL_TRIPLES else _DRAWS
    normal, distances, scores = np.empty(3), np.empty(n), np.empty(1 + STARTS)
    best = np.empty((1 + STARTS, n))
    best[:, :], scores[:] = np.inf, np.inf
    largest = 0.0
    for sweep in range(2):
        i, j, k = 0, 1, 1
        for number in range(count):
            i, j, k = _triple(number, n, i, j, k)
            area = _normal_of(local, i, j, k, normal)
            if sweep == 0 or area <= 1e-3 * largest:  # thin triangles say nothing of the tilt
                largest = max(largest, area)
                continue
            nx, ny, nz = normal[0], normal[1], normal[2]
            along = nx * view[0] + ny * view[1] + nz * view[2]
            if abs(along) < view[3]:
                continue
            side = 0.0 if along == 0.0 else math.copysign(1.0, along)
            height = nx * local[0, i] + ny * local[1, i] + nz * local[2, i]
            near, truncated = 0, 0.0
            for m in range(n):
                d = root[m] * (nx * local[0, m] + ny * local[1, m] + nz * local[2, m] - height)
                truncated += cost(d, root[m], side)
                distances[m] = abs(d)
                near += abs(d) < scores[0]
            if near >= size:
                scores[0] = smallest(distances, size)
                best[0, :] = distances
            if known and truncated < scores[STARTS]:
                _keep(truncated, distances, scores, best)
    return best


@njit(cache=True)
def beside_the_rest(local):
    """Indices of the points of a compact face: those far beside are no part of it, wherever its plane may pass them.

    So far out they would outvote all others. Four or more that lie all around, alike in distance, are corners of a face
    that is measured in its middle.
    """
    n = local.shape[1]
    everything = np.arange(n)
    if n < 6:
        return everything
    centre = _spatial_median(local)
    away, balance = np.empty(n), np.zeros(3)
    for i in range(n):
        away[i] = math.sqrt(
            (local[0, i] - centre[0]) ** 2 + (local[1, i] - centre[1]) ** 2 + (local[2, i] - centre[2]) ** 2
        )
    limit, count = _FARTHEST * smallest(away, n - n // 4), 0
    nearest, farthest = np.inf, 0.0
    beside = np.zeros(n, dtype=np.bool_)
    for i in range(n):
        if away[i] > limit and _nearest_of(local, i, away, limit) > _ALONE * limit:
            beside[i] = True
            count += 1
            nearest, farthest = min(nearest, away[i]), max(farthest, away[i])
            for k in range(3):
                balance[k] += (local[k, i] - centre[k]) / away[i]
    balanced = balance[0] ** 2 + balance[1] ** 2 + balance[2] ** 2 < (_BALANCED * count) ** 2
    alike = farthest <= _ALIKE * nearest and farthest <= 2.0 * _ALIKE * limit
    if count == 0 or (count > 3 and balanced and alike):
        return everything
    kept, m = np.empty(n - count, dtype=np.int64), 0
    for i in range(n):
        if not beside[i]:
            kept[m] = i
            m += 1
    return kept


@njit(cache=True)
def _nearest_of(local, i, away, limit):
    """Distance of a point from the nearest that is not far away."""
    least = np.inf
    for j in range(local.shape[1]):
        if away[j] <= limit:
            x, y, z = local[0, i] - local[0, j], local[1, i] - local[1, j], local[2, i] - local[2, j]
            least = min(least, x * x + y * y + z * z)
    return math.sqrt(least)


@njit(cache=True)
def _spatial_median(local):
    """Place of least sum of distances, nearly (Weiszfeld 1937)."""
    n = local.shape[1]
    centre = np.zeros(3)
    for k in range(3):
        for i in range(n):
            centre[k] += local[k, i] / n
    for _ in range(15):
        x, y, z, total = 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            square = (
                (local[0, i] - centre[0]) ** 2
                + (local[1, i] - centre[1]) ** 2
                + (local[2, i] - centre[2]) ** 2
            )
            weight = 1.0 / max(math.sqrt(square), 1e-9)
            total += weight
            x, y, z = x + weight * local[0, i], y + weight * local[1, i], z + weight * local[2, i]
        centre[0], centre[1], centre[2] = x / total, y / total, z / total
    return centre
