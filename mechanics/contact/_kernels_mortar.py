"""Numba kernels of the mortar method: integrals over the overlap of two triangulated faces."""

import numpy as np
from numba import njit

from mechanics.contact._kernels_narrow import MAX_POINTS

__all__ = ["mortar_integrals"]


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
