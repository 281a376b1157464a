"""Numba kernels of the mortar method: from integrals over the overlap of faces to weighted contact points."""

import numpy as np
from numba import njit

from mechanics.contact._kernels.facets import corner_count
from mechanics.contact._kernels.overlap import flattened, overlap_integrals, room

__all__ = ["mortar_rows", "mortar_shares"]

# a node whose share of the overlap is below this part of a neighbour's is joined to it
_SLIVER = 1e-2


@njit(cache=True)
def _join(facet, used, corners, share, kept):
    """The node for which each node counts: itself, or a neighbour that is kept; -1 where nothing is covered.

    Nodes join a neighbour that are not `kept`, or whose share is a sliver of the neighbour's.
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
        # a kept node has a sliver only beside a much larger share, so the way ends
        while best[r] >= 0 and (not kept[r] or share[r] < _SLIVER * share[best[r]]):
            r = best[r]
        root[node] = r
    return root


@njit(cache=True)
def _incidence(facet, used, corners, key, count):
    """Places in `used` × corners, sorted by the key of their node: pointers and places."""
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
def _scatter(nodes, values, name, scale, slot, column, value, base, end):
    """Add values to a sparse row that begins at `base` and ends at `end`; its new end."""
    for k in range(nodes.shape[0]):
        if values[k] == 0.0:
            continue
        node = nodes[k]
        at = slot[node]
        if at < base:
            at = end
            slot[node] = at
            column[at] = name[node]
            value[at] = 0.0
            end += 1
        value[at] += scale * values[k]
    return end


@njit(cache=True)
def _interface(
    p, mesh, face, body, frame, origin, centre, rotation,
    node_ptr, reference, facet_ptr, facet, kind, cut, vertices, cptr, corner,
):  # fmt: skip
    """Shares and moments (nodes,), (nodes, 3) of the candidate's nodes in one interface, and `overlap_integrals`."""
    m, a = mesh[p, 0], mesh[p, 1]
    kind_c, kind_a = kind[m], kind[a] if a >= 0 else 0
    b = body[p, 0]
    x_c = flattened(reference[node_ptr[m] : node_ptr[m + 1]], centre[b], rotation[b], origin[p], frame[p])
    x_a, other = np.empty((0, 2)), facet[:0, :0]
    if a >= 0:
        b = body[p, 1]
        x_a = flattened(reference[node_ptr[a] : node_ptr[a + 1]], centre[b], rotation[b], origin[p], frame[p])
        other = facet[facet_ptr[a] : facet_ptr[a + 1], :kind_a]
    outlines, size = _outlines(face[p], cut[m], a < 0 or cut[a], vertices, cptr, corner, origin[p], frame[p])
    share, moment = np.zeros(x_c.shape[0]), np.zeros((x_c.shape[0], 3))
    own = facet[facet_ptr[m] : facet_ptr[m + 1], :kind_c]
    return (
        share,
        moment,
        overlap_integrals(x_c, own, kind_c, x_a, other, kind_a, outlines, size, share, moment),
    )


@njit(cache=True)
def _bare(p, mesh, facet_ptr):
    """Whether a face of the interface is a deformable body's, but has no facets."""
    m, a = mesh[p, 0], mesh[p, 1]
    return facet_ptr[m] == facet_ptr[m + 1] or (a >= 0 and facet_ptr[a] == facet_ptr[a + 1])


@njit(cache=True)
def mortar_shares(
    mesh, face, body, frame, origin, least, centre, rotation,
    node_ptr, node, reference, facet_ptr, facet, kind, cut, vertices, cptr, corner,
):  # fmt: skip  # pragma: no cover - compiled
    """∫ψ of all nodes of the candidate in each interface, as of `mortar_rows`: pointers (ni+1,) and shares."""
    pointer = np.zeros(mesh.shape[0] + 1, dtype=np.int64)
    for p in range(mesh.shape[0]):
        pointer[p + 1] = pointer[p] + node_ptr[mesh[p, 0] + 1] - node_ptr[mesh[p, 0]]
    shares = np.zeros(pointer[-1])
    for p in range(mesh.shape[0]):
        if not _bare(p, mesh, facet_ptr):
            share, _, _ = _interface(
                p, mesh, face, body, frame, origin, centre, rotation,
                node_ptr, reference, facet_ptr, facet, kind, cut, vertices, cptr, corner,
            )  # fmt: skip
            if share.sum() >= least[p]:
                shares[pointer[p] : pointer[p + 1]] = share
    return pointer, shares


@njit(cache=True)
def mortar_rows(
    kept_ptr, kept, mesh, face, body, frame, origin, least, centre, rotation,
    node_ptr, node, reference, facet_ptr, facet, kind, cut, vertices, cptr, corner,
):  # fmt: skip  # pragma: no cover - compiled
    """Weighted points of flat interfaces: one per corner node of the candidate's facets.

    ψ_α is linear or bilinear on the facets of the candidate: the hat, one at its node α and zero at the other corners,
    or where the overlap covers a facet the function dual to it. Where a node is not kept, or has next to no share of
    the overlap, its ψ is added to a neighbour's. Quadrature has the degree of ψ times a shape function, 2 to 6, so it
    is exact on triangles and parallelograms; on other quadrilaterals both sides still see the same points, and so the
    same constants and places.

    Parameters
    ----------
    kept_ptr, kept : (ni+1,), flags of the nodes of the candidate in each interface: it may have a contact
    mesh : (ni, 2) meshes of candidate and antagonist; -1: rigid
    face, body : (ni, 2) their faces and bodies
    frame, origin : (ni, 3, 3), (ni, 3)
    least : (ni,) overlaps of less area do not touch
    centre, rotation : of the bodies
    node_ptr … cut : of all meshes, as in mechanics.contact.face_meshes
    vertices, cptr, corner : of all faces, world axes

    Returns
    -------
    interface, key : (nc,) interface and node (numbered over all bodies) of each contact
    area : (nc,) ∫ψ
    middle : (nc, 3) ∫ψ (x, y, x² + y²) / ∫ψ, with x, y along the second and third row of the frame from the origin
    pointer, column, value : (2 nc + 1,), … csr rows ∫ψ N_k / ∫ψ of candidate and antagonist
    """
    interface, key = np.empty(64, dtype=np.int64), np.empty(64, dtype=np.int64)
    area, middle = np.empty(64), np.empty(3 * 64)
    pointer = np.zeros(129, dtype=np.int64)
    column, value = np.empty(1024, dtype=np.int64), np.empty(1024)
    largest = 0
    for m in range(node_ptr.shape[0] - 1):
        largest = max(largest, node_ptr[m + 1] - node_ptr[m])
    # where a node has its place in the row at work; places only grow, so old entries need no clearing
    slot_c, slot_a = np.full(largest, -1), np.full(largest, -1)
    count, end = 0, 0
    for p in range(mesh.shape[0]):
        if _bare(p, mesh, facet_ptr):
            continue
        share, moment, (used, mass, met_ptr, met, cross) = _interface(
            p, mesh, face, body, frame, origin, centre, rotation,
            node_ptr, reference, facet_ptr, facet, kind, cut, vertices, cptr, corner,
        )  # fmt: skip
        if not share.sum() >= least[p] or used.shape[0] == 0:
            continue
        m, a = mesh[p, 0], mesh[p, 1]
        kind_c, kind_a = kind[m], kind[a] if a >= 0 else 0
        own, name_c = facet[facet_ptr[m] : facet_ptr[m + 1], :kind_c], node[node_ptr[m] : node_ptr[m + 1]]
        other, name_a = facet[:0, :0], node[:0]
        if a >= 0:
            other, name_a = (
                facet[facet_ptr[a] : facet_ptr[a + 1], :kind_a],
                node[node_ptr[a] : node_ptr[a + 1]],
            )
        corners = corner_count(kind_c)
        root = _join(own, used, corners, share, kept[kept_ptr[p] : kept_ptr[p + 1]])
        start, place = _incidence(own, used, corners, root, share.shape[0])
        joined, joined_moment = np.zeros(share.shape[0]), np.zeros((share.shape[0], 3))
        for n in range(share.shape[0]):
            if root[n] >= 0:
                joined[root[n]] += share[n]
                joined_moment[root[n]] += moment[n]
        for n in range(share.shape[0]):
            if start[n] == start[n + 1] or joined[n] <= 0.0:
                continue
            interface, key = room(interface, count + 1), room(key, count + 1)
            area, pointer = room(area, count + 1), room(pointer, 2 * count + 3)
            middle = room(middle, 3 * count + 3)
            interface[count], key[count], area[count] = p, name_c[n], joined[n]
            middle[3 * count : 3 * count + 3] = joined_moment[n] / joined[n]
            scale = 1.0 / joined[n]
            base = end
            for e in range(start[n], start[n + 1]):
                u, i = place[e] // corners, place[e] % corners
                column, value = room(column, end + kind_c), room(value, end + kind_c)
                at = (u * corners + i) * kind_c
                end = _scatter(
                    own[used[u]], mass[at : at + kind_c], name_c, scale, slot_c, column, value, base, end
                )
            pointer[2 * count + 1] = end
            base = end
            if a >= 0:
                for e in range(start[n], start[n + 1]):
                    u, i = place[e] // corners, place[e] % corners
                    for f in range(met_ptr[u], met_ptr[u + 1]):
                        column, value = room(column, end + kind_a), room(value, end + kind_a)
                        at = (f * corners + i) * kind_a
                        end = _scatter(
                            other[met[f]],
                            cross[at : at + kind_a],
                            name_a,
                            scale,
                            slot_a,
                            column,
                            value,
                            base,
                            end,
                        )
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
def _outlines(face, with_first, with_second, vertices, cptr, corner, origin, frame):
    """The polygons in the plane of those of two faces that bound the overlap besides their meshes, and their sizes."""
    size = np.zeros(2, dtype=np.int64)
    for s in range(2):
        if with_second if s else with_first:
            size[s] = cptr[face[s] + 1] - cptr[face[s]]
    out = np.empty((size.sum(), 2))
    k = 0
    for s in range(2):
        for c in range(cptr[face[s]], cptr[face[s]] + size[s]):
            v = vertices[corner[c]]
            for d in range(2):
                t = frame[1 + d]
                out[k, d] = t[0] * (v[0] - origin[0]) + t[1] * (v[1] - origin[1]) + t[2] * (v[2] - origin[2])
            k += 1
    return out, size
