"""Removal of slivers: nodes move so that flat tetrahedra get volume, surface nodes along the surface."""

from dataclasses import replace

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.stones.meshing.mesh import SolidMesh
from mechanics.stones.meshing.meshers._kernels.shaping import improve
from mechanics.stones.polyhedra import face_planes

Faces = tuple[tuple[int, ...], ...]

_GOOD = 0.4  # shape of tetrahedra that are left alone (1: regular, 0: flat)
_MAX_IMPROVEMENTS = 4  # of improvement, at most
_COPLANAR = 1e-3  # sine of the angle between two faces below which their edge has no certain direction
# the 26 directions to the neighbours in a cubic lattice
_TRIES = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if x or y or z])
_DIRECTIONS = _TRIES / np.linalg.norm(_TRIES, axis=1)[:, None]


def improve_cells(nodes: Array, cells: Ints, free: Array) -> None:
    """Move nodes (n, 3), in place, so that badly shaped tetrahedra (nc, 4) get better, and no other as bad as they.

    free : (n, 3, 3) projectors on the directions in which a node may move
    """
    flat = cells.ravel()
    around = (np.argsort(flat, kind="stable") // 4).astype(np.int64)
    start = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=len(nodes)))]).astype(np.int64)
    improve(nodes, cells, free, around, start, _DIRECTIONS, _GOOD, _MAX_IMPROVEMENTS)


def improved(mesh: SolidMesh, vertices: Array, faces: Faces) -> SolidMesh:
    """Improve the worst cells of a mesh of linear tetrahedra; the stone's corners, edges and faces stay."""
    nodes = mesh.nodes.copy()
    improve_cells(nodes, mesh.cells, _freedom(mesh, vertices, faces))
    return replace(mesh, nodes=nodes)


def _freedom(mesh: SolidMesh, vertices: Array, faces: Faces) -> Array:
    """Return projectors (n, 3, 3) on a face or an edge; zero at a corner."""
    normals, _ = face_planes(vertices, faces)
    on_face = np.zeros((len(mesh.nodes), len(faces)), dtype=bool)
    on_face[mesh.facets, mesh.facet_face[:, None]] = True
    count = on_face.sum(axis=1)
    first, last = on_face.argmax(axis=1), len(faces) - 1 - on_face[:, ::-1].argmax(axis=1)
    free = np.tile(np.eye(3), (len(mesh.nodes), 1, 1))
    free[count > 2] = 0.0
    single = count == 1
    free[single] -= normals[first[single], :, None] * normals[first[single], None]
    two = count == 2
    along = np.cross(normals[first[two]], normals[last[two]])
    sine = np.linalg.norm(along, axis=1)
    along /= np.where(sine > _COPLANAR, sine, np.inf)[:, None]
    free[two] = along[:, :, None] * along[:, None]
    return free
