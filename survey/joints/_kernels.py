"""Numba kernels that fit the plane half-way between the faces on both sides of a joint."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from survey.arrays import Array, Bools, Ints
from survey.conventions import CHECKED, FINEST, GROUP, LEVEL, MAX_ITERATIONS, PER_CENT, SAMPLE, SOME, WEAR
from survey.geometry._kernels.vectors import dot, height_over

_HUBER = 1.5
"""Robust standard deviations beyond which residuals lose weight."""

_PLANE = SOME
"""Of the straightness: largest rms of the corners of a wedge-shaped joint about its two planes."""


_MANY = SAMPLE
"""Least number of sound corners of a joint of more than two stones."""

WORN = PER_CENT
"""Weight of a worn corner: it is some 25 mm off where a sound one is 2.5 mm off."""


_USUAL = SOME
"""Weight of the usual width of joints, used where fewer than `KNOWN` sound corners define one side."""

KNOWN = GROUP
"""Least number of sound corners of each side of a joint that determine its width without the usual one."""

_OWN = CHECKED
"""Least number of sound corners from which one side has its own plane."""

_WEDGE = LEVEL
"""Least opening of a joint, as a slope, for which the two sides may have planes of their own (2°)."""


class FaceCorners(NamedTuple):
    """Corners of the faces of several joints, joint after joint.

    Attributes
    ----------
    points : (k, 3) float64, in the frame of their joint: along it, along it, across [m]
    hands : (k,) float64, +1 above the joint, -1 below
    sound : (k,) bool, whether a corner is known from measurement
    starts : (n + 1,) int64, index of the first corner of each joint
    scales : (n,) float64, divisors of the coordinates of each joint [m]
    """

    points: Array
    hands: Array
    sound: Bools
    starts: Ints
    scales: Array


@njit(cache=True)
def fit_middle_planes(corners, usual, straightness, planes, values):
    """Fit to each joint the plane half-way between the faces on its two sides.

    In the frame of a joint a corner at (x, y) on side s = ±1 is at the height z = a + b x + c y + s (w + p x + q y)/2.
    The middle plane is a + b x + c y; w is the width. The opening p, q is assumed to be zero unless it explains most of
    the residuals, since two faces give a better mean direction than each on its own.

    Inputs
    ------
    corners : JointCorners
    usual : float, usual width of joints [m]; negative: unknown
    straightness : float, residual of a sound corner above which it is off the joint [m]

    Outputs
    -------
    planes : (n, 3) float64, a [m], b, c [-]
    values : (n, 5) float64, zero on entry: width [m], rms [m], and of sound corners the largest residual [m], the
        share of those off [-], and the largest residual of the others [m]
    """
    points, hands, sound, starts, scales = corners
    for j in range(starts.shape[0] - 1):
        rows = slice(starts[j], starts[j + 1])
        _fit(points[rows], hands[rows], sound[rows], scales[j], usual, straightness, planes[j], values[j])


@njit(cache=True)
def _fit(points, hands, sound, scale, usual, straightness, plane, value):
    k = points.shape[0]
    number, above = 0, 0
    for i in range(k):
        number += sound[i]
        above += sound[i] and hands[i] > 0.0
    prior = _USUAL if usual >= 0.0 and min(above, number - above) < KNOWN else 0.0
    design = np.empty((k, 6))
    for i in range(k):
        x, y, s = points[i, 0] / scale, points[i, 1] / scale, 0.5 * hands[i]
        design[i, 0], design[i, 1], design[i, 2] = 1.0, x, y
        design[i, 3], design[i, 4], design[i, 5] = s, s * x, s * y
    # of no literal type, for each of which numba would compile the callees once more
    few, many = np.int64(4), np.int64(6)
    unknowns = few
    solution, left = _huber(design, points[:, 2], sound, few, prior, usual)
    if above >= _OWN and number - above >= _OWN:
        open_, less = _huber(design, points[:, 2], sound, many, prior, usual)
        wedge = math.sqrt(open_[4] ** 2 + open_[5] ** 2) / scale
        if wedge > _WEDGE and less < 0.1 * left and less < (_PLANE * straightness) ** 2:
            unknowns, solution = many, open_
    value[2], value[3], total = _left_over(design, points[:, 2], sound, solution, straightness)
    if value[3] > 0.0:
        # corners that are far off, the more so at an end, tilt the plane; the least sum of residuals finds them
        flat = _least_sum(design, points[:, 2], sound)
        _, off, less = _left_over(design, points[:, 2], sound, flat, straightness)
        if off < value[3] or (off == value[3] and less < total):
            unknowns, start = few, flat
        else:
            start = solution
        near = sound.copy()
        for i in range(k):
            near[i] = sound[i] and abs(points[i, 2] - _value(design[i], start)) <= straightness
        again, _ = _huber(design, points[:, 2], near, unknowns, prior, usual)
        largest, off, _ = _left_over(design, points[:, 2], sound, again, straightness)
        if off <= value[3]:
            solution, value[2], value[3] = again, largest, off
    plane[0], plane[1], plane[2] = solution[0], solution[1] / scale, solution[2] / scale
    total, weight = 0.0, 0.0
    for i in range(k):
        w, residual = 1.0 if sound[i] else WORN, abs(points[i, 2] - _value(design[i], solution))
        total, weight = total + w * residual**2, weight + w
        if sound[i] and residual <= straightness:
            value[4] = max(value[4], residual)
    value[0], value[1] = solution[3], math.sqrt(total / weight)


@njit(cache=True)
def _left_over(design, heights, sound, solution, straightness):
    """Return the largest residual of sound corners, the share of those off the joint, and the sum of residuals.

    Corners off the joint count in the sum as if they lay at its edge: their distance says nothing of the plane.
    """
    largest, off, number, total = 0.0, 0, 0, 0.0
    for i in range(design.shape[0]):
        if sound[i]:
            residual = abs(heights[i] - _value(design[i], solution))
            largest, number, total = max(largest, residual), number + 1, total + min(residual, straightness)
            off += residual > straightness
    return largest, off / max(number, 1), total


@njit(cache=True)
def _least_sum(design, heights, sound):
    """Return the solution (6,), without opening, with the least sum of residuals of sound corners."""
    k = design.shape[0]
    solution, weights = np.zeros(6), np.empty(k)
    for i in range(k):
        weights[i] = 1.0 if sound[i] else 0.0
    for _ in range(3 * MAX_ITERATIONS):
        _solve(*_normal(design, heights, weights, np.int64(4)), solution)
        for i in range(k):
            if sound[i]:
                weights[i] = 1.0 / max(abs(heights[i] - _value(design[i], solution)), FINEST)
    return solution


@njit(cache=True)
def _solve(matrix, right, out):
    """Solve normal equations by elimination, which needs no pivots; both are overwritten.

    numba takes three seconds to compile its call of LAPACK.
    """
    n = len(right)
    for a in range(n):
        for b in range(a + 1, n):
            factor = matrix[b, a] / matrix[a, a]
            right[b] -= factor * right[a]
            for c in range(a + 1, n):
                matrix[b, c] -= factor * matrix[a, c]
    for a in range(n - 1, -1, -1):
        for b in range(a + 1, n):
            right[a] -= matrix[a, b] * out[b]
        out[a] = right[a] / matrix[a, a]


@njit(cache=True)
def _normal(design, heights, weights, unknowns):
    """Return matrix and right side of the normal equations; unknowns without data stay zero."""
    matrix, right = np.zeros((unknowns, unknowns)), np.zeros(unknowns)
    for i in range(design.shape[0]):
        for c in range(unknowns):
            right[c] += weights[i] * design[i, c] * heights[i]
            for d in range(unknowns):
                matrix[c, d] += weights[i] * design[i, c] * design[i, d]
    total = 0.0
    for i in range(design.shape[0]):
        total += weights[i]
    for c in range(unknowns):
        matrix[c, c] += 1e-12 * total
    return matrix, right


@njit(cache=True)
def _value(row, solution):
    out = 0.0
    for c in range(6):
        out += row[c] * solution[c]
    return out


@njit(cache=True)
def _huber(design, heights, sound, unknowns, prior, usual):
    """Return the Huber solution (6,) of the least squares, and the weighted mean square residual."""
    k = design.shape[0]
    solution, previous, weights = np.zeros(6), np.zeros(6), np.empty(k)
    for i in range(k):
        weights[i] = 1.0 if sound[i] else WORN
    number = 0
    for i in range(k):
        number += sound[i]
    if unknowns == 4 and number >= _MANY:
        # least squares alone would never identify an odd stone at the end of a bed
        _weigh(design, heights, sound, _least_sum(design, heights, sound), weights)
    left = 0.0
    for _ in range(MAX_ITERATIONS):
        matrix, right = _normal(design, heights, weights, unknowns)
        matrix[3, 3] += prior
        right[3] += prior * usual
        for c in range(unknowns):
            previous[c] = solution[c]
        _solve(matrix, right, solution)
        left = _weigh(design, heights, sound, solution, weights)
        change = 0.0
        for c in range(unknowns):
            change = max(change, abs(solution[c] - previous[c]))
        if change < 1e-12:
            break
    return solution, left


@njit(cache=True)
def _weigh(design, heights, sound, solution, weights):
    """Replace `weights` by Huber's weights of the residuals; return the mean square residual by the old weights."""
    # of no literal type, or numba compiles `_median` twice
    residuals, count, total, whole = np.empty(design.shape[0]), np.int64(0), 0.0, 0.0
    for i in range(design.shape[0]):
        residual = abs(heights[i] - _value(design[i], solution))
        total += weights[i] * residual**2
        whole += weights[i]
        if sound[i]:
            residuals[count] = residual
            count += 1
    left = total / whole
    spread = 1e-4 if count == 0 else max(1.4826 * _median(residuals, count), 1e-4)
    for i in range(design.shape[0]):
        residual = abs(heights[i] - _value(design[i], solution))
        weight, bend = (1.0, _HUBER * spread) if sound[i] else (WORN, WEAR)
        weights[i] = weight * min(1.0, bend / max(residual, 1e-300))
    return left


@njit(cache=True)
def _median(values, count):
    """Return the median of the first values, which are reordered (Hoare 1961); np.median takes a second to compile."""
    low, high, half = 0, count - 1, count // 2
    while low < high:
        pivot, i, j = values[half], low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i, j = i + 1, j - 1
        if j < half:
            low = i
        if i > half:
            high = j
    if count % 2:
        return values[half]
    lower = values[0]
    for k in range(1, half):
        lower = max(lower, values[k])
    return 0.5 * (lower + values[half])


@njit(cache=True)
def continuing_faces(pairs, solid, normals, offsets, joined, cosine, near):
    """Find faces of neighbouring stones that lie in one plane, as the tops of two stones of a course do.

    Inputs
    ------
    pairs : (n, 2) int64, neighbouring stones
    solid : vertices, corners, face_starts, solid_starts of `SolidArrays`
    normals, offsets : (nf, 3) float64 unit [-], (nf,) float64 [m], of all faces
    joined : (nf,) bool, whether a face belongs to a joint
    cosine : float, of the largest angle between the two [-]
    near : float, distance by which a corner of either may be off the plane of the other [m]

    Outputs
    -------
    faces : (m, 2) int64; returned
    """
    starts = solid[3]
    out = np.empty((4 * pairs.shape[0], 2), np.int64)
    count = 0
    for pair in range(pairs.shape[0]):
        one, two = pairs[pair]
        for f in range(starts[one], starts[one + 1]):
            for g in range(starts[two], starts[two + 1]):
                if not (joined[f] and joined[g]):
                    continue
                if dot(normals[f], normals[g]) < cosine:
                    continue
                if (
                    _off(f, g, solid, normals, offsets) <= near
                    and _off(g, f, solid, normals, offsets) <= near
                ):
                    if count == out.shape[0]:
                        out = _doubled(out)
                    out[count, 0], out[count, 1] = f, g
                    count += 1
    return out[:count]


@njit(cache=True)
def _doubled(faces):
    """Return a copy with twice as many rows."""
    out = np.empty((2 * faces.shape[0], 2), np.int64)
    for k in range(faces.shape[0]):
        out[k, 0], out[k, 1] = faces[k, 0], faces[k, 1]
    return out


@njit(cache=True)
def _off(face, other, solid, normals, offsets):
    """Return the largest distance of a corner of one face from the plane of another [m]."""
    vertices, corners, face_starts, _ = solid
    farthest = 0.0
    for c in range(face_starts[face], face_starts[face + 1]):
        farthest = max(farthest, abs(height_over(normals[other], offsets[other], vertices[corners[c]])))
    return farthest
