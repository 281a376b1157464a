"""Numba kernel of contacts in which a ball takes part: with another ball, or with a convex polyhedron."""

import numpy as np
from numba import njit

__all__ = ["ball_points"]

# next to the kinds of mechanics.contact._kernels_narrow
BALL = 4


@njit(cache=True)
def _onto_segment(c, a, b, out):
    """Nearest point of the segment a b to c; its squared distance."""
    ab = ac = 0.0
    for d in range(3):
        ab += (b[d] - a[d]) ** 2
        ac += (b[d] - a[d]) * (c[d] - a[d])
    t = min(max(ac / ab, 0.0), 1.0)
    far = 0.0
    for d in range(3):
        out[d] = a[d] + t * (b[d] - a[d])
        far += (c[d] - out[d]) ** 2
    return far


@njit(cache=True)
def _above(c, f, cptr, corner, vertices, normals):
    """Whether the foot of c on the plane of face f lies within the face, and the distance above the plane."""
    n, start, stop = normals[f], cptr[f], cptr[f + 1]
    o = vertices[corner[start]]
    height = n[0] * (c[0] - o[0]) + n[1] * (c[1] - o[1]) + n[2] * (c[2] - o[2])
    inside = True
    for k in range(start, stop):
        a, b = vertices[corner[k]], vertices[corner[k + 1 if k + 1 < stop else start]]
        e0, e1, e2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        p0, p1, p2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        turn = n[0] * (e1 * p2 - e2 * p1) + n[1] * (e2 * p0 - e0 * p2) + n[2] * (e0 * p1 - e1 * p0)
        inside = inside and turn >= 0.0
    return inside, height


@njit(cache=True)
def _nearest(c, b, vertices, fptr, cptr, corner, normals, eptr, edge_a, edge_b, point, n):
    """Signed distance of c from polyhedron b; writes the nearest point and the unit vector from it towards c."""
    best, face, within = -np.inf, -1, False
    for f in range(fptr[b], fptr[b + 1]):
        inside, height = _above(c, f, cptr, corner, vertices, normals)
        if height > best:
            best, face, within = height, f, inside
    # inside the polyhedron, or above the inner part of the face that is farthest from it
    if best <= 0.0 or within:
        for d in range(3):
            n[d] = normals[face, d]
            point[d] = c[d] - best * n[d]
        return best
    far, trial = np.inf, np.empty(3)
    for e in range(eptr[b], eptr[b + 1]):
        distance = _onto_segment(c, vertices[edge_a[e]], vertices[edge_b[e]], trial)
        if distance < far:
            far = distance
            point[:] = trial
    for f in range(fptr[b], fptr[b + 1]):
        inside, height = _above(c, f, cptr, corner, vertices, normals)
        if inside and height > 0.0 and height * height < far:
            far = height * height
            for d in range(3):
                point[d] = c[d] - height * normals[f, d]
    far = np.sqrt(far)
    for d in range(3):
        n[d] = (c[d] - point[d]) / far
    return far


@njit(cache=True)
def _frame(n, axes, f):
    """Rows n, t1, t2, with t1 along the axis of the antagonist that is farthest from n, so that it turns with it."""
    axis, least = 0, np.inf
    for k in range(3):
        along = abs(n[0] * axes[0, k] + n[1] * axes[1, k] + n[2] * axes[2, k])
        if along < least * (1.0 - 1e-3):
            axis, least = k, along
    along = n[0] * axes[0, axis] + n[1] * axes[1, axis] + n[2] * axes[2, axis]
    length = 0.0
    for d in range(3):
        f[0, d] = n[d]
        f[1, d] = axes[d, axis] - along * n[d]
        length += f[1, d] ** 2
    f[1] /= np.sqrt(length)
    f[2, 0] = f[0, 1] * f[1, 2] - f[0, 2] * f[1, 1]
    f[2, 1] = f[0, 2] * f[1, 0] - f[0, 0] * f[1, 2]
    f[2, 2] = f[0, 0] * f[1, 1] - f[0, 1] * f[1, 0]


@njit(cache=True)
def ball_points(
    pairs, limit, radius, middle, axes, vertices, fptr, cptr, corner, normals, eptr, edge_a, edge_b
):  # pragma: no cover - compiled
    """Contacts of pairs (np, 2) of which one or both are balls, nearer than `limit` (np,).

    `radius` (ns,) is zero for polyhedra, `middle` (ns, 3) the centre of balls, `axes` (ns, 3, 3) the rotation of the
    body of each shape. The candidate is a ball; of two balls the first.

    Returns
    -------
    place, frame, nearest, area : as `interface_points` gives them
    """
    most = pairs.shape[0]
    place = np.empty((most, 3), dtype=np.int64)
    frame, nearest = np.empty((most, 3, 3)), np.empty((most, 2, 3))
    point, n = np.empty(3), np.empty(3)
    count = 0
    for p in range(most):
        first = 0 if radius[pairs[p, 0]] > 0.0 else 1
        ball, other = pairs[p, first], pairs[p, 1 - first]
        c = middle[ball]
        if radius[other] > 0.0:
            far = 0.0
            for d in range(3):
                n[d] = c[d] - middle[other, d]
                far += n[d] ** 2
            far = np.sqrt(far)
            for d in range(3):
                # balls with one centre: any direction parts them
                n[d] = n[d] / far if far > 0.0 else axes[other, d, 2]
                point[d] = middle[other, d] + radius[other] * n[d]
            gap = far - radius[other] - radius[ball]
        else:
            far = _nearest(c, other, vertices, fptr, cptr, corner, normals, eptr, edge_a, edge_b, point, n)
            gap = far - radius[ball]
        if gap > limit[p]:
            continue
        _frame(n, axes[other], frame[count])
        for d in range(3):
            nearest[count, 0, d] = c[d] - radius[ball] * n[d]
            nearest[count, 1, d] = point[d]
        place[count, 0], place[count, 1], place[count, 2] = p, first, BALL << 21
        count += 1
    return place[:count], frame[:count], nearest[:count], np.zeros(count)
