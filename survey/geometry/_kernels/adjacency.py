"""Numba kernels of touching faces: the intersection of two polygons, seen square to the joint between them.

Solids are held as in `survey.geometry.adjacency.SolidArrays`, in coordinates about a place among them.
"""

import math

import numpy as np
from numba import njit

from survey.conventions import MOST, ONE_WAY
from survey.geometry._kernels.vectors import dot

GROUPS = 4
"""Directions in which one solid can touch another; further ones are merged with the nearest of these."""

_ONE_WAY = math.cos(ONE_WAY)
"""Cosine of 30°: overlaps nearer to parallel are one contact, however many faces make it."""

_OF_STONE = MOST
"""Largest width of a joint over the thickness of the thinner stone, since no joint lies across a thin brick."""


@njit(cache=True)
def face_planes(vertices, corners, face_starts):
    """Compute normals, areas and boxes of faces, and whether each is convex.

    Inputs
    ------
    vertices : (nv, 3) float64 [m]
    corners, face_starts : (nc,), (nf + 1,) int64, as in `SolidArrays`

    Outputs
    -------
    normals, areas, boxes, convex : (nf, 3) float64 unit [-], (nf,) float64 [m²], (nf, 6) float64 lower and upper
        corner [m], (nf,) bool; returned
    """
    count = face_starts.shape[0] - 1
    normals, areas = np.zeros((count, 3)), np.zeros(count)
    boxes, convex = np.empty((count, 6)), np.ones(count, np.bool_)
    for f in range(count):
        ring = corners[face_starts[f] : face_starts[f + 1]]
        for k in range(3):
            p, q = (k + 1) % 3, (k + 2) % 3
            boxes[f, k], boxes[f, 3 + k] = math.inf, -math.inf
            for i in range(ring.shape[0]):
                a, b = vertices[ring[i]], vertices[ring[(i + 1) % ring.shape[0]]]
                o = vertices[ring[0]]
                normals[f, k] += 0.5 * ((a[p] - o[p]) * (b[q] - o[q]) - (a[q] - o[q]) * (b[p] - o[p]))
                boxes[f, k], boxes[f, 3 + k] = min(boxes[f, k], a[k]), max(boxes[f, 3 + k], a[k])
        areas[f] = math.sqrt(normals[f, 0] ** 2 + normals[f, 1] ** 2 + normals[f, 2] ** 2)
        if areas[f] > 0.0:
            for k in range(3):
                normals[f, k] /= areas[f]
        convex[f] = _is_convex(vertices, ring, normals[f], areas[f])
    return normals, areas, boxes, convex


@njit(cache=True)
def _is_convex(vertices, ring, normal, area):
    """Return whether a ring turns left at every corner, within the rounding and noise of a straight one."""
    n = ring.shape[0]
    for i in range(n):
        a, b, c = vertices[ring[i]], vertices[ring[(i + 1) % n]], vertices[ring[(i + 2) % n]]
        turn = 0.0
        for k in range(3):
            p, q = (k + 1) % 3, (k + 2) % 3
            turn += normal[k] * ((b[p] - a[p]) * (c[q] - b[q]) - (b[q] - a[q]) * (c[p] - b[p]))
        if turn < -1e-9 * area:
            return False
    return True


@njit(cache=True)
def _flatten(vertices, ring, origin, u, v, sense, out):
    """Project the corners of a ring onto two directions, in reverse order if `sense` is -1.0; return their number."""
    n = ring.shape[0]
    for i in range(n):
        corner = vertices[ring[n - 1 - i if sense < 0.0 else i]]
        x, y = 0.0, 0.0
        for k in range(3):
            x += (corner[k] - origin[k]) * u[k]
            y += (corner[k] - origin[k]) * v[k]
        out[i, 0], out[i, 1] = x, y
    return n


@njit(cache=True)
def _clip(first, n, second, m, work, other):
    """Return area and moments of the intersection of two counter-clockwise convex polygons (Sutherland & Hodgman)."""
    for i in range(n):
        work[i, 0], work[i, 1] = first[i, 0], first[i, 1]
    for j in range(m):
        ax, ay = second[j]
        bx, by = second[(j + 1) % m]
        count = 0
        for i in range(n):
            px, py = work[i]
            qx, qy = work[(i + 1) % n]
            p = (bx - ax) * (py - ay) - (by - ay) * (px - ax)
            q = (bx - ax) * (qy - ay) - (by - ay) * (qx - ax)
            if p >= 0.0:
                other[count, 0], other[count, 1] = px, py
                count += 1
            if (p > 0.0 and q < 0.0) or (p < 0.0 and q > 0.0):
                t = p / (p - q)
                other[count, 0], other[count, 1] = px + t * (qx - px), py + t * (qy - py)
                count += 1
        if count < 3:
            return 0.0, 0.0, 0.0
        work, other, n = other, work, count
    area, mx, my = 0.0, 0.0, 0.0
    ox, oy = work[0]
    for i in range(1, n - 1):
        px, py = work[i, 0] - ox, work[i, 1] - oy
        qx, qy = work[i + 1, 0] - ox, work[i + 1, 1] - oy
        part = 0.5 * (px * qy - py * qx)
        area += part
        mx += part * ((px + qx) / 3.0 + ox)
        my += part * ((py + qy) / 3.0 + oy)
    return area, mx, my


@njit(cache=True)
def _triangle(polygon, i, out):
    """Write triangle i of the fan about corner 0 to `out`, counter-clockwise; return its original sign, 1 or -1."""
    ax, ay = polygon[i, 0] - polygon[0, 0], polygon[i, 1] - polygon[0, 1]
    bx, by = polygon[i + 1, 0] - polygon[0, 0], polygon[i + 1, 1] - polygon[0, 1]
    left = ax * by - ay * bx >= 0.0
    second, third = (i, i + 1) if left else (i + 1, i)
    for k in range(2):
        out[0, k], out[1, k], out[2, k] = polygon[0, k], polygon[second, k], polygon[third, k]
    return 1.0 if left else -1.0


@njit(cache=True)
def _shared(first, n, second, m, convex, buffers):
    """Return area and moments of the intersection of any two simple polygons, as `_clip` does for convex ones.

    A polygon is the sum of the triangles of a fan about its first corner, clockwise ones counted negative; the
    intersection is the sum over pairs of triangles, with the product of their signs.
    """
    work, other = buffers[2], buffers[3]
    if convex:
        return _clip(first, n, second, m, work, other)
    area, mx, my = 0.0, 0.0, 0.0
    one, two = np.empty((3, 2)), np.empty((3, 2))
    for i in range(1, n - 1):
        sign = _triangle(first, i, one)
        for j in range(1, m - 1):
            turn = sign * _triangle(second, j, two)
            part, px, py = _clip(one, np.int64(3), two, np.int64(3), work, other)
            area, mx, my = area + turn * part, mx + turn * px, my + turn * py
    return area, mx, my


@njit(cache=True)
def _basis(n, u, v):
    """Write two directions u, v that make a right-handed frame with n."""
    least = 0
    for k in range(1, 3):
        if abs(n[k]) < abs(n[least]):
            least = k
    p, q = (least + 1) % 3, (least + 2) % 3
    size = math.sqrt(n[p] ** 2 + n[q] ** 2)
    u[least], u[p], u[q] = 0.0, -n[q] / size, n[p] / size
    for k in range(3):
        p, q = (k + 1) % 3, (k + 2) % 3
        v[k] = n[p] * u[q] - n[q] * u[p]


@njit(cache=True)
def _height(vertices, ring, normal, n, place):
    """Return the height along n of a face's plane over a place; the mean of its corners is on the plane."""
    part = 0.0
    for i in range(ring.shape[0]):
        for k in range(3):
            part += normal[k] * (vertices[ring[i], k] - place[k])
    return part / ring.shape[0] / dot(normal, n)


@njit(cache=True)
def _buffers(face_starts):
    """Return four polygons with room for the largest face, clipped by another."""
    largest = 0
    for f in range(face_starts.shape[0] - 1):
        largest = max(largest, face_starts[f + 1] - face_starts[f])
    return np.empty((4, 2 * largest + 8, 2))


@njit(cache=True)
def _boxes_apart(boxes, i, j, width):
    for k in range(3):  # noqa: SIM110
        if boxes[i, k] > boxes[j, 3 + k] + width or boxes[j, k] > boxes[i, 3 + k] + width:
            return True
    return False


@njit(cache=True)
def thickness(one, solid, n):
    """Compute the extent of a solid along a direction.

    Inputs
    ------
    one : int, solid
    solid : vertices, corners, face_starts, solid_starts of `SolidArrays`
    n : (3,) float64, unit vector [-]

    Outputs
    -------
    extent : float [m]; returned
    """
    vertices, corners, face_starts, solid_starts = solid
    low, high = math.inf, -math.inf
    for c in range(face_starts[solid_starts[one]], face_starts[solid_starts[one + 1]]):
        along = dot(vertices[corners[c]], n)
        low, high = min(low, along), max(high, along)
    return high - low


@njit(cache=True)
def _add(groups, count, row):
    """Add an overlap (8,): area, gap, place, normal, to the group of the nearest normal, or to a new group."""
    best, nearest = -1, -2.0
    for g in range(count):
        size = math.sqrt(groups[g, 5] ** 2 + groups[g, 6] ** 2 + groups[g, 7] ** 2)
        cosine = 0.0
        for k in range(5, 8):
            cosine += groups[g, k] * row[k] / size
        if cosine > nearest:
            best, nearest = g, cosine
    if nearest < _ONE_WAY and count < GROUPS:
        best, count = count, count + 1
    groups[best, 0] += row[0]
    for k in range(1, 8):
        groups[best, k] += row[0] * row[k]
    return count


@njit(cache=True)
def touching_faces(pairs, solid, planes, limits, out_pairs, out):
    """Compute the contacts of pairs of solids.

    Inputs
    ------
    pairs : (n, 2) int64, solids
    solid : vertices, corners, face_starts, solid_starts of `SolidArrays`
    planes : as from `face_planes`
    limits : widest joint, deepest overlap [m], cosine of the largest angle, least share of the smaller face [-],
        whether the width applies at the narrow end of a joint instead of its middle

    Outputs
    -------
    out_pairs : (≥ `GROUPS` n, 2) int64, solids of each contact
    out : (≥ `GROUPS` n, 8) float64, area [m²], gap [m], place [m], normal [-]
    count : int, contacts; returned
    """
    face_starts, solid_starts = solid[2], solid[3]
    normals, boxes, width, cosine = planes[0], planes[2], limits[0], limits[2]
    work = (_buffers(face_starts), np.empty((4, 3)))
    row, total = np.empty(8), 0
    for pair in range(pairs.shape[0]):
        one, two = pairs[pair]
        groups, count = out[total:], np.int64(0)
        groups[:GROUPS] = 0.0
        for i in range(solid_starts[one], solid_starts[one + 1]):
            for j in range(solid_starts[two], solid_starts[two + 1]):
                # most faces look elsewhere: reject them without a call
                facing = dot(normals[i], normals[j])
                if facing > -cosine or _boxes_apart(boxes, i, j, width):
                    continue
                if _contact((i, j), (one, two), facing, solid, planes, limits, work, row):
                    count = _add(groups, count, row)
        for g in range(count):
            _finish(groups[g])
            out_pairs[total + g, 0], out_pairs[total + g, 1] = one, two
        total += count
    return total


@njit(cache=True)
def facing_faces(pairs, solid, planes, limits, out_faces, out):
    """Compute the pairs of single faces that face each other.

    Inputs
    ------
    pairs, solid, planes, limits : as for `touching_faces`

    Outputs
    -------
    out_faces : (room, 2) int64, the two faces of each pair
    out : (room, 8) float64, as of `touching_faces`
    count : int, pairs, including those beyond the room; returned
    """
    face_starts, solid_starts = solid[2], solid[3]
    normals, boxes, width, cosine = planes[0], planes[2], limits[0], limits[2]
    work = (_buffers(face_starts), np.empty((4, 3)))
    row, total = np.empty(8), 0
    for pair in range(pairs.shape[0]):
        one, two = pairs[pair]
        for i in range(solid_starts[one], solid_starts[one + 1]):
            for j in range(solid_starts[two], solid_starts[two + 1]):
                facing = dot(normals[i], normals[j])
                if facing > -cosine or _boxes_apart(boxes, i, j, width):
                    continue
                if _contact((i, j), (one, two), facing, solid, planes, limits, work, row):
                    if total < out.shape[0]:
                        out_faces[total, 0], out_faces[total, 1] = i, j
                        for k in range(8):
                            out[total, k] = row[k]
                    total += 1
    return total


@njit(cache=True)
def _contact(faces, solids, facing, solid, planes, limits, work, row):
    """Return whether a face of one solid touches a face of another; write area, gap, place and normal (8,) to `row`.

    `facing` is the cosine of the angle between their normals, about -1.
    """
    (i, j), (one, two) = faces, solids
    vertices, corners, face_starts = solid[:3]
    normals, areas, convex = planes[0], planes[1], planes[3]
    width, overlap, share = limits[0], limits[1], limits[3]
    buffers, (n, u, v, place) = work[0], (work[1][0], work[1][1], work[1][2], work[1][3])
    size = math.sqrt(2.0 - 2.0 * facing)
    for k in range(3):
        n[k] = (normals[j, k] - normals[i, k]) / size
    _basis(n, u, v)
    first = corners[face_starts[i] : face_starts[i + 1]]
    second = corners[face_starts[j] : face_starts[j + 1]]
    origin = vertices[first[0]]
    ni = _flatten(vertices, first, origin, u, v, -1.0, buffers[0])
    nj = _flatten(vertices, second, origin, u, v, 1.0, buffers[1])
    area, mx, my = _shared(buffers[0], ni, buffers[1], nj, convex[i] and convex[j], buffers)
    if area <= 0.0 or area < share * min(areas[i], areas[j]):
        return False
    for k in range(3):
        place[k] = origin[k] + mx / area * u[k] + my / area * v[k]
    high = _height(vertices, first, normals[i], n, place)
    low = _height(vertices, second, normals[j], n, place)
    # two faces that open like a wedge are as wide apart as at their narrow end
    narrower = 0.5 * math.sqrt(area) * math.sqrt(max(1.0 / facing**2 - 1.0, 0.0)) if limits[4] else 0.0
    if not -overlap - narrower <= high - low <= width + narrower:
        return False
    if abs(high - low) > _OF_STONE * min(thickness(one, solid, n), thickness(two, solid, n)):
        return False
    row[0], row[1] = area, high - low
    for k in range(3):
        row[2 + k], row[5 + k] = place[k] + 0.5 * (high + low) * n[k], n[k]
    return True


@njit(cache=True)
def _finish(group):
    """Turn sums weighted by area into means."""
    for k in range(1, 5):
        group[k] /= group[0]
    size = math.sqrt(group[5] ** 2 + group[6] ** 2 + group[7] ** 2)
    for k in range(5, 8):
        group[k] /= size
