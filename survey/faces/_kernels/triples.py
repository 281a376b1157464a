"""Numba kernels that start the search for a face: its compact part, and the planes through three of its points."""

import math

import numpy as np
from numba import njit

from survey.conventions import CRITICAL, LARGELY, WEAR
from survey.geometry._kernels.vectors import cross, dot

STARTS = 6  # planes of least truncated squares that are kept

_ALL_TRIPLES = 26  # number of points up to which all triples are tried: 2,600
_DRAWS = 3000  # fixed draw of triples beyond that
_IN_FRONT = CRITICAL * CRITICAL  # additional cost of an outlier less than that in front [squares of sigma]
_FARTHEST = 2.5  # distance from the middle over that of the third quartile, beyond which a point may be beside the face
_ALONE = LARGELY  # least distance of such a point from its nearest neighbour, over that limit
_BALANCED = 0.4  # length of the mean direction below which points lie all around
_ALIKE = 2.0  # largest over smallest distance of corners from the middle of their face


@njit(cache=True)
def smallest(values, size):
    """Return the `size`-th smallest value (Hoare 1961)."""
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
    """Return the cost of a point in squares of sigma; `side` is 1 if the normal points to the observer, otherwise -1.

    The cost of an outlier is truncated at the limit, but doubles a little in front of the face: edges erode and mortar
    recedes behind it, so points in front are a sign that the plane is tilted into what lies behind.
    """
    if test * test <= CRITICAL**2:
        return test * test
    height = test / root * side
    return CRITICAL**2 + (_IN_FRONT if 0.0 < height < WEAR else 0.0)


@njit(cache=True)
def _triple(number, n, i, j, k):
    """Return the triple after (i, j, k): the next of all, or a drawn one, the same for every face of n points."""
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
    """Return twice the area of a triangle; write its unit normal."""
    x, y, z = local[0, i], local[1, i], local[2, i]
    u = (local[0, j] - x, local[1, j] - y, local[2, j] - z)
    v = (local[0, k] - x, local[1, k] - y, local[2, k] - z)
    n = cross(u, v)
    area = math.sqrt(dot(n, n))
    if area > 0.0:
        normal[0], normal[1], normal[2] = n[0] / area, n[1] / area, n[2] / area
    return area


@njit(cache=True)
def _keep(truncated, distances, scores, best):
    """Insert a plane among the best and drop a worse one with the same points within the limit."""
    n, last = distances.shape[0], STARTS
    for rank in range(1, 1 + STARTS):
        same = True
        for m in range(n):
            same = same and (best[rank, m] <= CRITICAL) == (distances[m] <= CRITICAL)
        if same:
            if scores[rank] <= truncated:
                return
            last = rank
            break
    while last > 1 and scores[last - 1] > truncated:
        scores[last] = scores[last - 1]
        for m in range(n):
            best[last, m] = best[last - 1, m]
        last -= 1
    scores[last] = truncated
    for m in range(n):
        best[last, m] = distances[m]


@njit(cache=True)
def search_triples(points, size, known, view):
    """Search the planes through three points.

    Inputs
    ------
    points : Points
    size : int, rank of the distance that counts as the median
    known : bool, whether the precision of the points is known
    view : (4,) float64, direction to the observer and least cosine between it and the normal; zeros if unknown

    Outputs
    -------
    (1 + STARTS, n) float64, distances from the planes in units of sigma, inf where there are fewer: first from the
    plane of least median distance, then, with a known precision, from those of least truncated squares, each with a
    different set of points within the limit, best first
    """
    local, root = points
    n = root.shape[0]
    count = n * (n - 1) * (n - 2) // 6 if n <= _ALL_TRIPLES else _DRAWS
    normal, distances, scores = np.empty(3), np.empty(n), np.empty(1 + STARTS)
    best = np.empty((1 + STARTS, n))
    best[:, :], scores[:] = np.inf, np.inf
    largest = 0.0
    for sweep in range(2):
        # of no literal type, or numba compiles `_triple` twice
        i, j, k = np.int64(0), np.int64(1), np.int64(1)
        for number in range(count):
            i, j, k = _triple(number, n, i, j, k)
            area = _normal_of(local, i, j, k, normal)
            if sweep == 0 or area <= 1e-3 * largest:  # thin triangles do not determine the tilt
                largest = max(largest, area)
                continue
            nx, ny, nz = normal[0], normal[1], normal[2]
            along = dot(normal, view)
            if abs(along) < view[3]:
                continue
            side = 0.0 if along == 0.0 else math.copysign(1.0, along)
            height = dot(normal, local[:, i])
            near, truncated = 0, 0.0
            for m in range(n):
                d = root[m] * (nx * local[0, m] + ny * local[1, m] + nz * local[2, m] - height)
                truncated += cost(d, root[m], side)
                distances[m] = abs(d)
                near += abs(d) < scores[0]
            if near >= size:
                scores[0] = smallest(distances, size)
                for m in range(n):
                    best[0, m] = distances[m]
            if known and truncated < scores[STARTS]:
                _keep(truncated, distances, scores, best)
    return best


@njit(cache=True)
def beside_the_rest(local):
    """Return the indices of the points that form a compact face, without those far beside it.

    Points so far out would outvote all others wherever they happen to lie near the prolonged plane. Four or more that
    lie all around, at similar distances, are kept: they are the corners of a face that was measured in its middle.
    """
    n = local.shape[1]
    everything = np.empty(n, dtype=np.int64)
    for i in range(n):
        everything[i] = i
    if n < 6:
        return everything
    centre = _spatial_median(local)
    away, balance = np.empty(n), np.zeros(3)
    for i in range(n):
        away[i] = math.sqrt(_squared_distance(local, i, centre[0], centre[1], centre[2]))
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
    balanced = dot(balance, balance) < (_BALANCED * count) ** 2
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
    """Return the distance of a point from the nearest one within the limit."""
    least = np.inf
    for j in range(local.shape[1]):
        if away[j] <= limit:
            least = min(least, _squared_distance(local, i, local[0, j], local[1, j], local[2, j]))
    return math.sqrt(least)


@njit(cache=True)
def _squared_distance(local, i, x, y, z):
    d = (local[0, i] - x, local[1, i] - y, local[2, i] - z)
    return dot(d, d)


@njit(cache=True)
def _spatial_median(local):
    """Approximate the point of least sum of distances (Weiszfeld 1937)."""
    n = local.shape[1]
    centre = np.zeros(3)
    for k in range(3):
        for i in range(n):
            centre[k] += local[k, i] / n
    for _ in range(15):
        x, y, z, total = 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            weight = 1.0 / max(math.sqrt(_squared_distance(local, i, centre[0], centre[1], centre[2])), 1e-9)
            total += weight
            x, y, z = x + weight * local[0, i], y + weight * local[1, i], z + weight * local[2, i]
        centre[0], centre[1], centre[2] = x / total, y / total, z / total
    return centre
