"""Surfaces of all bodies in flat arrays, as contact detection needs them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from mechanics.arrays import Array, Ints
from mechanics.contact._kernels.facets import FacetMeshes
from mechanics.contact._kernels.narrow_phase import Polyhedra
from mechanics.contact.face_meshes import FaceMesh, packed_meshes
from mechanics.stones.polyhedra import alike, face_planes_alike, smallest_widths

# faces of the parts of a body are in one plane
_SAME_WAY = 1.0 - 1e-12  # if the cosine between their normals is at least this
_SAME_PLANE = 1e-6  # and their offset is at most this share of its size


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
    size : (nb,) smallest width of each body, over all its parts [m]
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
    vertex, owner = np.concatenate(vertices).astype(float), np.asarray(body, dtype=np.int64)
    cptr = _pointer([len(face) for group in faces for face in group])
    eptr = _pointer(np.diff(cptr[fptr]) // 2)
    sptr = _pointer(np.bincount(owner))
    radii = np.array(radius, dtype=float) if len(radius) else np.zeros(len(body))
    corner = np.empty(cptr[-1], dtype=np.int64)
    normal, face_area = np.empty((fptr[-1], 3)), np.empty(fptr[-1])
    edge, size = np.empty((eptr[-1], 4), dtype=np.int64), np.empty(len(owner))
    for group, rows in alike(vertices, faces):
        first_vertex, first_face = vptr[rows][:, None], fptr[rows][:, None]
        place = vertex[first_vertex + np.arange(len(vertices[rows[0]]))]
        normals, areas = face_planes_alike(place, group)
        numbers = first_face + np.arange(len(group))
        normal[numbers], face_area[numbers] = normals, areas
        loops = np.concatenate([np.asarray(face) for face in group])
        corner[cptr[first_face] + np.arange(len(loops))] = first_vertex + loops
        size[rows] = smallest_widths(place, normals)
        ends = _edges(group, place, normals) + np.stack(
            [first_vertex, first_vertex, first_face, first_face], axis=2
        )
        edge[eptr[rows][:, None] + np.arange(ends.shape[1])] = ends
    size = np.where(radii > 0, 2.0 * radii, size)
    return Surfaces(
        body=owner,
        sptr=sptr,
        shapes=Polyhedra(
            vptr=vptr,
            vertex=vertex,
            fptr=fptr,
            cptr=cptr,
            corner=corner,
            normal=normal,
            eptr=eptr,
            edge_a=np.ascontiguousarray(edge[:, 0]),
            edge_b=np.ascontiguousarray(edge[:, 1]),
            edge_face=np.ascontiguousarray(edge[:, 2:]),
            inside=middles(vptr, vertex),
            size=size,
            face_area=face_area,
        ),
        radius=radii,
        size=_widths(owner, sptr, vptr, vertex, size),
        plane=_planes(owner, np.diff(fptr), normal, vertex[corner[cptr[:-1]]]),
        face_mesh=tuple(face_mesh),
        meshes=packed_meshes(face_mesh),
    )


def middles(vptr: Ints, vertex: Array) -> Array:
    """Return the mean of the vertices (ns, 3) of each shape."""
    mean: Array = np.add.reduceat(vertex, vptr[:-1]) / np.diff(vptr)[:, None]
    return mean


def _widths(body: Ints, sptr: Ints, vptr: Ints, vertex: Array, size: Array) -> Array:
    """Return the smallest width (nb,) of each body: that of its shape, or of the convex hull of several [m]."""
    width = size[sptr[:-1]]
    for b in np.flatnonzero(np.bincount(body) > 1):
        corners = vertex[vptr[sptr[b]] : vptr[sptr[b + 1]]]
        width[b] = np.ptp(corners @ ConvexHull(corners).equations[:, :3].T, axis=0).min()
    return width


def _pointer(counts: Sequence[int] | Ints) -> Ints:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def _planes(body: Ints, count: Ints, normal: Array, corner: Array) -> Ints:
    """Find for each face the first face of its body that lies in the same plane; a single shape has no two of them."""
    plane, start = np.arange(len(normal)), np.cumsum(count) - count
    for b in np.flatnonzero(np.bincount(body) > 1):
        shapes = np.flatnonzero(body == b)
        rows = np.arange(start[shapes[0]], start[shapes[-1]] + count[shapes[-1]])
        size = np.ptp(corner[rows], axis=0).max()
        alike = normal[rows] @ normal[rows].T > _SAME_WAY
        off = np.abs(np.einsum("fgi,fi->fg", corner[rows] - corner[rows][:, None], normal[rows]))
        plane[rows] = rows[(alike & (off < _SAME_PLANE * size)).argmax(axis=1)]
    return plane


def _edges(faces: tuple[tuple[int, ...], ...], vertex: Array, normal: Array) -> Ints:
    """List the edges of shapes (n, nv, 3) with the same faces, two vertices and two faces (n, ne, 4), each once.

    They are directed along second normal × first normal.
    """
    face_of = {
        (a, b): n for n, face in enumerate(faces) for a, b in zip(face, (*face[1:], face[0]), strict=True)
    }
    sides = [(a, b, face, face_of[b, a]) for (a, b), face in sorted(face_of.items()) if a < b]
    a, b, first, second = np.array(sides, dtype=np.int64).T
    turned = np.cross(normal[:, second], normal[:, first])
    forward = np.einsum("nei,nei->ne", vertex[:, b] - vertex[:, a], turned) >= 0
    return np.stack(
        [np.where(forward, a, b), np.where(forward, b, a), *np.broadcast_arrays(first, second, forward)[:2]],
        axis=2,
    )
