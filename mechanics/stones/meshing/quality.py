"""Quality of meshes by the smallest dihedral angle and scaled Jacobian of their cells, and its report for a scene."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import SolidMesh

_BATCH = 100_000  # cells computed at once: some 30 MB for each of a few arrays


@dataclass(frozen=True)
class MeshQuality:
    """Size of a mesh, and quality of its worst cells.

    Attributes
    ----------
    nodes, cells : counts
    min_dihedral : smallest angle between two sides of a cell [degrees]; 70.5 in a regular tetrahedron, 90 in a cube
    min_scaled_jacobian : smallest over the corners of all cells (and the middle of hexahedra) of the determinant of the
        edges that meet there, over the product of their lengths, times √2 in tetrahedra: 1 in regular tetrahedra and
        cubes, 0 in flat cells, negative in cells inside out [-] (Verdict 2007, "scaled Jacobian")
    """

    nodes: int
    cells: int
    min_dihedral: float
    min_scaled_jacobian: float


def mesh_quality(meshes: Sequence[SolidMesh]) -> tuple[MeshQuality, ...]:
    """Return the quality of each mesh; many meshes of a kind are computed at once."""
    qualities: dict[int, MeshQuality] = {}
    for element in sorted({mesh.element.linear for mesh in meshes}):
        indices = [k for k, mesh in enumerate(meshes) if mesh.element.linear is element]
        cells = np.cumsum([len(meshes[k].cells) for k in indices])
        for batch in np.split(indices, np.flatnonzero(np.diff(cells // _BATCH)) + 1):
            qualities |= _batch_quality(element, meshes, batch.tolist())
    return tuple(qualities[k] for k in range(len(meshes)))


def _batch_quality(
    element: Element, meshes: Sequence[SolidMesh], indices: Sequence[int]
) -> dict[int, MeshQuality]:
    corners = [meshes[k].nodes[meshes[k].cells[:, : element.corners]] for k in indices]
    starts = np.cumsum([0, *(len(corner) for corner in corners[:-1])])
    angle, jacobian = cell_quality(element, np.concatenate(corners))
    angles = np.minimum.reduceat(angle, starts).tolist()
    worst = np.minimum.reduceat(jacobian, starts).tolist()
    return {
        k: MeshQuality(len(meshes[k].nodes), len(meshes[k].cells), *least)
        for k, *least in zip(indices, angles, worst, strict=True)
    }


def cell_quality(element: Element, corners: Array) -> tuple[Array, Array]:
    """Return the smallest dihedral angle [degrees] and scaled Jacobian (nc,) of cells with corners (nc, k, 3)."""
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
    """Return the scaled Jacobian (nc,) in the middle of hexahedra, of the lines between middles of opposite sides."""
    sides = ((1, 2, 5, 6), (0, 3, 4, 7)), ((2, 3, 6, 7), (0, 1, 4, 5)), ((4, 5, 6, 7), (0, 1, 2, 3))
    axes = np.stack([corners[:, b].sum(axis=1) - corners[:, a].sum(axis=1) for b, a in sides], axis=1)
    scaled: Array = _triple(axes) / np.linalg.norm(axes, axis=-1).prod(axis=-1)
    return scaled


@cache
def _neighbours(element: Element) -> Ints:
    """Return for each corner of a cell the corners (k, 3) that edges lead to, as a right-handed triple."""
    if element is Element.TET4:
        return np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])
    lower = [((k + 1) % 4, (k - 1) % 4, k + 4) for k in range(4)]
    upper = [(4 + (k - 1) % 4, 4 + (k + 1) % 4, k) for k in range(4)]
    return np.array(lower + upper)


@dataclass(frozen=True)
class StoneMesh:
    """Meshing of one stone.

    Attributes
    ----------
    code : the stone
    how : the mesher that made its mesh
    failures : meshers tried before, each with the reason of its failure
    like : the stone of the same shape whose mesh it shares, moved and turned; its own code if it was meshed itself
    quality : of its mesh
    """

    code: str
    how: str
    failures: tuple[str, ...]
    like: str
    quality: MeshQuality


@dataclass(frozen=True)
class MeshReport:
    """Meshing of all deformable stones of a scene, in the order of its blocks."""

    stones: tuple[StoneMesh, ...] = ()

    @property
    def nodes(self) -> int:
        """Number of nodes of all stones."""
        return sum(stone.quality.nodes for stone in self.stones)

    @property
    def cells(self) -> int:
        """Number of cells of all stones."""
        return sum(stone.quality.cells for stone in self.stones)

    @property
    def distinct(self) -> int:
        """Number of meshes that were made."""
        return sum(stone.like == stone.code for stone in self.stones)

    @property
    def how(self) -> Mapping[str, int]:
        """Number of stones by mesher."""
        return dict(sorted(Counter(stone.how for stone in self.stones).items()))

    @property
    def sharpest(self) -> StoneMesh | None:
        """The first stone with the smallest dihedral angle; None without deformable stones."""
        return min(self.stones, key=lambda stone: stone.quality.min_dihedral, default=None)

    @property
    def worst(self) -> StoneMesh | None:
        """The first stone with the smallest scaled Jacobian; None without deformable stones."""
        return min(self.stones, key=lambda stone: stone.quality.min_scaled_jacobian, default=None)

    @property
    def retried(self) -> tuple[StoneMesh, ...]:
        """Stones at which a mesher failed before another succeeded."""
        return tuple(stone for stone in self.stones if stone.failures and stone.like == stone.code)
