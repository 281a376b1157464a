"""Numba kernels that lay points on and in a convex polyhedron, as far apart as a size field asks for."""

from math import ceil, log2, sqrt
from typing import Any, NamedTuple

import numpy as np
from numba import njit

_APART = 0.65  # distance from all other points, over the size
_INSIDE = 0.4  # distance from the boundary of the face or stone that a point fills, over the size
_STEP = 0.97  # of the cubic lattice, over the size: tetrahedra then have edges of about that length
_ON_PLANE = (
    1e-9  # distance from a plane at which points lie on it, over the stone's size; slack of all comparisons
)
_STATIONS = 64  # parts in which an edge is measured where its size changes
_SHORT = 0.01  # by which a part of an edge may exceed the size, over the size (gmsh's rule)


class Sizes(NamedTuple):
    """A `mechanics.stones.meshing.sizes.SizeField`, with the same fields."""

    size: float
    fine: float
    growth: float
    normals: Any  # (k, 3) float64
    offsets: Any  # (k,) float64


class Polyhedron(NamedTuple):
    """A convex polyhedron of unit size.

    Attributes
    ----------
    corners : (nv, 3) float64
    edges : (ne, 2) int64 corners that an edge joins
    loops, start : int64; corners of face k are loops[start[k]:start[k + 1]], counter-clockwise seen from outside
    planes : (nf, 4) float64 rows (n, d) with n·x ≤ d inside
    axes : (3, 3) float64 rows: directions of the lattice inside
    """

    corners: Any
    edges: Any
    loops: Any
    start: Any
    planes: Any
    axes: Any


@njit(cache=True)
def size_at(x, y, z, sizes):
    """Evaluate the size field h at a point."""
    h = sizes.size
    for k in range(len(sizes.offsets)):
        n = sizes.normals[k]
        away = abs(n[0] * x + n[1] * y + n[2] * z - sizes.offsets[k])
        h = min(h, sizes.fine + sizes.growth * away)
    return h


@njit(cache=True)
def lay_points(stone, sizes):
    """Lay points at the corners, then on edges, on faces and inside.

    Inputs
    ------
    stone : Polyhedron
    sizes : Sizes

    Outputs
    -------
    points : (n, 3) float64
    ends : (4,) int64 number of points after the corners, the edges, the faces, all
    owner : (n,) int64 corner, edge or face that a point lies on; -1 inside
    """
    corners, edges = stone.corners, stone.edges
    points = np.empty((512, 3))
    owner = np.empty(512, dtype=np.int64)
    ends = np.empty(4, dtype=np.int64)
    # of no literal type, for each of which numba would compile the callees once more
    count, inside = np.int64(0), np.int64(-1)
    for k in range(len(corners)):
        points, owner, count = _add(points, owner, count, corners[k, 0], corners[k, 1], corners[k, 2], k)
    ends[0] = count
    for k in range(len(edges)):
        a, b = corners[edges[k, 0]], corners[edges[k, 1]]
        for t in _cuts(a, b, sizes):
            x, y, z = a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])
            points, owner, count = _add(points, owner, count, x, y, z, k)
    ends[1] = count
    for k in range(len(stone.planes)):
        points, owner, count = _on_face(points, owner, count, stone, k, sizes)
    ends[2] = count
    points, owner, count = _inside(points, owner, count, stone, sizes)
    if count == len(corners):
        # no edge is cut: only a point in the middle lets the stone deform
        middle = np.zeros(3)
        for k in range(len(corners)):
            for d in range(3):
                middle[d] += corners[k, d] / len(corners)
        points, owner, count = _add(points, owner, count, middle[0], middle[1], middle[2], inside)
    ends[3] = count
    return points[:count], ends, owner[:count]


@njit(cache=True)
def _add(points, owner, count, x, y, z, of):
    """Append a point; arrays that are full double."""
    if count == len(points):
        more, whose = np.empty((2 * count, 3)), np.empty(2 * count, dtype=np.int64)
        for k in range(count):
            more[k, 0], more[k, 1], more[k, 2], whose[k] = points[k, 0], points[k, 1], points[k, 2], owner[k]
        points, owner = more, whose
    points[count, 0], points[count, 1], points[count, 2] = x, y, z
    owner[count] = of
    return points, owner, count + 1


@njit(cache=True)
def _cuts(a, b, sizes):
    """Return places t (n,) in (0, 1) that cut the edge from a to b into parts no longer than the field asks for."""
    length = sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2)
    if len(sizes.offsets) == 0:
        count = max(1, ceil(length / sizes.size - _SHORT))
        even = np.empty(count - 1)
        for k in range(count - 1):
            even[k] = (k + 1) / count
        return even
    parts = np.zeros(_STATIONS + 1)
    for s in range(_STATIONS):
        t = (s + 0.5) / _STATIONS
        x, y, z = a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])
        parts[s + 1] = parts[s] + length / _STATIONS / size_at(x, y, z, sizes)
    count = max(1, ceil(parts[-1] - _SHORT))
    places = np.empty(count - 1)
    s = 0
    for k in range(1, count):
        goal = parts[-1] * k / count
        while parts[s + 1] < goal:
            s += 1
        places[k - 1] = (s + (goal - parts[s]) / (parts[s + 1] - parts[s])) / _STATIONS
    return places


@njit(cache=True)
def _steps(sizes):
    """Return steps (n,) of the lattices, from the largest size down, each at least half of the one before."""
    size, fine = sizes.size, sizes.fine
    if len(sizes.offsets) == 0 or fine >= size:
        one = np.empty(1)
        one[0] = size
        return one
    levels = ceil(log2(size / fine) - 1e-9)
    steps = np.empty(levels + 1)
    for k in range(levels + 1):
        steps[k] = size * (fine / size) ** (k / levels)
    return steps


@njit(cache=True)
def _free(points, first, last, x, y, z, apart):
    """Return True if none of the points from `first` to `last` is nearer than `apart`."""
    least = (apart - _ON_PLANE) ** 2
    for j in range(first, last):
        if (points[j, 0] - x) ** 2 + (points[j, 1] - y) ** 2 + (points[j, 2] - z) ** 2 < least:
            return False
    return True


@njit(cache=True)
def _flat_face(corners, loop, plane):
    """Describe a face in its plane.

    Inputs
    ------
    corners : (nv, 3) float64
    loop : (m,) int64 corners of the face
    plane : (4,) float64

    Outputs
    -------
    origin, u, v : (3,) float64 mean corner, and unit vectors along its longest side and across
    walls : (m, 3) float64 rows (p, q, d) of its sides, p s + q t ≤ d inside, at origin + s u + t v
    far_u, far_v : reach from the origin along u and v
    """
    m = len(loop)
    origin, along = np.zeros(3), np.zeros(3)
    longest = 0.0
    for k in range(m):
        for d in range(3):
            origin[d] += corners[loop[k], d] / m
        side = corners[loop[(k + 1) % m]] - corners[loop[k]]
        if side @ side > (1.0 + _ON_PLANE) * longest:  # of equal ones the first
            longest, along = side @ side, side
    u = along / sqrt(longest)
    v = np.empty(3)
    v[0], v[1] = plane[1] * u[2] - plane[2] * u[1], plane[2] * u[0] - plane[0] * u[2]
    v[2] = plane[0] * u[1] - plane[1] * u[0]
    walls = np.empty((m, 3))
    far_u, far_v = 0.0, 0.0
    for k in range(m):
        here = corners[loop[k]] - origin
        there = corners[loop[(k + 1) % m]] - origin
        p, q = (there - here) @ v, -((there - here) @ u)
        length = sqrt(p * p + q * q)
        walls[k, 0], walls[k, 1] = p / length, q / length
        walls[k, 2] = (p * (here @ u) + q * (here @ v)) / length
        far_u, far_v = max(far_u, abs(here @ u)), max(far_v, abs(here @ v))
    return origin, u, v, walls, far_u, far_v


@njit(cache=True)
def _on_face(points, owner, count, stone, face, sizes):
    """Add points of triangular lattices inside a face.

    Lattices follow each other, each finer than the one before: coarse regions are filled first, and evenly.
    """
    loop, plane = stone.loops[stone.start[face] : stone.start[face + 1]], stone.planes[face]
    origin, u, v, walls, far_u, far_v = _flat_face(stone.corners, loop, plane)
    m = len(walls)
    # the points on its edges; those on the other side of a thin stone do not count
    near, none, there = np.empty((count, 3)), np.int64(0), np.int64(0)  # of no literal type
    for j in range(count):
        if abs(plane[:3] @ points[j] - plane[3]) < _ON_PLANE:
            near[there, 0], near[there, 1], near[there, 2] = points[j, 0], points[j, 1], points[j, 2]
            there += 1
    first = count
    for step in _steps(sizes):
        rows = int(far_v / (0.5 * sqrt(3.0) * step)) + 1
        across = int(far_u / step) + 2
        for row in range(-rows, rows + 1):
            t = row * 0.5 * sqrt(3.0) * step
            for column in range(-across, across + 1):
                s = (column + 0.5 * (row % 2)) * step
                x = origin[0] + s * u[0] + t * v[0]
                y = origin[1] + s * u[1] + t * v[1]
                z = origin[2] + s * u[2] + t * v[2]
                h = size_at(x, y, z, sizes)
                inside = h <= 2.0 * step  # a coarser lattice has filled larger sizes
                for w in range(m):
                    if not inside:
                        break
                    inside = walls[w, 0] * s + walls[w, 1] * t <= walls[w, 2] - _INSIDE * h + _ON_PLANE
                inside = inside and _free(near, none, there, x, y, z, _APART * h)
                if inside and _free(points, first, count, x, y, z, _APART * h):
                    points, owner, count = _add(points, owner, count, x, y, z, face)
    return points, owner, count


@njit(cache=True)
def _inside(points, owner, count, stone, sizes):
    """Add points of body-centred cubic lattices, as `_on_face` does those of triangular ones."""
    corners, planes, axes = stone.corners, stone.planes, stone.axes
    origin, none = np.zeros(3), np.int64(0)
    for k in range(len(corners)):
        for d in range(3):
            origin[d] += corners[k, d] / len(corners)
    extent = np.zeros(3)
    for j in range(len(corners)):
        for k in range(3):
            extent[k] = max(extent[k], abs(axes[k] @ (corners[j] - origin)))
    for widest in _steps(sizes):
        step = _STEP * widest
        across = int(extent[0] / step) + 1
        rows = int(extent[1] / step) + 1
        layers = int(extent[2] / step) + 1
        for i in range(-2 * across, 2 * across + 1):
            for j in range(-2 * rows + i % 2, 2 * rows + 1, 2):
                for k in range(-2 * layers + i % 2, 2 * layers + 1, 2):
                    a, b, c = 0.5 * i * step, 0.5 * j * step, 0.5 * k * step
                    x = origin[0] + a * axes[0, 0] + b * axes[1, 0] + c * axes[2, 0]
                    y = origin[1] + a * axes[0, 1] + b * axes[1, 1] + c * axes[2, 1]
                    z = origin[2] + a * axes[0, 2] + b * axes[1, 2] + c * axes[2, 2]
                    h = size_at(x, y, z, sizes)
                    inside = h <= 2.0 * step
                    for w in range(len(planes)):
                        if not inside:
                            break
                        deep = planes[w, 3] - planes[w, 0] * x - planes[w, 1] * y - planes[w, 2] * z
                        inside = deep >= _INSIDE * h - _ON_PLANE
                    if inside and _free(points, none, count, x, y, z, _APART * h):
                        points, owner, count = _add(points, owner, count, x, y, z, np.int64(-1))
    return points, owner, count
