"""Finite elements on the faces of a deformable block, and on those of its convex parts."""

from collections.abc import Sequence

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.contact._kernels.overlap import overlap_area
from mechanics.contact.face_meshes import FaceMesh
from mechanics.stones.meshing.mesh import SolidMesh
from mechanics.stones.polyhedra import face_plane

Faces = Sequence[Sequence[int]]

_FACET_DISTANCE = (
    1e-6  # share of the block's size: a facet nearer than this to the plane of a face lies in it
)
_SAME_AREA = 1e-6  # share of a facet's area: a smaller overlap is due to rounding


def face_meshes(mesh: SolidMesh, faces: int, start: int) -> list[FaceMesh]:
    """Return the meshes of the first `faces` faces of a block; its nodes are numbered from `start` on."""
    return [_face_mesh(mesh, mesh.facet_face == face, start) for face in range(faces)]


def part_face_meshes(mesh: SolidMesh, vertices: Array, faces: Faces, start: int) -> list[FaceMesh]:
    """Return the meshes of the faces of a convex part, whose corners are given in the axes of the mesh (nv, 3) [m].

    A facet belongs to each face that shares area with it; such a face may cut through it. A face between two
    parts has no facets.
    """
    corners = 3 if mesh.element.is_tetrahedron else 4
    x = mesh.nodes[mesh.facets[:, :corners]]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, -1] - x[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    tolerance = _FACET_DISTANCE * float(np.ptp(mesh.nodes, axis=0).max())
    cut_meshes = []
    for face in faces:
        polygon = vertices[list(face)]
        n, origin = face_plane(polygon)
        inside = (np.abs((x - origin) @ n).max(axis=1) < tolerance) & (normal @ n > 0.5)
        inside[inside], cut = _overlaps(x[inside], polygon, n)
        cut_meshes.append(_face_mesh(mesh, inside, start, cut))
    return cut_meshes


def _overlaps(facets: Array, polygon: Array, n: Array) -> tuple[Bools, bool]:
    """Find the facets (n, k, 3) that share area with a convex polygon in their plane, and whether it cuts any."""
    t1 = polygon[1] - polygon[0]
    t1 = t1 / np.linalg.norm(t1)
    flat = np.column_stack([t1, np.cross(n, t1)])
    outline, plane = (polygon - polygon[0]) @ flat, (facets - polygon[0]) @ flat
    share = np.array([overlap_area(facet, outline) / overlap_area(facet, facet) for facet in plane])
    inside = share > _SAME_AREA
    return inside, bool((share[inside] < 1.0 - _SAME_AREA).any())


def _face_mesh(mesh: SolidMesh, rows: Bools, start: int, cut: bool = False) -> FaceMesh:
    facets = mesh.facets[rows]
    node, facet = np.unique(facets, return_inverse=True)
    return FaceMesh(start + node, mesh.nodes[node], facet.reshape(facets.shape).astype(np.int64), cut)
