"""Numba kernels of the robust fit of a face, which leaves outliers out; planes are held as in `planes`."""

import math

import numpy as np
from numba import njit

from survey.conventions import CHECKED, CRITICAL, MANY, PARALLEL
from survey.faces._kernels.planes import Points, leverages, orient, precision, weighted_plane
from survey.faces._kernels.triples import STARTS, beside_the_rest, cost, search_triples, smallest
from survey.geometry._kernels.vectors import dot

FINE, NOT_FINITE, SIGMA, COLLINEAR = range(4)  # status of `fit_face`

_LARGEST_TILT = PARALLEL  # standard deviation of a tilt that no candidate plane may exceed
_GRAZING = math.sin(
    PARALLEL
)  # cosine between normal and line of sight below which nobody measures a face: 80°
_NARROW = 0.15  # width over length below which a subset of the points is not the whole face
_ROUNDING = (
    32.0 * np.finfo(np.float64).eps
)  # residual over largest coordinate that is rounding: 7 nm at 1,000 km


@njit(cache=True)
def _view(frame, origin, observer):
    """Return the direction (3,) to the observer and the least cosine between it and the normal; zeros without one.

    A plane seen edge-on holds all points of an edge of the face, however far out they are, but nobody measures a face
    edge-on.
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
def _largest_sum(redundancy):
    """Return the sum of squares that chance exceeds once in a thousand: chi-square after Wilson and Hilferty."""
    spread = 2.0 / (9.0 * redundancy)
    return redundancy * (1.0 - spread + 3.09 * math.sqrt(spread)) ** 3


@njit(cache=True)
def _is_clean(root, residuals, lever):
    """Return whether the plain fit passes every test; the sum of squares catches outliers that hide each other."""
    total = 0.0
    for i in range(root.shape[0]):
        square = (root[i] * residuals[i]) ** 2
        total += square
        if square > CRITICAL**2 * max(1.0 - lever[i], 1e-6):
            return False
    return total <= _largest_sum(root.shape[0] - 3)


@njit(cache=True)
def _consistency(part):
    """Return the standard deviation of the smallest `part` of normal errors, in units of that of all."""
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
    """Estimate the standard deviation of the `count` accepted points of `total`, in units of sigma.

    With a known precision it is 1, or more where the face itself is clearly rough. Without one, the best part of all
    points looks too good by a factor known for normal errors (the consistency factor of least trimmed squares).
    """
    redundancy = max(count - 3, 1)
    raw = math.sqrt(squares / redundancy)
    if known:
        return raw if squares > _largest_sum(redundancy) else 1.0
    return max(raw if count == total else raw / _consistency(count / total), 1e-300)


@njit(cache=True)
def _nearest(distances, size, points, accepted, frame, work):
    """Accept the `size` points nearest to a plane, refit, and repeat until the set no longer changes."""
    root = points.root
    n = root.shape[0]
    lever = np.empty(n)
    for _ in range(20):
        limit, same, count = smallest(distances, size), True, 0
        for i in range(n):
            count += distances[i] < limit
        for i in range(n):
            near = distances[i] < limit or (distances[i] == limit and count < size)
            count += near and distances[i] == limit
            same = same and accepted[i] == near
            accepted[i] = near
        if same:
            break
        total = weighted_plane(points, accepted, frame, work)
        if total == 0.0:
            break
        leverages(points, frame, total, distances, lever)
        for i in range(n):
            distances[i] = root[i] * abs(distances[i])


@njit(cache=True)
def _grow(accepted, majority, points, known, view, frame, work):
    """Add the best point, or drop the worst, one at a time, until the next one is an outlier.

    Among many points a single one hardly matters, so at first all are sorted at once.

    Returns the sum of squares of all points in units of sigma, truncated at the limit of an outlier.
    """
    root = points.root
    n = root.shape[0]
    residuals, lever, tests = np.empty(n), np.empty(n), np.empty(n)
    truncated = np.inf
    for step in range(4 * n):
        total = weighted_plane(points, accepted, frame, work)
        if total == 0.0:
            return np.inf
        leverages(points, frame, total, residuals, lever)
        squares, count, truncated = 0.0, np.int64(0), 0.0  # a literal 0 would compile `_scale` once more
        along = dot(frame[3], view)
        side = 0.0 if along == 0.0 else math.copysign(1.0, along)
        for i in range(n):
            square = (root[i] * residuals[i]) ** 2
            squares, count = squares + square * accepted[i], count + accepted[i]
            truncated += cost(root[i] * residuals[i], root[i], side)
        scale = _scale(squares, count, n, known)
        if scale > frame[4, 1] * _LARGEST_TILT:
            return np.inf
        worst, best, highest, lowest, fitting, changed = -1, -1, 0.0, np.inf, 0, False
        for i in range(n):
            # a point in the fit pulls the plane towards itself, one outside does not: variances 1 - h and 1 + h
            share = max(1.0 - lever[i], 1e-6) if accepted[i] else 1.0 + lever[i]
            test = root[i] * abs(residuals[i]) / (scale * math.sqrt(share))
            tests[i] = test
            fitting += test <= CRITICAL
            changed = changed or (test <= CRITICAL) != accepted[i]
            if accepted[i] and test > highest:
                worst, highest = i, test
            elif not accepted[i] and test < lowest:
                best, lowest = i, test
        if n > MANY and step < 10 and changed and fitting > majority:
            for i in range(n):
                accepted[i] = tests[i] <= CRITICAL
        elif highest > CRITICAL and count > majority:
            accepted[worst] = False
        elif best >= 0 and lowest <= CRITICAL:
            accepted[best] = True
        else:
            break
    return truncated


@njit(cache=True)
def _without_outliers(points, known, view, frame, work):
    """Return the points accepted from the best of the starts.

    The least median looks at half of the points only; with a known precision all of them can be judged, and fewer than
    half may be good.
    """
    n = points.root.shape[0]
    size = min(n // 2 + 2, n)  # of p = 3 parameters: the majority that tolerates most blunders
    starts = search_triples(points, size, known, view)
    accepted, other = np.zeros(n, dtype=np.bool_), np.empty(n, dtype=np.bool_)
    _nearest(starts[0], size, points, accepted, frame, work)
    score = _grow(accepted, size, points, known, view, frame, work)
    for rank in range(1, 1 + STARTS):
        count = 0
        for i in range(n):
            other[i] = starts[rank, i] <= CRITICAL
            count += other[i]
        if count > CHECKED:
            rival = _grow(other, np.int64(CHECKED), points, known, view, frame, work)
            if rival < score:
                score = rival
                for i in range(n):
                    accepted[i] = other[i]
    if score == np.inf:  # too narrow to search
        accepted[:] = True
    return accepted


@njit(cache=True)
def _check(xyz, sigma):
    """Return the status of the input."""
    for i in range(xyz.shape[0]):
        if not (math.isfinite(xyz[i, 0]) and math.isfinite(xyz[i, 1]) and math.isfinite(xyz[i, 2])):
            return NOT_FINITE
        if not (sigma[i] > 1e-100 and sigma[i] < 1e100):
            return SIGMA
    return FINE


@njit(cache=True)
def _is_exact(xyz, local, frame):
    """Return whether all points lie on one plane as exactly as their coordinates can be stored.

    Then no point is an outlier: one far beside the others still lies on their plane to rounding, and without a known
    precision the residuals, the only measure of the scatter, are rounding errors alone.
    """
    largest, farthest = 0.0, 0.0
    for i in range(xyz.shape[0]):
        height = 0.0
        for k in range(3):
            largest = max(largest, abs(xyz[i, k]))
            height += (local[k, i] - frame[0, k]) * frame[3, k]
        farthest = max(farthest, abs(height))
    return farthest <= _ROUNDING * largest


@njit(cache=True)
def _subset(points, kept):
    """Return some of the points."""
    m = kept.shape[0]
    near, root = np.empty((3, m)), np.empty(m)
    for i in range(m):
        root[i] = points.root[kept[i]]
        for k in range(3):
            near[k, i] = points.local[k, kept[i]]
    return Points(near, root)


@njit(cache=True)
def fit_face(xyz, sigma, known, observer):
    """Fit the plane of a face and leave outliers out.

    Inputs
    ------
    xyz : (n, 3) float64, n ≥ 3 [m]
    sigma : (n,) float64, standard deviation of a coordinate [m]
    known : bool, whether sigma was given; otherwise it is 1 throughout
    observer : (3,) float64 [m]; nan if unknown

    Outputs
    -------
    status : FINE, NOT_FINITE, SIGMA or COLLINEAR
    frame : (5, 3) float64, the plane, its centroid in the frame of the points
    accepted : (n,) bool
    residuals, standardised : (n,) float64 [m], [-]
    covariance : (3, 3) float64 of two tilts [rad] and the height at the centroid [m]
    (offset [m], root mean square residual [m], σ₀ [-])
    """
    n = xyz.shape[0]
    local, work, frame = np.empty((3, n)), np.empty((3, n)), np.zeros((5, 3))
    accepted, residuals, lever = np.ones(n, dtype=np.bool_), np.zeros(n), np.zeros(n)
    status = _check(xyz, sigma)
    if status != FINE:
        return status, frame, accepted, residuals, lever, np.zeros((3, 3)), (0.0, 0.0, 0.0)
    root = np.empty(n)
    for i in range(n):
        root[i] = 1.0 / sigma[i]
        for k in range(3):
            local[k, i] = xyz[i, k] - xyz[0, k]
    points = Points(local, root)
    near, kept, sound = points, np.empty(n, dtype=np.int64), np.ones(n, dtype=np.bool_)
    for i in range(n):
        kept[i] = i
    total = weighted_plane(points, sound, frame, work)
    exact = _is_exact(xyz, local, frame)
    compact = kept if exact else beside_the_rest(local)
    if compact.shape[0] < n:
        near = _subset(points, compact)
        total = weighted_plane(near, sound, frame, work)
        narrow = max(_NARROW * frame[4, 0], 3.0 / _LARGEST_TILT if known else 0.0)
        if frame[4, 1] > narrow:
            kept, sound = compact, sound[: compact.shape[0]].copy()
        else:  # most points lie along one edge, or close together
            near = points
            total = weighted_plane(points, sound, frame, work)
    m = kept.shape[0]
    if total > 0.0 and m > 3 and not exact:
        leverages(near, frame, total, residuals[:m], lever[:m])
        if not (known and _is_clean(near.root, residuals[:m], lever[:m])):
            view = _view(frame, xyz[0], observer)
            sound = _without_outliers(near, known, view, frame, work)
            total = weighted_plane(near, sound, frame, work)
    accepted[:] = False
    for i in range(m):
        accepted[kept[i]] = sound[i]
    if total == 0.0:
        return COLLINEAR, frame, accepted, residuals, lever, np.zeros((3, 3)), (0.0, 0.0, 0.0)
    orient(frame, xyz[0], observer)
    leverages(points, frame, total, residuals, lever)
    covariance, numbers = precision(xyz[0], root, known, accepted, total, frame, residuals, lever)
    return FINE, frame, accepted, residuals, lever, covariance, numbers
