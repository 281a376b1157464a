"""Numba kernels that fit a face and leave its blunders out; arrays as in `_kernels_planes`."""

import math

import numpy as np
from numba import njit

from survey._kernels_planes import leverages, orient, precision, weighted_plane

__all__ = ["COLLINEAR", "FINE", "NOT_FINITE", "SIGMA", "fit_face", "search_triples"]

FINE, NOT_FINITE, SIGMA, COLLINEAR = 0, 1, 2, 3  # what `fit_face` found

_CRITICAL = 3.29  # two-sided normal quantile of Baarda's α₀ = 0.1 %
_ALL_TRIPLES = 26  # up to so many points all triples are tried; beyond, a fixed draw of _DRAWS
_DRAWS = 3000
_STARTS = 6  # planes of least truncated squares from which the fit grows
_LARGEST_TILT = math.radians(10.0)  # standard deviation of a tilt that no plane among others may exceed
_EROSION = 0.03  # how far behind a face its eroded edges and its mortar lie [m]
_IN_FRONT = _CRITICAL**2  # how much more a blunder less than that in front counts, in squares of sigma
_GRAZING = 0.17  # cosine between normal and line of sight below which a face is not measured: 80°
_FEWEST = 4  # points that a plane is never grown from fewer than


@njit(cache=True)
def largest_sum(redundancy):
    """Sum of squares that chance exceeds once in a thousand: chi-square after Wilson and Hilferty."""
    spread = 2.0 / (9.0 * redundancy)
    return redundancy * (1.0 - spread + 3.09 * math.sqrt(spread)) ** 3


@njit(cache=True)
def is_clean(root, residuals, lever):
    """Whether the plain fit passes every test; the sum catches blunders that hide each other."""
    total = 0.0
    for i in range(root.shape[0]):
        square = (root[i] * residuals[i]) ** 2
        total += square
        if square > _CRITICAL**2 * max(1.0 - lever[i], 1e-6):
            return False
    return total <= largest_sum(root.shape[0] - 3)


@njit(cache=True)
def _consistency(part):
    """Standard deviation of the smallest `part` of normal errors, in units of that of all."""
    z = 0.0
    for _ in range(60):
        step = (math.erf(z / math.sqrt(2.0)) - part) / (
            2.0 * math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
        )
        z -= step
        if abs(step) < 1e-12:
            break
    density = math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
    return math.sqrt(1.0 - 2.0 * z * density / part)


@njit(cache=True)
def _scale(squares, count, total, known):
    """Standard deviation of the `count` accepted points of `total` in units of sigma.

    With a known precision it is 1, or more where the face itself is clearly rough. Without, the best part of all
    points looks too good by a factor known for normal errors (the consistency factor of least trimmed squares).
    """
    redundancy = max(count - 3, 1)
    raw = math.sqrt(squares / redundancy)
    if known:
        return raw if squares > largest_sum(redundancy) else 1.0
    return max(raw if count == total else raw / _consistency(count / total), 1e-300)


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
def search_triples(local, root, size, known, view):
    """Distances from planes through three points (1 + _STARTS, n), inf where there are fewer.

    First the plane of least median distance, then, with a known precision, those of least truncated squares, each with
    a different set of points within the limit, best first.
    """
    n = root.shape[0]
    count = n * (n - 1) * (n - 2) // 6 if n <= _ALL_TRIPLES else _DRAWS
    normal, distances, scores = np.empty(3), np.empty(n), np.empty(1 + _STARTS)
    best = np.empty((1 + _STARTS, n))
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
                truncated += _cost(d, root[m], side)
                distances[m] = abs(d)
                near += abs(d) < scores[0]
            if near >= size:
                scores[0] = _smallest(distances, size)
                best[0, :] = distances
            if known and truncated < scores[_STARTS]:
                _keep(truncated, distances, scores, best)
    return best


@njit(cache=True)
def _cost(test, root, side):
    """What a point counts, in squares of sigma; `side` is 1 if the normal looks to the observer, -1 if away from him.

    No blunder counts more than the limit, but one that lies a little in front of the face counts twice: there edges
    erode and mortar recedes, so such points are a sign that the plane is tilted into what lies behind.
    """
    if test * test <= _CRITICAL**2:
        return test * test
    height = test / root * side
    return _CRITICAL**2 + (_IN_FRONT if 0.0 < height < _EROSION else 0.0)


@njit(cache=True)
def _view(local, frame, origin, observer):
    """Direction (3,) to the observer, and the least cosine between it and the normal; nothing without an observer.

    A plane that is seen edge-on holds all points of an edge of the face, however far out they are; nobody measures
    a face so.
    """
    view = np.zeros(4)
    squares, along = 0.0, 0.0
    for k in range(3):
        view[k] = observer[k] - origin[k] - frame[0, k]
        squares += view[k] ** 2
    if not (squares > 0.0 and squares < np.inf):
        view[:] = 0.0
        return view
    for k in range(3):
        view[k] /= math.sqrt(squares)
        along += view[k] * frame[3, k]
    view[3] = _GRAZING if abs(along) > 2.0 * _GRAZING else 0.0
    return view


@njit(cache=True)
def _keep(truncated, distances, scores, best):
    """Sort a plane in among the best, and out those with the same points within the limit."""
    n, last = distances.shape[0], _STARTS
    for rank in range(1, 1 + _STARTS):
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
def _smallest(values, size):
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
def _nearest(distances, size, local, root, accepted, frame, work):
    """Accept the points nearest to a plane, and then to the plane through them, until they stay the same."""
    n = root.shape[0]
    lever = np.empty(n)
    for _ in range(20):
        limit, same, count = _smallest(distances, size), True, 0
        for i in range(n):
            count += distances[i] < limit
        for i in range(n):
            near = distances[i] < limit or (distances[i] == limit and count < size)
            count += near and distances[i] == limit
            same = same and accepted[i] == near
            accepted[i] = near
        if same:
            break
        total = weighted_plane(local, root, accepted, frame, work)
        if total == 0.0:
            break
        leverages(local, root, frame, total, distances, lever)
        for i in range(n):
            distances[i] = root[i] * abs(distances[i])


@njit(cache=True)
def _grow(accepted, majority, local, root, known, view, frame, work):
    """Add the best point, or drop the worst, one at a time, until the next one is a blunder.

    Returns the sum of squares of all points in units of sigma in which no blunder counts more than the limit.
    """
    n = root.shape[0]
    residuals, lever = np.empty(n), np.empty(n)
    truncated = np.inf
    for _ in range(4 * n):
        total = weighted_plane(local, root, accepted, frame, work)
        if total == 0.0:
            return np.inf
        leverages(local, root, frame, total, residuals, lever)
        squares, count, truncated = 0.0, 0, 0.0
        along = frame[3, 0] * view[0] + frame[3, 1] * view[1] + frame[3, 2] * view[2]
        side = 0.0 if along == 0.0 else math.copysign(1.0, along)
        for i in range(n):
            square = (root[i] * residuals[i]) ** 2
            squares, count = squares + square * accepted[i], count + accepted[i]
            truncated += _cost(root[i] * residuals[i], root[i], side)
        scale = _scale(squares, count, n, known)
        if scale > frame[4, 1] * _LARGEST_TILT:
            return np.inf
        worst, best, highest, lowest = -1, -1, 0.0, np.inf
        for i in range(n):
            # a point in the fit pulls the plane towards itself, one outside does not: variances 1 - h and 1 + h
            share = max(1.0 - lever[i], 1e-6) if accepted[i] else 1.0 + lever[i]
            test = root[i] * abs(residuals[i]) / (scale * math.sqrt(share))
            if accepted[i] and test > highest:
                worst, highest = i, test
            elif not accepted[i] and test < lowest:
                best, lowest = i, test
        if highest > _CRITICAL and count > majority:
            accepted[worst] = False
        elif best >= 0 and lowest <= _CRITICAL:
            accepted[best] = True
        else:
            break
    return truncated


@njit(cache=True)
def without_blunders(local, root, known, view, frame, work):
    """Accepted points, from the best of the starts.

    The least median sees half of the points only; with a known precision all of them can be judged, and less than half
    may be good.
    """
    n = root.shape[0]
    size = min(n // 2 + 2, n)  # of p = 3 parameters: the majority that tolerates most blunders
    starts = search_triples(local, root, size, known, view)
    accepted, other = np.zeros(n, dtype=np.bool_), np.empty(n, dtype=np.bool_)
    _nearest(starts[0], size, local, root, accepted, frame, work)
    score = _grow(accepted, size, local, root, known, view, frame, work)
    for rank in range(1, 1 + _STARTS):
        count = 0
        for i in range(n):
            other[i] = starts[rank, i] <= _CRITICAL
            count += other[i]
        if count > _FEWEST:
            rival = _grow(other, _FEWEST, local, root, known, view, frame, work)
            if rival < score:
                score = rival
                accepted[:] = other
    if score == np.inf:  # too narrow to search
        accepted[:] = True
    return accepted


@njit(cache=True)
def _check(xyz, sigma):
    for i in range(xyz.shape[0]):
        if not (math.isfinite(xyz[i, 0]) and math.isfinite(xyz[i, 1]) and math.isfinite(xyz[i, 2])):
            return NOT_FINITE
        if not (sigma[i] > 1e-100 and sigma[i] < 1e100):
            return SIGMA
    return FINE


@njit(cache=True)
def fit_face(xyz, sigma, known, observer):
    """Plane of a face (n, 3) without its blunders.

    Returns
    -------
    status, frame (5, 3) with the centroid in the frame of the points, accepted (n,), residuals (n,), standardised (n,),
    covariance (3, 3), (offset, rms, sigma0)
    """
    n = xyz.shape[0]
    local, work, frame = np.empty((3, n)), np.empty((3, n)), np.zeros((5, 3))
    accepted, residuals, lever = np.ones(n, dtype=np.bool_), np.zeros(n), np.zeros(n)
    covariance = np.zeros((3, 3))
    status = _check(xyz, sigma)
    if status != FINE:
        return status, frame, accepted, residuals, lever, covariance, (0.0, 0.0, 0.0)
    root = np.empty(n)
    for i in range(n):
        root[i] = 1.0 / sigma[i]
        for k in range(3):
            local[k, i] = xyz[i, k] - xyz[0, k]
    total = weighted_plane(local, root, accepted, frame, work)
    if total > 0.0 and n > 3:
        leverages(local, root, frame, total, residuals, lever)
        if not (known and is_clean(root, residuals, lever)):
            view = _view(local, frame, xyz[0], observer)
            accepted = without_blunders(local, root, known, view, frame, work)
            total = weighted_plane(local, root, accepted, frame, work)
    if total == 0.0:
        return COLLINEAR, frame, accepted, residuals, lever, covariance, (0.0, 0.0, 0.0)
    orient(frame, xyz[0], observer)
    leverages(local, root, frame, total, residuals, lever)
    numbers = precision(xyz[0], root, known, accepted, total, frame, residuals, lever, covariance)
    return FINE, frame, accepted, residuals, lever, covariance, numbers
