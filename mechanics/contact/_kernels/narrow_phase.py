"""Narrow phase: the best separating axis of two convex polyhedra, and their contact points."""

from typing import NamedTuple

import numpy as np
from numba import njit

from mechanics.arrays import Array, Bools, Ints
from mechanics.contact._kernels.cells import cell_points, corner_points, face_grid
from mechanics.contact._kernels.vectors import (
    along,
    cross,
    dot,
    minus,
    norm,
    over,
    row,
    write_frame,
    write_row,
)

# Contact points are named by numbers below 2²⁷ within a pair of shapes: the kind of the pair, what the point is (a
# corner of the incident face, a cut by a side of the reference face, a point inside, or the centroid or a corner
# beside points inside), and a corner of one shape with a face of the other, or two edges. Shapes have at most a third
# as many faces as corners of faces, half as many edges.
NAME_BITS = 27
_KIND_BIT, _WHAT_BIT = 25, 23
MAX_CORNERS = 5000  # corners over all faces of a shape: 5000 · 5000 / 3 < 2²³
# kinds of pairs: apart, or in touch at a face of the first shape, a face of the second, or two edges
SEPARATED, FACE_FIRST, FACE_SECOND, EDGES = 0, 1, 2, 3
# margin, relative to the size of the smaller shape, by which the second shape's face or two edges must separate better
# than the first shape's face to be preferred, so that the choice between equally good features does not flicker
_PREFERENCE = 1e-3
SAME_PLANE = 1.0 - 5e-13  # cosine of 10⁻⁶ rad: two faces at a smaller angle are one plane
_PARALLEL = 0.999999  # cosine of the angle below which edges need no test
# distance from a side, relative to the size of the smaller shape, within which a corner is on it, so that faces that
# end together clip cleanly
_ON_SIDE = 1e-7
_EQUAL = 1.0 - 1e-6  # of faces of equal area but for rounding, the first counts [-]
_LEAST_SHARE = 0.1  # smallest area of a contact point, relative to an even share of the overlap
# distance by which the edge of an overlap may recede where a corner is left out, relative to twice its smaller radius
# of gyration, which is the radius of a disk and 1.15 of half the width of a rectangle: stones then tip within 1 % of
# their limit
_RECEDES = 5e-3


class Polyhedra(NamedTuple):
    """Convex polyhedra in flat arrays, in the axes of their bodies or of the world.

    Shape s owns the vertices vptr[s]:vptr[s+1], the faces fptr[s]:fptr[s+1] and the edges eptr[s]:eptr[s+1].

    Attributes
    ----------
    vptr : (ns+1,) int64
    vertex : (nv, 3) float64, from the body's centre of mass in body axes, or its place in world axes [m]
    fptr : (ns+1,) int64
    cptr : (nf+1,) int64; face f has the corners corner[cptr[f]:cptr[f+1]], counter-clockwise seen from outside
    corner : (nc,) int64, indices into all vertices
    normal : (nf, 3) float64, outward unit vectors [-]
    eptr : (ns+1,) int64
    edge_a, edge_b : (ne,) int64, first and last vertex of each edge
    edge_face : (ne, 2) int64, faces of each edge, which runs along the normal of the second × that of the first
    inside : (ns, 3) float64, mean of the vertices of each shape [m]
    size : (ns,) float64, smallest width of each shape [m]
    face_area : (nf,) float64 [m²]
    """

    vptr: Ints
    vertex: Array
    fptr: Ints
    cptr: Ints
    corner: Ints
    normal: Array
    eptr: Ints
    edge_a: Ints
    edge_b: Ints
    edge_face: Ints
    inside: Array
    size: Array
    face_area: Array


class Pairs(NamedTuple):
    """Pairs of shapes, and the features at which they touch.

    Attributes
    ----------
    shapes : (np, 2) int64
    limit : (np,) float64, gap up to which a pair is watched [m]
    balls : (np,) bool, pairs with a ball, which have no separating axis
    kind : (np,) int64, SEPARATED, FACE_FIRST, FACE_SECOND or EDGES
    feature : (np, 2) int64, reference and incident face, or the edge of each shape
    axis : (np, 3) float64, unit axis from the first towards the second shape [-]
    """

    shapes: Ints
    limit: Array
    balls: Bools
    kind: Ints
    feature: Ints
    axis: Array


class Polygon(NamedTuple):
    """Buffer for the corners of a polygon in the frame of a face.

    Attributes
    ----------
    x, y : (n,) float64, coordinates in the plane of the face [m]
    z : (n,) float64, height above it [m]
    label : (n,) int64, unique within the polygon
    """

    x: Array
    y: Array
    z: Array
    label: Ints


class _Moments(NamedTuple):
    """Area [m²], centroid [m] and central second moments over the area [m²] of a polygon."""

    area: float
    x: float
    y: float
    xx: float
    xy: float
    yy: float


@njit(cache=True)
def _face_gap(f, other, shapes):
    """Return the separation of another shape from face f [m]."""
    n, nearest = row(shapes.normal, f), np.inf
    for v in range(shapes.vptr[other], shapes.vptr[other + 1]):
        nearest = min(nearest, dot(n, row(shapes.vertex, v)))
    return nearest - dot(n, row(shapes.vertex, shapes.corner[shapes.cptr[f]]))


@njit(cache=True)
def _deepest_face(s, other, limit, shapes):
    """Return the largest gap of a face of shape s to another shape [m], and the face; the first beyond `limit`."""
    best, face = -np.inf, -1
    for f in range(shapes.fptr[s], shapes.fptr[s + 1]):
        gap = _face_gap(f, other, shapes)
        if gap > best:
            best, face = gap, f
            if best > limit:
                break
    return best, face


@njit(cache=True)
def _opposite_face(s, n, shapes):
    """Return the face of shape s most opposed to a direction."""
    lowest, face = np.inf, -1
    for f in range(shapes.fptr[s], shapes.fptr[s + 1]):
        d = dot(row(shapes.normal, f), n)
        if d < lowest:
            lowest, face = d, f
    return face


@njit(cache=True)
def _deepest_edges(i, j, floor, shapes):
    """Return the gap [m], edges and axis of the two edges whose common normal separates the shapes most.

    Edges that do not separate by more than `floor` give -1. Two edges can only be nearest if the arcs between the
    normals of their faces cross on the Gauss sphere (Gregorius 2013).
    """
    best, first, second, axis = floor, -1, -1, (0.0, 0.0, 0.0)
    inside = row(shapes.inside, i)
    for e in range(shapes.eptr[i], shapes.eptr[i + 1]):
        a, b = row(shapes.normal, shapes.edge_face[e, 0]), row(shapes.normal, shapes.edge_face[e, 1])
        o = row(shapes.vertex, shapes.edge_a[e])
        p = minus(row(shapes.vertex, shapes.edge_b[e]), o)
        for f in range(shapes.eptr[j], shapes.eptr[j + 1]):
            # the second shape's normals count reversed
            cba = -dot(row(shapes.normal, shapes.edge_face[f, 0]), p)
            dba = -dot(row(shapes.normal, shapes.edge_face[f, 1]), p)
            if cba * dba >= 0.0:
                continue
            s = row(shapes.vertex, shapes.edge_a[f])
            q = minus(row(shapes.vertex, shapes.edge_b[f]), s)
            adc, bdc = dot(a, q), dot(b, q)
            if adc * bdc >= 0.0 or cba * bdc <= 0.0:
                continue
            n = cross(p, q)
            length = norm(n)
            if length < 1e-3 * np.sqrt(dot(p, p) * dot(q, q)):
                continue
            if dot(n, minus(o, inside)) < 0.0:
                length = -length
            n = over(n, length)
            apart = dot(n, minus(s, o))
            if apart > best:
                best, first, second, axis = apart, e, f, n
    return best, first, second, axis


@njit(cache=True, nogil=True)
def separating_axes(pair, limit, hint, plane, shapes):  # pragma: no cover - compiled
    """Find the best separating axis of each pair of convex polyhedra (separating-axis theorem).

    Inputs
    ------
    pair : (np, 2) int64, shapes
    limit : (np,) float64, gap beyond which a pair is apart [m]
    hint : (np,) int64, the face that separated the pair before, or -1; it is tried first, and updated
    plane : float64, cosine of the angle within which two faces count as one plane [-]
    shapes : Polyhedra

    Outputs
    -------
    kind, feature, axis : as in `Pairs`; SEPARATED where the gap exceeds `limit`
    """
    count = pair.shape[0]
    kind = np.zeros(count, dtype=np.int64)
    feature = np.zeros((count, 2), dtype=np.int64)
    axis = np.zeros((count, 3))
    for p in range(count):
        i, j, far = pair[p, 0], pair[p, 1], limit[p]
        known = hint[p]
        if known >= 0:
            other = j if shapes.fptr[i] <= known < shapes.fptr[i + 1] else i
            if _face_gap(known, other, shapes) > far:
                continue
        hint[p] = -1
        gap_i, face_i = _deepest_face(i, j, far, shapes)
        if gap_i > far:
            hint[p] = face_i
            continue
        gap_j, face_j = _deepest_face(j, i, far, shapes)
        if gap_j > far:
            hint[p] = face_j
            continue
        small = min(shapes.size[i], shapes.size[j])
        alike = -dot(row(shapes.normal, face_i), row(shapes.normal, face_j))
        # where the choice makes no difference the first face, so that it does not flicker; otherwise the better one, so
        # that nothing depends on the order of the stones
        use_i = gap_i >= gap_j - (_PREFERENCE * small if alike > plane else 0.0)
        face, other = (face_i, j) if use_i else (face_j, i)
        n = row(shapes.normal, face)
        incident = _opposite_face(other, n, shapes)
        sign = 1.0 if use_i else -1.0
        kind[p] = FACE_FIRST if use_i else FACE_SECOND
        feature[p, 0], feature[p, 1] = face, incident
        axis[p, 0], axis[p, 1], axis[p, 2] = sign * n[0], sign * n[1], sign * n[2]
        if -dot(row(shapes.normal, incident), n) > _PARALLEL:
            continue
        floor = (gap_i if use_i else gap_j) + _PREFERENCE * small
        edge_gap, first, second, edge_axis = _deepest_edges(i, j, floor, shapes)
        if first >= 0 and edge_gap > far:
            kind[p] = SEPARATED
        elif first >= 0:
            kind[p] = EDGES
            feature[p, 0], feature[p, 1] = first, second
            write_row(axis, p, edge_axis)
    return kind, feature, axis


@njit(cache=True)
def clip(polygon, count, a, b, side, slack, kept):  # pragma: no cover - compiled
    """Keep what lies left of a → b of a convex polygon, in place (Sutherland & Hodgman 1974); return its corners.

    A point is named after the edge that begins in it: the polygon's own edge, or the side that was cut along; no two
    points get the same label. Clipping a convex polygon adds one corner at most.

    Inputs
    ------
    polygon : Polygon, of which the first `count` corners are used; z is carried along
    a, b : two float64 each, ends of the side in the plane [m]
    side : int64, label of the side, none of the polygon's own
    slack : float64, distance from the line within which a corner is on it [m]
    kept : Polygon, scratch
    """
    x, y, z, label = polygon
    kx, ky, kz, kl = kept
    k = 0
    length = np.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2)
    if length == 0.0:
        # two corners of a face that are one in the plane have no side between them
        return count
    ux, uy = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    for p in range(count):
        q = p + 1 if p + 1 < count else 0
        dp = uy * (x[p] - a[0]) - ux * (y[p] - a[1])
        dq = uy * (x[q] - a[0]) - ux * (y[q] - a[1])
        inside, next_inside = dp <= slack, dq <= slack
        # rounding that makes a polygon not quite convex must not write beyond its room
        if inside and k < kx.shape[0]:
            kx[k], ky[k], kz[k], kl[k] = x[p], y[p], z[p], label[p]
            k += 1
        leaves, enters = inside and not next_inside, next_inside and not inside
        if ((leaves and dp < -slack) or (enters and dq < -slack)) and k < kx.shape[0]:
            t = dp / (dp - dq)
            kx[k], ky[k] = x[p] + t * (x[q] - x[p]), y[p] + t * (y[q] - y[p])
            kz[k] = z[p] + t * (z[q] - z[p])
            kl[k] = side if leaves else label[p]
            k += 1
        elif leaves and k > 0:
            # the corner lies on the side: what follows it is the side
            kl[k - 1] = side
    for p in range(k):
        x[p], y[p], z[p], label[p] = kx[p], ky[p], kz[p], kl[p]
    return k


@njit(cache=True)
def _moments(x, y, count):
    """Return the moments of a convex polygon."""
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
        return _Moments(0.0, x[0], y[0], 0.0, 0.0, 0.0)
    mx, my = sx / area, sy / area
    return _Moments(
        abs(area),
        x[0] + mx,
        y[0] + my,
        abs(sxx / area - mx * mx),
        sxy / area - mx * my,
        abs(syy / area - my * my),
    )


@njit(cache=True)
def point_areas(x, y, count, area, mx, my, out):  # pragma: no cover - compiled
    """Share out an area over points, as evenly as its centroid (mx, my) allows.

    Where a share would be less than a tenth of an even one, all are drawn towards even ones until it is that much; so
    no point is left without area, and the shares do not jump when the overlap changes.

    Inputs
    ------
    x, y : (≥ count,) float64, points [m]
    count : int64
    area, mx, my : float64, area [m²] and its centroid [m]
    out : (≥ count,) float64, to which the shares are written; they add up to the area [m²]
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
def _cut_off(x, y, a, b, c):
    """Return twice the area of the triangle of three points."""
    return abs((x[b] - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (y[b] - y[a]))


@njit(cache=True)
def _recess(x, y, count, a, c):
    """Return the largest distance of the corners between a and c from the line through both [m]."""
    ux, uy = x[c] - x[a], y[c] - y[a]
    length = np.sqrt(ux * ux + uy * uy)
    far, p = 0.0, a
    while True:
        p = p + 1 if p + 1 < count else 0
        if p == c:
            return far
        dx, dy = x[p] - x[a], y[p] - y[a]
        far = max(far, abs(ux * dy - uy * dx) / length if length > 0.0 else np.sqrt(dx * dx + dy * dy))


@njit(cache=True)
def spread(x, y, count, wanted, recess, chosen):  # pragma: no cover - compiled
    """Choose `wanted` corners of a convex polygon, or more where these would not describe its edge; return how many.

    Corners are left out one by one. A corner cuts off the triangle with its two neighbours (Visvalingam & Whyatt
    1993); the one that cuts off least goes first, so points on an edge go before corners, unless some corner left out
    would lie farther than `recess` from the edge that remains.

    Inputs
    ------
    x, y : (≥ count,) float64, corners in order [m]
    count, wanted : int64
    recess : float64 [m]
    chosen : (≥ count,) int64, to which the corners are written, in order
    """
    for p in range(count):
        chosen[p] = p
    kept = count
    while kept > wanted:
        out, least = -1, np.inf
        for p in range(kept):
            a, b, c = chosen[p - 1 if p else kept - 1], chosen[p], chosen[p + 1 if p + 1 < kept else 0]
            area = _cut_off(x, y, a, b, c)
            # of corners that cut off the same the first goes, whatever the rounding
            if area < least * (1.0 - 1e-6) and _recess(x, y, count, a, c) <= recess:
                out, least = p, area
        if out < 0:
            break
        for p in range(out, kept - 1):
            chosen[p] = chosen[p + 1]
        kept -= 1
    return kept


@njit(cache=True)
def _inner_points(points, m, x, y):
    """Write points of equal shares that carry centroid and second moments.

    They are the square root of the moments, applied to a regular polygon whose own moments are one.
    """
    if points == 1:
        x[0], y[0] = m.x, m.y
        return
    # square root of a symmetric 2 × 2 matrix: (S + √det) / √(trace + 2 √det)
    root = np.sqrt(max(m.xx * m.yy - m.xy * m.xy, 0.0))
    scale = np.sqrt(2.0) / np.sqrt(max(m.xx + m.yy + 2.0 * root, 1e-300))
    for p in range(points):
        angle = 2.0 * np.pi * (p + 0.5) / points
        u, v = scale * np.cos(angle), scale * np.sin(angle)
        x[p], y[p] = m.x + (m.xx + root) * u + m.xy * v, m.y + m.xy * u + (m.yy + root) * v


@njit(cache=True)
def _share_with_middle(x, y, count, m, share):
    """Take from the shares of points what a further one at the centroid has, so that all carry the second moments."""
    carried = 0.0
    for p in range(count):
        carried += share[p] * ((x[p] - m.x) ** 2 + (y[p] - m.y) ** 2)
    part = min(m.area * (m.xx + m.yy) / carried, 1.0) if carried > 0.0 else 1.0
    for p in range(count):
        share[p] *= part
    share[count] = (1.0 - part) * m.area


@njit(cache=True)
def _gyration(m):
    """Return the smaller radius of gyration of a polygon [m]."""
    mean, half = 0.5 * (m.xx + m.yy), 0.5 * (m.xx - m.yy)
    return np.sqrt(max(mean - np.sqrt(half * half + m.xy * m.xy), 0.0))


@njit(cache=True)
def _nearest_points(polygon, count, limit, points, recess, chosen):
    """Keep the points within `limit` of the reference face that `spread` chooses, in place; return how many.

    Of a single point the lowest is kept.
    """
    x, y, z, label = polygon
    k = np.int64(0)  # of no literal type
    for q in range(count):
        if z[q] <= limit:
            x[k], y[k], z[k], label[k] = x[q], y[q], z[q], label[q]
            k += 1
    if k <= points:
        return k
    if points == 1:
        kept, chosen[0] = 1, 0
        for q in range(k):
            if z[q] < z[chosen[0]]:
                chosen[0] = q
    else:
        kept = spread(x, y, k, points, recess, chosen)
    for q in range(kept):
        c = chosen[q]
        x[q], y[q], z[q], label[q] = x[c], y[c], z[c], label[c]
    return kept


@njit(cache=True)
def _polygon_of(size):
    return Polygon(np.empty(size), np.empty(size), np.empty(size), np.empty(size, np.int64))


@njit(cache=True)
def _grid_face(first, second, face_area):
    """Return which of two faces, of the first and of the second shape, carries the cells: the smaller one."""
    return second if face_area[second] < _EQUAL * face_area[first] else first


@njit(cache=True)
def _room_needed(pairs, points, spacing, flat, shapes):
    """Return the most corners of an overlap, and of all overlaps and pairs of edges together; -1 for too many cells."""
    kind, feature, cptr = pairs.kind, pairs.feature, shapes.cptr
    largest, total = max(points, 1), 0
    for p in range(kind.shape[0]):
        if kind[p] == EDGES:
            total += 1
        elif kind[p] != SEPARATED:
            # clipping one convex polygon by another gives at most the sum of both; there may be a point in the middle
            corners = max(points, 1) + 1
            for f in feature[p]:
                corners += cptr[f + 1] - cptr[f]
            one, other = feature[p, 0], feature[p, 1]
            if spacing > 0.0 and -dot(row(shapes.normal, one), row(shapes.normal, other)) > flat:
                if kind[p] != FACE_FIRST:
                    one, other = other, one
                face = _grid_face(one, other, shapes.face_area)
                _, _, _, n1, n2, _, _ = face_grid(
                    face, spacing, shapes.vertex, cptr, shapes.corner, shapes.normal
                )
                faces = 0
                for s in pairs.shapes[p]:
                    faces = max(faces, shapes.fptr[s + 1] - shapes.fptr[s])
                if 9.0 * n1 * n2 * faces * corners >= 1 << _WHAT_BIT:
                    return -1, -1
                corners += n1 * n2
            largest, total = max(largest, corners), total + corners
    return largest, total


@njit(cache=True, nogil=True)
def interface_points(
    pairs, points, inner, middle, spacing, flat, thin, shapes
):  # pragma: no cover - compiled
    """Find the contact points of each pair in touch: corners of the overlap of two faces, or the feet of two edges.

    Inputs
    ------
    pairs : Pairs
    points : int64, number of points of two faces, more where its edge needs more (`spread`); with one, the centroid of
        the overlap
    inner : bool, points of flat faces lie inside, where they carry the area's second moments
    middle : bool, flat faces have a further point at the centroid, so that springs in all points bend like the area
    spacing : float64, flat faces have a point in each cell, of this width or less, of a grid on the smaller one, and at
        the corners of the overlap; zero: at corners or inside [m]
    flat : float64, cosine of the angle within which faces lie flat on one another [-]
    thin : float64, flat faces that overlap by less than this part of the smaller one do not touch [-]
    shapes : Polyhedra

    Outputs
    -------
    place : (nc, 3) int64, pair, candidate (0 or 1 of the pair), name that is unique within the pair, below 2²⁷
    frame : (nc, 3, 3) float64, rows n, t1, t2 [-]
    nearest : (nc, 2, 3) float64, points on candidate and antagonist [m]
    area : (nc,) float64 [m²]

    Raises
    ------
    ValueError : cells of a face that are too many to be named
    """
    largest, most = _room_needed(pairs, points, spacing, flat, shapes)
    if most < 0:
        raise ValueError("too many cells")
    place = np.empty((most, 3), dtype=np.int64)
    frame, nearest, area = np.empty((most, 3, 3)), np.empty((2 * most, 3)), np.empty(most)
    polygon, kept = _polygon_of(largest), _polygon_of(largest)
    x, y, z, label = polygon
    share, chosen = np.empty(largest), np.empty(largest, dtype=np.int64)
    taker = np.empty(largest, dtype=np.int64)
    rings = np.empty((5, largest + 4 if spacing > 0.0 else 0, 4))
    # unpacked once: in the loop the compiler would count references
    pair, limit, _, kind, feature, axis = pairs
    _, vertex, fptr, cptr, corner, normal, eptr, edge_a, edge_b, _, _, size, face_area = shapes
    count = 0
    for p in range(pair.shape[0]):
        if kind[p] == SEPARATED:
            continue
        i, j, f = pair[p, 0], pair[p, 1], frame[count]
        base = kind[p] << _KIND_BIT
        reference, incident = feature[p, 0], feature[p, 1]
        if kind[p] == EDGES:
            a, b = row(vertex, edge_a[reference]), row(vertex, edge_b[reference])
            c, d = row(vertex, edge_a[incident]), row(vertex, edge_b[incident])
            first_foot, second_foot = _edge_feet(a, b, c, d, row(axis, p), f)
            write_row(nearest, 2 * count, first_foot)
            write_row(nearest, 2 * count + 1, second_foot)
            place[count, 0], place[count, 1] = p, 0
            place[count, 2] = base + (reference - eptr[i]) * (eptr[j + 1] - eptr[j]) + incident - eptr[j]
            area[count] = 0.0
            count += 1
            continue
        owner, other = (i, j) if kind[p] == FACE_FIRST else (j, i)
        start, stop = cptr[reference], cptr[reference + 1]
        o, n, g = row(vertex, corner[start]), row(normal, reference), row(normal, incident)
        edge = minus(row(vertex, corner[start + 1]), o)
        # t1 runs along the first edge, so that the frame turns with the stone
        write_frame(f, n, along(edge, -dot(edge, n), n))
        t1, t2 = row(f, 1), row(f, 2)
        k = np.int64(0)  # of no literal type, for each of which numba would compile the callees once more
        # seen along the normal the incident face runs clockwise
        for v in range(cptr[incident + 1] - 1, cptr[incident] - 1, -1):
            arm = minus(row(vertex, corner[v]), o)
            x[k], y[k], z[k], label[k] = dot(t1, arm), dot(t2, arm), dot(n, arm), v
            k += 1
        slack, end = _ON_SIDE * min(size[i], size[j]), (0.0, 0.0)
        for v in range(start, stop):
            begin, arm = end, minus(row(vertex, corner[v + 1 if v + 1 < stop else start]), o)
            end = dot(t1, arm), dot(t2, arm)
            k = clip(polygon, k, begin, end, -1 - v, slack, kept)
            if k == 0:
                break
        if k == 0:
            continue
        m, lies_flat = _moments(x, y, k), -dot(g, n) > flat
        if lies_flat and m.area < thin * min(face_area[reference], face_area[incident]):
            continue
        near, numbered, whole = 0, 0, False  # points that are named by numbers come first
        for q in range(k):
            if z[q] <= limit[p]:
                near += 1
        if spacing > 0.0 and lies_flat and near > 0:
            gx, gy = _slope(f, g)
            height = z[0] - gx * x[0] - gy * y[0]
            first, second = (reference, incident) if owner == i else (incident, reference)
            face = _grid_face(first, second, face_area)
            origin, e1, e2, n1, n2, p1, p2 = face_grid(face, spacing, vertex, cptr, corner, normal)
            away = minus(o, origin)
            for q in range(k):
                arm = along(along(along(away, x[q], t1), y[q], t2), z[q], n)
                rings[0, q, 0], rings[0, q, 1], rings[0, q, 2], rings[0, q, 3] = (
                    dot(e1, arm),
                    dot(e2, arm),
                    x[q],
                    y[q],
                )
            corners = spread(x, y, k, max(points, 3), 2.0 * _RECEDES * _gyration(m), chosen)
            for q in range(corners):
                kept.x[q], kept.y[q] = x[chosen[q]], y[chosen[q]]
            cells = x, y, label, share
            numbered = cell_points(rings[0], k, (n1, n2, p1, p2), rings[1:], cells, taker)
            for q in range(corners):
                taker[q] = taker[chosen[q]]
            k = corner_points(kept.x, kept.y, taker[:corners], numbered, 9 * n1 * n2, cells)
            for q in range(k):
                z[q] = height + gx * x[q] + gy * y[q]
        elif (inner or points == 1) and lies_flat and near == k:
            gx, gy = _slope(f, g)
            height = z[0] - gx * x[0] - gy * y[0]
            _inner_points(points, m, x, y)
            k, numbered = points, points
            for q in range(k):
                z[q], label[q], share[q] = height + gx * x[q] + gy * y[q], q, m.area / k
        elif near == 0:
            continue
        else:
            whole, level = middle and lies_flat and near == k, 0.0
            if whole:
                gx, gy = _slope(f, g)
                level = z[0] + gx * (m.x - x[0]) + gy * (m.y - y[0])
            k = _nearest_points(polygon, k, limit[p], points, 2.0 * _RECEDES * _gyration(m), chosen)
            point_areas(x, y, k, m.area, m.x, m.y, share)
            if whole:
                _share_with_middle(x, y, k, m, share)
                x[k], y[k], z[k], label[k] = m.x, m.y, level, 0
                k += 1
        face, facing = reference - fptr[owner], incident - fptr[other]
        faces, opposed = fptr[owner + 1] - fptr[owner], fptr[other + 1] - fptr[other]
        for q in range(k):
            for d in range(3):
                write_row(frame[count], d, row(f, d))
            foot = along(along(o, x[q], t1), y[q], t2)
            write_row(nearest, 2 * count, along(foot, z[q], n))
            write_row(nearest, 2 * count + 1, foot)
            place[count, 0], place[count, 1] = p, 1 if owner == i else 0
            if q < numbered:
                name = (2 << _WHAT_BIT) + label[q] * faces + face
            elif numbered or (whole and q == k - 1):
                name = (3 << _WHAT_BIT) + label[q] * faces + face
            elif label[q] >= 0:
                name = (label[q] - cptr[fptr[other]]) * faces + face
            else:
                name = (1 << _WHAT_BIT) + (-1 - label[q] - cptr[fptr[owner]]) * opposed + facing
            place[count, 2] = base + name
            area[count] = share[q]
            count += 1
    return place[:count], frame[:count], nearest[: 2 * count].reshape(count, 2, 3), area[:count]


@njit(cache=True)
def _slope(frame, g):
    """Return the rise of a plane with normal g along the second and third row of a frame, measured along the first."""
    g0, g1, g2 = dot(row(frame, 0), g), dot(row(frame, 1), g), dot(row(frame, 2), g)
    return -g1 / g0, -g2 / g0


@njit(cache=True)
def _edge_feet(a, b, c, d, axis, frame):
    """Return the nearest points of the edges a b and c d; write the frame with n from the second towards the first."""
    u, v, w = minus(b, a), minus(d, c), minus(a, c)
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    uw, vw = dot(u, w), dot(v, w)
    det = uu * vv - uv * uv
    s = min(max((uv * vw - vv * uw) / det, 0.0), 1.0)
    t = min(max((uu * vw - uv * uw) / det, 0.0), 1.0)
    write_frame(frame, (-axis[0], -axis[1], -axis[2]), u)
    return along(a, s, u), along(c, t, v)
