"""Tetrahedra by scipy's Delaunay triangulation, for convex stones where gmsh cannot be loaded."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from mechanics.meshing.mesh import SolidMesh, tet_mesh
from mechanics.polyhedra import face_plane, fan

__all__ = ["mesh_with_delaunay"]

Array = NDArray[np.float64]
Faces = tuple[tuple[int, ...], ...]

# points on a regular lattice lie by fours on a plane and by fives on a sphere, where Delaunay makes flat tetrahedra
_JITTER = 0.12


def mesh_with_delaunay(vertices: Array, faces: Faces, size: float, code: str) -> SolidMesh:
    """Mesh one convex polyhedron with linear tetrahedra of edge length about `size` [m].

    Points are laid on the faces and on shrunken copies of them, each moved a little within the faces that it
    lies on (always in the same way); tetrahedra that are flat on a face are dropped.

    Raises
    ------
    MeshError : if the mesh does not fill the polyhedron
    """
    centre = vertices.mean(axis=0)
    reach = float(np.linalg.norm(vertices - centre, axis=1).max())
    layers = max(1, round(reach / size))
    shells = np.arange(layers, 0, -1) / layers
    points = [centre + shell * (_lattice(vertices, faces, size / shell) - centre) for shell in shells]
    cloud = np.vstack([*points, centre[None]])
    normals, origins = map(np.array, zip(*(face_plane(vertices[list(face)]) for face in faces), strict=True))
    depth = np.abs(np.einsum("pfk,fk->pf", cloud[:, None] - origins, normals))
    on_face = depth < 1e-9 * reach
    # no point may reach a face that it does not lie on, or a slender stone would lose its shape
    room = np.minimum(size, np.where(on_face, np.inf, depth).min(axis=1))
    moves = np.random.default_rng(0).uniform(-1.0, 1.0, cloud.shape) * (_JITTER * room)[:, None]
    cloud = cloud + _tangential(moves, normals, on_face)
    tetrahedra = Delaunay((cloud - centre) / reach).simplices.astype(np.int64)
    flat = on_face[tetrahedra].all(axis=1).any(axis=1)
    return tet_mesh(cloud, tetrahedra[~flat], vertices, faces, code)


def _lattice(vertices: Array, faces: Faces, size: float) -> Array:
    """Distinct points that cut every triangle of the surface into equal parts no longer than `size`."""
    triangles = vertices[fan(faces)]
    longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max()
    n = max(1, round(float(longest) / size))
    weights = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]) / n
    points = np.einsum("wk,tki->twi", weights, triangles).reshape(-1, 3)
    _, first = np.unique(np.round((points - vertices[0]) / (1e-6 * size)), axis=0, return_index=True)
    distinct: Array = points[np.sort(first)]
    return distinct


def _tangential(moves: Array, normals: Array, on_face: NDArray[np.bool_]) -> Array:
    """Take from each move (n, 3) what would leave the faces that its point lies on."""
    result = moves.copy()
    for pattern in np.unique(on_face, axis=0):
        rows = (on_face == pattern).all(axis=1)
        if pattern.any():
            active = normals[pattern]
            result[rows] -= moves[rows] @ (np.linalg.pinv(active) @ active).T
    return result
