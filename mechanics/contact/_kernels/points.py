"""Numba kernel of single contact points on meshed faces: the facet that holds a point, its shape functions there."""

import numpy as np
from numba import njit

from mechanics.contact._kernels.facets import corner_count, locate, shapes

__all__ = ["surface_points"]


@njit(cache=True)
def _depth(corner, count, x, y):
    """How far inside the sides of a facet, counter-clockwise, a point of its plane lies."""
    least = np.inf
    for a in range(count):
        b = a + 1 if a + 1 < count else 0
        ux, uy = corner[b, 0] - corner[a, 0], corner[b, 1] - corner[a, 1]
        turn = ux * (y - corner[a, 1]) - uy * (x - corner[a, 0])
        least = min(least, turn / np.sqrt(ux * ux + uy * uy))
    return least


@njit(cache=True)
def _flat(point, o, t1, t2, out):
    out[0] = out[1] = 0.0
    for d in range(3):
        out[0] += t1[d] * (point[d] - o[d])
        out[1] += t2[d] * (point[d] - o[d])


@njit(cache=True)
def _nearest_facet(point, nodes, facets, count, n, corner, flat, best_corner):
    """The facet that holds a point or is nearest; how far the point lies off it; writes its plane corners and foot."""
    t1, t2, trial = np.empty(3), np.empty(3), np.empty(2)
    o = nodes[facets[0, 0]]
    length = 0.0
    for d in range(3):
        t1[d] = nodes[facets[0, 1], d] - o[d]
        length += t1[d] ** 2
    t1 /= np.sqrt(length)
    t2[0], t2[1], t2[2] = (
        n[1] * t1[2] - n[2] * t1[1],
        n[2] * t1[0] - n[0] * t1[2],
        n[0] * t1[1] - n[1] * t1[0],
    )
    _flat(point, o, t1, t2, flat)
    best, facet = -np.inf, 0
    for t in range(facets.shape[0]):
        for k in range(count):
            _flat(nodes[facets[t, k]], o, t1, t2, trial)
            corner[k, 0], corner[k, 1] = trial[0], trial[1]
        depth = _depth(corner, count, flat[0], flat[1])
        if depth > best:
            best, facet = depth, t
            best_corner[:] = corner
    height = 0.0
    for d in range(3):
        height += n[d] * (point[d] - o[d])
    beside = min(best, 0.0)
    return facet, np.sqrt(height * height + beside * beside)


@njit(cache=True)
def _into(count, r, s):
    """The reference coordinates of the nearest point of the reference facet, roughly."""
    if count == 4:
        return min(max(r, -1.0), 1.0), min(max(s, -1.0), 1.0)
    r, s = max(r, 0.0), max(s, 0.0)
    return r / max(r + s, 1.0), s / max(r + s, 1.0)


@njit(cache=True)
def surface_points(
    shape, face, arm, towards, fptr, normals, of_face, node_ptr, node, reference, facet_ptr, facet, kind
):  # pragma: no cover - compiled
    """Nodes and shape functions at points of deformable bodies.

    Parameters
    ----------
    shape, face, arm : (n,), (n,), (n, 3) the shape, the face on which each point lies (-1: unknown) and the point in
        body axes
    towards : (n, 3) direction towards the other side, body axes; of faces as near, the one that looks most that way
    fptr, normals : faces of each shape, in body axes
    of_face … kind : as in mechanics.contact.face_meshes

    Returns
    -------
    column, value : (n, 9); size : (n,) how many of them count
    off : (n,) how far each point lies off its facet [m]; infinite where the shape has no facets
    """
    count = shape.shape[0]
    column, value = np.zeros((count, 9), dtype=np.int64), np.zeros((count, 9))
    size, off = np.zeros(count, dtype=np.int64), np.full(count, np.inf)
    corner, best, foot = np.zeros((4, 2)), np.zeros((4, 2)), np.zeros(2)
    for p in range(count):
        first, last = fptr[shape[p]], fptr[shape[p] + 1]
        if face[p] >= 0:
            mesh = of_face[face[p]]
            if facet_ptr[mesh + 1] > facet_ptr[mesh]:
                first, last = face[p], face[p] + 1
        facing = -np.inf
        for f in range(first, last):
            m = of_face[f]
            if facet_ptr[m + 1] == facet_ptr[m]:
                continue
            corners = corner_count(kind[m])
            nodes, facets = reference[node_ptr[m] : node_ptr[m + 1]], facet[facet_ptr[m] : facet_ptr[m + 1]]
            t, far = _nearest_facet(arm[p], nodes, facets, corners, normals[f], corner, foot, best)
            look = 0.0
            for d in range(3):
                look += normals[f, d] * towards[p, d]
            # an edge lies on two faces: a difference of rounding does not choose between them
            scale = 1e-9 * np.sqrt(abs((best[1, 0] - best[0, 0]) ** 2 + (best[1, 1] - best[0, 1]) ** 2))
            if far > off[p] + scale or (far > off[p] - scale and look <= facing):
                continue
            off[p], facing = far, look
            r, s = locate(best, corners, foot[0], foot[1])
            r, s = _into(corners, r, s)
            size[p] = kind[m]
            shapes(kind[m], r, s, value[p])
            for k in range(kind[m]):
                column[p, k] = node[node_ptr[m] + facets[t, k]]
    return column, value, size, off
