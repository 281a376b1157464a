"""Finite elements on the faces of deformable bodies, singly and packed in flat arrays."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.contact._kernels.facets import FacetMeshes

_WIDEST = 9  # maximum number of nodes of a facet


@dataclass(frozen=True)
class FaceMesh:
    """The finite-element nodes and facets on one face of a deformable body.

    Attributes
    ----------
    node : (k,) nodes, numbered over all deformable bodies
    reference : (k, 3) their places in body axes [m]
    facet : (m, 3 | 6 | 4 | 8 | 9) indices into `node`, in VTK's order, corners first, counter-clockwise from outside
    cut : the face, one of several parts, cuts through some facets, so that they reach beyond it
    """

    node: Ints
    reference: Array
    facet: Ints
    cut: bool = False


def packed_meshes(meshes: Sequence[FaceMesh | None]) -> FacetMeshes:
    """Pack the meshes of all faces."""
    present = [mesh for mesh in meshes if mesh is not None]
    has = np.array([mesh is not None for mesh in meshes], dtype=bool)
    of_face = np.where(has, np.cumsum(has) - 1, -1).astype(np.int64)
    covered = np.array([_area(mesh) for mesh in present])
    triangles = np.array([len(mesh.facet) * (_corners(mesh) - 2) for mesh in present], dtype=float)
    fineness = np.full(len(meshes), -1.0)
    fineness[has] = triangles / np.where(covered > 0, covered, 1.0)
    return FacetMeshes(
        of_face=of_face,
        node_ptr=_pointer([len(mesh.node) for mesh in present]),
        node=np.concatenate([*(mesh.node for mesh in present), np.zeros(0)]).astype(np.int64),
        reference=np.vstack([*(mesh.reference for mesh in present), np.zeros((0, 3))]),
        facet_ptr=_pointer([len(mesh.facet) for mesh in present]),
        facet=np.vstack([*map(_padded, present), np.zeros((0, _WIDEST))]).astype(np.int64),
        kind=np.array([mesh.facet.shape[1] for mesh in present], dtype=np.int64),
        cut=np.array([mesh.cut for mesh in present], dtype=bool),
        fineness=fineness,
    )


def _pointer(counts: Sequence[int]) -> Ints:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


def _padded(mesh: FaceMesh) -> Ints:
    rows, columns = mesh.facet.shape
    return np.hstack([mesh.facet, np.full((rows, _WIDEST - columns), -1)])


def _corners(mesh: FaceMesh) -> int:
    return 3 if mesh.facet.shape[1] in (3, 6) else 4


def _area(mesh: FaceMesh) -> float:
    """Compute the area of the facets [m²]."""
    x = mesh.reference[mesh.facet[:, : _corners(mesh)]]
    # half the cross product of the diagonals, of a triangle of two edges
    cross = np.cross(x[:, 2] - x[:, 0], x[:, -1] - x[:, 1]) if x.shape[1] == 4 else np.cross(*_two_edges(x))
    return float(0.5 * np.linalg.norm(cross, axis=1).sum())


def _two_edges(x: Array) -> tuple[Array, Array]:
    return x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
