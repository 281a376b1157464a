"""Numba kernels of other shapes than one plane: a quadric, and two planes that meet along a line.

Heights `z` (n,) above the plane of a face are explained by columns of `design` (n, p) at places (u, v) on it; `root`
(n,) is 1/σ.
"""

import math

import numpy as np
from numba import njit

__all__ = ["fit_columns", "fit_two_planes", "grow_columns", "truncated_sum"]

_LIMIT = 3.29**2  # square of a standardised residual beyond which a point is a blunder: α₀ = 0.1 %
_DIRECTIONS = 24  # in which a line is looked for that parts the points
_TILTED = 6.63  # chi-square of one parameter at 1 %
_FLATTEST = 3.0  # spread of points across a strip over their σ below which its tilt is not asked for


@njit(cache=True)
def fit_columns(design, z, root, chosen, inverse, residuals, lever):
    """Weighted least squares on the chosen points: coefficients (p,); `inverse` (p, p) is their covariance.

    Residuals and leverages are of all points. The columns are few and scaled to one, so normal equations do.
    Returns coefficients of nan if the points do not determine them.
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
    """Gauss and Jordan on a symmetric positive matrix; False if it is singular."""
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
    """Sum of squares in units of sigma in which no blunder counts more than the limit."""
    out = 0.0
    for i in range(root.shape[0]):
        out += min((root[i] * residuals[i]) ** 2, _LIMIT)
    return out


@njit(cache=True)
def grow_columns(design, z, root, start, fewest):
    """Points that the columns explain: drop the worst, or add the best, until the next one is a blunder."""
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
    """Part the points by a line so that a plane through each part explains them best.

    Returns
    -------
    truncated sum of squares of both planes, that of the points that are no blunders, points beyond the line (n,),
    direction (2,) across the line to them, coefficients (3,) of the second plane, less the first, on 1, along the line,
    across it; nan where its tilt across is not known
    """
    n = z.shape[0]
    score, least, far, way, plane = (
        np.inf,
        np.inf,
        np.zeros(n, dtype=np.bool_),
        np.zeros(2),
        np.full(3, np.nan),
    )
    beyond, across, along = np.empty(n, dtype=np.bool_), np.empty(n), np.empty(n)
    for direction in range(_DIRECTIONS):
        angle = 2.0 * math.pi * direction / _DIRECTIONS
        c, s = math.cos(angle), math.sin(angle)
        for i in range(n):
            across[i], along[i] = c * u[i] + s * v[i], c * v[i] - s * u[i]
            beyond[i] = False
        for count in range(1, n // 2 + 1):
            last = -1
            for i in range(n):
                if not beyond[i] and (last < 0 or across[i] > across[last]):
                    last = i
            beyond[last] = True
            if count < 3 or n - count < 4:
                continue
            rival, within, coefficients = _both_planes(along, across, z, root, beyond, count)
            if rival + _worth(coefficients) < score + _worth(plane):
                score, least, far[:], way[0], way[1], plane = rival, within, beyond, c, s, coefficients
    return score, least, far, way, plane


@njit(cache=True)
def _worth(plane):
    """Squares that a tilt across must explain, lest a few points of the first plane be taken for it."""
    return 0.0 if math.isnan(plane[2]) else _TILTED


@njit(cache=True)
def _both_planes(along, across, z, root, beyond, count):
    """Truncated sum of squares with a plane through the points beyond a line, and that plane.

    Before the line the plane is z = 0, or one fitted there, whichever is better: z = 0 has left blunders out, but may
    be tilted into the second plane. Points in a row along the line say nothing of the tilt across it.
    """
    n = z.shape[0]
    mean, spread, weight = 0.0, 0.0, 0.0
    for i in range(n):
        if beyond[i]:
            mean, weight = mean + root[i] ** 2 * across[i], weight + root[i] ** 2
    for i in range(n):
        if beyond[i]:
            spread += (root[i] * (across[i] - mean / weight)) ** 2
    p = 3 if count > 3 and spread > _FLATTEST**2 * count else 2
    out, residuals, first = np.full(3, np.nan), z.copy(), z.copy()
    found = _plane_of(along, across, z, root, beyond, p, residuals)
    ours = _plane_of(along, across, z, root, ~beyond, 3, first)
    given, fitted = 0.0, 0.0
    for i in range(n):
        if not beyond[i]:
            given += min((root[i] * z[i]) ** 2, _LIMIT)
            fitted += min((root[i] * first[i]) ** 2, _LIMIT)
    within, better = 0.0, fitted < given
    for i in range(n):
        if not beyond[i]:
            residuals[i] = first[i] if better else z[i]
        square = (root[i] * residuals[i]) ** 2
        within += square if square <= _LIMIT else 0.0
    for a in range(p):
        out[a] = found[a] - (ours[a] if better else 0.0)
    return truncated_sum(root, residuals), within, out


@njit(cache=True)
def _plane_of(along, across, z, root, chosen, p, residuals):
    n = z.shape[0]
    design, inverse, lever = np.ones((n, p)), np.empty((p, p)), np.empty(n)
    for i in range(n):
        design[i, 1] = along[i]
        if p == 3:
            design[i, 2] = across[i]
    return fit_columns(design, z, root, chosen, inverse, residuals, lever)
