"""Surfaces of all bodies in flat arrays, as contact detection needs them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from mechanics.arrays import Array, Ints
from mechanics.contact._kernels.facets import FacetMeshes
from mechanics.contact._kernels.narrow_phase import Polyhedra
from mechanics.contact.face_meshes import FaceMesh, packed_meshes
from mechanics.stones.polyhedra import face_plane, smallest_width

__all__ = ["Placed", "Surfaces", "middles", "surfaces"]


# faces of the parts of a body are in one plane
_SAME_WAY = 1.0 - 1e-12  # if their normals have at least this cosine
_SAME_PLANE = 1e-6  # and they lie off each other by no more than this part of its size


@dataclass(frozen=True)
class Surfaces:
    """The convex polyhedra and balls of all bodies.

    A body has one shape, or one for each of its convex parts; the shapes of a body follow one another.

    Attributes
    ----------
    body : (ns,) the body of each shape
    sptr : (nb+1,) shapes of each body
    shapes : all shapes, in the axes of their bodies, from their centres of mass
    radius : (ns,) of balls, zero for polyhedra [m]
    size : (nb,) smallest width of each body, that of all its parts together [m]
    plane : (nf,) a number that faces of one body share if they lie in one plane
    face_mesh : per face, its finite elements; None for rigid bodies
    meshes : the same, packed
    """

    body: Ints
    sptr: Ints
    shapes: Polyhedra
    radius: Array
    size: Array
    plane: Ints
    face_mesh: tuple[FaceMesh | None, ...]
    meshes: FacetMeshes

    @property
    def body_vptr(self) -> Ints:
        """(nb+1,) vertices of each body."""
        return self.shapes.vptr[self.sptr]

    @property
    def body_of_vertex(self) -> Ints:
        """(nv,) the body of each vertex."""
        return np.repeat(self.body, np.diff(self.shapes.vptr))


@dataclass(frozen=True)
class Placed:
    """The shapes in world axes, and the frames of their bodies.

    Attributes
    ----------
    shapes : of all bodies, world axes
    centre : (nb, 3) of the bodies [m]
    rotation : (nb, 3, 3) of the bodies [-]
    """

    shapes: Polyhedra
    centre: Array
    rotation: Array


def surfaces(
    vertices: Sequence[Array],
    faces: Sequence[tuple[tuple[int, ...], ...]],
    face_mesh: Sequence[FaceMesh | None],
    body: Sequence[int],
    radius: Sequence[float] = (),
) -> Surfaces:
    """Pack shapes given by corners (body axes), faces, the body each belongs to, in order, and radii of balls."""
    vptr, fptr = _pointer([len(v) for v in vertices]), _pointer([len(group) for group in faces])
    corners = [start + np.asarray(face) for start, group in zip(vptr, faces, strict=False) for face in group]
    vertex = np.vstack(list(vertices))
    polygons = [vertex[c] for c in corners]
    normal = np.array([face_plane(p)[0] for p in polygons])
    edges = [
        _edges(group, vertex, normal, int(v), int(f)) for group, v, f in zip(faces, vptr, fptr, strict=False)
    ]
    packed = np.vstack(edges)
    owner = np.asarray(body, dtype=np.int64)
    sptr = _pointer(np.bincount(owner).tolist())
    radii = np.array(radius, dtype=float) if len(radius) else np.zeros(len(body))
    size = np.array(
        [
            2.0 * r if r > 0 else smallest_width(v, group)
            for v, group, r in zip(vertices, faces, radii, strict=True)
        ]
    )
    return Surfaces(
        body=owner,
        sptr=sptr,
        shapes=Polyhedra(
            vptr=vptr,
            vertex=vertex,
            fptr=fptr,
            cptr=_pointer([len(c) for c in corners]),
            corner=np.concatenate(corners).astype(np.int64),
            normal=normal,
            eptr=_pointer([len(e) for e in edges]),
            edge_a=np.ascontiguousarray(packed[:, 0]),
            edge_b=np.ascontiguousarray(packed[:, 1]),
            edge_face=np.ascontiguousarray(packed[:, 2:]),
            inside=middles(vptr, vertex),
            size=size,
            face_area=np.array([_area(p) for p in polygons]),
        ),
        radius=radii,
        size=_widths(owner, sptr, vptr, vertex, size),
        plane=_planes(owner, np.diff(fptr), normal, np.array([p[0] for p in polygons])),
        face_mesh=tuple(face_mesh),
        meshes=packed_meshes(face_mesh),
    )


def middles(vptr: Ints, vertex: Array) -> Array:
    """Return the mean of the vertices (ns, 3) of each shape."""
    mean: Array = np.add.reduceat(vertex, vptr[:-1]) / np.diff(vptr)[:, None]
    return mean


def _widths(body: Ints, sptr: Ints, vptr: Ints, vertex: Array, size: Array) -> Array:
    """Return the smallest width (nb,) of each body: of one shape its own, of several that of their convex hull [m]."""
    width = size[sptr[:-1]]
    for b in np.flatnonzero(np.bincount(body) > 1):
        corners = vertex[vptr[sptr[b]] : vptr[sptr[b + 1]]]
        width[b] = np.ptp(corners @ ConvexHull(corners).equations[:, :3].T, axis=0).min()
    return width


def _pointer(counts: Sequence[int]) -> Ints:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def _area(polygon: Array) -> float:
    local = polygon - polygon.mean(axis=0)
    return float(0.5 * np.linalg.norm(np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0)))


def _planes(body: Ints, count: Ints, normal: Array, corner: Array) -> Ints:
    """Find for each face the first face of its body that lies in the same plane; one shape has no two of them."""
    plane, start = np.arange(len(normal)), np.cumsum(count) - count
    for b in np.flatnonzero(np.bincount(body) > 1):
        shapes = np.flatnonzero(body == b)
        own = np.arange(start[shapes[0]], start[shapes[-1]] + count[shapes[-1]])
        size = np.ptp(corner[own], axis=0).max()
        alike = normal[own] @ normal[own].T > _SAME_WAY
        off = np.abs(np.einsum("fgi,fi->fg", corner[own] - corner[own][:, None], normal[own]))
        plane[own] = own[(alike & (off < _SAME_PLANE * size)).argmax(axis=1)]
    return plane


def _edges(
    faces: tuple[tuple[int, ...], ...], vertex: Array, normal: Array, first_vertex: int, first_face: int
) -> Ints:
    """List edges (ne, 4), two vertices and two faces, each once, directed along second normal × first normal."""
    face_of = {
        (a, b): n for n, face in enumerate(faces) for a, b in zip(face, (*face[1:], face[0]), strict=True)
    }
    rows = []
    for (a, b), one in sorted(face_of.items()):
        if a > b:
            continue
        other = face_of[(b, a)]
        along = vertex[first_vertex + b] - vertex[first_vertex + a]
        turned = np.cross(normal[first_face + other], normal[first_face + one])
        start, end = (a, b) if along @ turned >= 0 else (b, a)
        rows.append((first_vertex + start, first_vertex + end, first_face + one, first_face + other))
    return np.array(rows, dtype=np.int64)
