"""Numba kernels of the narrow phase: the best separating axis of two convex polyhedra, and their contact points.

Polyhedra are flat arrays: shape b owns vertices `vptr[b]:vptr[b+1]` and faces `fptr[b]:fptr[b+1]`; face f has
the corners `corner[cptr[f]:cptr[f+1]]` (indices into all vertices), counter-clockwise seen from outside. Edge e
runs along the cross product of the normals of its faces `edge_face[e]`, second times first.
"""

import numpy as np
from numba import njit

__all__ = ["clip", "interface_points", "point_areas", "separating_axes"]

# a face has at most MAX_CORNERS corners; clipping one convex polygon by another gives at most the sum of both
MAX_CORNERS = 16
MAX_POINTS = 2 * MAX_CORNERS
SEPARATED, FACE_FIRST, FACE_SECOND, EDGES = 0, 1, 2, 3
# of the smaller shape's size: how much better the second shape's face, or two edges, must separate to be preferred,
# so that the choice between features that are as good does not flicker
_PREFERENCE = 1e-3
# cosine of 10⁻⁶ rad: two faces flatter on one another are one plane
_SAME_PLANE = 1.0 - 5e-13
# faces flatter on one another than this need no look at edges
_PARALLEL = 0.999999
# of the smaller shape's size: closer to a side than this is on it, so that faces which end together clip cleanly
_ON_SIDE = 1e-7

# of an even share of an overlap: the least that a contact point has
_LEAST_SHARE = 0.1


@njit(cache=True)
def _face_gap(f, o, cptr, corner, vptr, vertices, normals):
    """How far face f keeps shape o away."""
    n0, n1, n2 = normals[f, 0], normals[f, 1], normals[f, 2]
    nearest = np.inf
    for v in range(vptr[o], vptr[o + 1]):
        nearest = min(nearest, n0 * vertices[v, 0] + n1 * vertices[v, 1] + n2 * vertices[v, 2])
    c = corner[cptr[f]]
    return nearest - (n0 * vertices[c, 0] + n1 * vertices[c, 1] + n2 * vertices[c, 2])


@njit(cache=True)
def _deepest_face(b, o, limit, fptr, cptr, corner, vptr, vertices, normals):
    """The face of shape b that keeps shape o farthest away, and that distance; the first that exceeds `limit`."""
    best, face = -np.inf, -1
    for f in range(fptr[b], fptr[b + 1]):
        nearest = _face_gap(f, o, cptr, corner, vptr, vertices, normals)
        if nearest > best:
            best, face = nearest, f
            if best > limit:
                break
    return best, face


@njit(cache=True)
def _opposite_face(b, n0, n1, n2, fptr, normals):
    """The face of shape b that looks most against a direction."""
    lowest, face = np.inf, -1
    for f in range(fptr[b], fptr[b + 1]):
        d = normals[f, 0] * n0 + normals[f, 1] * n1 + normals[f, 2] * n2
        if d < lowest:
            lowest, face = d, f
    return face


@njit(cache=True)
def _deepest_edges(i, j, floor, eptr, edge_a, edge_b, edge_face, vertices, normals, centre, axis):
    """The pair of edges whose common normal separates the shapes most, if by more than `floor`; writes `axis`.

    Two edges can only be nearest if the arcs between the normals of their faces cross on the Gauss sphere
    (Gregorius 2013).
    """
    best, first, second = floor, -1, -1
    for e in range(eptr[i], eptr[i + 1]):
        a, b = normals[edge_face[e, 0]], normals[edge_face[e, 1]]
        o = vertices[edge_a[e]]
        p0, p1, p2 = (
            vertices[edge_b[e], 0] - o[0],
            vertices[edge_b[e], 1] - o[1],
            vertices[edge_b[e], 2] - o[2],
        )
        pp = p0 * p0 + p1 * p1 + p2 * p2
        for f in range(eptr[j], eptr[j + 1]):
            c, d = normals[edge_face[f, 0]], normals[edge_face[f, 1]]
            # the second shape's normals count reversed
            cba = -(c[0] * p0 + c[1] * p1 + c[2] * p2)
            dba = -(d[0] * p0 + d[1] * p1 + d[2] * p2)
            if cba * dba >= 0.0:
                continue
            s = vertices[edge_a[f]]
            q0, q1, q2 = (
                vertices[edge_b[f], 0] - s[0],
                vertices[edge_b[f], 1] - s[1],
                vertices[edge_b[f], 2] - s[2],
            )
            adc = a[0] * q0 + a[1] * q1 + a[2] * q2
            bdc = b[0] * q0 + b[1] * q1 + b[2] * q2
            if adc * bdc >= 0.0 or cba * bdc <= 0.0:
                continue
            n0, n1, n2 = p1 * q2 - p2 * q1, p2 * q0 - p0 * q2, p0 * q1 - p1 * q0
            length = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
            if length < 1e-3 * np.sqrt(pp * (q0 * q0 + q1 * q1 + q2 * q2)):
                continue
            if n0 * (o[0] - centre[0]) + n1 * (o[1] - centre[1]) + n2 * (o[2] - centre[2]) < 0.0:
                length = -length
            n0, n1, n2 = n0 / length, n1 / length, n2 / length
            apart = n0 * (s[0] - o[0]) + n1 * (s[1] - o[1]) + n2 * (s[2] - o[2])
            if apart > best:
                best, first, second = apart, e, f
                axis[0], axis[1], axis[2] = n0, n1, n2
    return best, first, second


@njit(cache=True)
def separating_axes(
    pairs,
    limit,
    hint,
    vptr,
    vertices,
    fptr,
    cptr,
    corner,
    normals,
    eptr,
    edge_a,
    edge_b,
    edge_face,
    centres,
    size,
):  # pragma: no cover - compiled
    """The best separating axis of each pair of convex polyhedra (separating-axis theorem).

    `hint` (np,) is a face that kept the pair apart before, or -1; it is tried first, and written for the next time.

    Returns
    -------
    kind : (np,) 0 apart by more than `limit`; 1, 2 a face of the first, second shape; 3 two edges
    feature : (np, 2) reference and incident face, or the two edges
    axis : (np, 3) unit axis, from the first towards the second shape
    """
    count = pairs.shape[0]
    kind = np.zeros(count, dtype=np.int64)
    feature = np.zeros((count, 2), dtype=np.int64)
    axis = np.zeros((count, 3))
    edge_axis = np.zeros(3)
    for p in range(count):
        i, j, far = pairs[p, 0], pairs[p, 1], limit[p]
        known = hint[p]
        if known >= 0:
            other = j if fptr[i] <= known < fptr[i + 1] else i
            if _face_gap(known, other, cptr, corner, vptr, vertices, normals) > far:
                continue
        hint[p] = -1
        gap_i, face_i = _deepest_face(i, j, far, fptr, cptr, corner, vptr, vertices, normals)
        if gap_i > far:
            hint[p] = face_i
            continue
        gap_j, face_j = _deepest_face(j, i, far, fptr, cptr, corner, vptr, vertices, normals)
        if gap_j > far:
            hint[p] = face_j
            continue
        small = min(size[i], size[j])
        alike = -(
            normals[face_i, 0] * normals[face_j, 0]
            + normals[face_i, 1] * normals[face_j, 1]
            + normals[face_i, 2] * normals[face_j, 2]
        )
        # where the choice makes no difference the first, so that it does not flicker; else the better, so that
        # nothing depends on the order of the stones
        use_i = gap_i >= gap_j - (_PREFERENCE * small if alike > _SAME_PLANE else 0.0)
        face, other = (face_i, j) if use_i else (face_j, i)
        n0, n1, n2 = normals[face, 0], normals[face, 1], normals[face, 2]
        incident = _opposite_face(other, n0, n1, n2, fptr, normals)
        facing = -(normals[incident, 0] * n0 + normals[incident, 1] * n1 + normals[incident, 2] * n2)
        sign = 1.0 if use_i else -1.0
        kind[p] = FACE_FIRST if use_i else FACE_SECOND
        feature[p, 0], feature[p, 1] = face, incident
        axis[p, 0], axis[p, 1], axis[p, 2] = sign * n0, sign * n1, sign * n2
        if facing > _PARALLEL:
            continue
        floor = (gap_i if use_i else gap_j) + _PREFERENCE * small
        edge_gap, first, second = _deepest_edges(
            i, j, floor, eptr, edge_a, edge_b, edge_face, vertices, normals, centres[i], edge_axis
        )
        if first >= 0 and edge_gap > far:
            kind[p] = SEPARATED
        elif first >= 0:
            kind[p] = EDGES
            feature[p, 0], feature[p, 1] = first, second
            axis[p] = edge_axis
    return kind, feature, axis


@njit(cache=True)
def clip(x, y, z, label, count, ax, ay, bx, by, side, slack, kx, ky, kz, kl):  # pragma: no cover - compiled
    """Keep what lies left of a → b of a convex polygon in the plane, in place (Sutherland & Hodgman 1974).

    z is carried along. `label` names each point after the edge that begins in it: the polygon's own edge, or
    MAX_CORNERS + the side that was cut along; no two points get the same. A corner within `slack` of the line is on it.
    The k arrays are scratch.
    """
    k = 0
    length = np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    ux, uy = (bx - ax) / length, (by - ay) / length
    for p in range(count):
        q = p + 1 if p + 1 < count else 0
        dp = uy * (x[p] - ax) - ux * (y[p] - ay)
        dq = uy * (x[q] - ax) - ux * (y[q] - ay)
        inside, next_inside = dp <= slack, dq <= slack
        if inside and k < MAX_POINTS:
            kx[k], ky[k], kz[k], kl[k] = x[p], y[p], z[p], label[p]
            k += 1
        leaves, enters = inside and not next_inside, next_inside and not inside
        if ((leaves and dp < -slack) or (enters and dq < -slack)) and k < MAX_POINTS:
            t = dp / (dp - dq)
            kx[k], ky[k], kz[k] = x[p] + t * (x[q] - x[p]), y[p] + t * (y[q] - y[p]), z[p] + t * (z[q] - z[p])
            kl[k] = MAX_CORNERS + side if leaves else label[p]
            k += 1
        elif leaves and k > 0:
            # the corner lies on the side: what follows it is the side
            kl[k - 1] = MAX_CORNERS + side
    for p in range(k):
        x[p], y[p], z[p], label[p] = kx[p], ky[p], kz[p], kl[p]
    return k


@njit(cache=True)
def _moments(x, y, count):
    """Area, centroid and central second moments xx, xy, yy of a convex polygon."""
    area = sx = sy = sxx = sxy = syy = 0.0
    for p in range(1, count - 1):
        ax, ay, bx, by = x[p] - x[0], y[p] - y[0], x[p + 1] - x[0], y[p + 1] - y[0]
        a = 0.5 * (ax * by - ay * bx)
        area += a
        sx += a * (ax + bx) / 3.0
        sy += a * (ay + by) / 3.0
        sxx += a * (ax * ax + ax * bx + bx * bx) / 6.0
        sxy += a * (2.0 * ax * ay + ax * by + bx * ay + 2.0 * bx * by) / 12.0
        syy += a * (ay * ay + ay * by + by * by) / 6.0
    if abs(area) < 1e-300:
        return 0.0, x[0], y[0], 0.0, 0.0, 0.0
    mx, my = sx / area, sy / area
    return (
        abs(area),
        x[0] + mx,
        y[0] + my,
        abs(sxx / area - mx * mx),
        sxy / area - mx * my,
        abs(syy / area - my * my),
    )


@njit(cache=True)
def point_areas(x, y, count, area, mx, my, out):  # pragma: no cover - compiled
    """Shares of an area that add up to it and have its centroid (mx, my): the most even ones.

    Where one would be less than a tenth of an even share, all are drawn towards even ones until it is that much; so
    no point is left without area, and the shares do not jump when the overlap changes.
    """
    sxx = sxy = syy = cx = cy = 0.0
    for p in range(count):
        cx += x[p] / count
        cy += y[p] / count
    for p in range(count):
        sxx += (x[p] - cx) ** 2
        sxy += (x[p] - cx) * (y[p] - cy)
        syy += (y[p] - cy) ** 2
    det = sxx * syy - sxy * sxy
    even = area / count
    lx = ly = 0.0
    if det > 1e-12 * (sxx + syy) ** 2:
        dx, dy = area * (mx - cx), area * (my - cy)
        lx, ly = (syy * dx - sxy * dy) / det, (sxx * dy - sxy * dx) / det
    lowest = np.inf
    for p in range(count):
        out[p] = even + lx * (x[p] - cx) + ly * (y[p] - cy)
        lowest = min(lowest, out[p])
    if lowest < _LEAST_SHARE * even:
        keep = (1.0 - _LEAST_SHARE) * even / (even - lowest)
        for p in range(count):
            out[p] = even + keep * (out[p] - even)


@njit(cache=True)
def _spread(x, y, count, wanted, chosen):
    """`wanted` corners of a convex polygon, in order: those that cut off least are left out, one after the other.

    What a corner cuts off is the triangle with its two neighbours (Visvalingam & Whyatt 1993), so points on an edge go
    first, and true corners stay.
    """
    for p in range(count):
        chosen[p] = p
    kept = count
    while kept > wanted:
        out, least = 0, np.inf
        for p in range(kept):
            a, b, c = chosen[p - 1 if p else kept - 1], chosen[p], chosen[p + 1 if p + 1 < kept else 0]
            area = abs((x[b] - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (y[b] - y[a]))
            # of corners that cut off the same the first goes, whatever the rounding
            if area < least * (1.0 - 1e-6):
                out, least = p, area
        for p in range(out, kept - 1):
            chosen[p] = chosen[p + 1]
        kept -= 1


@njit(cache=True)
def _inner_points(points, mx, my, sxx, sxy, syy, x, y):
    """Points of equal shares that carry centroid and second moments: the square root of the moments applied to a
    regular polygon whose own moments are one.
    """
    if points == 1:
        x[0], y[0] = mx, my
        return
    # square root of a symmetric 2 × 2 matrix: (S + √det) / √(trace + 2 √det)
    root = np.sqrt(max(sxx * syy - sxy * sxy, 0.0))
    scale = np.sqrt(2.0) / np.sqrt(max(sxx + syy + 2.0 * root, 1e-300))
    for p in range(points):
        angle = 2.0 * np.pi * (p + 0.5) / points
        u, v = scale * np.cos(angle), scale * np.sin(angle)
        x[p], y[p] = mx + (sxx + root) * u + sxy * v, my + sxy * u + (syy + root) * v


@njit(cache=True)
def interface_points(
    pairs, kind, feature, axis, limit, points, inner, flat, thin,
    vptr, vertices, fptr, cptr, corner, normals, eptr, edge_a, edge_b, size, face_area,
):  # fmt: skip  # pragma: no cover - compiled
    """The contact points of each touching pair: corners of the overlap of two faces, or the feet of two edges.

    Parameters
    ----------
    pairs, kind, feature, axis, limit : as of `separating_axes`
    points : largest number of points of two faces; with one, the centroid of the overlap
    inner : points of flat faces lie inside, where they carry the area's second moments
    flat : cosine of the angle within which faces lie flat on one another
    thin : flat faces that overlap by less than this part of the smaller one do not touch

    Returns
    -------
    place : (nc, 3) pair, candidate (0 or 1 of the pair), label that is unique within the pair
    frame : (nc, 3, 3); nearest : (nc, 2, 3) the places on candidate and antagonist; area : (nc,)
    """
    most = pairs.shape[0] * max(points, 1)
    place = np.empty((most, 3), dtype=np.int64)
    frame, nearest, area = np.empty((most, 3, 3)), np.empty((most, 2, 3)), np.empty(most)
    x, y, z = np.empty(MAX_POINTS), np.empty(MAX_POINTS), np.empty(MAX_POINTS)
    kx, ky, kz = np.empty(MAX_POINTS), np.empty(MAX_POINTS), np.empty(MAX_POINTS)
    share, label, kl = np.empty(MAX_POINTS), np.empty(MAX_POINTS, np.int64), np.empty(MAX_POINTS, np.int64)
    chosen = np.empty(MAX_POINTS, dtype=np.int64)
    count = 0
    for p in range(pairs.shape[0]):
        if kind[p] == SEPARATED:
            continue
        i, j = pairs[p, 0], pairs[p, 1]
        if kind[p] == EDGES:
            _edge_feet(
                vertices[edge_a[feature[p, 0]]],
                vertices[edge_b[feature[p, 0]]],
                vertices[edge_a[feature[p, 1]]],
                vertices[edge_b[feature[p, 1]]],
                axis[p],
                frame[count],
                nearest[count],
            )
            first, second = feature[p, 0] - eptr[i], feature[p, 1] - eptr[j]
            place[count, 0], place[count, 1] = p, 0
            place[count, 2] = (EDGES << 21) + ((first % 512) << 9) + second % 512
            area[count] = 0.0
            count += 1
            continue
        owner, other = (i, j) if kind[p] == FACE_FIRST else (j, i)
        reference, incident = feature[p, 0], feature[p, 1]
        n, start, stop = normals[reference], cptr[reference], cptr[reference + 1]
        o = vertices[corner[start]]
        f = frame[count]
        _face_frame(o, vertices[corner[start + 1]], n, f)
        k = 0
        # seen along the normal the incident face runs clockwise
        for c in range(cptr[incident + 1] - 1, cptr[incident] - 1, -1):
            d0, d1, d2 = (
                vertices[corner[c], 0] - o[0],
                vertices[corner[c], 1] - o[1],
                vertices[corner[c], 2] - o[2],
            )
            z[k] = f[0, 0] * d0 + f[0, 1] * d1 + f[0, 2] * d2
            x[k] = f[1, 0] * d0 + f[1, 1] * d1 + f[1, 2] * d2
            y[k] = f[2, 0] * d0 + f[2, 1] * d1 + f[2, 2] * d2
            label[k] = c - cptr[incident]
            k += 1
        slack = _ON_SIDE * min(size[i], size[j])
        bx = by = 0.0
        for c in range(start, stop):
            ax, ay = bx, by
            v = corner[c + 1 if c + 1 < stop else start]
            d0, d1, d2 = vertices[v, 0] - o[0], vertices[v, 1] - o[1], vertices[v, 2] - o[2]
            bx = f[1, 0] * d0 + f[1, 1] * d1 + f[1, 2] * d2
            by = f[2, 0] * d0 + f[2, 1] * d1 + f[2, 2] * d2
            k = clip(x, y, z, label, k, ax, ay, bx, by, c - start, slack, kx, ky, kz, kl)
            if k == 0:
                break
        if k == 0:
            continue
        whole, mx, my, sxx, sxy, syy = _moments(x, y, k)
        g = normals[incident]
        facing = -(g[0] * n[0] + g[1] * n[1] + g[2] * n[2])
        if facing > flat and whole < thin * min(face_area[reference], face_area[incident]):
            continue
        near = 0
        for q in range(k):
            if z[q] <= limit[p]:
                near += 1
        local = ((reference - fptr[owner]) % 64 << 6) + (incident - fptr[other]) % 64
        base = (kind[p] << 21) + (local << 9)
        if (inner or points == 1) and facing > flat and near == k:
            gx, gy = _slope(f, g)
            height = z[0] - gx * x[0] - gy * y[0]
            _inner_points(points, mx, my, sxx, sxy, syy, x, y)
            k = points
            for q in range(k):
                z[q], label[q], share[q] = height + gx * x[q] + gy * y[q], 2 * MAX_CORNERS + q, whole / k
        else:
            kept = 0
            for q in range(k):
                if z[q] <= limit[p]:
                    x[kept], y[kept], z[kept], label[kept] = x[q], y[q], z[q], label[q]
                    kept += 1
            k = kept
            if k == 0:
                continue
            if k > points:
                if points == 1:
                    lowest = 0
                    for q in range(k):
                        if z[q] < z[lowest]:
                            lowest = q
                    chosen[0] = lowest
                else:
                    _spread(x, y, k, points, chosen)
                k = points
                for q in range(k):
                    c = chosen[q]
                    x[q], y[q], z[q], label[q] = x[c], y[c], z[c], label[c]
            point_areas(x, y, k, whole, mx, my, share)
        for q in range(k):
            frame[count] = f
            for d in range(3):
                foot = o[d] + f[1, d] * x[q] + f[2, d] * y[q]
                nearest[count, 1, d] = foot
                nearest[count, 0, d] = foot + f[0, d] * z[q]
            place[count, 0], place[count, 1] = p, 1 if owner == i else 0
            place[count, 2] = base + label[q]
            area[count] = share[q]
            count += 1
    return place[:count], frame[:count], nearest[:count], area[:count]


@njit(cache=True)
def _slope(f, g):
    """Rise of a plane with normal g along the second and third row of a frame, measured along the first."""
    g0 = f[0, 0] * g[0] + f[0, 1] * g[1] + f[0, 2] * g[2]
    g1 = f[1, 0] * g[0] + f[1, 1] * g[1] + f[1, 2] * g[2]
    g2 = f[2, 0] * g[0] + f[2, 1] * g[1] + f[2, 2] * g[2]
    return -g1 / g0, -g2 / g0


@njit(cache=True)
def _face_frame(a, b, n, f):
    """Rows n, t1 along a → b, t2 = n × t1: a frame that turns with the stone."""
    e0, e1, e2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    along = e0 * n[0] + e1 * n[1] + e2 * n[2]
    e0, e1, e2 = e0 - along * n[0], e1 - along * n[1], e2 - along * n[2]
    length = np.sqrt(e0 * e0 + e1 * e1 + e2 * e2)
    f[0, 0], f[0, 1], f[0, 2] = n[0], n[1], n[2]
    f[1, 0], f[1, 1], f[1, 2] = e0 / length, e1 / length, e2 / length
    f[2, 0] = f[0, 1] * f[1, 2] - f[0, 2] * f[1, 1]
    f[2, 1] = f[0, 2] * f[1, 0] - f[0, 0] * f[1, 2]
    f[2, 2] = f[0, 0] * f[1, 1] - f[0, 1] * f[1, 0]


@njit(cache=True)
def _edge_feet(a, b, c, d, axis, f, nearest):
    """Nearest points of the edges a b and c d, and the frame with n from the second towards the first."""
    u0, u1, u2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    v0, v1, v2 = d[0] - c[0], d[1] - c[1], d[2] - c[2]
    w0, w1, w2 = a[0] - c[0], a[1] - c[1], a[2] - c[2]
    uu, vv = u0 * u0 + u1 * u1 + u2 * u2, v0 * v0 + v1 * v1 + v2 * v2
    uv = u0 * v0 + u1 * v1 + u2 * v2
    uw, vw = u0 * w0 + u1 * w1 + u2 * w2, v0 * w0 + v1 * w1 + v2 * w2
    det = uu * vv - uv * uv
    s = min(max((uv * vw - vv * uw) / det, 0.0), 1.0)
    t = min(max((uu * vw - uv * uw) / det, 0.0), 1.0)
    length = np.sqrt(uu)
    f[0, 0], f[0, 1], f[0, 2] = -axis[0], -axis[1], -axis[2]
    f[1, 0], f[1, 1], f[1, 2] = u0 / length, u1 / length, u2 / length
    f[2, 0] = f[0, 1] * f[1, 2] - f[0, 2] * f[1, 1]
    f[2, 1] = f[0, 2] * f[1, 0] - f[0, 0] * f[1, 2]
    f[2, 2] = f[0, 0] * f[1, 1] - f[0, 1] * f[1, 0]
    nearest[0, 0], nearest[0, 1], nearest[0, 2] = a[0] + s * u0, a[1] + s * u1, a[2] + s * u2
    nearest[1, 0], nearest[1, 1], nearest[1, 2] = c[0] + t * v0, c[1] + t * v1, c[2] + t * v2
