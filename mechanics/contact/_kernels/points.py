"""Single contact points on meshed faces: the facet that holds a point, and its shape functions there."""

import numpy as np
from numba import njit

from mechanics.contact._kernels.facets import corner_count, locate, shape_functions
from mechanics.contact._kernels.vectors import cross, dot, minus, norm, over, row


@njit(cache=True)
def _depth(corner, count, x, y):
    """Return the depth of a point inside the sides of a facet, counter-clockwise [m]."""
    least = np.inf
    for a in range(count):
        b = a + 1 if a + 1 < count else 0
        ux, uy = corner[b, 0] - corner[a, 0], corner[b, 1] - corner[a, 1]
        turn = ux * (y - corner[a, 1]) - uy * (x - corner[a, 0])
        least = min(least, turn / np.sqrt(ux * ux + uy * uy))
    return least


@njit(cache=True)
def _nearest_facet(point, nodes, facets, count, n, corner, best_corner):
    """Find the facet that holds a point or is nearest to it.

    Return the facet, the distance of the point from it [m], and the point in the plane; write the plane corners of the
    facet to `best_corner`. The plane's first axis runs along the first edge of the first facet.
    """
    o = row(nodes, facets[0, 0])
    edge = minus(row(nodes, facets[0, 1]), o)
    t1 = over(edge, norm(edge))
    t2 = cross(n, t1)
    away = minus(point, o)
    x, y = dot(t1, away), dot(t2, away)
    best, facet = -np.inf, 0
    for t in range(facets.shape[0]):
        for k in range(count):
            d = minus(row(nodes, facets[t, k]), o)
            corner[k, 0], corner[k, 1] = dot(t1, d), dot(t2, d)
        depth = _depth(corner, count, x, y)
        if depth > best:
            best, facet = depth, t
            for k in range(count):
                best_corner[k, 0], best_corner[k, 1] = corner[k, 0], corner[k, 1]
    height, beside = dot(n, away), min(best, 0.0)
    return facet, np.sqrt(height * height + beside * beside), x, y


@njit(cache=True)
def _into(count, r, s):
    """Return an approximation to the nearest point of the reference facet."""
    if count == 4:
        return min(max(r, -1.0), 1.0), min(max(s, -1.0), 1.0)
    r, s = max(r, 0.0), max(s, 0.0)
    return r / max(r + s, 1.0), s / max(r + s, 1.0)


@njit(cache=True)
def surface_points(shape, face, arm, towards, shapes, meshes):  # pragma: no cover - compiled
    """Find nodes and shape functions at points of deformable bodies.

    Inputs
    ------
    shape : (n,) int64, shape of each point
    face : (n,) int64, the face on which it lies; -1: unknown
    arm : (n, 3) float64, the point, body axes [m]
    towards : (n, 3) float64, direction towards the other side, body axes; of equally near faces, the one that
        faces that way most is taken [-]
    shapes : Polyhedra, body axes
    meshes : FacetMeshes

    Outputs
    -------
    column : (n, 9) int64, nodes
    value : (n, 9) float64, shape functions [-]
    size : (n,) int64, how many of them are used
    off : (n,) float64, distance of each point from its facet; infinite where the shape has no facets [m]
    """
    count = shape.shape[0]
    column, value = np.zeros((count, 9), dtype=np.int64), np.zeros((count, 9))
    size, off = np.zeros(count, dtype=np.int64), np.full(count, np.inf)
    corner, best = np.zeros((4, 2)), np.zeros((4, 2))
    for p in range(count):
        point, way = row(arm, p), row(towards, p)
        first, last = shapes.fptr[shape[p]], shapes.fptr[shape[p] + 1]
        if face[p] >= 0:
            mesh = meshes.of_face[face[p]]
            if meshes.facet_ptr[mesh + 1] > meshes.facet_ptr[mesh]:
                first, last = face[p], face[p] + 1
        facing = -np.inf
        for f in range(first, last):
            m = meshes.of_face[f]
            if meshes.facet_ptr[m + 1] == meshes.facet_ptr[m]:
                continue
            kind, corners, n = meshes.kind[m], corner_count(meshes.kind[m]), row(shapes.normal, f)
            nodes = meshes.reference[meshes.node_ptr[m] : meshes.node_ptr[m + 1]]
            facets = meshes.facet[meshes.facet_ptr[m] : meshes.facet_ptr[m + 1]]
            t, far, x, y = _nearest_facet(point, nodes, facets, corners, n, corner, best)
            look = dot(n, way)
            # an edge lies on two faces: rounding must not choose between them
            scale = 1e-9 * np.sqrt(abs((best[1, 0] - best[0, 0]) ** 2 + (best[1, 1] - best[0, 1]) ** 2))
            if far > off[p] + scale or (far > off[p] - scale and look <= facing):
                continue
            off[p], facing = far, look
            r, s = locate(best, corners, x, y)
            r, s = _into(corners, r, s)
            size[p] = kind
            shape_functions(kind, r, s, value[p])
            for k in range(kind):
                column[p, k] = meshes.node[meshes.node_ptr[m] + facets[t, k]]
    return column, value, size, off
