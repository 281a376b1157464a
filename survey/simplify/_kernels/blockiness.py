"""Numba kernels that measure a solid: volume, angles, distance from another solid's edges, common volume.

A solid is its vertices (nv, 3) float64 [m], the corners (nc,) int64 of all faces, concatenated, and the index
starts (nf + 1,) int64 of each face's first corner.
"""

import math

import numpy as np
from numba import njit

from survey.geometry._kernels.vectors import cross, dot, minus


@njit(cache=True)
def area_vectors(vertices, corners, starts):
    """Compute area times outward normal of each face.

    Inputs
    ------
    vertices, corners, starts : the solid

    Outputs
    -------
    vectors : (nf, 3) float64 [m²]; returned
    """
    out = np.zeros((len(starts) - 1, 3))
    for f in range(len(starts) - 1):
        o = vertices[corners[starts[f]]]
        for c in range(starts[f] + 1, starts[f + 1] - 1):
            x, y, z = cross(minus(vertices[corners[c]], o), minus(vertices[corners[c + 1]], o))
            out[f, 0], out[f, 1], out[f, 2] = out[f, 0] + 0.5 * x, out[f, 1] + 0.5 * y, out[f, 2] + 0.5 * z
    return out


@njit(cache=True)
def face_planes(vertices, corners, starts):
    """Compute the planes of the faces, through the mean of their corners; zero for a face without area.

    Inputs
    ------
    vertices, corners, starts : the solid

    Outputs
    -------
    planes : (nf, 4) float64, outward unit normals [-] and offsets [m]; returned
    """
    out = np.zeros((len(starts) - 1, 4))
    vectors = area_vectors(vertices, corners, starts)
    for f in range(len(starts) - 1):
        length = math.sqrt(dot(vectors[f], vectors[f]))
        if length > 0.0:
            for k in range(3):
                out[f, k] = vectors[f, k] / length
            for c in range(starts[f], starts[f + 1]):
                out[f, 3] += dot(out[f], vertices[corners[c]]) / (starts[f + 1] - starts[f])
    return out


@njit(cache=True)
def _middle(vertices, corners, start, stop):
    """Return the mean (3,) of the corners of a face."""
    out = np.zeros(3)
    for c in range(start, stop):
        for k in range(3):
            out[k] += vertices[corners[c], k] / (stop - start)
    return out


@njit(cache=True)
def volume(vertices, corners, starts):
    """Compute the volume by the divergence theorem; a warped face is fanned about the mean of its corners.

    Inputs
    ------
    vertices, corners, starts : the solid

    Outputs
    -------
    volume : float [m³], negative if the faces are seen from inside; returned
    """
    origin = vertices[corners[0]]
    total = 0.0
    for f in range(len(starts) - 1):
        a = minus(_middle(vertices, corners, starts[f], starts[f + 1]), origin)
        for c in range(starts[f], starts[f + 1]):
            following = c + 1 if c + 1 < starts[f + 1] else starts[f]
            second, third = minus(vertices[corners[c]], origin), minus(vertices[corners[following]], origin)
            total += dot(a, cross(second, third))
    return total / 6.0


@njit(cache=True)
def worst_angle(vertices, corners, starts):
    """Compute the largest departure from a right angle of the inside angle between faces with a common edge.

    Inputs
    ------
    vertices, corners, starts : the solid

    Outputs
    -------
    angle : float [rad]; returned
    """
    planes = face_planes(vertices, corners, starts)
    worst = 0.0
    for f in range(len(starts) - 1):
        for c in range(starts[f], starts[f + 1]):
            p = corners[c]
            q = corners[c + 1 if c + 1 < starts[f + 1] else starts[f]]
            if p > q:
                continue
            g = _face_with(q, p, corners, starts)
            if g < 0:
                continue
            n, m = planes[f], planes[g]
            turn = cross((n[0], n[1], n[2]), (m[0], m[1], m[2]))
            sine = dot(turn, minus(vertices[q], vertices[p]))
            exterior = math.copysign(math.atan2(math.sqrt(dot(turn, turn)), dot(n, m)), sine)
            worst = max(worst, abs(0.5 * math.pi - exterior))
    return worst


@njit(cache=True)
def _face_with(p, q, corners, starts):
    """Return the face that has the edge from p to q; -1 if there is none."""
    for f in range(len(starts) - 1):
        for c in range(starts[f], starts[f + 1]):
            following = c + 1 if c + 1 < starts[f + 1] else starts[f]
            if corners[c] == p and corners[following] == q:
                return f
    return -1


@njit(cache=True)
def edge_distances(points, vertices, corners, starts):
    """Compute the distance of points from the nearest edge of a solid.

    Inputs
    ------
    points : (n, 3) float64 [m]
    vertices, corners, starts : the solid

    Outputs
    -------
    distances : (n,) float64 [m]; returned
    """
    out = np.full(len(points), math.inf)
    for f in range(len(starts) - 1):
        for c in range(starts[f], starts[f + 1]):
            a = vertices[corners[c]]
            u = minus(vertices[corners[c + 1 if c + 1 < starts[f + 1] else starts[f]]], a)
            square = dot(u, u)
            for i in range(len(points)):
                w = minus(points[i], a)
                along = min(max(dot(w, u) / square, 0.0), 1.0) if square > 0.0 else 0.0
                w = (w[0] - along * u[0], w[1] - along * u[1], w[2] - along * u[2])
                out[i] = min(out[i], math.sqrt(dot(w, w)))
    return out


@njit(cache=True)
def common_volume(vertices, corners, starts, planes):
    """Compute the volume of the intersection of a solid with a convex body.

    The solid is the signed sum of tetrahedra over the triangles fanned about the means of its faces' corners, each
    clipped by all planes.

    Inputs
    ------
    vertices, corners, starts : the solid
    planes : (np, 4) float64, half-spaces n·x ≤ d of the convex body

    Outputs
    -------
    volume : float [m³]; returned
    """
    apex = _middle(vertices, corners, np.int64(0), len(corners))
    total = 0.0
    for f in range(len(starts) - 1):
        middle = _middle(vertices, corners, starts[f], starts[f + 1])
        for c in range(starts[f], starts[f + 1]):
            following = c + 1 if c + 1 < starts[f + 1] else starts[f]
            four = np.empty((4, 3))
            for k in range(3):
                four[0, k], four[1, k] = apex[k], middle[k]
                four[2, k], four[3, k] = vertices[corners[c], k], vertices[corners[following], k]
            total += math.copysign(_clipped(four, planes), _six_volumes(four))
    return total


@njit(cache=True)
def _clipped(four, planes):
    """Return the volume of a tetrahedron inside half-spaces: clipped by one plane after another into tetrahedra."""
    waiting = np.empty((2 * len(planes) + 2, 4, 3))
    done = np.zeros(2 * len(planes) + 2, np.int64)
    _put(waiting[0], four)
    count, total = 1, 0.0
    while count:
        count -= 1
        body, number = waiting[count].copy(), done[count]
        if number == len(planes):
            total += abs(_six_volumes(body)) / 6.0
            continue
        inside, sorted_body, heights = _split(body, planes[number])
        if inside == 0:
            continue
        pieces = _pieces(sorted_body, heights, inside)
        for k in range(len(pieces)):
            _put(waiting[count], pieces[k])
            done[count] = number + 1
            count += 1
    return total


@njit(cache=True)
def _put(target, rows):
    """Write rows to the first of a target's; numba compiles a loop much sooner than an assignment."""
    for k in range(len(rows)):
        for d in range(3):
            target[k, d] = rows[k, d]


@njit(cache=True)
def _split(body, plane):
    """Count the corners of a tetrahedron below a plane; sort its corners, those first, with their heights."""
    out, heights = np.empty((4, 3)), np.empty(4)
    inside, last = 0, 4
    for i in range(4):
        height = dot(plane, body[i]) - plane[3]
        if height <= 0.0:
            place = inside
            inside += 1
        else:
            last -= 1
            place = last
        out[place, 0], out[place, 1], out[place, 2] = body[i, 0], body[i, 1], body[i, 2]
        heights[place] = height
    return inside, out, heights


@njit(cache=True)
def _pieces(body, heights, inside):
    """Return the tetrahedra (np, 4, 3) of the part below a plane; corners below the plane come first in `body`."""
    if inside == 4:
        out = np.empty((1, 4, 3))
        _put(out[0], body)
        return out
    cut = np.empty((inside, 4 - inside, 3))
    for i in range(inside):
        for j in range(inside, 4):
            share = heights[i] / (heights[i] - heights[j])
            for d in range(3):
                cut[i, j - inside, d] = body[i, d] + share * (body[j, d] - body[i, d])
    if inside == 1:
        out = np.empty((1, 4, 3))
        _put(out[0], body[:1])
        _put(out[0, 1:], cut[0])
        return out
    ends = np.empty((2, 3, 3))  # of a prism
    if inside == 3:
        for i in range(3):
            _put(ends[0, i:], body[i : i + 1])
            _put(ends[1, i:], cut[i])
    else:
        for i in range(2):
            _put(ends[i], body[i : i + 1])
            _put(ends[i, 1:], cut[i])
    out = np.empty((3, 4, 3))
    _put(out[0], ends[0])
    _put(out[0, 3:], ends[1, :1])
    _put(out[1], ends[0, 1:])
    _put(out[1, 2:], ends[1, :2])
    _put(out[2], ends[0, 2:])
    _put(out[2, 1:], ends[1])
    return out


@njit(cache=True)
def _six_volumes(four):
    o = four[0]
    return dot(minus(four[1], o), cross(minus(four[2], o), minus(four[3], o)))
