"""The two facings of a wall: stones whose faces point in opposite directions, back to back."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, cKDTree

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import LARGELY, ON_PLANE, SMALL_STONE, STEP
from survey.extrusion.extrusion import SurveyedBlock
from survey.geometry.solids import Solid, area_vector
from survey.quality.facades import WallPlane, upright_frame
from survey.unseen.core.settings import InfillSettings

Indices = NDArray[np.intp]

_SHARED = STEP  # metres: least overlap of two faces across a wall, along it and upwards
_FLUSH = SMALL_STONE  # metres: largest offset of a face from the next one of its facing
_LEANING = LARGELY  # cosine above which a face points along an axis


@dataclass(frozen=True)
class FacingStone:
    """A stone of a facing.

    Attributes
    ----------
    code, course : as in the survey
    solid : closed, surveyed or with its joints closed
    normal : (3,) of its visible face, towards the observer [-]
    """

    code: str
    course: int | None
    solid: Solid
    normal: Array

    @cached_property
    def vectors(self) -> Array:
        """Area times normal of each face of the solid, (nf, 3) [m²]."""
        return np.array([area_vector(self.solid.vertices[list(face)]) for face in self.solid.faces])

    @cached_property
    def planes(self) -> Array:
        """Half-spaces n·x ≤ d that contain the stone, (np, 4): of its faces, or of its hull if it is not convex."""
        unit = self.vectors / np.linalg.norm(self.vectors, axis=1)[:, None]
        corners = [self.solid.vertices[list(face)].mean(axis=0) for face in self.solid.faces]
        offsets = (unit * np.array(corners)).sum(axis=1)
        if (self.solid.vertices @ unit.T - offsets).max() <= ON_PLANE:
            return np.column_stack([unit, offsets])
        hull = ConvexHull(self.solid.vertices).equations
        return np.column_stack([hull[:, :3], -hull[:, 3]])

    def towards(self, direction: Array) -> Indices | None:
        """Return the corners of the largest face that points along a direction; None if none does."""
        areas = self.vectors @ direction
        best = int(areas.argmax())
        if areas[best] < _LEANING * float(np.linalg.norm(self.vectors[best])):
            return None
        return np.array(self.solid.faces[best], dtype=np.intp)

    def support(self, direction: Array) -> Array:
        """Return the plane (4,) of the largest face along a direction, moved out until the stone lies behind it.

        Without a face that points along it, the plane is perpendicular to the direction.
        """
        face = self.towards(direction)
        normal = direction if face is None else area_vector(self.solid.vertices[face])
        normal = normal / np.linalg.norm(normal)
        return np.append(normal, float((self.solid.vertices @ normal).max()))


@dataclass(frozen=True)
class FacingWall:
    """Two facings and the frame of the wall between them.

    Attributes
    ----------
    front, back : their stones, in coordinates of the frame; the front faces along its third axis
    frame : along the wall, up, outward from the front; its origin is in the wall
    """

    front: tuple[FacingStone, ...]
    back: tuple[FacingStone, ...]
    frame: WallPlane


def facing_stone(block: SurveyedBlock, solid: Solid | None = None) -> FacingStone:
    """Return a surveyed stone, with another solid if given, such as one with closed joints."""
    return FacingStone(block.code, block.course, solid or block.solid, block.face.fit.normal)


def find_walls(stones: Sequence[FacingStone], settings: InfillSettings) -> tuple[FacingWall, ...]:
    """Find the walls with two facings.

    Two stones belong to the two facings of a wall if their faces point in opposite directions, each lies behind the
    other's face within the greatest thickness, and they overlap seen square to the wall. They belong to one facing if
    their faces point the same way, nearly flush, and are no farther apart than a joint. Stones linked in this way,
    directly or through others, make a wall.

    Parameters
    ----------
    stones : in any order, of any walls
    settings : tolerances

    Returns
    -------
    Walls, in the order of their first stones, which are of the front; stones of one facing only belong to none
    """
    pairs = _linked(stones, settings)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(stones), len(stones)))
    count, member = connected_components(graph, directed=False)
    walls = []
    for number in range(count):
        rows = np.flatnonzero(member == number)
        if len(rows) < 2:
            continue
        normals = np.array([stones[i].normal for i in rows.tolist()])
        ahead = normals @ normals[0] > 0.0
        if not ahead.all():
            front = [stones[i] for i in rows[ahead].tolist()]
            walls.append(wall_between(front, [stones[i] for i in rows[~ahead].tolist()]))
    return tuple(walls)


def wall_between(front: Sequence[FacingStone], back: Sequence[FacingStone]) -> FacingWall:
    """Return the wall of two known facings.

    Raises
    ------
    GeometryError
        if one is empty, or they do not face opposite ways
    """
    if not front or not back:
        raise GeometryError("a facing has no stones", remedy="name stones of both sides of the wall")
    first, second = (_mean_normal(stones) for stones in (front, back))
    if first @ second > -_LEANING:
        angle = float(np.degrees(np.arccos(np.clip(-(first @ second), -1.0, 1.0))))
        raise GeometryError(
            f"the two facings are {angle:.0f}° out of parallel",
            remedy="name stones of the two sides of one wall",
        )
    normal = (first - second) / np.linalg.norm(first - second)
    centres = [
        np.mean([stone.solid.vertices.mean(axis=0) for stone in side], axis=0) for side in (front, back)
    ]
    frame = upright_frame(normal, (centres[0] + centres[1]) / 2.0)
    return FacingWall(_within(front, frame), _within(back, frame), frame)


def _within(stones: Sequence[FacingStone], frame: WallPlane) -> tuple[FacingStone, ...]:
    """Express the stones in coordinates of the frame."""
    moved = []
    for stone in stones:
        vertices = (stone.solid.vertices - frame.origin) @ frame.axes.T
        solid = Solid(stone.code, vertices, stone.solid.faces)
        moved.append(FacingStone(stone.code, stone.course, solid, frame.axes @ stone.normal))
    return tuple(moved)


def _mean_normal(stones: Sequence[FacingStone]) -> Array:
    total = np.sum([stone.normal for stone in stones], axis=0)
    out: Array = total / max(float(np.linalg.norm(total)), 1e-300)
    return out


def _linked(stones: Sequence[FacingStone], settings: InfillSettings) -> Indices:
    """Return pairs (m, 2) of stones that are back to back across a wall, or beside each other in a facing."""
    if len(stones) < 2:
        return np.zeros((0, 2), np.intp)
    normals = np.array([stone.normal for stone in stones])
    fronts = [_front(stone) for stone in stones]
    centres = np.array([front.mean(axis=0) for front in fronts])
    radii = np.array([np.linalg.norm(face - face.mean(axis=0), axis=1).max() for face in fronts])
    reach = settings.max_thickness + 2.0 * float(radii.max())
    pairs = cKDTree(centres).query_pairs(reach, output_type="ndarray")
    i, j = pairs[:, 0], pairs[:, 1]
    cosine = (normals[i] * normals[j]).sum(axis=1)
    between = centres[j] - centres[i]
    behind, before = -(between * normals[i]).sum(axis=1), (between * normals[j]).sum(axis=1)
    beside = np.sqrt(np.maximum((between**2).sum(axis=1) - behind**2, 0.0))
    close = beside <= radii[i] + radii[j] + settings.max_joint
    parallel = float(np.cos(np.radians(settings.max_angle)))
    thin = (np.minimum(behind, before) > 0.0) & (np.maximum(behind, before) <= settings.max_thickness)
    across = (cosine < -parallel) & thin & close
    flush = (cosine > parallel) & (np.maximum(np.abs(behind), np.abs(before)) <= _FLUSH) & close
    facing_pairs = [
        pair
        for pair, facing in zip(pairs[across | flush].tolist(), across[across | flush].tolist(), strict=True)
        if _overlap(fronts[pair[0]], fronts[pair[1]], normals[pair[0]])
        > (_SHARED if facing else -settings.max_joint)
    ]
    return np.array(facing_pairs, dtype=np.intp).reshape(-1, 2)


def _front(stone: FacingStone) -> Array:
    """Return the corners of the visible face."""
    face = stone.towards(stone.normal)
    return stone.solid.vertices if face is None else stone.solid.vertices[face]


def _overlap(first: Array, second: Array, normal: Array) -> float:
    """Return the least overlap of the boxes of two faces, along or up, seen square to the first [m]."""
    frame = upright_frame(normal, first[0])
    a, b = frame.flatten(first), frame.flatten(second)
    return float((np.minimum(a.max(axis=0), b.max(axis=0)) - np.maximum(a.min(axis=0), b.min(axis=0))).min())
