"""Cuts of the core of a wall: beds of its courses, head joints of its facings.

All in the frame of the wall: x along it, y up, z out of the front. Planes are (nx, ny, nz, d), n·x = d.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array
from survey.conventions import WEAR
from survey.unseen.core.facings import FacingStone, FacingWall
from survey.unseen.core.settings import InfillSettings

_ALONG, _UP = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
_OFF_BED = WEAR  # metres: distance from the bed of its course above which a corner is left out


@dataclass(frozen=True)
class Strip:
    """The space between two beds.

    Attributes
    ----------
    lower, upper : (4,) their planes, with normals upwards
    course : number of the course of the front, or of the back, that begins at the lower bed; None if none does
    """

    lower: Array
    upper: Array
    course: int | None

    @property
    def middle(self) -> float:
        """Height half-way between the beds, at the origin [m]."""
        return 0.5 * (height_of(self.lower, 0.0) + height_of(self.upper, 0.0))


@dataclass(frozen=True)
class Stretch:
    """Part of a strip that one stone of a facing takes.

    Attributes
    ----------
    stone : of the facing
    left, right : (4,) planes of its head joints, with normals to the right
    start, stop : their places at half the height of the strip [m]
    """

    stone: FacingStone
    left: Array
    right: Array
    start: float
    stop: float


@dataclass(frozen=True)
class _Bed:
    height: float
    corners: Array
    course: int | None


def strips(wall: FacingWall, settings: InfillSettings) -> tuple[Strip, ...]:
    """Return the strips between the beds of both facings, from below; beds that nearly coincide are one."""
    beds = sorted(
        (bed for side in (wall.front, wall.back) for bed in _beds(side)), key=lambda bed: bed.height
    )
    groups: list[list[_Bed]] = []
    for bed in beds:
        if groups and bed.height - groups[-1][-1].height < settings.merge:
            groups[-1].append(bed)
        else:
            groups.append([bed])
    planes = [_plane(np.concatenate([bed.corners for bed in group])) for group in groups]
    courses = [next((bed.course for bed in group if bed.course is not None), None) for group in groups]
    return tuple(
        Strip(lower, upper, course) for lower, upper, course in zip(planes, planes[1:], courses, strict=False)
    )


def stretches(strip: Strip, stones: Sequence[FacingStone], settings: InfillSettings) -> list[Stretch]:
    """Return the parts of a strip that the stones of one facing take, from left to right.

    Neighbours share the plane half-way between them; at a hole or an opening each ends at its own side.
    """
    runs = []
    for stone in stones:
        if not _fills(stone, strip):
            continue
        left, right = -stone.support(-_ALONG), stone.support(_ALONG)
        start, stop = (place_of(plane, strip.middle) for plane in (left, right))
        runs.append(Stretch(stone, left, right, start, stop))
    runs.sort(key=lambda run: run.start + run.stop)
    for k in range(len(runs) - 1):
        first, second = runs[k], runs[k + 1]
        if second.start - first.stop >= settings.max_joint:
            continue
        shared = _between(first.right, second.left, 0.5 * (first.stop + second.start), strip.middle)
        place = place_of(shared, strip.middle)
        runs[k] = Stretch(first.stone, first.left, shared, first.start, place)
        runs[k + 1] = Stretch(second.stone, shared, second.right, place, second.stop)
    return [run for run in runs if run.stop > run.start]


def height_of(plane: Array, along: float) -> float:
    """Return the height of a bed plane at a place along the wall, in the middle of its thickness [m]."""
    return float((plane[3] - plane[0] * along) / plane[1])


def place_of(plane: Array, height: float) -> float:
    """Return the place of a head joint's plane along the wall, at a height, in the middle of its thickness [m]."""
    return float((plane[3] - plane[1] * height) / plane[0])


def _fills(stone: FacingStone, strip: Strip) -> bool:
    """Return whether a stone takes more than half the height of the strip at its place."""
    low, high = stone.solid.vertices[:, 1].min(), stone.solid.vertices[:, 1].max()
    along = float(stone.solid.vertices[:, 0].mean())
    bottom, top = height_of(strip.lower, along), height_of(strip.upper, along)
    return bool(min(high, top) - max(low, bottom) > 0.5 * (top - bottom))


def _beds(stones: Sequence[FacingStone]) -> list[_Bed]:
    """Return lower and upper beds of each course of a facing, or of each stone if courses are unknown."""
    courses: dict[object, list[FacingStone]] = {}
    numbered = any(stone.course is not None for stone in stones)
    for stone in stones:
        if stone.course is not None or not numbered:
            courses.setdefault(stone.course if numbered else stone.code, []).append(stone)
    beds = []
    for members in courses.values():
        for direction, course in ((-_UP, members[0].course), (_UP, None)):
            faces = [(stone, stone.towards(direction)) for stone in members]
            corners = [stone.solid.vertices[face] for stone, face in faces if face is not None]
            if corners:
                together = np.concatenate(corners)
                beds.append(_Bed(float(np.median(together[:, 1])), together, course))
    return beds


def _plane(corners: Array) -> Array:
    """Fit the bed plane to corners (n, 3), without those of another bed."""
    typical = np.abs(corners[:, 1] - np.median(corners[:, 1])) <= 2.0 * _OFF_BED
    for _ in range(3):
        some = corners[typical]
        middle = some.mean(axis=0)
        arms = some[:, [0, 2]] - middle[[0, 2]]
        slopes = np.linalg.lstsq(arms, some[:, 1] - middle[1], rcond=1e-9)[0]
        residuals = corners[:, 1] - middle[1] - (corners[:, [0, 2]] - middle[[0, 2]]) @ slopes
        typical = np.abs(residuals) <= _OFF_BED
    normal = np.array([-slopes[0], 1.0, -slopes[1]])
    normal /= np.linalg.norm(normal)
    return np.append(normal, float(normal @ middle))


def _between(first: Array, second: Array, place: float, height: float) -> Array:
    """Return the plane half-way between two head joints, through a place at a height."""
    normal = first[:3] + second[:3]
    normal = normal / np.linalg.norm(normal)
    return np.append(normal, float(normal @ np.array([place, height, 0.0])))
