"""Numba kernels of the bundle adjustment: normal equations reduced to the cameras, points, covariances.

Of the normal equations [N, W; Wᵀ, V] [dc; dp] = [g_c; g_p] the matrix V of the points is made of 3 × 3 blocks:
each point is
eliminated as soon as its rays are summed, so that nothing but the system of the cameras, N - W V⁻¹ Wᵀ, is ever stored.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from survey.orientation._kernels.camera import PARAMETERS, ray


class Rays(NamedTuple):
    """Measured image points, sorted by their points.

    Attributes
    ----------
    start : (np + 1,) int64, the rays of point i are start[i] to start[i + 1]
    photo : (n,) int64
    measured : (n, 2) float64 [camera unit]
    weight : (n, 2) float64, 1/σ [1 / camera unit]
    """

    start: NDArray[np.int64]
    photo: NDArray[np.int64]
    measured: NDArray[np.float64]
    weight: NDArray[np.float64]


class Unknowns(NamedTuple):
    """Values of the unknowns, and which of them are estimated.

    Attributes
    ----------
    camera : (nf,) int64, the camera of each photograph
    forward : (nc,) bool, the model of each camera
    inner : (nc, 10) float64, interior orientations
    rotation : (nf, 3, 3) float64
    station : (nf, 3) float64 [m]
    point : (np, 3) float64 [m]
    column : (nf, 16) int64, of the parameters of each photograph and its camera in the reduced system; -1: fixed
    free : (np,) bool, points that are estimated
    """

    camera: NDArray[np.int64]
    forward: NDArray[np.bool_]
    inner: NDArray[np.float64]
    rotation: NDArray[np.float64]
    station: NDArray[np.float64]
    point: NDArray[np.float64]
    column: NDArray[np.int64]
    free: NDArray[np.bool_]


@njit(cache=True)
def _inverse(v, out):
    """Invert a symmetric 3 × 3 matrix; return its determinant relative to its diagonal, 0 if it is singular."""
    c00 = v[1, 1] * v[2, 2] - v[1, 2] * v[1, 2]
    c01 = v[0, 2] * v[1, 2] - v[0, 1] * v[2, 2]
    c02 = v[0, 1] * v[1, 2] - v[0, 2] * v[1, 1]
    det = v[0, 0] * c00 + v[0, 1] * c01 + v[0, 2] * c02
    size = v[0, 0] * v[1, 1] * v[2, 2]
    if not det > 1e-15 * size:
        return 0.0
    out[0, 0], out[0, 1], out[0, 2] = c00 / det, c01 / det, c02 / det
    out[1, 1] = (v[0, 0] * v[2, 2] - v[0, 2] * v[0, 2]) / det
    out[1, 2] = (v[0, 1] * v[0, 2] - v[0, 0] * v[1, 2]) / det
    out[2, 2] = (v[0, 0] * v[1, 1] - v[0, 1] * v[0, 1]) / det
    out[1, 0], out[2, 0], out[2, 1] = out[0, 1], out[0, 2], out[1, 2]
    return det / size


@njit(cache=True)
def _gather(i, rays, unknowns, prior, scratch):
    """Sum the rays of one point.

    Inputs
    ------
    i : the point
    rays, unknowns : as above
    prior : (np, 3, 4) float64, weight matrix of what is known of each point, and that times its difference

    Outputs
    -------
    scratch : `Scratch`; `columns[:count]` the columns of its rays, `w[:count]` their W, `v` with V and g_p, `slot`
        restored by the caller
    count of columns, sum of squares, rays that see the point from behind
    """
    v, w, columns, slot, work = scratch
    for a in range(3):
        for b in range(4):
            v[a, b] = prior[i, a, b]
    count, square, behind = 0, 0.0, 0
    for k in range(rays.start[i], rays.start[i + 1]):
        f = rays.photo[k]
        m = unknowns.camera[f]
        depth = ray(
            rays.measured[k], rays.weight[k], unknowns.forward[m], unknowns.inner[m],
            unknowns.rotation[f], unknowns.station[f], unknowns.point[i], work[k - rays.start[i]],
        )  # fmt: skip
        one = work[k - rays.start[i]]
        if not depth > 0.0:
            behind += 1
        square += one[4, 0] ** 2 + one[4, 1] ** 2
        for a in range(3):
            for b in range(a, 3):
                v[a, b] += one[2, a] * one[2, b] + one[3, a] * one[3, b]
            v[a, 3] += one[2, a] * one[4, 0] + one[3, a] * one[4, 1]
        for p in range(PARAMETERS):
            column = unknowns.column[f, p]
            if column < 0:
                continue
            if slot[column] < 0:
                slot[column] = count
                columns[count] = column
                w[count, 0], w[count, 1], w[count, 2] = 0.0, 0.0, 0.0
                count += 1
            at = slot[column]
            for a in range(3):
                w[at, a] += one[0, p] * one[2, a] + one[1, p] * one[3, a]
    v[1, 0], v[2, 0], v[2, 1] = v[0, 1], v[0, 2], v[1, 2]
    return count, square, behind


@njit(cache=True)
def _scratch(rays, width):
    most = 1
    for i in range(len(rays.start) - 1):
        most = max(most, rays.start[i + 1] - rays.start[i])
    local = min(width, PARAMETERS * most)
    return (
        np.empty((3, 4)),
        np.empty((local, 3)),
        np.empty(local, np.int64),
        np.full(width, -1),
        np.zeros((most, 5, PARAMETERS)),
    )


@njit(cache=True)
def reduced_normals(rays, unknowns, prior, damping, normal, right):
    """Sum the normal equations and eliminate the points.

    Inputs
    ------
    rays, unknowns, prior : as in `_gather`
    damping : λ, the diagonal is multiplied by 1 + λ

    Outputs
    -------
    normal : (nr, nr) float64, to which the lower triangle of N - W V⁻¹ Wᵀ is added
    right : (nr,) float64, to which g_c - W V⁻¹ g_p is added
    sum of squares of the weighted residuals of rays; rays from behind; first point that its rays do not determine,
    or -1
    """
    width = len(right)
    scratch = _scratch(rays, width)
    v, w, columns, slot, work = scratch
    inverse, y = np.empty((3, 3)), np.empty((len(columns), 3))
    total, behind, loose = 0.0, 0, -1
    for i in range(len(rays.start) - 1):
        count, square, turned = _gather(i, rays, unknowns, prior, scratch)
        total += square
        behind += turned
        for k in range(rays.start[i], rays.start[i + 1]):
            one, place = work[k - rays.start[i]], unknowns.column[rays.photo[k]]
            for p in range(PARAMETERS):
                if place[p] < 0:
                    continue
                right[place[p]] += one[0, p] * one[4, 0] + one[1, p] * one[4, 1]
                for o in range(p + 1):
                    if place[o] >= 0:
                        value = one[0, p] * one[0, o] + one[1, p] * one[1, o]
                        normal[max(place[p], place[o]), min(place[p], place[o])] += value
        if unknowns.free[i]:
            for a in range(3):
                v[a, a] *= 1.0 + damping
            if _inverse(v, inverse) > 0.0:
                for p in range(count):
                    for a in range(3):
                        y[p, a] = w[p, 0] * inverse[0, a] + w[p, 1] * inverse[1, a] + w[p, 2] * inverse[2, a]
                    at = columns[p]
                    right[at] -= y[p, 0] * v[0, 3] + y[p, 1] * v[1, 3] + y[p, 2] * v[2, 3]
                    for o in range(p + 1):
                        value = y[p, 0] * w[o, 0] + y[p, 1] * w[o, 1] + y[p, 2] * w[o, 2]
                        normal[max(at, columns[o]), min(at, columns[o])] -= value
            elif loose < 0:
                loose = i
        for p in range(count):
            slot[columns[p]] = -1
    return total, behind, loose


@njit(cache=True)
def back_substitute(rays, unknowns, prior, damping, change, moved):
    """Compute the corrections of the points, V⁻¹ (g_p - Wᵀ dc).

    Inputs
    ------
    rays, unknowns, prior, damping : as in `reduced_normals`
    change : (nr,) float64, dc

    Outputs
    -------
    moved : (np, 3) float64 [m]
    """
    scratch = _scratch(rays, len(change))
    v, w, columns, slot, _ = scratch
    inverse = np.empty((3, 3))
    for i in range(len(rays.start) - 1):
        moved[i] = 0.0
        if not unknowns.free[i]:
            continue
        count, _, _ = _gather(i, rays, unknowns, prior, scratch)
        for p in range(count):
            for a in range(3):
                v[a, 3] -= w[p, a] * change[columns[p]]
            slot[columns[p]] = -1
        for a in range(3):
            v[a, a] *= 1.0 + damping
        if _inverse(v, inverse) > 0.0:
            for a in range(3):
                moved[i, a] = inverse[a, 0] * v[0, 3] + inverse[a, 1] * v[1, 3] + inverse[a, 2] * v[2, 3]


@njit(cache=True)
def point_statistics(rays, unknowns, prior, cameras, covariance, per_ray):
    """Compute the covariance of each point, and the residuals and the redundancy of each ray.

    With Y = C_cc W V⁻¹: C_pp = V⁻¹ + V⁻¹Wᵀ Y, C_cp = -Y, and of an image point with the rows A and B the adjusted
    value has the covariance A C_cc Aᵀ - A Y Bᵀ - (A Y Bᵀ)ᵀ + B C_pp Bᵀ.

    Inputs
    ------
    rays, unknowns, prior : as in `_gather`
    cameras : (nr, nr) float64, C_cc

    Outputs
    -------
    covariance : (np, 3, 3) float64 [m²], for σ₀ = 1; nan where the rays do not determine the point
    per_ray : (n, 3, 2) float64; weighted residuals, redundancy numbers, and how far the point moves [m] if the
        coordinate is wrong by one σ
    """
    scratch = _scratch(rays, len(cameras))
    v, w, columns, slot, work = scratch
    inverse = np.empty((3, 3))
    part, y = np.empty((len(columns), 3)), np.empty((len(columns), 3))
    ay = np.empty((2, 3))
    for i in range(len(rays.start) - 1):
        count, _, _ = _gather(i, rays, unknowns, prior, scratch)
        known = unknowns.free[i] and _inverse(v, inverse) > 0.0
        covariance[i] = 0.0 if not unknowns.free[i] else np.nan
        for p in range(count):
            for a in range(3):
                part[p, a], y[p, a] = 0.0, 0.0
        if known:
            for p in range(count):
                for a in range(3):
                    part[p, a] = w[p, 0] * inverse[0, a] + w[p, 1] * inverse[1, a] + w[p, 2] * inverse[2, a]
            for p in range(count):
                row = cameras[columns[p]]
                for o in range(count):
                    value = row[columns[o]]
                    for a in range(3):
                        y[p, a] += value * part[o, a]
            for a in range(3):
                for b in range(3):
                    value = inverse[a, b]
                    for p in range(count):
                        value += part[p, a] * y[p, b]
                    covariance[i, a, b] = value
        for k in range(rays.start[i], rays.start[i + 1]):
            one, place = work[k - rays.start[i]], unknowns.column[rays.photo[k]]
            for row in range(2):
                own = 0.0
                for a in range(3):
                    ay[row, a] = 0.0
                for p in range(PARAMETERS):
                    if place[p] < 0:
                        continue
                    at = slot[place[p]]
                    for a in range(3):
                        ay[row, a] += one[row, p] * y[at, a]
                    line = cameras[place[p]]
                    for o in range(PARAMETERS):
                        if place[o] >= 0:
                            own += one[row, p] * line[place[o]] * one[row, o]
                per_ray[k, 2, row] = 0.0
                if unknowns.free[i]:
                    reach = 0.0
                    for a in range(3):
                        moved = -ay[row, a]
                        own -= ay[row, a] * one[2 + row, a]
                        for b in range(3):
                            moved += covariance[i, a, b] * one[2 + row, b]
                        own += moved * one[2 + row, a]
                        reach += moved * moved
                    per_ray[k, 2, row] = np.sqrt(reach)
                per_ray[k, 0, row] = one[4, row]
                per_ray[k, 1, row] = 1.0 - own
        for p in range(count):
            slot[columns[p]] = -1


@njit(cache=True)
def datum_sums(rays, unknowns, prior, cameras, moves, out):
    """Compute the covariances of t = Σ Gᵀ p, the sums over the points that define a datum, with cameras and points.

    Inputs
    ------
    rays, unknowns, prior, cameras : as in `point_statistics`
    moves : (np, 3, 7) float64, G of each point

    Outputs
    -------
    out : (7, nr) float64, cov(t, c) = -Σ Gᵀ V⁻¹Wᵀ C_cc; (np, 7, 3) float64, cov(t, p) = Gᵀ V⁻¹ - cov(t, c) W V⁻¹
    """
    width = len(cameras)
    scratch = _scratch(rays, width)
    v, w, columns, slot, _ = scratch
    inverse, part, sums = np.empty((3, 3)), np.empty(3), np.zeros((7, width))
    for turn in range(2):
        for i in range(len(rays.start) - 1):
            if not unknowns.free[i]:
                continue
            count, _, _ = _gather(i, rays, unknowns, prior, scratch)
            known = _inverse(v, inverse) > 0.0
            for p in range(count):
                at = columns[p]
                slot[at] = -1
                if not known:
                    continue
                for a in range(3):
                    part[a] = w[p, 0] * inverse[0, a] + w[p, 1] * inverse[1, a] + w[p, 2] * inverse[2, a]
                for g in range(7):
                    for a in range(3):
                        if turn == 0:
                            sums[g, at] -= moves[i, a, g] * part[a]
                        else:
                            out[1][i, g, a] -= out[0][g, at] * part[a]
            if known and turn == 1:
                for g in range(7):
                    for a in range(3):
                        for b in range(3):
                            out[1][i, g, a] += moves[i, b, g] * inverse[b, a]
        if turn == 0:
            for g in range(7):
                for p in range(width):
                    for o in range(width):
                        out[0][g, p] += sums[g, o] * cameras[o, p]
