"""Joints as pairs of faces in contact; every contact point between faces belongs to one.

The joints of the start of a run keep their numbers, even after they have parted.
"""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.contact.contacts import Contacts, material_points
from mechanics.contact.detection import FLAT
from mechanics.model.model import Model
from mechanics.scene.state import State
from mechanics.stones.convex_polygons import following

__all__ = ["Faces", "Interfaces", "find_interfaces", "placed_faces"]


_HINGED = float(
    np.cos(np.radians(45.0))
)  # cosine of the angle to which a joint of the start may open on its edge


@dataclass(frozen=True)
class Faces:
    """Flat faces of all stones at one instant.

    Attributes
    ----------
    body : (nf,)
    first : (nb+1,) faces of each body
    normal : (nf, 3) outward [-]
    centre : (nf, 3) mean of the corners [m]
    corner : (nf, m, 3) counter-clockwise seen from outside [m]
    count : (nf,) corners of each face
    size : (nf,) smallest width of the body [m]
    flat : (nf,) false for the facets of balls, which serve pictures only
    """

    body: Ints
    first: Ints
    normal: Array
    centre: Array
    corner: Array
    count: Ints
    size: Array
    flat: Bools


@dataclass(frozen=True)
class Interfaces:
    """Pairs of faces in contact now or at the start.

    Attributes
    ----------
    face : (nj, 2) numbers in `Faces`; those of the body with the lower number first
    joint : (nc,) the pair of each contact; -1 without one, as between edges
    """

    face: Ints
    joint: Ints


def placed_faces(model: Model, state: State) -> Faces:
    """Return the faces of all stones at a state; corners of deformable stones follow their nodes."""
    surfaces = model.surfaces
    owner = surfaces.body_of_vertex
    vertex = np.einsum("vij,vj->vi", state.rotation[owner], surfaces.shapes.vertex) + state.centre[owner]
    for b, stone in enumerate(model.stones):
        if stone is not None:
            own = slice(surfaces.body_vptr[b], surfaces.body_vptr[b + 1])
            away = np.linalg.norm(surfaces.shapes.vertex[own, None] - stone.mesh.nodes, axis=2)
            vertex[own] = state.node[model.nodes_of(b)][away.argmin(axis=1)]
    count = np.diff(surfaces.shapes.cptr)
    place = np.arange(int(count.max()))
    chosen = surfaces.shapes.cptr[:-1, None] + np.where(place < count[:, None], place, 0)
    corner = vertex[surfaces.shapes.corner[chosen]]
    shape = np.repeat(np.arange(len(surfaces.body)), np.diff(surfaces.shapes.fptr))
    body = surfaces.body[shape]
    meant = (place < count[:, None])[..., None]
    return Faces(
        body=body,
        first=np.searchsorted(body, np.arange(len(model.mass) + 1)).astype(np.int64),
        normal=np.einsum("fij,fj->fi", state.rotation[body], surfaces.shapes.normal),
        centre=np.where(meant, corner, 0.0).sum(axis=1) / count[:, None],
        corner=corner,
        count=count,
        size=surfaces.size[body],
        flat=surfaces.radius[shape] == 0,
    )


def find_interfaces(faces: Faces, contacts: Contacts, state: State, known: Ints | None = None) -> Interfaces:
    """Return the pairs of faces to which contacts belong.

    Parameters
    ----------
    faces, contacts, state : at one instant
    known : (n, 2) pairs that are kept with or without contacts, numbered first: those of the start
    """
    known = np.zeros((0, 2), dtype=np.int64) if known is None else known
    point, normal = material_points(contacts, state), contacts.frame[:, 0]
    face = np.column_stack(
        [
            _facing(faces, contacts.bodies[:, side], point[:, side], -normal if side == 0 else normal)
            for side in (0, 1)
        ]
    )
    face = np.sort(face, axis=1)  # faces are numbered body after body
    angle = -np.einsum("ci,ci->c", faces.normal[face[:, 0]], faces.normal[face[:, 1]])
    key, known_key = face @ [len(faces.body), 1], known @ [len(faces.body), 1]
    is_known = np.isin(key, known_key)
    valid = (contacts.area > 0) & faces.flat[face].all(axis=1) & (angle > np.where(is_known, _HINGED, FLAT))
    new = np.unique(key[valid & ~is_known])
    every = np.concatenate([known_key, new])
    order = np.argsort(every)
    joint = np.full(len(contacts), -1)
    joint[valid] = order[np.searchsorted(every, key[valid], sorter=order)]
    pairs = np.column_stack([every // len(faces.body), every % len(faces.body)])
    return Interfaces(pairs.astype(np.int64), joint.astype(np.int64))


def _facing(faces: Faces, body: Ints, point: Array, direction: Array) -> Ints:
    """Return the face of a body on which a point lies, among those that face a direction (n, 3)."""
    number = np.diff(faces.first)[body]
    start = np.concatenate([[0], np.cumsum(number)[:-1]]) if len(number) else number
    row = np.repeat(np.arange(len(body)), number)
    face = np.arange(int(number.sum())) + np.repeat(faces.first[body] - start, number)
    looks = np.einsum("fi,fi->f", faces.normal[face], direction[row])
    away = np.where(looks > 0, looks - _distance(faces, face, point[row]) / faces.size[face], -np.inf)
    order = np.lexsort((-away, row))
    best: Ints = face[order][start]
    return best


def _distance(faces: Faces, face: Ints, point: Array) -> Array:
    """Return the distances of points (n, 3) from the planes of faces (n,), plus those beyond their edges [m]."""
    normal, corner, count = faces.normal[face], faces.corner[face], faces.count[face]
    after = following(count, corner.shape[1])
    along = corner[np.arange(len(face))[:, None], after] - corner
    out = np.cross(along, normal[:, None])
    length = np.linalg.norm(out, axis=2)
    beyond = np.einsum("fki,fki->fk", point[:, None] - corner, out) / np.where(length > 0, length, 1.0)
    beyond = np.where(np.arange(corner.shape[1]) < count[:, None], beyond, -np.inf).max(axis=1)
    off = np.abs(np.einsum("fi,fi->f", point - faces.centre[face], normal))
    distance: Array = off + np.maximum(beyond, 0.0)
    return distance
