"""Stones in the elevation of their facade: their sides as lines, without worn corners.

Coordinates (s, t): s along the facade to the right as seen from outside, t up, metres.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from survey.arrays import Array
from survey.conventions import PARALLEL, STEEPEST, STONE
from survey.extrusion.extrusion import SurveyedBlock
from survey.faces.neighbours import Neighbours
from survey.quality.facades import WallPlane, find_facades

_FACING = math.cos(STEEPEST)  # largest angle of a side from its direction
_NEARLY = math.cos(PARALLEL)  # largest turn of a side by wear
_LAYER = STONE  # metres: least distance of two walls that face the same way


@dataclass(frozen=True)
class Line:
    """A straight line: a point (2,) and a unit direction (2,)."""

    point: Array
    direction: Array

    def moved(self, towards: Array, by: float) -> "Line":
        """Return the parallel line at a distance, on the side of a point (2,)."""
        normal = np.array([-self.direction[1], self.direction[0]])
        sign = 1.0 if normal @ (towards - self.point) > 0.0 else -1.0
        return Line(self.point + sign * by * normal, self.direction)

    def at_place(self, place: float) -> float:
        """Return its height at a place along the wall [m]."""
        return float(self.point[1] + (place - self.point[0]) * self.direction[1] / self.direction[0])


def line_through(first: Array, second: Array) -> Line:
    """Return the line through two points."""
    run = second - first
    return Line(first, run / np.linalg.norm(run))


def meeting(first: Line, second: Line) -> Array:
    """Return the intersection (2,) of two lines."""
    matrix = np.column_stack([first.direction, -second.direction])
    along = np.linalg.solve(matrix, second.point - first.point)
    out: Array = first.point + along[0] * first.direction
    return out


@dataclass(frozen=True)
class FlatStone:
    """A stone in the elevation.

    Attributes
    ----------
    block : as surveyed
    outline : (nv, 2) counter-clockwise [m]
    worn : indices of worn corners
    """

    block: SurveyedBlock
    outline: Array
    worn: frozenset[int]

    @cached_property
    def centre(self) -> Array:
        """Mean of its corners, (2,)."""
        out: Array = self.outline.mean(axis=0)
        return out

    def side(self, towards: Array, otherwise: Array) -> Line | None:
        """Return the line of the side that faces a direction (2,); None if none does.

        If one end of the side is worn, the line goes through the sound one, in the direction `otherwise` (2,), if the
        side is nearly in that direction.
        """
        ends = self.side_ends(towards)
        if ends is None:
            return None
        sound = [k for k in ends if k not in self.worn]
        line = line_through(self.outline[ends[0]], self.outline[ends[1]])
        if len(sound) == 2 or abs(line.direction @ otherwise) < _NEARLY:
            return line
        return Line(self.outline[sound[0] if sound else ends[0]], otherwise)

    def side_ends(self, towards: Array) -> tuple[int, int] | None:
        """Return the indices of the ends of the side that faces a direction; None if none does."""
        run = np.roll(self.outline, -1, axis=0) - self.outline
        length = np.hypot(run[:, 0], run[:, 1])
        facing = (run[:, 1] * towards[0] - run[:, 0] * towards[1]) / length
        if not (facing >= _FACING).any():
            return None
        # of a long side that faces half away and a short one that faces the direction, take the short one
        k = int(np.where(facing >= _FACING, length * facing**4, 0.0).argmax())
        return k, (k + 1) % len(self.outline)

    def crossing(self, height: Line) -> tuple[float, float] | None:
        """Return the places along the wall where a nearly level line enters and leaves it [m]; None if it misses."""
        normal = np.array([-height.direction[1], height.direction[0]])
        above = (self.outline - height.point) @ normal
        places = []
        for k, (a, b) in enumerate(zip(above, np.roll(above, -1), strict=True)):
            if (a > 0.0) != (b > 0.0):
                here, after = self.outline[k], self.outline[(k + 1) % len(above)]
                places.append(float(here[0] + a / (a - b) * (after[0] - here[0])))
        return (min(places), max(places)) if places else None

    def contains(self, point: Array) -> bool:
        """Return whether a point (2,) is in its outline."""
        inside = False
        for here, after in zip(self.outline, np.roll(self.outline, -1, axis=0), strict=True):
            if (here[1] > point[1]) != (after[1] > point[1]):
                share = (point[1] - here[1]) / (after[1] - here[1])
                inside ^= bool(point[0] < here[0] + share * (after[0] - here[0]))
        return inside


@dataclass(frozen=True)
class Elevation:
    """A facade in elevation.

    Attributes
    ----------
    frame : of the facade
    stones : all that face this way and belong to this wall
    """

    frame: WallPlane
    stones: tuple[FlatStone, ...]

    @cached_property
    def neighbours(self) -> Neighbours:
        """Faces of its stones, searchable by place."""
        return Neighbours([stone.block.face for stone in self.stones])

    @cached_property
    def boxes(self) -> Array:
        """Lower left and upper right corner of each stone's outline, (n, 2, 2) [m]."""
        return np.array([[stone.outline.min(axis=0), stone.outline.max(axis=0)] for stone in self.stones])


def elevations(blocks: Sequence[SurveyedBlock]) -> tuple[Elevation, ...]:
    """Return the standing facades of a survey; walls that face one way but stand one behind the other are apart."""
    if not blocks:
        return ()
    normals = np.array([block.face.fit.normal for block in blocks])
    areas = np.array([block.face.measures.area for block in blocks])
    centres = np.array([block.face.outline.mean(axis=0) for block in blocks])
    walls = []
    for facade in find_facades(normals, areas, centres):
        if facade.azimuth is None:
            continue
        out = (centres[facade.members] - facade.frame.origin) @ facade.frame.axes[2]
        order = np.argsort(out)
        layer = np.concatenate([[0], np.cumsum(np.diff(out[order]) > _LAYER)])
        for number in range(int(layer[-1]) + 1):
            members = sorted(facade.members[order[layer == number]].tolist())
            walls.append(_elevation([blocks[i] for i in members], facade.frame))
    return tuple(walls)


def _elevation(blocks: Sequence[SurveyedBlock], frame: WallPlane) -> Elevation:
    stones = []
    for block in blocks:
        flat = frame.flatten(block.face.outline)
        stones.append(FlatStone(block, flat, frozenset(block.face.rejected_vertices)))
    return Elevation(frame, tuple(stones))
