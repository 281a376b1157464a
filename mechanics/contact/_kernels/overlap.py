"""Numba kernels of the mortar method: integrals over the overlap of two meshed faces of one plane."""

import numpy as np
from numba import njit

from mechanics.contact._kernels.facets import QUADRATURE, corner_count, degree, hats, locate, rule_of, shapes

__all__ = ["flattened", "overlap_area", "overlap_integrals", "room"]

# corners that a facet can have when it is cut by another facet and by the outlines of two faces
_MAX_CUT = 64
# covered up to this part a facet is tested by hats, which stay within the overlap; from that part on by dual functions
_HATS, _DUAL = 0.8, 0.98
# where a joint ends at a node, rounding leaves overlaps of about this part of a facet, of which no pressure can be told
_NOTHING = 1e-12


@njit(cache=True)
def _clip_flat(polygon, count, cutter, corners, kept):
    """Keep what lies inside a convex polygon `cutter`, whichever way round it is, of `polygon`, in place."""
    turn = 0.0
    for k in range(1, corners - 1):
        turn += (cutter[k, 0] - cutter[0, 0]) * (cutter[k + 1, 1] - cutter[0, 1]) - (
            cutter[k + 1, 0] - cutter[0, 0]
        ) * (cutter[k, 1] - cutter[0, 1])
    sign = 1.0 if turn > 0.0 else -1.0
    for c in range(corners):
        d = c + 1 if c + 1 < corners else 0
        ax, ay = cutter[c, 0], cutter[c, 1]
        ux, uy = sign * (cutter[d, 0] - ax), sign * (cutter[d, 1] - ay)
        k = 0
        for p in range(count):
            q = p + 1 if p + 1 < count else 0
            dp = ux * (polygon[p, 1] - ay) - uy * (polygon[p, 0] - ax)
            dq = ux * (polygon[q, 1] - ay) - uy * (polygon[q, 0] - ax)
            if dp >= 0.0:
                kept[k, 0], kept[k, 1] = polygon[p, 0], polygon[p, 1]
                k += 1
            if dp > 0.0 > dq or dq > 0.0 > dp:
                t = dp / (dp - dq)
                kept[k, 0] = polygon[p, 0] + t * (polygon[q, 0] - polygon[p, 0])
                kept[k, 1] = polygon[p, 1] + t * (polygon[q, 1] - polygon[p, 1])
                k += 1
        count = k
        for p in range(count):
            polygon[p, 0], polygon[p, 1] = kept[p, 0], kept[p, 1]
        if count < 3:
            return 0
    return count


@njit(cache=True)
def overlap_area(one, other):  # pragma: no cover - compiled
    """Area common to two convex polygons (n, 2), (m, 2) of the plane."""
    polygon, kept = np.empty((_MAX_CUT, 2)), np.empty((_MAX_CUT, 2))
    polygon[: one.shape[0]] = one
    count = _clip_flat(polygon, one.shape[0], other, other.shape[0], kept)
    area = 0.0
    for k in range(1, count - 1):
        area += _triangle(polygon, k)
    return abs(area)


@njit(cache=True)
def _triangle(polygon, k):
    """Area of the triangle 0, k, k + 1."""
    return 0.5 * (
        (polygon[k, 0] - polygon[0, 0]) * (polygon[k + 1, 1] - polygon[0, 1])
        - (polygon[k + 1, 0] - polygon[0, 0]) * (polygon[k, 1] - polygon[0, 1])
    )


@njit(cache=True)
def flattened(points, centre, rotation, origin, frame):
    """Coordinates (n, 2) along the second and third row of a frame of points given in body axes."""
    out = np.empty((points.shape[0], 2))
    for d in range(2):
        t = frame[1 + d]
        shift = 0.0
        for e in range(3):
            shift += t[e] * (centre[e] - origin[e])
        # Rᵀ t, so that each point costs one product
        a0 = t[0] * rotation[0, 0] + t[1] * rotation[1, 0] + t[2] * rotation[2, 0]
        a1 = t[0] * rotation[0, 1] + t[1] * rotation[1, 1] + t[2] * rotation[2, 1]
        a2 = t[0] * rotation[0, 2] + t[1] * rotation[1, 2] + t[2] * rotation[2, 2]
        for k in range(points.shape[0]):
            out[k, d] = shift + a0 * points[k, 0] + a1 * points[k, 1] + a2 * points[k, 2]
    return out


@njit(cache=True)
def _facet_boxes(x, facet, corners):
    low, high = np.full((facet.shape[0], 2), np.inf), np.full((facet.shape[0], 2), -np.inf)
    for t in range(facet.shape[0]):
        for k in range(corners):
            for d in range(2):
                low[t, d] = min(low[t, d], x[facet[t, k], d])
                high[t, d] = max(high[t, d], x[facet[t, k], d])
    return low, high


@njit(cache=True)
def _grid(low, high):
    """Origin, cell sizes, cells along both axes of a grid with about one cell per box, and the boxes in each cell."""
    n = low.shape[0]
    origin, top = np.full(2, np.inf), np.full(2, -np.inf)
    for t in range(n):
        for d in range(2):
            origin[d], top[d] = min(origin[d], low[t, d]), max(top[d], high[t, d])
    width, height = max(top[0] - origin[0], 1e-300), max(top[1] - origin[1], 1e-300)
    nx = min(max(int(np.sqrt(n * width / height)), 1), n)
    ny = max(n // nx, 1)
    size = np.array([width / nx, height / ny])
    start = np.zeros(nx * ny + 1, dtype=np.int64)
    for t in range(n):
        x0, x1, y0, y1 = _cells(low[t], high[t], origin, size, nx, ny)
        for i in range(x0, x1 + 1):
            for j in range(y0, y1 + 1):
                start[i * ny + j + 1] += 1
    for c in range(nx * ny):
        start[c + 1] += start[c]
    item, cursor = np.empty(start[-1], dtype=np.int64), start[:-1].copy()
    for t in range(n):
        x0, x1, y0, y1 = _cells(low[t], high[t], origin, size, nx, ny)
        for i in range(x0, x1 + 1):
            for j in range(y0, y1 + 1):
                item[cursor[i * ny + j]] = t
                cursor[i * ny + j] += 1
    return origin, size, nx, ny, start, item


@njit(cache=True)
def _cells(low, high, origin, size, nx, ny):
    """First and last cell along both axes; none where the box lies beside the grid."""
    x0, x1 = int(np.floor((low[0] - origin[0]) / size[0])), int(np.floor((high[0] - origin[0]) / size[0]))
    y0, y1 = int(np.floor((low[1] - origin[1]) / size[1])), int(np.floor((high[1] - origin[1]) / size[1]))
    # what ends at the far side of the grid lies in its last cell
    return max(min(x0, nx - 1), 0), min(x1, nx - 1), max(min(y0, ny - 1), 0), min(y1, ny - 1)


@njit(cache=True)
def _close_facets(low, high, low_a, high_a):
    """Facets of the antagonist whose boxes overlap that of each candidate facet: pointers and facets."""
    origin, size, nx, ny, start, item = _grid(low_a, high_a)
    seen = np.full(low_a.shape[0], -1)
    pointer = np.zeros(low.shape[0] + 1, dtype=np.int64)
    found = np.empty(4 * low.shape[0] + 4, dtype=np.int64)
    count = 0
    for t in range(low.shape[0]):
        x0, x1, y0, y1 = _cells(low[t], high[t], origin, size, nx, ny)
        for i in range(x0, x1 + 1):
            for j in range(y0, y1 + 1):
                for e in range(start[i * ny + j], start[i * ny + j + 1]):
                    a = item[e]
                    if seen[a] == t:
                        continue
                    seen[a] = t
                    if (
                        low_a[a, 0] < high[t, 0]
                        and high_a[a, 0] > low[t, 0]
                        and low_a[a, 1] < high[t, 1]
                        and high_a[a, 1] > low[t, 1]
                    ):
                        found = room(found, count + 1)
                        found[count] = a
                        count += 1
        pointer[t + 1] = count
    return pointer, found


@njit(cache=True)
def room(array, needed):
    """The array, or a copy with at least this many places."""
    if needed <= array.shape[0]:
        return array
    grown = np.empty(max(needed, 2 * array.shape[0]), dtype=array.dtype)
    grown[: array.shape[0]] = array
    return grown


@njit(cache=True)
def _area(polygon, count):
    area = 0.0
    for t in range(1, count - 1):
        area += abs(_triangle(polygon, t))
    return area


@njit(cache=True)
def _integrate(polygon, count, own, kind, far, far_kind, n_psi, n_own, n_far, share, moment, mass, cross):
    """Add ∫ψ_i, ∫ψ_i (x, y, x² + y²), ∫ψ_i N_k, ∫ψ_i N_j over a polygon in the facets `own` and, if kind > 0, `far`."""
    corners = corner_count(kind)
    wanted = corners - 2 + max(degree(kind), degree(far_kind) if far_kind > 0 else 1)
    first, last = rule_of(wanted)
    for t in range(1, count - 1):
        area = abs(_triangle(polygon, t))
        for q in range(first, last):
            a, b, w = QUADRATURE[q, 0], QUADRATURE[q, 1], QUADRATURE[q, 2] * area
            c = 1.0 - a - b
            x = a * polygon[0, 0] + b * polygon[t, 0] + c * polygon[t + 1, 0]
            y = a * polygon[0, 1] + b * polygon[t, 1] + c * polygon[t + 1, 1]
            r, s = locate(own, corners, x, y)
            hats(corners, r, s, n_psi)
            shapes(kind, r, s, n_own)
            if far_kind > 0:
                r, s = locate(far, corner_count(far_kind), x, y)
                shapes(far_kind, r, s, n_far)
            for i in range(corners):
                psi = w * n_psi[i]
                share[i] += psi
                moment[i, 0] += psi * x
                moment[i, 1] += psi * y
                moment[i, 2] += psi * (x * x + y * y)
                for k in range(kind):
                    mass[i, k] += psi * n_own[k]
                for k in range(far_kind):
                    cross[i, k] += psi * n_far[k]


@njit(cache=True)
def _take_corners(x, facet, corners, out):
    for k in range(corners):
        out[k, 0], out[k, 1] = x[facet[k], 0], x[facet[k], 1]


@njit(cache=True)
def _hat_products(kind, corners, mass, out):
    """∫ψ_i ψ_j from ∫ψ_i N_k: a hat is the sum of the shape functions, each by its value at their node."""
    for i in range(corners):
        for j in range(corners):
            before = j - 1 if j > 0 else corners - 1
            out[i, j] = mass[i, j]
            if kind > corners:
                out[i, j] += 0.5 * (mass[i, corners + j] + mass[i, corners + before])
            if kind == 9:
                out[i, j] += 0.25 * mass[i, 8]


@njit(cache=True)
def _solve_small(matrix, right, count):
    """Gauss elimination of symmetric positive matrices, in place; `right` becomes the solution."""
    for k in range(count):
        for i in range(k + 1, count):
            f = matrix[i, k] / matrix[k, k]
            for j in range(k, count):
                matrix[i, j] -= f * matrix[k, j]
            for j in range(count):
                right[i, j] -= f * right[k, j]
    for k in range(count - 1, -1, -1):
        for j in range(count):
            for i in range(k + 1, count):
                right[k, j] -= matrix[k, i] * right[i, j]
            right[k, j] /= matrix[k, k]


@njit(cache=True)
def _turn_rows(turn, corners, rows):
    """rows ← turn · rows."""
    was = rows.copy()
    for i in range(corners):
        for k in range(rows.shape[1]):
            x = 0.0
            for j in range(corners):
                x += turn[i, j] * was[j, k]
            rows[i, k] = x


@njit(cache=True)
def _turn_dual(own, kind, share, moment, mass, cross):
    """Integrals with the hats of a facet become integrals with functions dual to them, where it is nearly all covered.

    The dual functions φ are combinations of the hats, T ψ with T ∫ψψᵀ = diag ∫ψ. They have the same integrals and the
    same sum, one; φ_i meets no other node's hat, so that on linear facets a contact is its node alone (Wohlmuth 2000),
    and pressures do not swing where a contact ends.
    """
    corners = corner_count(kind)
    whole = covered = 0.0
    for k in range(1, corners - 1):
        whole += abs(_triangle(own, k))
    for i in range(corners):
        covered += share[i]
    dual = min(max((covered / whole - _HATS) / (_DUAL - _HATS), 0.0), 1.0)
    if dual == 0.0:
        return
    products, turn = np.empty((corners, corners)), np.zeros((corners, corners))
    _hat_products(kind, corners, mass, products)
    for i in range(corners):
        turn[i, i] = share[i]
    # its rows are the columns of T
    _solve_small(products, turn, corners)
    turn = dual * turn.T.copy()
    for i in range(corners):
        turn[i, i] += 1.0 - dual
    _turn_rows(turn, corners, mass)
    _turn_rows(turn, corners, moment)
    for e in range(cross.shape[0]):
        _turn_rows(turn, corners, cross[e])
    if kind == corners and dual == 1.0:
        # what is zero is so without rounding, and takes no place
        for i in range(corners):
            for k in range(corners):
                mass[i, k] = share[i] if i == k else 0.0


@njit(cache=True)
def overlap_integrals(x_c, facet_c, kind_c, x_a, facet_a, kind_a, outlines, outline_size, share, moment):
    """Integrals over the overlap of two faces, by facets of the candidate, with hats or their dual functions as ψ.

    Parameters
    ----------
    x_c, facet_c, kind_c : plane nodes, facets and nodes of a facet of the candidate
    x_a, facet_a, kind_a : those of the antagonist; kind_a = 0 if it is rigid
    outlines, outline_size : convex polygons that bound the overlap besides the meshes
    share, moment : (nodes,), (nodes, 3) to which ∫ψ_i and ∫ψ_i (x, y, x² + y²) are added

    Returns
    -------
    used : facets of the candidate that meet the antagonist
    mass : ∫ψ_i N_k of each, flat
    pointer, far, cross : facets of the antagonist that each of these meets, and ∫ψ_i N_j of each pair, flat
    """
    corners, corners_a = corner_count(kind_c), corner_count(kind_a) if kind_a > 0 else 0
    low, high = _facet_boxes(x_c, facet_c, corners)
    most = facet_c.shape[0]
    if kind_a > 0:
        near_ptr, near = _close_facets(low, high, *_facet_boxes(x_a, facet_a, corners_a))
    else:
        near_ptr, near = np.arange(most + 1), np.zeros(most, dtype=np.int64)
    used, pointer = np.empty(most, dtype=np.int64), np.zeros(most + 1, dtype=np.int64)
    stride_c, stride_a = corners * kind_c, corners * kind_a
    mass = np.zeros(most * stride_c)
    far, cross = np.empty(near_ptr[-1], dtype=np.int64), np.zeros(near_ptr[-1] * stride_a)
    polygon, kept = np.empty((_MAX_CUT, 2)), np.empty((_MAX_CUT, 2))
    own, other = np.empty((4, 2)), np.empty((4, 2))
    n_psi, n_own, n_far = np.empty(4), np.empty(9), np.empty(9)
    part, middle = np.empty(4), np.empty((4, 3))
    count, pairs = 0, 0
    for t in range(most):
        _take_corners(x_c, facet_c[t], corners, own)
        block = mass[count * stride_c : (count + 1) * stride_c].reshape(corners, kind_c)
        part[:], middle[:] = 0.0, 0.0
        for e in range(near_ptr[t], near_ptr[t + 1]):
            polygon[:corners] = own[:corners]
            k = corners
            if kind_a > 0:
                _take_corners(x_a, facet_a[near[e]], corners_a, other)
                k = _clip_flat(polygon, k, other, corners_a, kept)
            begin = 0
            for o in outline_size:
                if k > 0 and o > 0:
                    k = _clip_flat(polygon, k, outlines[begin : begin + o], o, kept)
                begin += o
            if k < 3 or _area(polygon, k) <= _NOTHING * _area(own, corners):
                continue
            pair = cross[pairs * stride_a : (pairs + 1) * stride_a].reshape(corners, kind_a)
            _integrate(polygon, k, own, kind_c, other, kind_a, n_psi, n_own, n_far, part, middle, block, pair)
            far[pairs] = near[e]
            pairs += 1
        if pairs == pointer[count]:
            continue
        pair = cross[pointer[count] * stride_a : pairs * stride_a].reshape(-1, corners, kind_a)
        _turn_dual(own, kind_c, part, middle, block, pair)
        for i in range(corners):
            node = facet_c[t, i]
            share[node] += part[i]
            for d in range(3):
                moment[node, d] += middle[i, d]
        used[count] = t
        count += 1
        pointer[count] = pairs
    return used[:count], mass, pointer[: count + 1], far[:pairs], cross
