"""The surfaces of all bodies in flat arrays: what contact detection needs to know of a scene."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechanics.polyhedra import face_plane, smallest_width

__all__ = ["FaceMesh", "Surfaces", "surfaces"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class FaceMesh:
    """The finite-element nodes and triangles on one face of a deformable body.

    Attributes
    ----------
    node : (k,) nodes, numbered over all deformable bodies
    reference : (k, 3) their places in body axes [m]
    triangle : (m, 3) indices into `node`
    """

    node: Ints
    reference: Array
    triangle: Ints


@dataclass(frozen=True)
class Surfaces:
    """Convex polyhedra of all bodies, in body axes, as in mechanics.contact._kernels.

    Attributes
    ----------
    vptr : (nb+1,) vertices of each body
    vertex : (nv, 3) relative to the centre of mass, body axes [m]
    fptr : (nb+1,) faces of each body
    cptr, corner : corners of each face
    normal : (nf, 3) outward, body axes
    eptr, edge_a, edge_b : edges of each body, as vertex indices
    size : (nb,) smallest width of each body [m]
    face_area : (nf,) [m²]
    face_mesh : per face, its finite elements; None for rigid bodies
    """

    vptr: Ints
    vertex: Array
    fptr: Ints
    cptr: Ints
    corner: Ints
    normal: Array
    eptr: Ints
    edge_a: Ints
    edge_b: Ints
    size: Array
    face_area: Array
    face_mesh: tuple[FaceMesh | None, ...]

    @property
    def body_of_vertex(self) -> Ints:
        """(nv,) the body of each vertex."""
        return np.repeat(np.arange(len(self.vptr) - 1), np.diff(self.vptr))

    @property
    def body_of_face(self) -> Ints:
        """(nf,) the body of each face."""
        return np.repeat(np.arange(len(self.fptr) - 1), np.diff(self.fptr))


def surfaces(
    vertices: Sequence[Array],
    faces: Sequence[tuple[tuple[int, ...], ...]],
    face_mesh: Sequence[FaceMesh | None],
) -> Surfaces:
    """Pack bodies given by their corners (body axes) and faces."""
    vptr = _pointer([len(v) for v in vertices])
    corners = [start + np.asarray(face) for start, group in zip(vptr, faces, strict=False) for face in group]
    vertex = np.vstack(list(vertices))
    edges = [_edges(group) + start for group, start in zip(faces, vptr, strict=False)]
    packed = np.vstack(edges)
    polygons = [vertex[c] for c in corners]
    return Surfaces(
        vptr=vptr,
        vertex=vertex,
        fptr=_pointer([len(group) for group in faces]),
        cptr=_pointer([len(c) for c in corners]),
        corner=np.concatenate(corners).astype(np.int64),
        normal=np.array([face_plane(p)[0] for p in polygons]),
        eptr=_pointer([len(e) for e in edges]),
        edge_a=np.ascontiguousarray(packed[:, 0]),
        edge_b=np.ascontiguousarray(packed[:, 1]),
        size=np.array([smallest_width(v, group) for v, group in zip(vertices, faces, strict=True)]),
        face_area=np.array([_area(p) for p in polygons]),
        face_mesh=tuple(face_mesh),
    )


def _pointer(counts: Sequence[int]) -> Ints:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def _area(polygon: Array) -> float:
    local = polygon - polygon.mean(axis=0)
    return float(0.5 * np.linalg.norm(np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)))


def _edges(faces: tuple[tuple[int, ...], ...]) -> Ints:
    """All edges (ne, 2), each once."""
    pairs = {(min(a, b), max(a, b)) for f in faces for a, b in zip(f, (*f[1:], f[0]), strict=True)}
    return np.array(sorted(pairs), dtype=np.int64)
