"""The mesh of one stone, and its boundary."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechanics.meshing.elements import Element
from mechanics.polyhedra import face_plane
from moma.errors import MeshError

__all__ = ["SolidMesh", "boundary_triangles", "tet_mesh"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class SolidMesh:
    """The finite elements of one stone, and the facets of its boundary; edges are straight, with nodes at their middle.

    Attributes
    ----------
    element : kind of all cells
    nodes : (n, 3) [m]
    cells : (nc, element.cell_nodes) node indices in VTK's order, positive volume
    facets : (ns, element.facet_nodes) boundary node indices in VTK's order, corners counter-clockwise seen from outside
    facet_face : (ns,) the stone's face that each boundary facet lies on
    """

    element: Element
    nodes: Array
    cells: Ints
    facets: Ints
    facet_face: Ints


def boundary_triangles(tetrahedra: Ints) -> Ints:
    """Triangles (ns, 3) that belong to one tetrahedron alone, oriented outwards."""
    faces = tetrahedra[:, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    boundary: Ints = faces[np.sort(first[count == 1])]
    return boundary


def tet_mesh(
    nodes: Array, tetrahedra: Ints, vertices: Array, faces: tuple[tuple[int, ...], ...], code: str
) -> SolidMesh:
    """Orient the tetrahedra, drop unused nodes, and tell which stone face each boundary triangle lies on.

    Raises
    ------
    MeshError : if the mesh does not fill the polyhedron, or a boundary triangle lies on none of its faces
    """
    volumes = np.linalg.det(nodes[tetrahedra[:, 1:]] - nodes[tetrahedra[:, :1]]) / 6.0
    tetrahedra = np.where((volumes < 0)[:, None], tetrahedra[:, [0, 2, 1, 3]], tetrahedra)
    used, inverse = np.unique(tetrahedra, return_inverse=True)
    nodes, tetrahedra = nodes[used], inverse.reshape(-1, 4).astype(np.int64)
    triangles = boundary_triangles(tetrahedra)
    size = float(np.ptp(vertices, axis=0).max())
    distance = np.empty((len(triangles), len(faces)))
    for k, face in enumerate(faces):
        normal, origin = face_plane(vertices[list(face)])
        distance[:, k] = np.abs((nodes[triangles] - origin) @ normal).max(axis=1)
    triangle_face = distance.argmin(axis=1).astype(np.int64)
    worst = float(distance.min(axis=1).max())
    if worst > 1e-6 * size:
        raise MeshError(
            f"a boundary triangle lies {worst:.2e} m off the stone's faces",
            where=f"stone {code}",
            remedy="give a smaller mesh size, or make the stone's faces planar",
        )
    return SolidMesh(Element.TET4, nodes, tetrahedra, triangles, triangle_face)
