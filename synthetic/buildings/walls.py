"""Walls of any size in running bond: with an arched opening, sagging courses, or stones that span two courses."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from random import Random
from types import MappingProxyType

import numpy as np

from ground.errors import GeometryError
from synthetic.bond import (
    CLEARANCES,
    WIDTHS,
    Bed,
    Piece,
    PlanLine,
    PlannedStone,
    fill_run,
    planned,
    upright,
)
from synthetic.building import Draft, SyntheticBuilding, measured_building, observer
from synthetic.buildings.openings import ArchShape, Opening, plan_opening
from synthetic.frame import BATTER, Movement, build_stone, wall_frame

DEPTHS = {
    "header": 0.50,
    "jamb": 0.45,
    "keystone": 0.42,
    "springer": 0.45,
    "stretcher": 0.38,
    "voussoir": 0.42,
}  # of each kind [m]
_COURSE = (0.26, 0.34)  # heights of courses [m]
_STONE = 0.51 * 0.30  # mean face of a stone [m²]
_SLENDER = 2.2  # length over height of a wall
_APART = 0.95  # distance of stones that span two courses, and from the ends of their run [m]


@dataclass(frozen=True)
class LaidCourse:
    """The stones of a course.

    Attributes
    ----------
    pieces : from left to right
    tall : indices of those that reach through the next course too
    """

    pieces: tuple[Piece, ...]
    tall: frozenset[int]


def wall(
    stones: int,
    seed: int = 1,
    *,
    arch: ArchShape | None = None,
    sag: float = 0.0,
    snecked: float = 0.0,
    batter: float = BATTER,
    movement: Movement = MappingProxyType({}),
    measured: int | None = None,
) -> SyntheticBuilding:
    """Build a wall of a single leaf and measure its face.

    Parameters
    ----------
    stones : their approximate number
    seed : of Python's own generator, whose stream is the same everywhere
    arch : of an opening in its middle; needs about 60 stones
    sag : by which beds sag over 10 m, along a parabola [m]; not together with an arch
    snecked : share of the stones that are two courses high [-]
    batter : angle by which it leans back [rad]
    movement : of the stones since they were laid
    measured : seed of the joints, wear and noise alone, so that the same stones are measured again; None: as `seed`

    Returns
    -------
    SyntheticBuilding, whose stones of kinds other than voussoirs and keystones have the code W<course>-<number>
    """
    if arch is not None and sag:
        raise GeometryError("beds that sag and an arch in one wall", remedy="build one of the two")
    rng = Random(seed)
    high = max(math.sqrt(stones * _STONE / _SLENDER), 6.5 * 0.3 if arch else 0.0)
    heights = bed_heights(rng, max(2, round(high / 0.30)))
    half = 0.6 if stones < 400 else 1.2
    opening = None
    if arch is not None:
        spans = math.ceil(((half if arch is ArchShape.SEMICIRCULAR else half / 3.0) + 0.3) / _COURSE[0])
        opening = plan_opening(arch, half, heights, min(7, max(1, len(heights) - 3 - spans)))
    length = stones * _STONE / heights[-1] + (2.0 * half if opening else 0.0)
    ends = (-0.49 * length, 0.51 * length)
    courses = plan_courses(rng, heights, ends, opening, snecked)
    plans = _outlines(courses, heights, sag)
    if opening is not None:
        plans += [(plan, (0, 1, 2, 3)) for plan in opening.voussoirs()]
    frame = wall_frame(batter)
    drafts = []
    for plan, side_of in plans:
        stone = build_stone(plan, DEPTHS[plan.kind], frame, rng)
        quad = plan.corners[[0, -3, -2, -1]]
        drafts.append(Draft(stone, frame, quad, side_of))
    base = [plan.code for plan, _ in plans if plan.course == 1]
    middle = np.array([[0.0, 0.5 * heights[-1]]])
    station = observer(frame.place(middle, 9.0 + heights[-1])[0])
    name = f"wall of {len(drafts)} stones"
    rng = rng if measured is None else Random(measured)
    return measured_building(name, drafts, DEPTHS, [station], base, rng, movement=movement)


def bed_heights(rng: Random, courses: int) -> list[float]:
    """Draw the heights of the beds, from the ground to the top [m]."""
    heights = [0.0]
    for _ in range(courses):
        heights.append(heights[-1] + rng.uniform(*_COURSE))
    return heights


def plan_courses(
    rng: Random,
    heights: Sequence[float],
    ends: tuple[float, float],
    opening: Opening | None = None,
    snecked: float = 0.0,
    through: Sequence[Sequence[Piece]] = (),
) -> list[LaidCourse]:
    """Fill the courses of a wall from the ground.

    Parameters
    ----------
    rng : random numbers
    heights : of the beds [m]
    ends : of the wall [m]
    opening : to be left open
    snecked : share of the stones that are two courses high [-]
    through : by course, stones that are already in place; courses beyond its length have none
    """
    courses: list[LaidCourse] = []
    below: list[float] = []
    for number, (low, high) in enumerate(pairwise(heights), start=1):
        middle = 0.5 * (low + high)
        through_stones = list(through[number - 1]) if number <= len(through) else []
        before = courses[-1] if courses else LaidCourse((), frozenset())
        blocked = [before.pieces[k] for k in sorted(before.tall)] + through_stones
        pieces = list(through_stones)
        if opening is not None and number == opening.jambs[0] - 1:  # no jamb on a sliver of the next stone
            below = sorted({*below, -opening.half, opening.half})
        for start, stop in _runs(blocked, opening, number, middle, ends):
            pieces += _fill_beside(rng, start, stop, opening, number, middle, below)
        pieces.sort(key=lambda piece: piece.left.at(middle))
        tall = frozenset[int]()
        if snecked and number < len(heights) - 1:
            tall = _tall(rng, pieces, snecked, middle, _forbidden(ends, opening, blocked, middle))
        courses.append(LaidCourse(tuple(pieces), tall))
        tops = [p for k, p in enumerate(pieces) if k not in tall] + blocked
        below = sorted({line.at(high) for piece in tops for line in (piece.left, piece.right)})
        if opening is not None and number == opening.arch[1]:
            below = sorted({*below, *(stone.corners[2, 0] for stone in opening.voussoirs())})
    return courses


def _runs(
    blocked: Sequence[Piece], opening: Opening | None, number: int, middle: float, ends: tuple[float, float]
) -> list[tuple[PlanLine, PlanLine]]:
    """Return the stretches of a course to be filled, between stones already in place."""
    gaps = [(piece.left, piece.right) for piece in blocked]
    edges = opening.edges(number, middle) if opening is not None else None
    if edges is not None:
        gaps.append(edges[:2])
    gaps.sort(key=lambda gap: gap[0].at(middle))
    starts = [upright(ends[0], middle), *(right for _, right in gaps)]
    stops = [*(left for left, _ in gaps), upright(ends[1], middle)]
    return [
        (start, stop)
        for start, stop in zip(starts, stops, strict=True)
        if stop.at(middle) > start.at(middle) + 1e-6
    ]


def _fill_beside(
    rng: Random,
    start: PlanLine,
    stop: PlanLine,
    opening: Opening | None,
    number: int,
    middle: float,
    below: Sequence[float],
) -> list[Piece]:
    """Fill a run, with a stone of a special kind beside an opening."""
    edges = opening.edges(number, middle) if opening is not None else None
    if opening is None or edges is None or edges[2] == "stretcher":
        return fill_run(rng, start, stop, middle, below)
    left, right, kind = edges
    lengths = opening.beside(number)
    if stop == left:
        edge = min(stop.at(middle), -opening.half)
        place = _end_beside(edge, lengths, -1, start.at(middle), below)
        if place is None:
            return [Piece(kind, start, stop)]
        cut = upright(place, middle, rng)
        return [*fill_run(rng, start, cut, middle, below), Piece(kind, cut, stop)]
    if start == right:
        edge = max(start.at(middle), opening.half)
        place = _end_beside(edge, lengths[::-1], 1, stop.at(middle), below)
        if place is None:
            return [Piece(kind, start, stop)]
        cut = upright(place, middle, rng)
        return [Piece(kind, start, cut), *fill_run(rng, cut, stop, middle, below)]
    return fill_run(rng, start, stop, middle, below)


def _end_beside(
    edge: float, lengths: Sequence[float], outward: int, end: float, below: Sequence[float]
) -> float | None:
    """Return where the stone beside an opening ends, with the first length whose rest can be filled; None: at `end`."""
    for length in lengths:
        place = _clear(edge + outward * length, outward, below)
        rest = outward * (end - place)
        if WIDTHS["header"][0] <= rest <= WIDTHS["header"][1] or rest >= WIDTHS["stretcher"][0]:
            return place
    return None


def _clear(place: float, outward: int, below: Sequence[float]) -> float:
    """Move a head joint outward until it is clear of those of the course below."""
    while any(abs(place - joint) < CLEARANCES[0] for joint in below):
        place += 0.02 * outward
    return place


def _forbidden(
    ends: tuple[float, float], opening: Opening | None, blocked: Sequence[Piece], middle: float
) -> list[tuple[float, float]]:
    """Return the stretches without stones two courses high: near ends, such stones and the opening."""
    out = [(ends[0], ends[0]), (ends[1], ends[1])]
    out += [(piece.left.at(middle), piece.right.at(middle)) for piece in blocked]
    if opening is not None:
        out.append((-opening.reach - 0.8, opening.reach + 0.8))
    return out


def _tall(
    rng: Random,
    pieces: Sequence[Piece],
    share: float,
    middle: float,
    forbidden: list[tuple[float, float]],
) -> frozenset[int]:
    """Choose stones that are two courses high, each with room for stones beside it in both."""
    chosen: list[int] = []
    for k, piece in enumerate(pieces):
        left, right = piece.left.at(middle), piece.right.at(middle)
        free = all(right + _APART <= low or high + _APART <= left for low, high in forbidden)
        if rng.random() < 2.0 * share and free:
            chosen.append(k)
            forbidden = [*forbidden, (left, right)]
    return frozenset(chosen)


def _outlines(
    courses: Sequence[LaidCourse], heights: Sequence[float], sag: float
) -> list[tuple[PlannedStone, tuple[int, ...]]]:
    """Outline all stones of the courses, once the beds are known."""
    beds = _beds(courses, heights, sag)
    return [
        planned(
            f"W{number:02d}-{k + 1:02d}",
            piece,
            beds[number - 1],
            beds[number + (k in course.tall)],
            number,
        )
        for number, course in enumerate(courses, start=1)
        for k, piece in enumerate(course.pieces)
    ]


def _beds(courses: Sequence[LaidCourse], heights: Sequence[float], sag: float) -> list[Bed]:
    """Lay out the beds: level, or bent at the head joints of the stones that end below them."""
    if not sag:
        return [Bed(height) for height in heights]
    beds = [_bent(courses[0].pieces, heights[0], sag)]
    tall: list[Piece] = []
    for course, height in zip(courses, heights[1:], strict=True):
        tops = tall + [piece for k, piece in enumerate(course.pieces) if k not in course.tall]
        beds.append(_bent(tops, height, sag))
        tall = [course.pieces[k] for k in sorted(course.tall)]
    return beds


def _bent(below: Sequence[Piece], height: float, sag: float) -> Bed:
    """Lay out the bed on some stones: at their head joints it is on a parabola that falls by `sag` over 5 m."""
    corners = set()
    for piece in below:
        for line in (piece.left, piece.right):
            t = height + sag * (line.at(height) / 5.0) ** 2
            corners.add((line.at(t), t))
    return Bed(height, tuple(sorted(corners)))
