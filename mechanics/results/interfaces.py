"""Joints as pairs of faces in contact; every contact point between faces belongs to one.

The joints of the start of a run keep their numbers, even after they have parted.
"""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Ints
from mechanics.contact.contacts import Contacts, material_points
from mechanics.contact.detection import FLAT
from mechanics.model.model import Model
from mechanics.results._kernels import Faces, facing
from mechanics.scene.state import State

_HINGED = float(
    np.cos(np.radians(45.0))
)  # cosine of the angle to which a joint of the start may open on its edge


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
            corners = slice(surfaces.body_vptr[b], surfaces.body_vptr[b + 1])
            away = np.linalg.norm(surfaces.shapes.vertex[corners, None] - stone.mesh.nodes, axis=2)
            vertex[corners] = state.node[model.nodes_of(b)][away.argmin(axis=1)]
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
        corners=count,
        size=surfaces.size[body],
        flat=surfaces.radius[shape] == 0,
    )


def find_interfaces(
    faces: Faces, contacts: Contacts, state: State, known_pairs: Ints | None = None
) -> Interfaces:
    """Return the pairs of faces to which contacts belong.

    Parameters
    ----------
    faces, contacts, state : at one instant
    known_pairs : (n, 2) pairs that are kept with or without contacts, numbered first: those of the start
    """
    known_pairs = np.zeros((0, 2), dtype=np.int64) if known_pairs is None else known_pairs
    # contiguous as its opposite is: a kernel is compiled once more for views
    point, normal = material_points(contacts, state), np.ascontiguousarray(contacts.frame[:, 0])
    face = np.column_stack(
        [
            facing(faces, contacts.bodies[:, side], point[:, side], -normal if side == 0 else normal)
            for side in (0, 1)
        ]
    )
    face = np.sort(face, axis=1)  # faces are numbered body after body
    angle = -np.einsum("ci,ci->c", faces.normal[face[:, 0]], faces.normal[face[:, 1]])
    key, known_key = face @ [len(faces.body), 1], known_pairs @ [len(faces.body), 1]
    is_known = np.isin(key, known_key)
    valid = (contacts.area > 0) & faces.flat[face].all(axis=1) & (angle > np.where(is_known, _HINGED, FLAT))
    new = np.unique(key[valid & ~is_known])
    every = np.concatenate([known_key, new])
    order = np.argsort(every)
    joint = np.full(len(contacts), -1)
    joint[valid] = order[np.searchsorted(every, key[valid], sorter=order)]
    pairs = np.column_stack([every // len(faces.body), every % len(faces.body)])
    return Interfaces(pairs.astype(np.int64), joint.astype(np.int64))
