"""Gaps in the courses of a facade, grouped into holes, and the signs of openings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from survey.arrays import Array, Ints
from survey.conventions import BESIDE, PLACES, WIDEST_JOINT
from survey.unseen.missing.settings import MissingSettings
from survey.unseen.missing.sides import Elevation, FlatStone, Line

_UP, _DOWN = np.array([0.0, 1.0]), np.array([0.0, -1.0])
_SAME_BED = WIDEST_JOINT  # metres: largest distance of ends of stones from one bed
_BEYOND = WIDEST_JOINT  # metres above and below a gap at which stones are sought
_SHARED = WIDEST_JOINT  # metres: least overlap of gaps of two courses that are one hole
_FRAMES = {"jamb": "a jamb", "mullion": "a mullion"}
_BELOW = {"sill": "a sill"}
_ABOVE = {"lintel": "a lintel", "voussoir": "an arch", "keystone": "an arch"}


@dataclass(frozen=True)
class CourseGap:
    """A gap without known stones between two neighbours of a course.

    Attributes
    ----------
    zone, course : location
    left, right : the neighbours
    start, stop : ends of the gap, at half the height of the course [m]
    lower, upper : lines of its beds
    below, above : index of the stone under and over it at places along it; -1 for none, -2 for the ground
    """

    zone: str | None
    course: int
    left: FlatStone
    right: FlatStone
    start: float
    stop: float
    lower: Line
    upper: Line
    below: Ints
    above: Ints

    @property
    def width(self) -> float:
        """Distance of the neighbours [m]."""
        return self.stop - self.start

    @property
    def middle(self) -> float:
        """Half-way between the neighbours, along the wall [m]."""
        return 0.5 * (self.start + self.stop)


@dataclass(frozen=True)
class Gaps:
    """Gaps and joints of the courses of a facade.

    Attributes
    ----------
    gaps : wider than a joint
    joints : widths of the joints of the courses [m]
    """

    gaps: tuple[CourseGap, ...]
    joints: Array


@dataclass(frozen=True)
class Hole:
    """Gaps one above the other.

    Attributes
    ----------
    gaps : from below
    courses : height in courses
    bounded : least part of the length of any of its gaps with stones, or another gap, both below and above [-]
    """

    gaps: tuple[CourseGap, ...]
    courses: int
    bounded: float


def find_gaps(elevation: Elevation, settings: MissingSettings) -> Gaps:
    """Return all gaps in the courses of a facade, course by course from below, from left to right."""
    stones = elevation.stones
    low, high = elevation.boxes[:, 0, 1], elevation.boxes[:, 1, 1]
    courses: dict[tuple[str, int], list[FlatStone]] = {}
    for stone in stones:
        if stone.block.course is not None:
            courses.setdefault((stone.block.face.record.zone or "", stone.block.course), []).append(stone)
    gaps: list[CourseGap] = []
    joints: list[float] = []
    for (zone, course), members in sorted(courses.items(), key=lambda item: (item[0][1], item[0][0])):
        middle = _middle(members)
        heights = [middle.at_place(place) for place in _ends(members)]
        crossed = np.flatnonzero((low < max(heights)) & (high > min(heights))).tolist()
        for left, right, start, stop in _between([stones[i] for i in crossed], middle, _ends(members)):
            if stop - start <= settings.max_joint:
                joints.append(stop - start)
            elif (
                gap := _gap(elevation, members, zone or None, course, left, right, start, stop)
            ) is not None:
                gaps.append(gap)
    return Gaps(tuple(gaps), np.array(joints))


def find_holes(gaps: Sequence[CourseGap]) -> tuple[Hole, ...]:
    """Group gaps that lie on one another."""
    pairs = [
        (i, j)
        for i, gap in enumerate(gaps)
        for j, above in enumerate(gaps)
        if i != j and _lies_on(above, gap)
    ]
    rows, columns = ([pair[k] for pair in pairs] for k in (0, 1))
    graph = coo_array((np.ones(len(pairs)), (rows, columns)), shape=(len(gaps), len(gaps)))
    count, member = connected_components(graph, directed=False) if gaps else (0, np.zeros(0))
    holes = []
    for number in range(count):
        mine = [gaps[i] for i in np.flatnonzero(member == number).tolist()]
        mine.sort(key=lambda gap: (gap.lower.at_place(gap.middle), gap.start))
        levels = {(gap.zone, gap.course) for gap in mine}
        holes.append(Hole(tuple(mine), len(levels), min(_bounded(gap, mine) for gap in mine)))
    return tuple(holes)


def opening_signs(hole: Hole, elevation: Elevation) -> tuple[str, ...]:
    """Return the signs that a hole is framed as an opening: jambs, a sill, a lintel, an arch."""
    signs = []
    for gap in hole.gaps:
        signs += [f"{_FRAMES[kind]} on the left" for kind in [gap.left.block.kind] if kind in _FRAMES]
        signs += [f"{_FRAMES[kind]} on the right" for kind in [gap.right.block.kind] if kind in _FRAMES]
        for bordering, frames, where in ((gap.below, _BELOW, "below"), (gap.above, _ABOVE, "above")):
            kinds = [elevation.stones[i].block.kind for i in bordering.tolist() if i >= 0]
            framing = [frames[kind] for kind in kinds if kind in frames]
            if 2 * len(framing) > len(bordering):
                signs.append(f"{framing[0]} {where}")
    return tuple(dict.fromkeys(signs))


def _ends(members: Sequence[FlatStone]) -> tuple[float, float]:
    return (
        min(float(stone.outline[:, 0].min()) for stone in members),
        max(float(stone.outline[:, 0].max()) for stone in members),
    )


def _middle(members: Sequence[FlatStone]) -> Line:
    """Return the line at half the height of a course, without stones much higher than the others."""
    heights = np.array([np.ptp(stone.outline[:, 1]) for stone in members])
    usual = np.abs(heights - np.median(heights)) <= 0.3 * np.median(heights)
    boxes = np.array([[stone.outline.min(axis=0), stone.outline.max(axis=0)] for stone in members])
    return _fitted(boxes[usual].mean(axis=1))


def _fitted(points: Array) -> Line:
    """Fit a nearly level line to points (n, 2)."""
    centre = points.mean(axis=0)
    arms = points - centre
    spread = float((arms[:, 0] ** 2).sum())
    slope = float(arms[:, 0] @ arms[:, 1]) / spread if spread > 0.05**2 else 0.0
    direction = np.array([1.0, slope])
    return Line(centre, direction / np.linalg.norm(direction))


def _between(
    stones: Sequence[FlatStone], middle: Line, ends: tuple[float, float]
) -> list[tuple[FlatStone, FlatStone, float, float]]:
    """Yield neighbours along a line, with the end of the one and the start of the other."""
    spans = [(span, stone) for stone in stones if (span := stone.crossing(middle)) is not None]
    spans = [(span, stone) for span, stone in spans if span[1] > ends[0] and span[0] < ends[1]]
    spans.sort(key=lambda span: span[0])
    gaps = []
    (_, reached), left = spans[0] if spans else ((0.0, 0.0), None)
    for (start, stop), right in spans[1:]:
        if left is not None:
            gaps.append((left, right, reached, start))
        if stop > reached:
            reached, left = stop, right
    return gaps


def _gap(
    elevation: Elevation,
    members: Sequence[FlatStone],
    zone: str | None,
    course: int,
    left: FlatStone,
    right: FlatStone,
    start: float,
    stop: float,
) -> CourseGap | None:
    middle = 0.5 * (start + stop)
    lower, upper = (_bed(members, towards, start, stop) for towards in (_DOWN, _UP))
    if lower is None or upper is None or upper.at_place(middle) <= lower.at_place(middle):
        return None
    places = start + (np.arange(PLACES) + 0.5) / PLACES * (stop - start)
    below = _stones_at(elevation, places, lower, -_BEYOND)
    above = _stones_at(elevation, places, upper, _BEYOND)
    if _on_the_ground(elevation, lower, start, stop):
        below = np.full(PLACES, -2)
    return CourseGap(zone, course, left, right, start, stop, lower, upper, below, above)


def _bed(members: Sequence[FlatStone], towards: Array, start: float, stop: float) -> Line | None:
    """Fit the upper or lower bed of a course at a gap to sound corners of the nearest stones of the course."""
    sides = [(stone, stone.side_ends(towards)) for stone in members]
    usable = [(stone, ends) for stone, ends in sides if ends is not None and not stone.worn & set(ends)]
    usable.sort(key=lambda entry: max(start - entry[0].centre[0], entry[0].centre[0] - stop))
    edges = [stone.outline[list(ends)] for stone, ends in usable[: 2 * BESIDE]]
    if not edges:
        return None
    heights = np.array([ends[:, 1].mean() for ends in edges])
    usual = np.abs(heights - np.median(heights)) <= _SAME_BED
    return _fitted(np.concatenate([ends for ends, fits in zip(edges, usual, strict=True) if fits][:BESIDE]))


def _stones_at(elevation: Elevation, places: Array, bed: Line, above: float) -> Ints:
    """Return the stone at each place at a height above a bed; -1 where there is none."""
    stone_at = np.full(len(places), -1, dtype=np.int64)
    points = np.array([[place, bed.at_place(place) + above] for place in places.tolist()])
    boxes = elevation.boxes
    boxed = (boxes[:, 0] < points.max(axis=0)) & (boxes[:, 1] > points.min(axis=0))
    for number in np.flatnonzero(boxed.all(axis=1)).tolist():
        stone = elevation.stones[number]
        for k in np.flatnonzero(stone_at < 0).tolist():
            if stone.contains(points[k]):
                stone_at[k] = number
    return stone_at


def _on_the_ground(elevation: Elevation, lower: Line, start: float, stop: float) -> bool:
    """Return whether no stone is known under a gap at any depth."""
    boxes = elevation.boxes
    over = (boxes[:, 1, 0] > start) & (boxes[:, 0, 0] < stop)
    return not bool((boxes[over, :, 1].mean(axis=1) < lower.at_place(0.5 * (start + stop))).any())


def _lies_on(upper: CourseGap, lower: CourseGap) -> bool:
    shared = min(upper.stop, lower.stop) - max(upper.start, lower.start)
    if shared < _SHARED:
        return False
    place = max(upper.start, lower.start) + 0.5 * shared
    return abs(upper.lower.at_place(place) - lower.upper.at_place(place)) < 2.0 * _BEYOND


def _bounded(gap: CourseGap, hole: Sequence[CourseGap]) -> float:
    """Return the least part of a gap's length with stones, the ground or another gap of its hole, below or above."""
    places = gap.start + (np.arange(PLACES) + 0.5) / PLACES * gap.width
    parts = []
    for bordering, others in (
        (gap.below, [lower for lower in hole if _lies_on(gap, lower)]),
        (gap.above, [upper for upper in hole if _lies_on(upper, gap)]),
    ):
        filled = bordering != -1
        for neighbour in others:
            filled |= (places > neighbour.start) & (places < neighbour.stop)
        parts.append(float(filled.mean()))
    return min(parts)
