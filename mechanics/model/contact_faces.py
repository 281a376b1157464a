"""Faces of stones that touch other stones at the start of a scene."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from mechanics.arrays import Array
from mechanics.scene.scene import Block
from mechanics.stones.convex_polygons import moments, overlaps
from mechanics.stones.polyhedra import face_plane

__all__ = ["touching_faces"]


_FACING = -0.966  # cosine between the normals of faces that face each other: within about 15°
_SHARED = 1e-3  # least overlap of two faces over the area of the smaller one [-]


def touching_faces(blocks: Sequence[Block], wanted: Sequence[int], near: float) -> dict[int, tuple[int, ...]]:
    """Return the faces of the wanted blocks that another block faces, nearer than `near` times the smaller one's size.

    Parameters
    ----------
    blocks : of a scene
    wanted : indices of blocks
    near : distance over size, like that at which contacts are watched [-]
    """
    low = np.array([block.vertices.min(axis=0) for block in blocks])
    high = np.array([block.vertices.max(axis=0) for block in blocks])
    size = (high - low).max(axis=1)
    radius = 0.5 * np.linalg.norm(high - low, axis=1)
    tree = cKDTree(0.5 * (low + high))
    faces: dict[int, tuple[Array, Array]] = {}

    def planes(index: int) -> tuple[Array, Array]:
        if index not in faces:
            block = blocks[index]
            rows = [face_plane(block.vertices[list(face)]) for face in block.faces]
            faces[index] = np.array([normal for normal, _ in rows]), np.array([origin for _, origin in rows])
        return faces[index]

    touching: dict[int, tuple[int, ...]] = {}
    largest = float(radius.max())
    for index in wanted:
        around = tree.query_ball_point(tree.data[index], radius[index] + largest * (1.0 + near))
        found: set[int] = set()
        for other in around:
            gap = near * min(size[index], size[other])
            apart = (low[index] > high[other] + gap).any() or (low[other] > high[index] + gap).any()
            if other != index and not apart:
                found.update(_facing(blocks[index], planes(index), blocks[other], planes(other), gap))
        touching[index] = tuple(sorted(found))
    return touching


def _facing(
    block: Block, own: tuple[Array, Array], other: Block, its: tuple[Array, Array], gap: float
) -> list[int]:
    """Return the faces of a block over which a face of the other lies, nearer than a gap [m]."""
    if block.radius is not None or other.radius is not None:
        return []
    (normals, origins), (facing, places) = own, its
    distance = ((places - origins[:, None]) * normals[:, None]).sum(axis=-1)
    pairs = np.argwhere((normals @ facing.T < _FACING) & (np.abs(distance) < gap))
    return sorted(
        {
            int(k)
            for k, j in pairs
            if _over(block.vertices[list(block.faces[k])], other.vertices[list(other.faces[j])], normals[k])
        }
    )


def _over(polygon: Array, other: Array, normal: Array) -> bool:
    """Return true if two polygons overlap, seen along the normal of the first."""
    u = polygon[1] - polygon[0]
    u = u / np.linalg.norm(u)
    axes = np.column_stack([u, np.cross(normal, u)])
    first, second = (polygon - polygon[0]) @ axes, (other[::-1] - polygon[0]) @ axes
    one, two = np.array([len(first)]), np.array([len(second)])
    common, count = overlaps(first[None], one, second[None], two)
    areas = [
        float(moments(*given)[0][0]) for given in ((common, count), (first[None], one), (second[None], two))
    ]
    return areas[0] > _SHARED * min(areas[1:])
