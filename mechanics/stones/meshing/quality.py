"""How well cells are shaped: their smallest dihedral angle, and their smallest scaled Jacobian."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import SolidMesh

__all__ = ["MeshQuality", "cell_quality", "mesh_quality"]


# cells that are computed in one go: some 30 MB for each of a few arrays
_BATCH = 100_000


@dataclass(frozen=True)
class MeshQuality:
    """How large a mesh is, and how well its worst cells are shaped.

    Attributes
    ----------
    nodes, cells : how many
    min_dihedral : smallest angle between two sides of a cell [degrees]; 70.5 in a regular tetrahedron, 90 in a cube
    min_scaled_jacobian : smallest over the corners of all cells (and the middle of hexahedra) of the determinant of the
        edges that meet there, over the product of their lengths, times √2 in tetrahedra: 1 in regular tetrahedra and
        cubes, 0 in flat cells, negative in those turned inside out [-] (Verdict 2007, "scaled Jacobian")
    """

    nodes: int
    cells: int
    min_dihedral: float
    min_scaled_jacobian: float


def mesh_quality(meshes: Sequence[SolidMesh]) -> tuple[MeshQuality, ...]:
    """The quality of each mesh; many meshes of a kind are computed in one go."""
    found: dict[int, MeshQuality] = {}
    for element in sorted({mesh.element.linear for mesh in meshes}):
        own = [k for k, mesh in enumerate(meshes) if mesh.element.linear is element]
        cells = np.cumsum([len(meshes[k].cells) for k in own])
        for batch in np.split(own, np.flatnonzero(np.diff(cells // _BATCH)) + 1):
            found |= _batch_quality(element, meshes, batch.tolist())
    return tuple(found[k] for k in range(len(meshes)))


def _batch_quality(
    element: Element, meshes: Sequence[SolidMesh], own: Sequence[int]
) -> dict[int, MeshQuality]:
    corners = [meshes[k].nodes[meshes[k].cells[:, : element.corners]] for k in own]
    starts = np.cumsum([0, *(len(one) for one in corners[:-1])])
    angle, jacobian = cell_quality(element, np.concatenate(corners))
    angles = np.minimum.reduceat(angle, starts).tolist()
    worst = np.minimum.reduceat(jacobian, starts).tolist()
    return {
        k: MeshQuality(len(meshes[k].nodes), len(meshes[k].cells), *least)
        for k, *least in zip(own, angles, worst, strict=True)
    }


def cell_quality(element: Element, corners: Array) -> tuple[Array, Array]:
    """Smallest dihedral angle [degrees] and scaled Jacobian (nc,) of each cell, from its corners (nc, k, 3)."""
    neighbours = _neighbours(element.linear)
    edges = corners[:, neighbours] - corners[:, :, None]  # (nc, k, 3, 3), three from each corner
    lengths = np.linalg.norm(edges, axis=-1)
    scaled = _triple(edges) / lengths.prod(axis=-1)
    # between the planes of edges a, b and a, c: the angle about a
    sides = np.cross(edges, np.roll(edges, -1, axis=2))
    after, before = sides, -np.roll(sides, 1, axis=2)
    cosine = (after * before).sum(axis=-1)
    sine = np.linalg.norm(np.cross(after, before), axis=-1)
    angle = np.degrees(np.arctan2(sine, cosine)).min(axis=(1, 2))
    if element.is_tetrahedron:
        return angle, np.sqrt(2.0) * scaled.min(axis=1)
    return angle, np.minimum(scaled.min(axis=1), _middle(corners))


def _triple(edges: Array) -> Array:
    a, b, c = np.moveaxis(edges, -2, 0)
    determinant: Array = (np.cross(a, b) * c).sum(axis=-1)
    return determinant


def _middle(corners: Array) -> Array:
    """Scaled Jacobian (nc,) in the middle of hexahedra, of the lines that join the middles of opposite sides."""
    sides = ((1, 2, 5, 6), (0, 3, 4, 7)), ((2, 3, 6, 7), (0, 1, 4, 5)), ((4, 5, 6, 7), (0, 1, 2, 3))
    axes = np.stack([corners[:, b].sum(axis=1) - corners[:, a].sum(axis=1) for b, a in sides], axis=1)
    scaled: Array = _triple(axes) / np.linalg.norm(axes, axis=-1).prod(axis=-1)
    return scaled


@cache
def _neighbours(element: Element) -> Ints:
    """For each corner of a cell (k, 3) the corners that edges lead to, in the order of a right-handed triple."""
    if element is Element.TET4:
        return np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])
    lower = [((k + 1) % 4, (k - 1) % 4, k + 4) for k in range(4)]
    upper = [(4 + (k - 1) % 4, 4 + (k + 1) % 4, k) for k in range(4)]
    return np.array(lower + upper)
