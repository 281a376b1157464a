"""Mortar method: from integrals over the overlap of faces to weighted contact points."""

from typing import NamedTuple

import numpy as np
from numba import njit

from mechanics.arrays import Array, Ints
from mechanics.contact._kernels.facets import corner_count
from mechanics.contact._kernels.overlap import FlatMesh, flattened, overlap_integrals, room
from mechanics.contact._kernels.vectors import dot, minus, row

_SLIVER = 1e-2  # a node whose share of the overlap is below this fraction of a neighbour's is merged into it


class FacePairs(NamedTuple):
    """Pairs of flat faces; 0 is the candidate, 1 the antagonist.

    Attributes
    ----------
    mesh : (ni, 2) int64; -1 for a rigid antagonist
    face, body : (ni, 2) int64
    frame : (ni, 3, 3) float64, rows n, t1, t2 [-]
    origin : (ni, 3) float64 [m]
    least : (ni,) float64, overlaps of less area do not touch [m²]
    """

    mesh: Ints
    face: Ints
    body: Ints
    frame: Array
    origin: Array
    least: Array


class Bodies(NamedTuple):
    """Places of the bodies: centre (nb, 3) float64 [m] and rotation (nb, 3, 3) float64 [-]."""

    centre: Array
    rotation: Array


class _Side(NamedTuple):
    """Nodes of a mesh: their numbers over all bodies, and their positions in the current sparse row."""

    node: Ints
    slot: Ints


@njit(cache=True)
def _join(facet, used, corners, share, kept):
    """Return the representative of each node: itself, or a kept neighbour; -1 where nothing is covered.

    Nodes that are not `kept`, or whose share is a sliver of a neighbour's, are merged into that neighbour.
    """
    best, seen = np.full(share.shape[0], -1), np.zeros(share.shape[0], dtype=np.bool_)
    for t in used:
        top = -1
        for i in range(corners):
            node = facet[t, i]
            seen[node] = True
            if kept[node] and (top < 0 or share[node] > share[top]):
                top = node
        for i in range(corners):
            node = facet[t, i]
            if top >= 0 and (best[node] < 0 or share[top] > share[best[node]]):
                best[node] = top
    root = np.full(share.shape[0], -1)
    for node in range(share.shape[0]):
        if not seen[node]:
            continue
        r = node
        # a kept node has a sliver only beside a much larger share, so the chain ends
        while best[r] >= 0 and (not kept[r] or share[r] < _SLIVER * share[best[r]]):
            r = best[r]
        root[node] = r
    return root


@njit(cache=True)
def _incidence(facet, used, corners, key, count):
    """Sort places in `used` × corners by the key of their node; return pointers and places."""
    start = np.zeros(count + 1, dtype=np.int64)
    for t in used:
        for i in range(corners):
            start[key[facet[t, i]] + 1] += 1
    for k in range(count):
        start[k + 1] += start[k]
    place, cursor = np.empty(start[-1], dtype=np.int64), start[:-1].copy()
    for u in range(used.shape[0]):
        for i in range(corners):
            k = key[facet[used[u], i]]
            place[cursor[k]] = u * corners + i
            cursor[k] += 1
    return start, place


@njit(cache=True)
def _scatter(nodes, values, scale, side, column, value, base, end):
    """Add values to a sparse row that begins at `base` and ends at `end`; return its new end."""
    for k in range(nodes.shape[0]):
        if values[k] == 0.0:
            continue
        node = nodes[k]
        at = side.slot[node]
        if at < base:
            at = end
            side.slot[node] = at
            column[at] = side.node[node]
            value[at] = 0.0
            end += 1
        value[at] += scale * values[k]
    return end


@njit(cache=True)
def _flat_mesh(m, b, p, interfaces, bodies, meshes):
    """Return mesh m of body b in the plane of interface p; -1 gives one without nodes."""
    if m < 0:
        return FlatMesh(np.empty((0, 2)), meshes.facet[:0, :0], np.int64(0))
    nodes = meshes.reference[meshes.node_ptr[m] : meshes.node_ptr[m + 1]]
    x = flattened(nodes, bodies.centre[b], bodies.rotation[b], interfaces.origin[p], interfaces.frame[p])
    kind = meshes.kind[m]
    return FlatMesh(x, meshes.facet[meshes.facet_ptr[m] : meshes.facet_ptr[m + 1], :kind], kind)


@njit(cache=True)
def _bare(p, interfaces, meshes):
    """Return whether a face of the interface belongs to a deformable body but has no facets."""
    m, a = interfaces.mesh[p, 0], interfaces.mesh[p, 1]
    start = meshes.facet_ptr
    return start[m] == start[m + 1] or (a >= 0 and start[a] == start[a + 1])


@njit(cache=True)
def mortar_rows(kept_ptr, kept, interfaces, bodies, meshes, shapes, shares):  # pragma: no cover - compiled
    """Make weighted points of flat interfaces: one per corner node of the candidate's facets.

    ψ_α is linear or bilinear on the facets of the candidate: the hat, one at its node α and zero at the other corners,
    or where the overlap covers a facet the function dual to it. Where a node is not kept, or has a negligible share of
    the overlap, its ψ is added to a neighbour's. Quadrature has the degree of ψ times a shape function, 2 to 6, so it
    is exact on triangles and parallelograms; on other quadrilaterals both sides still see the same points, and so the
    same constants and places.

    Inputs
    ------
    kept_ptr : (ni+1,) int64, nodes of the candidate in each interface
    kept : bool, whether each of them may have a contact; empty if only the shares are wanted
    interfaces : Interfaces
    bodies : Bodies
    meshes : FacetMeshes
    shapes : Polyhedra, world axes

    Outputs
    -------
    shares : float64, ∫ψ of each node of the candidates before any are joined [m²], written where faces touch
    interface, key : (nc,) int64, interface and node (numbered over all bodies) of each contact
    area : (nc,) float64, ∫ψ [m²]
    middle : (nc, 3) float64, ∫ψ (x, y, x² + y²) / ∫ψ, with x, y along the second and third row of the frame from the
        origin [m, m, m²]
    pointer : (2 nc + 1,) int64, with column (int64) and value (float64): csr rows ∫ψ N_k / ∫ψ of candidate and
        antagonist [-]
    """
    interface, key = np.empty(64, dtype=np.int64), np.empty(64, dtype=np.int64)
    area, middle = np.empty(64), np.empty(3 * 64)
    pointer = np.zeros(129, dtype=np.int64)
    column, value = np.empty(1024, dtype=np.int64), np.empty(1024)
    largest = 0
    for m in range(meshes.node_ptr.shape[0] - 1):
        largest = max(largest, meshes.node_ptr[m + 1] - meshes.node_ptr[m])
    # position of a node in the current row; positions only grow, so old entries need no clearing
    slot_c, slot_a = np.full(largest, -1), np.full(largest, -1)
    # not a literal type, for which numba would compile the callees again
    count, end = np.int64(0), np.int64(0)
    for p in range(interfaces.mesh.shape[0]):
        if _bare(p, interfaces, meshes):
            continue
        m, a = interfaces.mesh[p, 0], interfaces.mesh[p, 1]
        own = _flat_mesh(m, interfaces.body[p, 0], p, interfaces, bodies, meshes)
        other = _flat_mesh(a, interfaces.body[p, 1], p, interfaces, bodies, meshes)
        outlines, size = _outlines(p, (meshes.cut[m], a < 0 or meshes.cut[a]), interfaces, shapes)
        share, moment = np.zeros(own.x.shape[0]), np.zeros((own.x.shape[0], 3))
        used, mass, met_ptr, met, cross = overlap_integrals(own, other, outlines, size, share, moment)
        covered = 0.0
        for n in range(share.shape[0]):
            covered += share[n]
        if not covered >= interfaces.least[p]:
            continue
        for n in range(share.shape[0]):
            shares[kept_ptr[p] + n] = share[n]
        if kept.shape[0] == 0 or used.shape[0] == 0:
            continue
        candidate = _Side(meshes.node[meshes.node_ptr[m] :], slot_c)
        antagonist = _Side(meshes.node[meshes.node_ptr[a] :], slot_a)  # unused if it is rigid
        corners = corner_count(own.kind)
        root = _join(own.facet, used, corners, share, kept[kept_ptr[p] : kept_ptr[p + 1]])
        start, place = _incidence(own.facet, used, corners, root, share.shape[0])
        joined, joined_moment = np.zeros(share.shape[0]), np.zeros((share.shape[0], 3))
        for n in range(share.shape[0]):
            if root[n] >= 0:
                joined[root[n]] += share[n]
                for d in range(3):
                    joined_moment[root[n], d] += moment[n, d]
        for n in range(share.shape[0]):
            if start[n] == start[n + 1] or joined[n] <= 0.0:
                continue
            interface, key = room(interface, count + 1), room(key, count + 1)
            area, pointer = room(area, count + 1), room(pointer, 2 * count + 3)
            middle = room(middle, 3 * count + 3)
            interface[count], key[count], area[count] = p, candidate.node[n], joined[n]
            for d in range(3):
                middle[3 * count + d] = joined_moment[n, d] / joined[n]
            scale = 1.0 / joined[n]
            base = end
            for e in range(start[n], start[n + 1]):
                u = place[e] // corners
                column, value = room(column, end + own.kind), room(value, end + own.kind)
                at = place[e] * own.kind
                part = mass[at : at + own.kind]
                end = _scatter(own.facet[used[u]], part, scale, candidate, column, value, base, end)
            pointer[2 * count + 1] = end
            base = end
            if a >= 0:
                for e in range(start[n], start[n + 1]):
                    u, i = place[e] // corners, place[e] % corners
                    for f in range(met_ptr[u], met_ptr[u + 1]):
                        column, value = room(column, end + other.kind), room(value, end + other.kind)
                        at = (f * corners + i) * other.kind
                        part = cross[at : at + other.kind]
                        end = _scatter(other.facet[met[f]], part, scale, antagonist, column, value, base, end)
            pointer[2 * count + 2] = end
            count += 1
    return (
        interface[:count],
        key[:count],
        area[:count],
        middle[: 3 * count].reshape(count, 3),
        pointer[: 2 * count + 1],
        column[:end],
        value[:end],
    )


@njit(cache=True)
def _outlines(p, bounded, interfaces, shapes):
    """Return the polygons of those of the two faces that are `bounded` beyond their meshes, and their sizes."""
    size = np.zeros(2, dtype=np.int64)
    for s in range(2):
        if bounded[s]:
            f = interfaces.face[p, s]
            size[s] = shapes.cptr[f + 1] - shapes.cptr[f]
    out = np.empty((size[0] + size[1], 2))
    o, t1, t2 = row(interfaces.origin, p), row(interfaces.frame[p], 1), row(interfaces.frame[p], 2)
    k = 0
    for s in range(2):
        start = shapes.cptr[interfaces.face[p, s]]
        for c in range(start, start + size[s]):
            v = minus(row(shapes.vertex, shapes.corner[c]), o)
            out[k, 0], out[k, 1] = dot(t1, v), dot(t2, v)
            k += 1
    return out, size
