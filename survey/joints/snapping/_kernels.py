"""Numba kernels of matching faces: opposite faces of two solids that lie in one plane within a tolerance.

Solids are held as in `survey.geometry.adjacency.SolidArrays`, in coordinates about a place among them.
"""

import math

import numpy as np
from numba import njit

from survey.conventions import TENTH
from survey.geometry._kernels.adjacency import _basis, _boxes_apart, _buffers, _flatten, _shared
from survey.geometry._kernels.vectors import dot

_OPPOSITE = TENTH - 1.0
"""Cosine of opposite faces: heights over the common plane decide, except for small faces."""


@njit(cache=True)
def near_pairs(boxes, order, margin, out):
    """Find pairs of boxes that come nearer than a margin.

    Inputs
    ------
    boxes : (n, 6) float64, lower and upper corner [m]
    order : (n,) int64, boxes sorted by their lower x
    margin : float [m]

    Outputs
    -------
    out : (room, 2) int64, the pairs, as far as there is room
    count : int, number of pairs; returned
    """
    count = 0
    for a in range(order.shape[0]):
        i = order[a]
        for b in range(a + 1, order.shape[0]):
            j = order[b]
            if boxes[j, 0] > boxes[i, 3] + margin:
                break
            apart = False
            for k in range(1, 3):
                if boxes[i, k] > boxes[j, 3 + k] + margin or boxes[j, k] > boxes[i, 3 + k] + margin:
                    apart = True
            if not apart:
                if count < out.shape[0]:
                    out[count, 0], out[count, 1] = min(i, j), max(i, j)
                count += 1
    return count


@njit(cache=True)
def _perimeter(polygon, n):
    total = 0.0
    for i in range(n):
        k = (i + 1) % n
        total += math.hypot(polygon[k, 0] - polygon[i, 0], polygon[k, 1] - polygon[i, 1])
    return total


@njit(cache=True)
def _grow(polygon, n, factor):
    """Enlarge a polygon about the mean of its corners."""
    for k in range(2):
        mean = 0.0
        for i in range(n):
            mean += polygon[i, k] / n
        for i in range(n):
            polygon[i, k] = mean + factor * (polygon[i, k] - mean)


@njit(cache=True)
def _spread(vertices, first, second, n):
    """Return half the extent along n of the corners of two faces [m]."""
    low, high = math.inf, -math.inf
    for ring in (first, second):
        for i in range(ring.shape[0]):
            along = dot(vertices[ring[i]], n)
            low, high = min(low, along), max(high, along)
    return 0.5 * (high - low)


@njit(cache=True)
def matching_faces(pairs, solid, planes, tolerance, out, measures):
    """Find faces of pairs of solids that lie in one plane.

    Inputs
    ------
    pairs : (n, 2) int64, solids
    solid : vertices, corners, face_starts, solid_starts of `SolidArrays`
    planes : as from `face_planes`
    tolerance : float, distance of the corners of both faces from their common plane [m]

    Outputs
    -------
    out : (room, 2) int64, the two faces, as far as there is room
    measures : (room, 2) float64, distance of their corners from the plane [m], and shared area [m²]: negative for a
        seam no wider than the tolerance, or if the faces only come that near
    count : int, number of matches; returned
    """
    vertices, corners, face_starts, solid_starts = solid
    normals, sizes, boxes, convex = planes
    buffers = _buffers(face_starts)
    n, u, v = np.empty(3), np.empty(3), np.empty(3)
    count = 0
    for pair in range(pairs.shape[0]):
        one, two = pairs[pair]
        for i in range(solid_starts[one], solid_starts[one + 1]):
            for j in range(solid_starts[two], solid_starts[two + 1]):
                facing = dot(normals[i], normals[j])
                if (
                    facing > _OPPOSITE
                    or _boxes_apart(boxes, i, j, 2.0 * tolerance)
                    or not min(sizes[i], sizes[j]) > 0.0
                ):
                    continue
                # the larger face has the more accurate normal
                a, b = sizes[i] / (sizes[i] + sizes[j]), sizes[j] / (sizes[i] + sizes[j])
                size = math.sqrt(a * a + b * b - 2.0 * a * b * facing)
                for k in range(3):
                    n[k] = (b * normals[j, k] - a * normals[i, k]) / size
                first = corners[face_starts[i] : face_starts[i + 1]]
                second = corners[face_starts[j] : face_starts[j + 1]]
                spread = _spread(vertices, first, second, n)
                if spread > tolerance:
                    continue
                _basis(n, u, v)
                origin = vertices[first[0]]
                ni = _flatten(vertices, first, origin, u, v, -1.0, buffers[0])
                nj = _flatten(vertices, second, origin, u, v, 1.0, buffers[1])
                both = convex[i] and convex[j]
                area = _shared(buffers[0], ni, buffers[1], nj, both, buffers)[0]
                seam = 0.5 * tolerance * min(_perimeter(buffers[0], ni), _perimeter(buffers[1], nj))
                if area <= seam:
                    _grow(buffers[0], ni, 1.0 + 8.0 * tolerance / math.sqrt(sizes[i]))
                    if not _shared(buffers[0], ni, buffers[1], nj, both, buffers)[0] > 0.0:
                        continue
                    area = -1.0
                if count < out.shape[0]:
                    out[count, 0], out[count, 1] = i, j
                    measures[count, 0], measures[count, 1] = spread, area
                count += 1
    return count
