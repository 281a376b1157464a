"""Numba kernels of other shapes than one plane: a quadric, and two planes that meet along a line.

Heights `z` (n,) float64 above the plane of a face [m] are explained by columns of `design` (n, p) float64 at places
(u, v) on it; `root` (n,) float64 is 1/σ [1/m].
"""

import math

import numpy as np
from numba import njit

from survey.conventions import CRITICAL, PLACES, SIGNIFICANT

_LIMIT = (
    CRITICAL * CRITICAL
)  # square of a standardised residual beyond which a point is an outlier: α₀ = 0.1 %
_TILTED = 6.63  # chi-square of one parameter at 1 %
_FLATTEST = SIGNIFICANT  # spread of points across a strip over their σ below which its tilt is not estimated


@njit(cache=True)
def fit_columns(design, z, root, chosen, inverse, residuals, lever):
    """Fit the columns to the chosen points by weighted least squares.

    The columns are few and scaled to 1, so normal equations are accurate enough.

    Inputs
    ------
    design, z, root : as above
    chosen : (n,) bool

    Outputs
    -------
    inverse : (p, p) float64, covariance of the coefficients
    residuals, lever : (n,) float64 of all points [m], [-]
    coefficients (p,) float64; nan if the points do not determine them
    """
    n, p = design.shape
    normal, right = np.zeros((p, p)), np.zeros(p)
    for i in range(n):
        if chosen[i]:
            for a in range(p):
                right[a] += root[i] ** 2 * design[i, a] * z[i]
                for b in range(p):
                    normal[a, b] += root[i] ** 2 * design[i, a] * design[i, b]
    out = np.full(p, np.nan)
    if not _invert(normal, inverse):
        return out
    for a in range(p):
        out[a] = 0.0
        for b in range(p):
            out[a] += inverse[a, b] * right[b]
    for i in range(n):
        residuals[i], lever[i] = z[i], 0.0
        for a in range(p):
            residuals[i] -= design[i, a] * out[a]
            for b in range(p):
                lever[i] += root[i] ** 2 * design[i, a] * inverse[a, b] * design[i, b]
    return out


@njit(cache=True)
def _invert(matrix, inverse):
    """Invert a symmetric positive matrix by Gauss–Jordan elimination; return False if it is singular."""
    p = matrix.shape[0]
    work = matrix.copy()
    for a in range(p):
        for b in range(p):
            inverse[a, b] = 1.0 if a == b else 0.0
    for a in range(p):
        pivot = work[a, a]
        if not pivot > 1e-10 * matrix[a, a]:
            return False
        for b in range(p):
            work[a, b] /= pivot
            inverse[a, b] /= pivot
        for c in range(p):
            factor = work[c, a]
            if c != a and factor != 0.0:
                for b in range(p):
                    work[c, b] -= factor * work[a, b]
                    inverse[c, b] -= factor * inverse[a, b]
    return True


@njit(cache=True)
def truncated_sum(root, residuals):
    """Return the sum of squares in units of sigma, each truncated at the limit of an outlier."""
    out = 0.0
    for i in range(root.shape[0]):
        out += min((root[i] * residuals[i]) ** 2, _LIMIT)
    return out


@njit(cache=True)
def grow_columns(design, z, root, start, fewest):
    """Grow the set of points that the columns explain: drop the worst or add the best until the next is an outlier.

    Inputs
    ------
    design, z, root : as above
    start : (n,) bool, points to begin with
    fewest : int, number of points that always remain

    Outputs
    -------
    (n,) bool
    """
    n, p = design.shape
    chosen, inverse, residuals, lever = start.copy(), np.empty((p, p)), z.copy(), np.zeros(n)
    for _ in range(2 * n):
        if math.isnan(fit_columns(design, z, root, chosen, inverse, residuals, lever)[0]):
            break
        worst, best, highest, lowest, count = -1, -1, 0.0, np.inf, 0
        for i in range(n):
            count += chosen[i]
            share = max(1.0 - lever[i], 1e-6) if chosen[i] else 1.0 + lever[i]
            test = (root[i] * residuals[i]) ** 2 / share
            if chosen[i] and test > highest:
                worst, highest = i, test
            elif not chosen[i] and test < lowest:
                best, lowest = i, test
        if highest > _LIMIT and count > fewest:
            chosen[worst] = False
        elif best >= 0 and lowest <= _LIMIT:
            chosen[best] = True
        else:
            break
    return chosen


@njit(cache=True)
def fit_two_planes(u, v, z, root):
    """Divide the points by a line so that a plane through each part explains them best.

    On the near side the plane is z = 0, or one fitted there, whichever is better: z = 0 is free of outliers, but may be
    tilted into the second plane. Points in a row along the line do not determine the tilt across it.

    Inputs
    ------
    u, v, z : (n,) float64 [m]
    root : (n,) float64 [1/m]

    Outputs
    -------
    score, least : float64, sum of squares of both planes in units of sigma, truncated, and of points within the limit
    far : (n,) bool, points beyond the line
    way : (2,) float64, direction across the line towards them [-]
    plane : (3,) float64, coefficients of the second plane less the first, on 1 [m], along the line and across it [-];
        nan where the tilt across is not determined
    """
    n = z.shape[0]
    score, worth, least = np.inf, np.inf, np.inf
    far, way, plane = np.zeros(n, dtype=np.bool_), np.zeros(2), np.zeros(3)
    across, along, moved = np.empty(n), np.empty(n), np.empty(n, dtype=np.bool_)
    first, second, zero = np.zeros(3), np.zeros(3), np.zeros(3)
    for direction in range(PLACES):
        angle = 2.0 * math.pi * direction / PLACES
        c, s = math.cos(angle), math.sin(angle)
        here, there = np.zeros((3, 4)), np.zeros((3, 4))
        for i in range(n):
            across[i], along[i], moved[i] = c * u[i] + s * v[i], c * v[i] - s * u[i], False
            _add(here, 1.0, along[i], across[i], z[i], root[i])
        for count in range(1, n // 2 + 1):
            last = -1
            for i in range(n):
                if not moved[i] and (last < 0 or across[i] > across[last]):
                    last = i
            moved[last] = True
            _add(here, -1.0, along[last], across[last], z[last], root[last])
            _add(there, 1.0, along[last], across[last], z[last], root[last])
            if count < 3 or n - count < 4:
                continue
            spread = there[2, 2] - there[0, 2] ** 2 / there[0, 0]
            size = 3 if count > 3 and spread > _FLATTEST**2 * count else 2
            if not (_solve(there, size, second) and _solve(here, np.int64(3), first)):
                continue
            rival, within = _unexplained(along, across, z, root, moved, zero, second)
            other, inner = _unexplained(along, across, z, root, moved, first, second)
            base = zero
            if other < rival:
                rival, within, base = other, inner, first
            if rival + (_TILTED if size == 3 else 0.0) < worth:
                score, least, worth = rival, within, rival + (_TILTED if size == 3 else 0.0)
                way[0], way[1] = c, s
                for i in range(n):
                    far[i] = moved[i]
                for k in range(3):
                    plane[k] = second[k] - base[k] if k < size else np.nan
    return score, least, far, way, plane


@njit(cache=True)
def _add(sums, sign, along, across, z, root):
    """Add a point to the normal equations (3, 4) of a plane on 1, along, across; remove it if `sign` is -1."""
    weight = sign * root**2
    row = (1.0, along, across, z)
    for a in range(3):
        for b in range(4):
            sums[a, b] += weight * row[a] * row[b]


@njit(cache=True)
def _solve(sums, size, out):
    """Solve for the leading two or all three coefficients; return False if the points do not determine them."""
    work = sums.copy()
    for a in range(size):
        if not work[a, a] > 1e-10 * sums[a, a]:
            return False
        for b in range(a + 1, size):
            factor = work[b, a] / work[a, a]
            for k in range(4):
                work[b, k] -= factor * work[a, k]
    out[2] = 0.0
    for a in range(size - 1, -1, -1):
        out[a] = work[a, 3]
        for b in range(a + 1, size):
            out[a] -= work[a, b] * out[b]
        out[a] /= work[a, a]
    return True


@njit(cache=True)
def _unexplained(along, across, z, root, beyond, first, second):
    """Return the truncated sum of squares that two planes leave, and that of the points within the limit."""
    out, within = 0.0, 0.0
    for i in range(z.shape[0]):
        plane = second if beyond[i] else first
        square = (root[i] * (z[i] - plane[0] - plane[1] * along[i] - plane[2] * across[i])) ** 2
        out += min(square, _LIMIT)
        within += square if square <= _LIMIT else 0.0
    return out, within
