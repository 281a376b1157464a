"""Contacts of a ball with another ball or a convex polyhedron."""

import numpy as np
from numba import njit

from mechanics.contact._kernels.vectors import (
    along,
    column,
    cross,
    dot,
    minus,
    norm,
    over,
    row,
    write_frame,
    write_row,
)


@njit(cache=True)
def _onto_segment(c, a, b):
    """Return the nearest point of the segment a b to c [m], and its squared distance [m²]."""
    e = minus(b, a)
    t = min(max(dot(e, minus(c, a)) / dot(e, e), 0.0), 1.0)
    foot = along(a, t, e)
    away = minus(c, foot)
    return foot, dot(away, away)


@njit(cache=True)
def _above(c, f, shapes):
    """Return whether the foot of c on the plane of face f lies within the face, and c's height above the plane [m]."""
    n, start, stop = row(shapes.normal, f), shapes.cptr[f], shapes.cptr[f + 1]
    height = dot(n, minus(c, row(shapes.vertex, shapes.corner[start])))
    inside = True
    for k in range(start, stop):
        a = row(shapes.vertex, shapes.corner[k])
        b = row(shapes.vertex, shapes.corner[k + 1 if k + 1 < stop else start])
        inside = inside and dot(n, cross(minus(b, a), minus(c, a))) >= 0.0
    return inside, height


@njit(cache=True)
def _nearest(c, s, shapes):
    """Return the signed distance of c from shape s [m], the nearest point, and the unit vector from it towards c."""
    best, face, within = -np.inf, -1, False
    for f in range(shapes.fptr[s], shapes.fptr[s + 1]):
        inside, height = _above(c, f, shapes)
        if height > best:
            best, face, within = height, f, inside
    # inside the polyhedron, or above the inner part of the face that is farthest from it
    if best <= 0.0 or within:
        n = row(shapes.normal, face)
        return best, along(c, -best, n), n
    far, point = np.inf, c
    for e in range(shapes.eptr[s], shapes.eptr[s + 1]):
        foot, square = _onto_segment(
            c, row(shapes.vertex, shapes.edge_a[e]), row(shapes.vertex, shapes.edge_b[e])
        )
        if square < far:
            far, point = square, foot
    for f in range(shapes.fptr[s], shapes.fptr[s + 1]):
        inside, height = _above(c, f, shapes)
        if inside and height > 0.0 and height * height < far:
            far, point = height * height, along(c, -height, row(shapes.normal, f))
    far = np.sqrt(far)
    return far, point, over(minus(c, point), far)


@njit(cache=True)
def _frame(n, axes, frame):
    """Write rows n, t1, t2, with t1 along the antagonist's axis farthest from n, so that the frame turns with it."""
    axis, least = 0, np.inf
    for k in range(3):
        cosine = abs(dot(n, column(axes, k)))
        if cosine < least * (1.0 - 1e-3):
            axis, least = k, cosine
    direction = column(axes, axis)
    write_frame(frame, n, along(direction, -dot(n, direction), n))


@njit(cache=True)
def ball_points(pair, limit, radius, middle, axes, shapes):  # pragma: no cover - compiled
    """Find the contacts of pairs with at least one ball; the candidate is a ball, of two balls the first.

    Inputs
    ------
    pair : (np, 2) int64, shapes
    limit : (np,) float64, gap up to which a pair is watched [m]
    radius : (ns,) float64, zero for polyhedra [m]
    middle : (ns, 3) float64, centre of the body of each shape [m]
    axes : (ns, 3, 3) float64, rotation of the body of each shape [-]
    shapes : Polyhedra

    Outputs
    -------
    place, frame, nearest, area : as of `interface_points`; name and area are zero
    """
    most = pair.shape[0]
    place = np.empty((most, 3), dtype=np.int64)
    frame, nearest = np.empty((most, 3, 3)), np.empty((2 * most, 3))
    count = 0
    for p in range(most):
        first = 0 if radius[pair[p, 0]] > 0.0 else 1
        ball, other = pair[p, first], pair[p, 1 - first]
        c = row(middle, ball)
        if radius[other] > 0.0:
            o = row(middle, other)
            away = minus(c, o)
            far = norm(away)
            # concentric balls: any direction separates them
            n = over(away, far) if far > 0.0 else column(axes[other], 2)
            point = along(o, radius[other], n)
            gap = far - radius[other] - radius[ball]
        else:
            far, point, n = _nearest(c, other, shapes)
            gap = far - radius[ball]
        if gap > limit[p]:
            continue
        _frame(n, axes[other], frame[count])
        write_row(nearest, 2 * count, along(c, -radius[ball], n))
        write_row(nearest, 2 * count + 1, point)
        place[count, 0], place[count, 1], place[count, 2] = p, first, 0
        count += 1
    return place[:count], frame[:count], nearest[: 2 * count].reshape(count, 2, 3), np.zeros(count)
