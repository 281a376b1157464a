"""Numba kernels of contact detection between convex polyhedra.

Polyhedra are flat arrays: body b owns vertices `vptr[b]:vptr[b+1]` and faces `fptr[b]:fptr[b+1]`; face f has
the corners `corner[cptr[f]:cptr[f+1]]` (indices into all vertices), counter-clockwise seen from outside.
"""

import numpy as np
from numba import njit

__all__ = ["clip_polygon", "close_pairs", "face_points", "mortar_integrals", "separating_axes"]

# a face has at most MAX_CORNERS corners; clipping one convex polygon by another gives at most the sum of both
MAX_CORNERS = 16
MAX_POINTS = 2 * MAX_CORNERS
SEPARATED, FACE_FIRST, FACE_SECOND, EDGES = 0, 1, 2, 3


@njit(cache=True)
def close_pairs(low, high, fixed):  # pragma: no cover - compiled
    """Pairs (np, 2) of boxes that overlap, not both fixed, by a sweep along the longest axis."""
    nb = low.shape[0]
    extent = np.empty(3)
    for k in range(3):
        extent[k] = high[:, k].max() - low[:, k].min()
    axis = np.argmax(extent)
    order = np.argsort(low[:, axis], kind="mergesort")
    pairs = np.empty((8 * nb + 8, 2), dtype=np.int64)
    count = 0
    for a in range(nb):
        i = order[a]
        for b in range(a + 1, nb):
            j = order[b]
            if low[j, axis] > high[i, axis]:
                break
            if fixed[i] and fixed[j]:
                continue
            apart = False
            for k in range(3):
                if low[j, k] > high[i, k] or low[i, k] > high[j, k]:
                    apart = True
                    break
            if apart:
                continue
            if count == pairs.shape[0]:
                grown = np.empty((2 * count, 2), dtype=np.int64)
                grown[:count] = pairs
                pairs = grown
            pairs[count, 0], pairs[count, 1] = min(i, j), max(i, j)
            count += 1
    return pairs[:count]


@njit(cache=True)
def _deepest_face(b, o, fptr, cptr, corner, vptr, vertices, normals):
    """The face of body b that keeps body o farthest away, and that distance."""
    best, face = -np.inf, -1
    for f in range(fptr[b], fptr[b + 1]):
        n = normals[f]
        origin = vertices[corner[cptr[f]]]
        nearest = np.inf
        for v in range(vptr[o], vptr[o + 1]):
            d = (
                n[0] * (vertices[v, 0] - origin[0])
                + n[1] * (vertices[v, 1] - origin[1])
                + n[2] * (vertices[v, 2] - origin[2])
            )
            if d < nearest:
                nearest = d
        if nearest > best:
            best, face = nearest, f
    return best, face


@njit(cache=True)
def _opposite_face(b, n, fptr, normals):
    """The face of body b that looks most against direction n."""
    lowest, face = np.inf, -1
    for f in range(fptr[b], fptr[b + 1]):
        d = normals[f, 0] * n[0] + normals[f, 1] * n[1] + normals[f, 2] * n[2]
        if d < lowest:
            lowest, face = d, f
    return face


@njit(cache=True)
def _support(b, n, sign, vptr, vertices):
    """Largest value of sign · n·x over the corners of body b."""
    best = -np.inf
    for v in range(vptr[b], vptr[b + 1]):
        d = sign * (n[0] * vertices[v, 0] + n[1] * vertices[v, 1] + n[2] * vertices[v, 2])
        if d > best:
            best = d
    return best


@njit(cache=True)
def _deepest_edges(i, j, floor, eptr, edge_a, edge_b, vptr, vertices, centres):
    """The pair of edges whose common normal separates the bodies most, if by more than `floor`."""
    best, first, second = floor, -1, -1
    axis = np.zeros(3)
    toward = centres[j] - centres[i]
    for e in range(eptr[i], eptr[i + 1]):
        p = vertices[edge_b[e]] - vertices[edge_a[e]]
        for f in range(eptr[j], eptr[j + 1]):
            q = vertices[edge_b[f]] - vertices[edge_a[f]]
            n = np.array([p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]])
            length = np.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
            if length < 1e-3 * np.sqrt((p @ p) * (q @ q)):
                continue
            n /= length
            if n @ toward < 0.0:
                n = -n
            # only edges that are extreme along n can touch
            top_i, top_j = _support(i, n, 1.0, vptr, vertices), -_support(j, n, -1.0, vptr, vertices)
            apart = top_j - top_i
            if apart <= best:
                continue
            slack = 1e-9 * (np.sqrt(p @ p) + np.sqrt(q @ q))
            if abs(n @ vertices[edge_a[e]] - top_i) < slack and abs(n @ vertices[edge_a[f]] - top_j) < slack:
                best, first, second = apart, e, f
                axis[:] = n
    return best, first, second, axis


@njit(cache=True)
def separating_axes(
    pairs, alert, vptr, vertices, fptr, cptr, corner, normals, eptr, edge_a, edge_b, centres, size
):  # pragma: no cover - compiled
    """The best separating axis of each pair of convex polyhedra (separating-axis theorem).

    Returns
    -------
    kind : (np,) 0 apart by more than `alert`; 1, 2 a face of the first, second body; 3 two edges
    feature : (np, 2) reference and incident face, or the two edges
    axis : (np, 3) unit axis, from the first towards the second body
    """
    count = pairs.shape[0]
    kind = np.zeros(count, dtype=np.int64)
    feature = np.zeros((count, 2), dtype=np.int64)
    axis = np.zeros((count, 3))
    for p in range(count):
        i, j = pairs[p]
        limit = alert[p]
        gap_i, face_i = _deepest_face(i, j, fptr, cptr, corner, vptr, vertices, normals)
        if gap_i > limit:
            continue
        gap_j, face_j = _deepest_face(j, i, fptr, cptr, corner, vptr, vertices, normals)
        if gap_j > limit:
            continue
        small = min(size[i], size[j])
        # two faces that are equally good: keep the first body's, so that the choice does not flicker
        use_i = gap_i >= gap_j - 1e-6 * small
        face_gap = gap_i if use_i else gap_j
        n = normals[face_i] if use_i else -normals[face_j]
        incident = _opposite_face(j, n, fptr, normals) if use_i else _opposite_face(i, -n, fptr, normals)
        parallel = -(normals[incident] @ (n if use_i else -n)) > 0.999999
        kind[p] = FACE_FIRST if use_i else FACE_SECOND
        feature[p, 0], feature[p, 1] = (face_i, incident) if use_i else (face_j, incident)
        axis[p] = n
        if parallel:
            continue
        floor = face_gap + 1e-3 * small
        edge_gap, first, second, edge_axis = _deepest_edges(
            i, j, floor, eptr, edge_a, edge_b, vptr, vertices, centres
        )
        if edge_gap > limit:
            kind[p] = SEPARATED
        elif first >= 0:
            kind[p] = EDGES
            feature[p, 0], feature[p, 1] = first, second
            axis[p] = edge_axis
    return kind, feature, axis


@njit(cache=True)
def clip_polygon(polygon, label, count, origin, normal, side):  # pragma: no cover - compiled
    """Keep the part of a polygon (MAX_POINTS, 3) where normal·(x - origin) ≤ 0 (Sutherland & Hodgman 1974), in place.

    `label` names each point after the edge that begins in it: the polygon's own edge, or MAX_CORNERS + the side that
    was cut along.
    A convex polygon has no two corners where the same edge begins.
    """
    kept = np.empty_like(polygon)
    kept_label = np.empty_like(label)
    k = 0
    for a in range(count):
        b = (a + 1) % count
        da = (
            normal[0] * (polygon[a, 0] - origin[0])
            + normal[1] * (polygon[a, 1] - origin[1])
            + normal[2] * (polygon[a, 2] - origin[2])
        )
        db = (
            normal[0] * (polygon[b, 0] - origin[0])
            + normal[1] * (polygon[b, 1] - origin[1])
            + normal[2] * (polygon[b, 2] - origin[2])
        )
        if da <= 0.0 and k < MAX_POINTS:
            kept[k] = polygon[a]
            kept_label[k] = label[a]
            k += 1
        if (da < 0.0 < db or db < 0.0 < da) and k < MAX_POINTS:
            t = da / (da - db)
            kept[k] = polygon[a] + t * (polygon[b] - polygon[a])
            kept_label[k] = MAX_CORNERS + side if da < 0.0 else label[a]
            k += 1
    polygon[:k] = kept[:k]
    label[:k] = kept_label[:k]
    return k


@njit(cache=True)
def _point_areas(polygon, count):
    """Tributary area of each corner: half of the two triangles that it spans with the mean point."""
    areas = np.zeros(count)
    centre = np.zeros(3)
    for a in range(count):
        centre += polygon[a] / count
    for a in range(count):
        b = (a + 1) % count
        area = 0.5 * np.linalg.norm(np.cross(polygon[a] - centre, polygon[b] - centre))
        areas[a] += 0.5 * area
        areas[b] += 0.5 * area
    return areas


@njit(cache=True)
def face_points(
    reference, incident, n, cptr, corner, vertices, alert, parallel, thin
):  # pragma: no cover - compiled
    """Clip the incident face by the sides of the reference face, and keep the points nearer than `alert`.

    Returns
    -------
    count : number of points; 0 when `parallel` faces overlap by less than the area `thin`
    polygon : (MAX_POINTS, 3) points on the incident face
    gap : (MAX_POINTS,) distance to the reference plane along n, the reference face's outward normal
    area : (MAX_POINTS,) tributary areas
    label : (MAX_POINTS,) which edge of the overlap begins in the point, as in `clip_polygon`
    """
    polygon, label = np.empty((MAX_POINTS, 3)), np.empty(MAX_POINTS, dtype=np.int64)
    gap, area = np.empty(MAX_POINTS), np.zeros(MAX_POINTS)
    count = 0
    for c in range(cptr[incident], cptr[incident + 1]):
        polygon[count] = vertices[corner[c]]
        label[count] = count
        count += 1
    start, stop = cptr[reference], cptr[reference + 1]
    for c in range(start, stop):
        a = vertices[corner[c]]
        b = vertices[corner[c + 1 if c + 1 < stop else start]]
        count = clip_polygon(polygon, label, count, a, np.cross(b - a, n), c - start)
        if count == 0:
            return 0, polygon, gap, area, label
    origin = vertices[corner[start]]
    areas = _point_areas(polygon, count)
    # blocks that meet at an edge of two parallel faces do not press on one another
    if parallel and areas.sum() < thin:
        return 0, polygon, gap, area, label
    k = 0
    for a in range(count):
        gap[a] = n @ (polygon[a] - origin)
    for a in range(count):
        if gap[a] <= alert:
            polygon[k], gap[k], area[k], label[k] = polygon[a], gap[a], areas[a], label[a]
            k += 1
    return k, polygon, gap, area, label


@njit(cache=True)
def _clip_flat(polygon, count, ax, ay, bx, by):
    """Keep what lies to the left of the line a → b of a plane polygon (MAX_POINTS, 2), in place."""
    kept = np.empty_like(polygon)
    k = 0
    for p in range(count):
        q = (p + 1) % count
        dp = (bx - ax) * (polygon[p, 1] - ay) - (by - ay) * (polygon[p, 0] - ax)
        dq = (bx - ax) * (polygon[q, 1] - ay) - (by - ay) * (polygon[q, 0] - ax)
        if dp >= 0.0 and k < MAX_POINTS:
            kept[k] = polygon[p]
            k += 1
        if (dp > 0.0 > dq or dq > 0.0 > dp) and k < MAX_POINTS:
            kept[k] = polygon[p] + dp / (dp - dq) * (polygon[q] - polygon[p])
            k += 1
    polygon[:k] = kept[:k]
    return k


@njit(cache=True)
def _barycentric(x, y, tri):
    ax, ay = tri[0]
    bx, by = tri[1]
    cx, cy = tri[2]
    det = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    w1 = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / det
    w2 = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / det
    return 1.0 - w1 - w2, w1, w2


@njit(cache=True)
def _counter_clockwise(tri):
    ax, ay = tri[0]
    bx, by = tri[1]
    cx, cy = tri[2]
    if (bx - ax) * (cy - ay) - (cx - ax) * (by - ay) < 0.0:
        return tri[::-1].copy()
    return tri


@njit(cache=True)
def mortar_integrals(xc, tc, xa, ta, outline):  # pragma: no cover - compiled
    """Integrals of the shape functions over the overlap of two triangulated plane faces.

    Parameters
    ----------
    xc, tc : (nc, 2) nodes and (mc, 3) triangles of the candidate face
    xa, ta : (na, 2) nodes and (ma, 3) triangles of the antagonist face; ma = 0 when it is rigid
    outline : (k, 2) convex polygon of a rigid antagonist's face, counter-clockwise; k = 0 when it is deformable

    Returns
    -------
    area : (nc,) ∫ N_i
    own : (nc, nc) ∫ N_i N_k
    other : (nc, na) ∫ N_i N_j of the antagonist
    centre : (nc, 2) ∫ N_i x
    """
    nc, na = xc.shape[0], xa.shape[0]
    area, own, other, centre = np.zeros(nc), np.zeros((nc, nc)), np.zeros((nc, na)), np.zeros((nc, 2))
    polygon = np.empty((MAX_POINTS, 2))
    corners = np.empty((3, 2))
    cutters = max(ta.shape[0], 1)
    for c in range(tc.shape[0]):
        tri_c = np.empty((3, 2))
        for k in range(3):
            tri_c[k] = xc[tc[c, k]]
        lo_x, hi_x = tri_c[:, 0].min(), tri_c[:, 0].max()
        lo_y, hi_y = tri_c[:, 1].min(), tri_c[:, 1].max()
        for a in range(cutters):
            tri_a = np.empty((3, 2))
            if ta.shape[0] > 0:
                for k in range(3):
                    tri_a[k] = xa[ta[a, k]]
                cutter = _counter_clockwise(tri_a)
            else:
                cutter = outline
            if (
                cutter[:, 0].min() >= hi_x
                or cutter[:, 0].max() <= lo_x
                or cutter[:, 1].min() >= hi_y
                or cutter[:, 1].max() <= lo_y
            ):
                continue
            polygon[:3] = tri_c
            count = 3
            for k in range(cutter.shape[0]):
                m = (k + 1) % cutter.shape[0]
                count = _clip_flat(polygon, count, cutter[k, 0], cutter[k, 1], cutter[m, 0], cutter[m, 1])
                if count < 3:
                    break
            for s in range(1, count - 1):
                corners[0], corners[1], corners[2] = polygon[0], polygon[s], polygon[s + 1]
                part = 0.5 * abs(
                    (corners[1, 0] - corners[0, 0]) * (corners[2, 1] - corners[0, 1])
                    - (corners[2, 0] - corners[0, 0]) * (corners[1, 1] - corners[0, 1])
                )
                # the three-point rule is exact for products of linear functions
                for g in range(3):
                    x = (corners.sum(axis=0) + 3.0 * corners[g]) / 6.0
                    w = part / 3.0
                    n_c = _barycentric(x[0], x[1], tri_c)
                    for i in range(3):
                        area[tc[c, i]] += w * n_c[i]
                        centre[tc[c, i]] += w * n_c[i] * x
                        for k in range(3):
                            own[tc[c, i], tc[c, k]] += w * n_c[i] * n_c[k]
                    if ta.shape[0] > 0:
                        n_a = _barycentric(x[0], x[1], tri_a)
                        for i in range(3):
                            for k in range(3):
                                other[tc[c, i], ta[a, k]] += w * n_c[i] * n_a[k]
    return area, own, other, centre
