"""Numba kernels that fit a face and leave its blunders out; arrays as in `_kernels_planes`."""

import math

import numpy as np
from numba import njit

from survey.faces._kernels.planes import leverages, orient, precision, weighted_plane
from survey.faces._kernels.triples import STARTS, beside_the_rest, cost, search_triples, smallest

__all__ = ["COLLINEAR", "FINE", "NOT_FINITE", "SIGMA", "fit_face"]

FINE, NOT_FINITE, SIGMA, COLLINEAR = 0, 1, 2, 3  # what `fit_face` found

_CRITICAL = 3.29  # two-sided normal quantile of Baarda's α₀ = 0.1 %
_LARGEST_TILT = math.radians(10.0)  # standard deviation of a tilt that no plane among others may exceed
_GRAZING = 0.17  # cosine between normal and line of sight below which a face is not measured: 80°
_NARROW = 0.15  # width over length of a part of the points that is not the whole face
_MANY = 50  # points of which none has much to say alone
_ROUNDING = 32.0 * 2.0**-52  # residual over largest coordinate that is rounding: 7 nm at 1,000 km
_FEWEST = 4  # points that a plane is never grown from fewer than


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
def _largest_sum(redundancy):
    """Sum of squares that chance exceeds once in a thousand: chi-square after Wilson and Hilferty."""
    spread = 2.0 / (9.0 * redundancy)
    return redundancy * (1.0 - spread + 3.09 * math.sqrt(spread)) ** 3


@njit(cache=True)
def _is_clean(root, residuals, lever):
    """Whether the plain fit passes every test; the sum catches blunders that hide each other."""
    total = 0.0
    for i in range(root.shape[0]):
        square = (root[i] * residuals[i]) ** 2
        total += square
        if square > _CRITICAL**2 * max(1.0 - lever[i], 1e-6):
            return False
    return total <= _largest_sum(root.shape[0] - 3)


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
        return raw if squares > _largest_sum(redundancy) else 1.0
    return max(raw if count == total else raw / _consistency(count / total), 1e-300)


@njit(cache=True)
def _nearest(distances, size, local, root, accepted, frame, work):
    """Accept the points nearest to a plane, and then to the plane through them, until they stay the same."""
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
        total = weighted_plane(local, root, accepted, frame, work)
        if total == 0.0:
            break
        leverages(local, root, frame, total, distances, lever)
        for i in range(n):
            distances[i] = root[i] * abs(distances[i])


@njit(cache=True)
def _grow(accepted, majority, local, root, known, view, frame, work):
    """Add the best point, or drop the worst, one at a time, until the next one is a blunder.

    Of many points none has much to say alone, so at first all are sorted at once.

    Returns the sum of squares of all points in units of sigma in which no blunder counts more than the limit.
    """
    n = root.shape[0]
    residuals, lever, tests = np.empty(n), np.empty(n), np.empty(n)
    truncated = np.inf
    for step in range(4 * n):
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
            fitting += test <= _CRITICAL
            changed = changed or (test <= _CRITICAL) != accepted[i]
            if accepted[i] and test > highest:
                worst, highest = i, test
            elif not accepted[i] and test < lowest:
                best, lowest = i, test
        if n > _MANY and step < 10 and changed and fitting > majority:
            for i in range(n):
                accepted[i] = tests[i] <= _CRITICAL
        elif highest > _CRITICAL and count > majority:
            accepted[worst] = False
        elif best >= 0 and lowest <= _CRITICAL:
            accepted[best] = True
        else:
            break
    return truncated


@njit(cache=True)
def _without_blunders(local, root, known, view, frame, work):
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
    for rank in range(1, 1 + STARTS):
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
def _is_exact(xyz, local, frame):
    """Return whether all points lie on one plane as exactly as their coordinates can be stored.

    Nothing can then be a blunder: a point far beside the others lies on their plane to rounding, and without a known
    precision the residuals, the only measure of the scatter, hold rounding and no errors.
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
def _part(local, root, kept):
    """The points of a compact face, their 1/σ, and that all are accepted."""
    m = kept.shape[0]
    if m == root.shape[0]:
        return local, root, np.ones(m, dtype=np.bool_)
    near, near_root = np.empty((3, m)), np.empty(m)
    for i in range(m):
        near_root[i] = root[kept[i]]
        for k in range(3):
            near[k, i] = local[k, kept[i]]
    return near, near_root, np.ones(m, dtype=np.bool_)


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
    sound, kept = accepted.copy(), np.arange(n)
    near, near_root = local, root
    total = weighted_plane(near, near_root, sound, frame, work)
    exact = _is_exact(xyz, local, frame)
    beside = kept if exact else beside_the_rest(local)
    if beside.shape[0] < n:
        part, part_root, part_sound = _part(local, root, beside)
        part_total = weighted_plane(part, part_root, part_sound, frame, work)
        narrow = max(_NARROW * frame[4, 0], 3.0 / _LARGEST_TILT if known else 0.0)
        if frame[4, 1] > narrow:
            kept, near, near_root, sound, total = beside, part, part_root, part_sound, part_total
        else:  # most points lie along one edge, or close together
            total = weighted_plane(near, near_root, sound, frame, work)
    m = kept.shape[0]
    if total > 0.0 and m > 3:
        leverages(near, near_root, frame, total, residuals[:m], lever[:m])
        if not (exact or (known and _is_clean(near_root, residuals[:m], lever[:m]))):
            view = _view(near, frame, xyz[0], observer)
            sound = _without_blunders(near, near_root, known, view, frame, work)
            total = weighted_plane(near, near_root, sound, frame, work)
    accepted[:] = False
    for i in range(m):
        accepted[kept[i]] = sound[i]
    if total == 0.0:
        return COLLINEAR, frame, accepted, residuals, lever, covariance, (0.0, 0.0, 0.0)
    orient(frame, xyz[0], observer)
    leverages(local, root, frame, total, residuals, lever)
    numbers = precision(xyz[0], root, known, accepted, total, frame, residuals, lever, covariance)
    return FINE, frame, accepted, residuals, lever, covariance, numbers
