"""Finite-element facets: their shape functions, the inverse of their map, and quadrature on triangles.

A facet has 3 or 6 nodes (triangle) or 4, 8 or 9 nodes (quadrilateral), corners first, in VTK's order. Its edges are
straight with nodes at their middle, so the map from reference coordinates to the plane is that of its corners:
affine on triangles, bilinear on quadrilaterals. Reference coordinates are (r, s) ≥ 0, r + s ≤ 1, or -1 ≤ r, s ≤ 1.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mechanics.arrays import Array, Bools, Ints


class FacetMeshes(NamedTuple):
    """The meshes of all faces; mesh m owns nodes node_ptr[m]:node_ptr[m+1] and facets facet_ptr[m]:facet_ptr[m+1].

    Attributes
    ----------
    of_face : (nf,) int64, the mesh of each face; -1 for those of rigid bodies
    node_ptr : (nm+1,) int64
    node : (n,) int64, nodes of each mesh, numbered over all deformable bodies
    reference : (n, 3) float64, their places in body axes [m]
    facet_ptr : (nm+1,) int64
    facet : (·, 9) int64, facets of each mesh as indices into its nodes, padded with -1
    kind : (nm,) int64, nodes of a facet of each mesh
    cut : (nm,) bool, whether the face, one of several parts, cuts through facets, so that they extend beyond it
    fineness : (nf,) float64, triangles (a quadrilateral counts for two) per area of each face; 0 without facets, -1 if
        rigid [1/m²]
    """

    of_face: Ints
    node_ptr: Ints
    node: Ints
    reference: Array
    facet_ptr: Ints
    facet: Ints
    kind: Ints
    cut: Bools
    fineness: Array


def _symmetric(groups):
    """Return points (n, 3): two area coordinates and the weight, of orbits given by their coordinates and weight."""
    rows = []
    for *coordinates, weight in groups:
        a = coordinates[0]
        b = coordinates[1] if len(coordinates) == 2 else a
        c = 1.0 - a - b
        orbit = {(a, b), (b, c), (c, a), (b, a), (c, b), (a, c)}
        if abs(a - c) < 1e-15:
            orbit = {(a, b)}
        rows += [(*point, weight) for point in sorted(orbit)]
    return np.array(rows)


_R10, _R15 = np.sqrt(10.0), np.sqrt(15.0)
_A4, _W4 = np.sqrt(38.0 - 44.0 * np.sqrt(0.4)), np.sqrt(213125.0 - 53320.0 * _R10)
# exact to degree 2, 4 (Strang & Fix 1973), 5 (Radon 1948) and 6 (Dunavant 1985); all weights positive
_RULES = (
    _symmetric([(1 / 6, 1 / 3)]),
    _symmetric([((8 - _R10 + _A4) / 18, (620 + _W4) / 3720), ((8 - _R10 - _A4) / 18, (620 - _W4) / 3720)]),
    _symmetric(
        [(1 / 3, 9 / 40), ((6 + _R15) / 21, (155 + _R15) / 1200), ((6 - _R15) / 21, (155 - _R15) / 1200)]
    ),
    _symmetric(
        [
            (0.249286745170910421291638553107, 0.116786275726379366025289611385),
            (0.063089014491502228340331602871, 0.050844906370206816920936809107),
            (
                0.053145049844816947353249671631,
                0.310352451033784405416607733957,
                0.082851075618373575193553456420,
            ),
        ]
    ),
)
QUADRATURE_START = np.cumsum([0] + [len(rule) for rule in _RULES])
QUADRATURE = np.vstack(_RULES)


@njit(cache=True)
def corner_count(kind):
    """Count the corners of a facet with `kind` nodes."""
    return 3 if kind == 3 or kind == 6 else 4


@njit(cache=True)
def degree(kind):
    """Return the total degree in the plane of the shape functions of an affine facet with `kind` nodes."""
    if kind == 3:
        return 1
    if kind == 8:
        return 3
    return 4 if kind == 9 else 2


@njit(cache=True)
def rule_of(wanted):
    """Return the first and last row of the triangle quadrature exact to this degree."""
    k = 0 if wanted <= 2 else 1 if wanted <= 4 else 2 if wanted == 5 else 3
    return QUADRATURE_START[k], QUADRATURE_START[k + 1]


@njit(cache=True)
def hats(corners, r, s, out):
    """Write the linear (3 corners) or bilinear (4) functions at (r, s)."""
    if corners == 3:
        out[0], out[1], out[2] = 1.0 - r - s, r, s
    else:
        out[0], out[1] = 0.25 * (1.0 - r) * (1.0 - s), 0.25 * (1.0 + r) * (1.0 - s)
        out[2], out[3] = 0.25 * (1.0 + r) * (1.0 + s), 0.25 * (1.0 - r) * (1.0 + s)


@njit(cache=True)
def shape_functions(kind, r, s, out):
    """Write the shape functions of a facet with `kind` nodes at (r, s)."""
    if kind == 3 or kind == 4:
        hats(kind, r, s, out)
    elif kind == 6:
        t = 1.0 - r - s
        out[0], out[1], out[2] = t * (2.0 * t - 1.0), r * (2.0 * r - 1.0), s * (2.0 * s - 1.0)
        out[3], out[4], out[5] = 4.0 * t * r, 4.0 * r * s, 4.0 * s * t
    elif kind == 8:
        rr, ss = 1.0 - r * r, 1.0 - s * s
        out[4], out[5] = 0.5 * rr * (1.0 - s), 0.5 * ss * (1.0 + r)
        out[6], out[7] = 0.5 * rr * (1.0 + s), 0.5 * ss * (1.0 - r)
        out[0] = 0.25 * (1.0 - r) * (1.0 - s) - 0.5 * (out[4] + out[7])
        out[1] = 0.25 * (1.0 + r) * (1.0 - s) - 0.5 * (out[4] + out[5])
        out[2] = 0.25 * (1.0 + r) * (1.0 + s) - 0.5 * (out[5] + out[6])
        out[3] = 0.25 * (1.0 - r) * (1.0 + s) - 0.5 * (out[6] + out[7])
    else:
        r0, r1, r2 = 0.5 * r * (r - 1.0), 1.0 - r * r, 0.5 * r * (r + 1.0)
        s0, s1, s2 = 0.5 * s * (s - 1.0), 1.0 - s * s, 0.5 * s * (s + 1.0)
        out[0], out[1], out[2], out[3] = r0 * s0, r2 * s0, r2 * s2, r0 * s2
        out[4], out[5], out[6], out[7] = r1 * s0, r2 * s1, r1 * s2, r0 * s1
        out[8] = r1 * s1


@njit(cache=True)
def locate(corner, count, x, y):
    """Return the reference coordinates of a point of the plane in a facet with corners (≥ count, 2).

    Newton's method on quadrilaterals; one step is exact on a parallelogram.
    """
    if count == 3:
        ax, ay = corner[1, 0] - corner[0, 0], corner[1, 1] - corner[0, 1]
        bx, by = corner[2, 0] - corner[0, 0], corner[2, 1] - corner[0, 1]
        px, py = x - corner[0, 0], y - corner[0, 1]
        det = ax * by - ay * bx
        return (px * by - py * bx) / det, (ax * py - ay * px) / det
    # 4 x = m + a r + b s + c r s
    mx = corner[0, 0] + corner[1, 0] + corner[2, 0] + corner[3, 0]
    my = corner[0, 1] + corner[1, 1] + corner[2, 1] + corner[3, 1]
    ax = corner[1, 0] + corner[2, 0] - corner[0, 0] - corner[3, 0]
    ay = corner[1, 1] + corner[2, 1] - corner[0, 1] - corner[3, 1]
    bx = corner[2, 0] + corner[3, 0] - corner[0, 0] - corner[1, 0]
    by = corner[2, 1] + corner[3, 1] - corner[0, 1] - corner[1, 1]
    cx = corner[0, 0] - corner[1, 0] + corner[2, 0] - corner[3, 0]
    cy = corner[0, 1] - corner[1, 1] + corner[2, 1] - corner[3, 1]
    px, py = 4.0 * x - mx, 4.0 * y - my
    r = s = 0.0
    straight = abs(cx) + abs(cy) <= 1e-14 * (abs(ax) + abs(ay) + abs(bx) + abs(by))
    for _ in range(1 if straight else 30):
        ex, ey = px - ax * r - bx * s - cx * r * s, py - ay * r - by * s - cy * r * s
        jxr, jyr, jxs, jys = ax + cx * s, ay + cy * s, bx + cx * r, by + cy * r
        det = jxr * jys - jyr * jxs
        dr, ds = (ex * jys - ey * jxs) / det, (jxr * ey - jyr * ex) / det
        r, s = r + dr, s + ds
        if abs(dr) + abs(ds) < 1e-14:
            break
    return r, s
