"""Mortar method: integrals over the overlap of two meshed faces of one plane."""

from typing import NamedTuple

import numpy as np
from numba import njit

from mechanics.arrays import Array, Ints
from mechanics.contact._kernels.facets import (
    QUADRATURE,
    corner_count,
    degree,
    hats,
    locate,
    rule_of,
    shape_functions,
)
from mechanics.contact._kernels.vectors import column, dot, minus, row

_HATS = 0.8  # covered share of a facet up to which hats are used, which stay within the overlap
_DUAL = 0.98  # covered share of a facet from which dual functions are used
# share of a facet's area that rounding leaves as overlap where a joint ends at a node: it carries no pressure
_NOTHING = 1e-12


class FlatMesh(NamedTuple):
    """A face mesh in the plane of an interface.

    Attributes
    ----------
    x : (n, 2) float64, nodes [m]
    facet : (m, kind) int64, indices into the nodes, corners first
    kind : int64, nodes of a facet; 0 for a rigid face, which has none
    """

    x: Array
    facet: Ints
    kind: int


class _Integrals(NamedTuple):
    """Integrals over a facet with test functions ψ_i of its corners and shape functions N.

    Attributes
    ----------
    share : (4,) float64, ∫ψ_i [m²]
    moment : (4, 3) float64, ∫ψ_i (x, y, x² + y²) [m³, m³, m⁴]
    mass : (corners, kind) float64, ∫ψ_i N_k [m²]
    cross : (corners, kind of the other mesh) float64, ∫ψ_i N_j [m²]
    """

    share: Array
    moment: Array
    mass: Array
    cross: Array


@njit(cache=True)
def _clip_flat(polygon, count, cutter, corners, kept):
    """Clip `polygon` by a convex polygon `cutter` of either orientation, in place; return its number of corners.

    The buffer must hold the corners of both.
    """
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
            if dp >= 0.0 and k < kept.shape[0]:
                kept[k, 0], kept[k, 1] = polygon[p, 0], polygon[p, 1]
                k += 1
            if (dp > 0.0 > dq or dq > 0.0 > dp) and k < kept.shape[0]:
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
    """Compute the area common to two convex polygons of the plane, (n, 2) and (m, 2) float64 [m]."""
    most = one.shape[0] + other.shape[0]
    polygon, kept = np.empty((most, 2)), np.empty((most, 2))
    polygon[: one.shape[0]] = one
    count = _clip_flat(polygon, one.shape[0], other, other.shape[0], kept)
    area = 0.0
    for k in range(1, count - 1):
        area += _triangle(polygon, k)
    return abs(area)


@njit(cache=True)
def _triangle(polygon, k):
    """Compute the signed area of the triangle 0, k, k + 1."""
    return 0.5 * (
        (polygon[k, 0] - polygon[0, 0]) * (polygon[k + 1, 1] - polygon[0, 1])
        - (polygon[k + 1, 0] - polygon[0, 0]) * (polygon[k, 1] - polygon[0, 1])
    )


@njit(cache=True)
def flattened(points, centre, rotation, origin, frame):  # pragma: no cover - compiled
    """Return coordinates along the second and third row of a frame.

    Inputs
    ------
    points : (n, 3) float64, body axes [m]
    centre, rotation : (3,) and (3, 3) float64, of the body [m, -]
    origin, frame : (3,) and (3, 3) float64, of the plane [m, -]

    Outputs
    -------
    (n, 2) float64 [m]
    """
    out = np.empty((points.shape[0], 2))
    for d in range(2):
        t = row(frame, 1 + d)
        shift = dot(t, minus(centre, origin))
        # Rᵀ t, so that each point costs one product
        a0, a1, a2 = dot(t, column(rotation, 0)), dot(t, column(rotation, 1)), dot(t, column(rotation, 2))
        for k in range(points.shape[0]):
            out[k, d] = shift + a0 * points[k, 0] + a1 * points[k, 1] + a2 * points[k, 2]
    return out


@njit(cache=True)
def _facet_boxes(mesh):
    """Return the boxes of facets, (m, 2) and (m, 2)."""
    x, facet = mesh.x, mesh.facet
    low, high = np.full((facet.shape[0], 2), np.inf), np.full((facet.shape[0], 2), -np.inf)
    for t in range(facet.shape[0]):
        for k in range(corner_count(mesh.kind)):
            for d in range(2):
                low[t, d] = min(low[t, d], x[facet[t, k], d])
                high[t, d] = max(high[t, d], x[facet[t, k], d])
    return low, high


@njit(cache=True)
def _grid(low, high):
    """Sort boxes into a grid with about one cell per box.

    Return its origin, cell sizes and number of cells along both axes, and pointers and boxes of the cells.
    """
    n = low.shape[0]
    origin, top = np.full(2, np.inf), np.full(2, -np.inf)
    for t in range(n):
        for d in range(2):
            origin[d], top[d] = min(origin[d], low[t, d]), max(top[d], high[t, d])
    width, height = max(top[0] - origin[0], 1e-300), max(top[1] - origin[1], 1e-300)
    nx = min(max(int(np.sqrt(n * width / height)), 1), n)
    ny = max(n // nx, 1)
    size = (width / nx, height / ny)
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
    """Return the first and last cell of a box along both axes; none where it lies beside the grid."""
    x0, x1 = int(np.floor((low[0] - origin[0]) / size[0])), int(np.floor((high[0] - origin[0]) / size[0]))
    y0, y1 = int(np.floor((low[1] - origin[1]) / size[1])), int(np.floor((high[1] - origin[1]) / size[1]))
    # a box that ends at the far side of the grid lies in its last cell
    return max(min(x0, nx - 1), 0), min(x1, nx - 1), max(min(y0, ny - 1), 0), min(y1, ny - 1)


@njit(cache=True)
def _close_facets(low, high, low_a, high_a):
    """Return pointers and facets of the antagonist whose boxes overlap that of each candidate facet."""
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
    """Return the array, or a copy with at least this many entries."""
    if needed <= array.shape[0]:
        return array
    grown = np.empty(max(needed, 2 * array.shape[0]), dtype=array.dtype)
    for k in range(array.shape[0]):
        grown[k] = array[k]
    return grown


@njit(cache=True)
def _area(polygon, count):
    """Compute the area of a convex polygon."""
    area = 0.0
    for t in range(1, count - 1):
        area += abs(_triangle(polygon, t))
    return area


@njit(cache=True)
def _integrate(polygon, count, own, kind, far, far_kind, values, total):
    """Add the integrals over a polygon in the facets `own` and, if their kind is not 0, `far`; `values` is scratch."""
    corners = corner_count(kind)
    wanted = corners - 2 + max(degree(kind), degree(far_kind) if far_kind > 0 else 1)
    first, last = rule_of(wanted)
    psi, n_own, n_far = values[0], values[1], values[2]
    for t in range(1, count - 1):
        area = abs(_triangle(polygon, t))
        for q in range(first, last):
            a, b, w = QUADRATURE[q, 0], QUADRATURE[q, 1], QUADRATURE[q, 2] * area
            c = 1.0 - a - b
            x = a * polygon[0, 0] + b * polygon[t, 0] + c * polygon[t + 1, 0]
            y = a * polygon[0, 1] + b * polygon[t, 1] + c * polygon[t + 1, 1]
            r, s = locate(own, corners, x, y)
            hats(corners, r, s, psi)
            shape_functions(kind, r, s, n_own)
            if far_kind > 0:
                r, s = locate(far, corner_count(far_kind), x, y)
                shape_functions(far_kind, r, s, n_far)
            for i in range(corners):
                v = w * psi[i]
                total.share[i] += v
                total.moment[i, 0] += v * x
                total.moment[i, 1] += v * y
                total.moment[i, 2] += v * (x * x + y * y)
                for k in range(kind):
                    total.mass[i, k] += v * n_own[k]
                for k in range(far_kind):
                    total.cross[i, k] += v * n_far[k]


@njit(cache=True)
def _take_corners(mesh, t, out):
    """Write the corners of facet t."""
    for k in range(corner_count(mesh.kind)):
        n = mesh.facet[t, k]
        out[k, 0], out[k, 1] = mesh.x[n, 0], mesh.x[n, 1]


@njit(cache=True)
def _hat_products(kind, corners, mass, out):
    """Write ∫ψ_i ψ_j, from ∫ψ_i N_k: a hat is the sum of the shape functions times its values at their nodes."""
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
    """Solve with a symmetric positive matrix by Gauss elimination, in place; `right` becomes the solution."""
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
    """Replace rows by turn · rows."""
    was = rows.copy()
    for i in range(corners):
        for k in range(rows.shape[1]):
            x = 0.0
            for j in range(corners):
                x += turn[i, j] * was[j, k]
            rows[i, k] = x


@njit(cache=True)
def _turn_dual(own, kind, share, moment, mass, cross):
    """Turn integrals with the hats of a facet into those with functions dual to them where it is nearly all covered.

    The dual functions φ are combinations of the hats, T ψ with T ∫ψψᵀ = diag ∫ψ. They have the same integrals and the
    same sum, one; φ_i is orthogonal to the hats of other nodes, so that on linear facets a contact is its node alone
    (Wohlmuth 2000), and pressures do not oscillate where a contact ends.
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
    for i in range(corners):
        for j in range(corners):
            products[i, j] = dual * turn[j, i]
        products[i, i] += 1.0 - dual
    _turn_rows(products, corners, mass)
    _turn_rows(products, corners, moment)
    for e in range(cross.shape[0]):
        _turn_rows(products, corners, cross[e])
    if kind == corners and dual == 1.0:
        # exact zeros, so that they are not stored
        for i in range(corners):
            for k in range(corners):
                mass[i, k] = share[i] if i == k else 0.0


@njit(cache=True)
def overlap_integrals(own, other, outlines, outline_size, share, moment):  # pragma: no cover - compiled
    """Integrate over the overlap of two faces, by facets of the candidate, with hats or their dual functions as ψ.

    Inputs
    ------
    own, other : FlatMesh of candidate and antagonist; the kind of a rigid antagonist is 0
    outlines : (n, 2) float64, convex polygons that bound the overlap besides the meshes, one after the other [m]
    outline_size : (2,) int64, their corners
    share : (nodes,) float64, to which ∫ψ_i is added [m²]
    moment : (nodes, 3) float64, to which ∫ψ_i (x, y, x² + y²) is added [m³, m³, m⁴]

    Outputs
    -------
    used : int64, facets of the candidate that meet the antagonist
    mass : float64, ∫ψ_i N_k of each, flat [m²]
    pointer, far : int64, facets of the antagonist that each of these meets
    cross : float64, ∫ψ_i N_j of each pair, flat [m²]
    """
    corners, corners_a = corner_count(own.kind), corner_count(other.kind) if other.kind > 0 else 0
    low, high = _facet_boxes(own)
    most = own.facet.shape[0]
    if other.kind > 0:
        near_ptr, near = _close_facets(low, high, *_facet_boxes(other))
    else:
        near_ptr, near = np.empty(most + 1, dtype=np.int64), np.zeros(most, dtype=np.int64)
        for t in range(most + 1):
            near_ptr[t] = t
    used, pointer = np.empty(most, dtype=np.int64), np.zeros(most + 1, dtype=np.int64)
    stride, stride_a = corners * own.kind, corners * other.kind
    mass = np.zeros(most * stride)
    far, cross = np.empty(near_ptr[-1], dtype=np.int64), np.zeros(near_ptr[-1] * stride_a)
    # a facet cut by another facet and by the outlines of two faces has at most as many corners as all of them together
    room_for = corners + corners_a + outline_size[0] + outline_size[1]
    polygon, kept = np.empty((room_for, 2)), np.empty((room_for, 2))
    mine, theirs = np.empty((4, 2)), np.empty((4, 2))
    values, part, middle = np.empty((3, 9)), np.empty(4), np.empty((4, 3))
    count, pairs = 0, 0
    for t in range(most):
        _take_corners(own, t, mine)
        block = mass[count * stride : (count + 1) * stride].reshape(corners, own.kind)
        part[:], middle[:] = 0.0, 0.0
        for e in range(near_ptr[t], near_ptr[t + 1]):
            for c in range(corners):
                polygon[c, 0], polygon[c, 1] = mine[c, 0], mine[c, 1]
            k = corners
            if other.kind > 0:
                _take_corners(other, near[e], theirs)
                k = _clip_flat(polygon, k, theirs, corners_a, kept)
            begin = 0
            for o in outline_size:
                if k > 0 and o > 0:
                    k = _clip_flat(polygon, k, outlines[begin : begin + o], o, kept)
                begin += o
            if k < 3 or _area(polygon, k) <= _NOTHING * _area(mine, corners):
                continue
            pair = cross[pairs * stride_a : (pairs + 1) * stride_a].reshape(corners, other.kind)
            total = _Integrals(part, middle, block, pair)
            _integrate(polygon, k, mine, own.kind, theirs, other.kind, values, total)
            far[pairs] = near[e]
            pairs += 1
        if pairs == pointer[count]:
            continue
        met = cross[pointer[count] * stride_a : pairs * stride_a].reshape(-1, corners, other.kind)
        _turn_dual(mine, own.kind, part, middle, block, met)
        for i in range(corners):
            node = own.facet[t, i]
            share[node] += part[i]
            for d in range(3):
                moment[node, d] += middle[i, d]
        used[count] = t
        count += 1
        pointer[count] = pairs
    return used[:count], mass, pointer[: count + 1], far[:pairs], cross
