"""Numba kernel that cuts a convex polyhedron by its planes."""

from typing import NamedTuple

import numpy as np
from numba import njit

from survey.arrays import Array, Ints
from survey.geometry._kernels.vectors import height_over

FULL, EMPTY, OPEN = range(3)
"""Outcome: a solid, nothing, or something that the planes do not close."""

MAX_CORNERS = 64
"""Largest number of corners of a face."""


class CutSolid(NamedTuple):
    """Arrays for a polyhedron that is being cut.

    Attributes
    ----------
    vertices : (room, 3) corners [m]
    loops : (n + 6, MAX_CORNERS) corners of each face, counter-clockwise seen from outside
    sizes : (n + 6,) number of corners of each face
    of_face : (n + 6,) plane on which each face lies; -1: a side of the box
    meeting : (room, 3) three planes that cross in each corner, those at the widest angles; -1: none cross at wide ones
    """

    vertices: Array
    loops: Ints
    sizes: Ints
    of_face: Ints
    meeting: Ints


@njit(cache=True)
def cut_out(planes, centre, reach, near, solid):
    """Compute the intersection of half-spaces n·x ≤ d within a box about a centre.

    A box is cut by one plane after another. Corners within `near` of a plane count as lying on it, which keeps the
    result closed whatever the rounding: the faces left by a plane have one open ring of edges, which its new face
    closes. The caller puts each corner where the three planes of `meeting` cross: numba takes five seconds to compile
    its call of LAPACK.

    Inputs
    ------
    planes : (n, 4) float64, outward unit normals [-] and offsets d [m]
    centre, reach : (3,) float64 and float, half the side of the box, larger than the solid [m]
    near : float [m]

    Outputs
    -------
    solid : CutSolid, corners and faces written into it
    status, number of corners, number of faces : returned
    """
    vertices, loops, sizes, of_face, meeting = solid
    count, faces = _box(centre, reach, vertices, loops, sizes, of_face)
    # of no literal type, for each of which numba would compile the callees once more
    count, faces = np.int64(count), np.int64(faces)
    distance = np.empty(vertices.shape[0])
    for p in range(planes.shape[0]):
        status, count, faces = _cut(planes, p, near, solid, count, faces, distance)
        if status != FULL:
            return status, 0, 0
    for f in range(faces):
        if of_face[f] < 0:
            return OPEN, 0, 0
    count = _compact(vertices, count, loops, sizes, faces)
    _choose_planes(planes, count, loops, sizes, of_face, faces, meeting)
    return FULL, count, faces


@njit(cache=True)
def _box(centre, reach, vertices, loops, sizes, of_face):
    for v in range(8):
        for k in range(3):
            vertices[v, k] = centre[k] + (reach if (v >> k) & 1 else -reach)
    corners = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))
    for f in range(6):
        for k in range(4):
            loops[f, k] = corners[f][k]
        sizes[f], of_face[f] = 4, -1
    return 8, 6


@njit(cache=True)
def _cut(planes, p, near, solid, count, faces, distance):
    """Cut by plane p; return the status and the numbers of corners and faces."""
    vertices, loops, sizes, of_face, _ = solid
    inside, outside = False, False
    for v in range(count):
        distance[v] = height_over(planes[p], planes[p, 3], vertices[v])
    for f in range(faces):
        for k in range(sizes[f]):
            inside = inside or distance[loops[f, k]] < -near
            outside = outside or distance[loops[f, k]] > near
    if not inside:
        return EMPTY, count, faces
    if not outside:
        return FULL, count, faces
    room = vertices.shape[0]
    ends = np.empty((MAX_CORNERS, 2), np.int64)  # cut edges, with the corner that each has got
    made = np.empty(MAX_CORNERS, np.int64)
    cuts, kept = np.int64(0), np.int64(0)
    work = np.empty(2 * MAX_CORNERS, np.int64)
    for f in range(faces):
        n, size = sizes[f], 0
        for k in range(n):
            a, b = loops[f, k], loops[f, (k + 1) % n]
            if distance[a] <= near:
                work[size] = a
                size += 1
            if (distance[a] < -near and distance[b] > near) or (distance[a] > near and distance[b] < -near):
                low, high = min(a, b), max(a, b)
                found = -1
                for c in range(cuts):
                    if ends[c, 0] == low and ends[c, 1] == high:
                        found = made[c]
                if found < 0:
                    if count >= room or cuts >= MAX_CORNERS:
                        return OPEN, count, faces
                    t = distance[low] / (distance[low] - distance[high])
                    for k2 in range(3):
                        vertices[count, k2] = vertices[low, k2] + t * (vertices[high, k2] - vertices[low, k2])
                    distance[count] = 0.0
                    ends[cuts, 0], ends[cuts, 1], made[cuts] = low, high, count
                    found = count
                    count, cuts = count + 1, cuts + 1
                work[size] = found
                size += 1
        # a face that only touches the plane from outside is gone
        below = False
        for k in range(size):
            below = below or distance[work[k]] < -near
        if size >= 3 and below and size <= MAX_CORNERS:
            for k in range(size):
                loops[kept, k] = work[k]
            sizes[kept], of_face[kept] = size, of_face[f]
            kept += 1
    return _cap(p, loops, sizes, of_face, kept, count)


@njit(cache=True)
def _cap(p, loops, sizes, of_face, faces, count):
    """Close the one ring of edges that have no face on their other side with a face on plane p."""
    after = np.full(count, -1, np.int64)
    start, number = -1, 0
    for f in range(faces):
        n = sizes[f]
        for k in range(n):
            a, b = loops[f, k], loops[f, (k + 1) % n]
            single = True
            for g in range(faces):
                m = sizes[g]
                for q in range(m):
                    if loops[g, q] == b and loops[g, (q + 1) % m] == a:
                        single = False
            if single:
                after[b] = a
                start, number = b, number + 1
    if number < 3 or number > MAX_CORNERS:
        return OPEN, count, faces
    at = start
    for k in range(number):
        loops[faces, k] = at
        at = after[at]
        if at < 0:
            return OPEN, count, faces
    if at != start:
        return OPEN, count, faces
    sizes[faces], of_face[faces] = number, p
    return FULL, count, faces + 1


@njit(cache=True)
def _compact(vertices, count, loops, sizes, faces):
    """Drop corners that no face has, keeping their order."""
    number = np.full(count, -1, np.int64)
    for f in range(faces):
        for k in range(sizes[f]):
            number[loops[f, k]] = 0
    used = 0
    for v in range(count):
        if number[v] == 0:
            number[v] = used
            for k in range(3):
                vertices[used, k] = vertices[v, k]
            used += 1
    for f in range(faces):
        for k in range(sizes[f]):
            loops[f, k] = number[loops[f, k]]
    return used


@njit(cache=True)
def _choose_planes(planes, count, loops, sizes, of_face, faces, meeting):
    """Write three planes of each corner, those at the widest angles."""
    own = np.empty(faces, np.int64)
    for v in range(count):
        n = 0
        for f in range(faces):
            for k in range(sizes[f]):
                if loops[f, k] == v:
                    own[n] = of_face[f]
                    n += 1
        best = 1e-6
        meeting[v, 0] = meeting[v, 1] = meeting[v, 2] = -1
        for a in range(n):
            for b in range(a):
                for c in range(b):
                    volume = abs(_determinant(planes[own[a]], planes[own[b]], planes[own[c]]))
                    if volume > best:
                        best, meeting[v, 0], meeting[v, 1], meeting[v, 2] = volume, own[a], own[b], own[c]


@njit(cache=True)
def _determinant(a, b, c):
    return (
        a[0] * (b[1] * c[2] - b[2] * c[1])
        - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
    )
