"""Finite elements of all deformable stones of a scene; stones of one shape share a mesh.

Stones that differ by a translation share one `Deformable` with its matrices. Those that differ by a rotation as well
share the mesh, turned with them. Of each shape the stone with the first code is meshed, so that a mesh does not depend
on the order of the blocks.
"""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from mechanics.arrays import Array
from mechanics.model.deformable import Deformable, deformable
from mechanics.scene.scene import Block, Fidelity
from mechanics.stones.convex_polygons import moments, overlaps
from mechanics.stones.meshing.congruence import Congruence, classes, motion, translation
from mechanics.stones.meshing.mesh import SolidMesh
from mechanics.stones.meshing.meshers.mesher import Meshed, meshed_block
from mechanics.stones.meshing.quality import MeshQuality, MeshReport, StoneMesh, mesh_quality
from mechanics.stones.polyhedra import face_plane

_FACING = -0.966  # cosine between the normals of faces that face each other: within about 15°
_SHARED = 1e-3  # least overlap of two faces over the area of the smaller one [-]


class StoneWorkshop:
    """Elastic stones of a scene, made once for each shape.

    Parameters
    ----------
    blocks : of the scene
    near : distance over size at which contacts are watched [-]
    lumped : mass on the diagonal
    """

    def __init__(self, blocks: Sequence[Block], near: float, lumped: bool) -> None:
        self._blocks, self._lumped = blocks, lumped
        self._soft = [b for b, block in enumerate(blocks) if block.fidelity is Fidelity.DEFORMABLE]
        graded = [b for b in self._soft if _is_graded(blocks[b])]
        self._contact = touching_faces(blocks, graded, near) if graded else {}
        self._motions: dict[int, Congruence] = {}
        self._meshed: dict[int, Meshed] = {}
        self._made: dict[int, tuple[Deformable, Array]] = {}
        in_order = sorted(self._soft, key=lambda b: blocks[b].code)
        self._first = self._classes(in_order, self._stone_key, self._moved)
        leaders = [b for b in in_order if self._first[b] == b]
        self._shape = self._classes(leaders, self._mesh_key, self._turned)

    def __call__(self, index: int) -> tuple[Deformable, Array]:
        """Return the finite elements of a block, and its centre of mass (3,) [m].

        Raises
        ------
        MeshError : if the stone cannot be meshed
        """
        first = self._first[index]
        if first not in self._made:
            stone, centre = deformable(self._mesh(first), self._blocks[first].material, self._lumped)
            self._made[first] = stone, centre - self._blocks[first].vertices[0]
        stone, arm = self._made[first]
        return stone, self._blocks[index].vertices[0] + arm

    def report(self) -> MeshReport:
        """Return the report on the meshes made so far."""
        made = list(self._meshed)
        quality = dict(zip(made, mesh_quality([self._meshed[b].mesh for b in made]), strict=True))
        return MeshReport(
            tuple(self._stone_mesh(b, quality) for b in self._soft if self._shape[self._first[b]] in quality)
        )

    def _stone_mesh(self, index: int, quality: dict[int, MeshQuality]) -> StoneMesh:
        shape = self._shape[self._first[index]]
        made = self._meshed[shape]
        return StoneMesh(
            self._blocks[index].code, made.how, made.failures, self._blocks[shape].code, quality[shape]
        )

    def _mesh(self, index: int) -> SolidMesh:
        shape = self._shape[index]
        if shape not in self._meshed:
            self._meshed[shape] = meshed_block(self._blocks[shape], self._contact.get(shape, ()))
        mesh = self._meshed[shape].mesh
        if shape == index:
            return mesh
        there = self._motions[index]
        return replace(mesh, nodes=there(mesh.nodes), facet_face=there.face[mesh.facet_face])

    def _classes(
        self, order: list[int], key: Callable[[int], Hashable], same: Callable[[int, int], bool]
    ) -> dict[int, int]:
        """Return for each of some blocks the first equal one."""
        own = classes(
            [key(b) for b in order],
            [self._blocks[b].vertices for b in order],
            lambda first, second: same(order[first], order[second]),
        )
        return {b: order[k] for b, k in zip(order, own, strict=True)}

    def _stone_key(self, index: int) -> tuple[object, ...]:
        block = self._blocks[index]
        own = block.faces, block.material, tuple(map(id, block.parts)), self._contact.get(index, ())
        return (*_sizes(block), *own)

    def _mesh_key(self, index: int) -> tuple[object, ...]:
        block = self._blocks[index]
        corners = tuple(sorted(map(len, block.faces)))
        return (*_sizes(block), corners, len(self._contact.get(index, ())))

    def _moved(self, first: int, other: int) -> bool:
        return translation(self._blocks[first].vertices, self._blocks[other].vertices)

    def _turned(self, first: int, second: int) -> bool:
        first_block, two = self._blocks[first], self._blocks[second]
        contact = self._contact.get(first, ()), self._contact.get(second, ())
        congruence = motion(first_block.vertices, first_block.faces, two.vertices, two.faces, *contact)
        if congruence is not None:
            self._motions[second] = congruence
        return congruence is not None


def _is_graded(block: Block) -> bool:
    return (
        block.contact_size is not None
        and block.mesh_size is not None
        and block.contact_size < block.mesh_size
    )


def _sizes(block: Block) -> tuple[object, ...]:
    return block.mesh_size, block.element, block.contact_size, block.growth, block.mesher


def touching_faces(
    blocks: Sequence[Block], wanted: Sequence[int], reach: float
) -> dict[int, tuple[int, ...]]:
    """Return the faces of the wanted blocks that another block faces, nearer than `reach` times the smaller one's size.

    Parameters
    ----------
    blocks : of a scene
    wanted : indices of blocks
    reach : distance over size, like that at which contacts are watched [-]
    """
    low = np.array([block.vertices.min(axis=0) for block in blocks])
    high = np.array([block.vertices.max(axis=0) for block in blocks])
    size = (high - low).max(axis=1)
    radius = 0.5 * np.linalg.norm(high - low, axis=1)
    tree = cKDTree(0.5 * (low + high))
    faces: dict[int, tuple[Array, Array]] = {}

    def planes(index: int) -> tuple[Array, Array]:
        """Return normals (n, 3) and origins (n, 3) of the faces of a block."""
        if index not in faces:
            block = blocks[index]
            rows = [face_plane(block.vertices[list(face)]) for face in block.faces]
            faces[index] = np.array([normal for normal, _ in rows]), np.array([origin for _, origin in rows])
        return faces[index]

    touching: dict[int, tuple[int, ...]] = {}
    largest = float(radius.max())
    for index in wanted:
        around = tree.query_ball_point(tree.data[index], radius[index] + largest * (1.0 + reach))
        found: set[int] = set()
        for neighbour in around:
            gap = reach * min(size[index], size[neighbour])
            apart = (low[index] > high[neighbour] + gap).any() or (low[neighbour] > high[index] + gap).any()
            if neighbour != index and not apart:
                found.update(_facing(blocks[index], planes(index), blocks[neighbour], planes(neighbour), gap))
        touching[index] = tuple(sorted(found))
    return touching


def _facing(
    block: Block, own: tuple[Array, Array], neighbour: Block, its: tuple[Array, Array], gap: float
) -> list[int]:
    """Return the faces of a block over which a face of the other lies, nearer than a gap [m]."""
    if block.radius is not None or neighbour.radius is not None:
        return []
    (normals, origins), (facing, places) = own, its
    distance = ((places - origins[:, None]) * normals[:, None]).sum(axis=-1)
    pairs = np.argwhere((normals @ facing.T < _FACING) & (np.abs(distance) < gap))
    return sorted(
        {
            int(k)
            for k, j in pairs
            if _over(
                block.vertices[list(block.faces[k])], neighbour.vertices[list(neighbour.faces[j])], normals[k]
            )
        }
    )


def _over(polygon: Array, other: Array, normal: Array) -> bool:
    """Return true if two polygons overlap, seen along the normal of the first."""
    u = polygon[1] - polygon[0]
    u = u / np.linalg.norm(u)
    axes = np.column_stack([u, np.cross(normal, u)])
    first, second = (polygon - polygon[0]) @ axes, (other[::-1] - polygon[0]) @ axes
    first_count, two = np.array([len(first)]), np.array([len(second)])
    common, count = overlaps(first[None], first_count, second[None], two)
    areas = [
        float(moments(*given)[0][0])
        for given in ((common, count), (first[None], first_count), (second[None], two))
    ]
    return areas[0] > _SHARED * min(areas[1:])
