"""Contacts of deformable stones: weighted points between flat faces (mortar), single points of a surface elsewhere."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from mechanics.contact._kernels_mortar import mortar_integrals
from mechanics.contact.contacts import Contacts
from mechanics.contact.surfaces import FaceMesh, Placed, Surfaces

__all__ = ["mortar_contacts", "surface_weights"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# a node whose share of the interface is below this part of the largest share makes no contact of its own
_SLIVER = 1e-3
_NO_NODES = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True)
class _Side:
    """One side of a contact: a place in body axes, or weighted nodes."""

    arm: Array
    node: Ints
    weight: Array


@dataclass(frozen=True)
class _Point:
    """One contact of an interface."""

    node: int
    area: float
    sides: tuple[_Side, _Side]


def surface_weights(
    surfaces: Surfaces, placed: Placed, sides: Ints, face: Ints, normal: Array, arm: Array, nodes: int
) -> "csr_array[np.float64]":
    """Weights (2 nc, nodes) of the nodes of deformable bodies at single contact points.

    Parameters
    ----------
    sides, face : (nc, 2) shapes of candidate and antagonist, and the faces on which the points lie; -1: the face
        that looks most towards the other side
    normal : (nc, 3) from antagonist to candidate
    arm : (nc, 2, 3) the points in body axes [m]
    """
    rows, columns, values = [], [], []
    meshed = np.array([surfaces.face_mesh[f] is not None for f in surfaces.fptr[:-1]])
    for c, s in zip(*np.nonzero(meshed[sides]), strict=True):
        shape, on = int(sides[c, s]), int(face[c, s])
        if on < 0:
            on = _face_at(surfaces, placed, shape, normal[c] * (1.0 if s else -1.0))
        mesh = surfaces.face_mesh[on]
        assert mesh is not None
        node, weight = _nearest_triangle(mesh, arm[c, s])
        rows.append(np.full(3, 2 * c + s))
        columns.append(node)
        values.append(weight)
    shape_ = (2 * len(sides), nodes)
    if not rows:
        return csr_array(shape_)
    return csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape_)


def mortar_contacts(
    surfaces: Surfaces,
    placed: Placed,
    shapes: Ints,
    faces: Ints,
    key: Ints,
    limit: Array,
    nodes: int,
    thin: float,
) -> tuple[Contacts, Array]:
    """One weighted point per node of the candidate faces of flat interfaces, and the alert distance of each [m].

    Parameters
    ----------
    shapes, faces : (np, 2) those of the reference and of the incident face; at least one is deformable
    key, limit : (np,) first key and alert distance of each interface
    thin : faces that overlap by less than this part of the smaller one do not touch
    """
    bodies, keys, frames, points, limits = [], [], [], [], []
    for pair, face, first, far in zip(shapes, faces, key, limit, strict=True):
        # the candidate is deformable, the finer of two
        finer = _fineness(surfaces, face[0]) > _fineness(surfaces, face[1])
        candidate, antagonist = (0, 1) if finer else (1, 0)
        own = surfaces.body[pair]
        frame, found = _mortar(
            surfaces, placed, own[[candidate, antagonist]], face[[candidate, antagonist]], thin
        )
        for point in found:
            bodies.append(own[[candidate, antagonist]])
            keys.append(int(first) + (1 << 23) + point.node)
            frames.append(frame)
            points.append(point)
            limits.append(far)
    contacts = Contacts(
        np.array(bodies, dtype=np.int64).reshape(-1, 2),
        np.array(keys, dtype=np.int64),
        np.array(frames).reshape(-1, 3, 3),
        np.array([point.area for point in points]),
        np.array([[side.arm for side in point.sides] for point in points]).reshape(-1, 2, 3),
        _packed([side for point in points for side in point.sides], nodes),
    )
    return contacts, np.array(limits)


def _packed(sides: Sequence[_Side], nodes: int) -> "csr_array[np.float64]":
    if not sides:
        return csr_array((0, nodes))
    pointer = np.concatenate([[0], np.cumsum([len(side.node) for side in sides])])
    values = np.concatenate([side.weight for side in sides])
    columns = np.concatenate([side.node for side in sides])
    return csr_array((values, columns, pointer), shape=(len(sides), nodes))


def _mortar(
    surfaces: Surfaces, placed: Placed, body: Ints, face: Ints, thin: float
) -> tuple[Array, list[_Point]]:
    """Frame and points of one interface; `body`, `face` (2,) of candidate and antagonist."""
    (candidate, antagonist), (face_c, face_a) = body.tolist(), face.tolist()
    mesh_c, mesh_a = surfaces.face_mesh[face_c], surfaces.face_mesh[face_a]
    assert mesh_c is not None
    corners = placed.vertex[surfaces.corner[surfaces.cptr[face_a] : surfaces.cptr[face_a + 1]]]
    n = placed.normal[face_a] - placed.normal[face_c]
    frame = _frame(n / np.linalg.norm(n), corners)
    origin, flat = corners[0], frame[1:].T
    outline = (corners - origin) @ flat
    x_c = (_world(placed, candidate, mesh_c) - origin) @ flat
    x_a = outline if mesh_a is None else (_world(placed, antagonist, mesh_a) - origin) @ flat
    t_a = np.zeros((0, 3), dtype=np.int64) if mesh_a is None else mesh_a.facet
    area, own, other, centre = mortar_integrals(x_c, mesh_c.facet, x_a, t_a, outline)
    if area.sum() < thin * min(surfaces.face_area[face_c], surfaces.face_area[face_a]):
        return frame, []
    points = []
    for i in np.flatnonzero(area > _SLIVER * area.max()):
        if mesh_a is None:
            # the point of a rigid antagonist lies on its face, straight below along n
            at = origin + flat @ (centre[i] / area[i])
            slope = frame[0] @ placed.normal[face_a]
            at = at + frame[0] * ((origin - at) @ placed.normal[face_a] / slope)
            arm = placed.rotation[antagonist].T @ (at - placed.centre[antagonist])
            far_side = _Side(arm, _NO_NODES, np.zeros(0))
        else:
            far_side = _Side(np.zeros(3), mesh_a.node, other[i] / area[i])
        sides = _Side(np.zeros(3), mesh_c.node, own[i] / area[i]), far_side
        points.append(_Point(int(mesh_c.node[i]), float(area[i]), sides))
    return frame, points


def _frame(n: Array, corners: Array) -> Array:
    """Rows n, t1, t2, with t1 along the face's first edge, so that the frame turns with the stones."""
    edge = corners[1] - corners[0]
    t1 = edge - (edge @ n) * n
    t1 = t1 / np.linalg.norm(t1)
    return np.array([n, t1, np.cross(n, t1)])


def _world(placed: Placed, body: int, mesh: FaceMesh) -> Array:
    at: Array = placed.centre[body] + mesh.reference @ placed.rotation[body].T
    return at


def _face_at(surfaces: Surfaces, placed: Placed, shape: int, direction: Array) -> int:
    start, stop = surfaces.fptr[shape], surfaces.fptr[shape + 1]
    return int(start + np.argmax(placed.normal[start:stop] @ direction))


def _nearest_triangle(mesh: FaceMesh, arm: Array) -> tuple[Ints, Array]:
    """The nodes of the triangle that holds a point of the face (body axes), and its barycentric weights."""
    corners = mesh.reference[mesh.facet]
    a, b, r = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], arm - corners[:, 0]
    aa, bb, ab = (np.einsum("ti,ti->t", x, y) for x, y in ((a, a), (b, b), (a, b)))
    ra, rb = np.einsum("ti,ti->t", r, a), np.einsum("ti,ti->t", r, b)
    det = aa * bb - ab**2
    w1, w2 = (bb * ra - ab * rb) / det, (aa * rb - ab * ra) / det
    t = int(np.minimum(np.minimum(w1, w2), 1.0 - w1 - w2).argmax())
    weight = np.clip([1.0 - w1[t] - w2[t], w1[t], w2[t]], 0.0, 1.0)
    return mesh.node[mesh.facet[t]], weight / weight.sum()


def _fineness(surfaces: Surfaces, face: int) -> float:
    """Finite-element triangles per area of a face; zero if its body is rigid."""
    mesh = surfaces.face_mesh[face]
    return 0.0 if mesh is None else len(mesh.facet) / float(surfaces.face_area[face])
