"""Numba kernels of the plane through a face: weighted least squares, and its precision.

A plane is held in `frame` (5, 3) float64: its centroid [m], the unit directions of largest and of smaller spread, the
unit normal, and the singular values of the weighted centred points [-], largest first.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from survey.arrays import Array
from survey.conventions import VANISHING
from survey.geometry._kernels.vectors import cross

_COLLINEAR = VANISHING  # second singular value over the first below which there is no plane
_UNCHECKED = VANISHING  # share of the other points in a residual below which they do not check it


class Points(NamedTuple):
    """Points of a face and their weights.

    Attributes
    ----------
    local : (3, n) float64, from the first point of the face, so that site coordinates of 10⁶ m lose nothing [m]
    root : (n,) float64, 1/σ of a coordinate [1/m]
    """

    local: Array
    root: Array


@njit(cache=True)
def weighted_plane(points, accepted, frame, work):
    """Fit the plane of the accepted points by weighted least squares.

    One-sided Jacobi (Demmel & Veselić 1992) on the weighted centred points, without squaring them.

    Inputs
    ------
    points : Points
    accepted : (n,) bool
    work : (3, n) float64, overwritten

    Outputs
    -------
    frame : (5, 3) float64, the plane
    total weight of the accepted points, Σ 1/σ² [1/m²]; 0 if they lie on one line
    """
    local, root = points
    n, m, total = root.shape[0], np.int64(0), 0.0
    for i in range(n):
        if accepted[i]:
            total += root[i] ** 2
    for k in range(3):
        mean = 0.0
        for i in range(n):
            if accepted[i]:
                mean += root[i] ** 2 * local[k, i]
        frame[0, k] = mean / total
    for i in range(n):
        if accepted[i]:
            for k in range(3):
                work[k, m] = root[i] * (local[k, i] - frame[0, k])
            m += 1
    for p in range(3):
        for k in range(3):
            frame[1 + p, k] = 1.0 if p == k else 0.0
    _jacobi(work, m, frame)
    return total if frame[4, 1] > _COLLINEAR * frame[4, 0] else 0.0


@njit(cache=True)
def _jacobi(work, m, frame):
    """Rotate pairs of columns until all are orthogonal, then sort them by length."""
    for _ in range(30):
        turned = False
        for p in range(2):
            for q in range(p + 1, 3):
                alpha, beta, gamma = 0.0, 0.0, 0.0
                for i in range(m):
                    alpha += work[p, i] ** 2
                    beta += work[q, i] ** 2
                    gamma += work[p, i] * work[q, i]
                if abs(gamma) <= 1e-15 * math.sqrt(alpha) * math.sqrt(beta):
                    continue
                turned = True
                zeta = (beta - alpha) / (2.0 * gamma)
                t = math.copysign(1.0, zeta) / (abs(zeta) + math.hypot(1.0, zeta))
                c = 1.0 / math.sqrt(1.0 + t * t)
                s = c * t
                for i in range(m):
                    x, y = work[p, i], work[q, i]
                    work[p, i], work[q, i] = c * x - s * y, s * x + c * y
                for k in range(3):
                    x, y = frame[1 + p, k], frame[1 + q, k]
                    frame[1 + p, k], frame[1 + q, k] = c * x - s * y, s * x + c * y
        if not turned:
            break
    for k in range(3):
        squares = 0.0
        for i in range(m):
            squares += work[k, i] ** 2
        frame[4, k] = math.sqrt(squares)
    for p, q in ((0, 1), (1, 2), (0, 1)):
        if frame[4, p] < frame[4, q]:
            frame[4, p], frame[4, q] = frame[4, q], frame[4, p]
            for k in range(3):
                frame[1 + p, k], frame[1 + q, k] = frame[1 + q, k], frame[1 + p, k]


@njit(cache=True)
def leverages(points, frame, total, residuals, lever):
    """Compute signed distances from a plane, and the share of each observation in its own fit.

    Inputs
    ------
    points : Points
    frame : (5, 3) float64, the plane
    total : float64, total weight of the accepted points [1/m²]

    Outputs
    -------
    residuals : (n,) float64 [m]
    lever : (n,) float64 [-]
    """
    local, root = points
    for i in range(root.shape[0]):
        u, v, r = 0.0, 0.0, 0.0
        for k in range(3):
            d = local[k, i] - frame[0, k]
            u += d * frame[1, k]
            v += d * frame[2, k]
            r += d * frame[3, k]
        residuals[i] = r
        lever[i] = root[i] ** 2 * (1.0 / total + (u / frame[4, 0]) ** 2 + (v / frame[4, 1]) ** 2)


@njit(cache=True)
def orient(frame, origin, observer):
    """Turn the normal towards the observer and make the three axes right-handed.

    Inputs
    ------
    frame : (5, 3) float64, the plane, turned in place
    origin : (3,) float64, first point of the face [m]
    observer : (3,) float64 [m]; nan if unknown: the largest component of the normal becomes positive
    """
    along = 0.0
    for k in range(3):
        along += frame[3, k] * (observer[k] - origin[k] - frame[0, k])
    if math.isnan(along):
        along = _largest_of(frame[3])
    first = _largest_of(frame[1])
    for k in range(3):
        frame[3, k] = math.copysign(1.0, along) * frame[3, k]
        frame[1, k] = math.copysign(1.0, first) * frame[1, k]
    frame[2, 0], frame[2, 1], frame[2, 2] = cross(frame[3], frame[1])


@njit(cache=True)
def _largest_of(vector):
    """Return the component of largest size."""
    out = vector[0]
    for k in range(1, 3):
        if abs(vector[k]) > abs(out):
            out = vector[k]
    return out


@njit(cache=True)
def precision(origin, root, known, accepted, total, frame, residuals, lever):
    """Compute the precision of a fitted plane and move its centroid into the frame of the site.

    Inputs
    ------
    origin : (3,) float64, first point of the face [m]
    root : (n,) float64, 1/σ [1/m]
    known : bool, whether σ was given; otherwise the residuals scale the covariance
    accepted : (n,) bool
    total : float64, total weight of the accepted points [1/m²]
    frame : (5, 3) float64, the plane, changed in place
    residuals : (n,) float64 [m]
    lever : (n,) float64, leverages, replaced by the standardised residuals; nan where no other point checks one [-]

    Outputs
    -------
    covariance : (3, 3) float64 of two tilts [rad] and the height at the centroid [m]
    (offset [m], root mean square of the accepted residuals [m], σ₀ [-])
    """
    covariance = np.zeros((3, 3))
    n, count, squares, plain = root.shape[0], 0, 0.0, 0.0
    for i in range(n):
        if accepted[i]:
            count += 1
            squares += (root[i] * residuals[i]) ** 2
            plain += residuals[i] ** 2
    sigma0 = math.sqrt(squares / (count - 3)) if count > 3 else math.nan
    unit = 1.0 if known else sigma0
    for i in range(n):
        share = 1.0 - lever[i] if accepted[i] else 1.0 + lever[i]
        checked = count > 3 and share > _UNCHECKED and unit > 0.0
        lever[i] = root[i] * residuals[i] / (unit * math.sqrt(share)) if checked else math.nan
    covariance[0, 0] = (unit / frame[4, 0]) ** 2
    covariance[1, 1] = (unit / frame[4, 1]) ** 2
    covariance[2, 2] = unit**2 / total
    offset = 0.0
    for k in range(3):
        offset += frame[3, k] * origin[k]
    for k in range(3):
        offset += frame[3, k] * frame[0, k]
        frame[0, k] += origin[k]
        frame[4, k] /= math.sqrt(total / count)
    return covariance, (offset, math.sqrt(plain / count), sigma0)
