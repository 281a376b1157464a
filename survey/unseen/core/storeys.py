"""Core of a wall as one continuum for each storey, with planar sides that step around the tails of headers.

Hidden sides of about the same depth have one plane, behind the deepest of them: a level. Levels of both facings, beds
and upright planes at the sides of deeper stones cut the wall into cells with planar sides; the core consists of the
cells that no stone reaches into. Where the front and the back have one depth each, it is a prism without steps.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from survey.arrays import Array
from survey.conventions import ON_PLANE, STEP
from survey.geometry.solids import Solid
from survey.unseen.core.cells import CellGrid, grid_solids
from survey.unseen.core.courses import Strip, height_of, stretches, strips
from survey.unseen.core.facings import FacingStone, FacingWall
from survey.unseen.core.settings import InfillSettings

Interval = tuple[float, float]

_OUT = np.array([0.0, 0.0, 1.0])
_SNAP = STEP  # metres: distance below which sides of deeper stones make one cut if possible


@dataclass(frozen=True)
class CoreStorey:
    """A continuum of the core.

    Attributes
    ----------
    solid : in the frame of the wall; convex where it has no steps
    number : of the storey, from 1 below
    courses : first and last course that it covers; None if courses are unknown
    """

    solid: Solid
    number: int
    courses: tuple[int, int] | None


@dataclass(frozen=True)
class _Deep:
    """A stone that reaches behind the first level of its facing.

    Attributes
    ----------
    stone : in the frame of the wall
    cells : range of the cells it takes, between the levels from the front to the back
    """

    stone: FacingStone
    cells: slice

    @property
    def along(self) -> Interval:
        """Its start and end along the wall [m]."""
        return float(self.stone.solid.vertices[:, 0].min()), float(self.stone.solid.vertices[:, 0].max())

    def above(self, plane: Array) -> Interval:
        """Return the heights of its lowest and highest corner above a bed plane [m]."""
        heights = self.stone.solid.vertices @ plane[:3] - plane[3]
        return float(heights.min()), float(heights.max())


@dataclass(frozen=True)
class _Line:
    """A bed plane (4,) that cuts the core, and the depth by which stones may reach across it [m]."""

    plane: Array
    slack: float


def core_storeys(wall: FacingWall, settings: InfillSettings) -> tuple[CoreStorey, ...]:
    """Fill the core of a wall with a continuum for each storey, from below.

    Parameters
    ----------
    wall : two facings
    settings : tolerances, and the height of a storey

    Returns
    -------
    Storeys; more than one solid of a number where through stones or openings divide a storey
    """
    rows = strips(wall, settings)
    planes, deep = _levels(wall, settings)
    if not rows or not planes:
        return ()
    storeys = []
    beds = _beds(rows, deep)
    for number, group in enumerate(_storeys(rows, settings.storey_height), start=1):
        courses = [rows[k].course for k in group]
        numbered = [course for course in courses if course is not None]
        lines = [
            beds[group[0]][-1],
            *(line for k in group[1:] for line in beds[k]),
            beds[group[-1] + 1][0],
        ]
        grid = _grid(wall, [rows[k] for k in group], lines, planes, deep, settings)
        span = (min(numbered), max(numbered)) if numbered else None
        storeys += [CoreStorey(solid, number, span) for solid in grid_solids(grid)]
    return tuple(storeys)


def _storeys(rows: Sequence[Strip], height: float | None) -> list[list[int]]:
    """Group the strips into storeys, from below: a storey ends at the first bed that makes it high enough."""
    groups: list[list[int]] = [[]]
    start = height_of(rows[0].lower, 0.0)
    for k, row in enumerate(rows):
        groups[-1].append(k)
        top = height_of(row.upper, 0.0)
        if height is not None and top - start >= height * (1.0 - 1e-9) and k + 1 < len(rows):
            groups.append([])
            start = top
    return groups


def _levels(wall: FacingWall, settings: InfillSettings) -> tuple[list[Array], list[_Deep]]:
    """Return the planes of all levels from front to back, and the stones deeper than the first of their facing.

    A level nearer than the least thickness to one of the other facing is dropped: its stones go through.
    """
    box = np.concatenate([stone.solid.vertices for stone in (*wall.front, *wall.back)])
    low, high = box.min(axis=0), box.max(axis=0)
    corners = np.array([[x, y, 0.0] for x in (low[0], high[0]) for y in (low[1], high[1])])
    front, of_front = _facing_levels(wall.front, -_OUT, settings.level)
    back, of_back = _facing_levels(wall.back, _OUT, settings.level)

    def meet(first: Array, second: Array) -> bool:
        """Return whether less than the least thickness is between two planes at any corner."""
        space = (second[3] - corners @ second[:3]) / second[2] - (first[3] - corners @ first[:3]) / first[2]
        return bool((space > -settings.min_thickness).any())

    while len(front) > 1 and any(meet(front[-1], rear) for rear in back):
        front.pop()
    while len(back) > 1 and any(meet(level, back[-1]) for level in front):
        back.pop()
    if meet(front[0], back[0]):
        return [], []
    whole = slice(None)
    deep = [
        _Deep(stone, slice(k) if k < len(front) else whole)
        for stone, k in zip(wall.front, of_front, strict=True)
        if k
    ]
    deep += [
        _Deep(stone, slice(-k, None) if k < len(back) else whole)
        for stone, k in zip(wall.back, of_back, strict=True)
        if k
    ]
    return [*front, *back[::-1]], deep


def _facing_levels(
    stones: Sequence[FacingStone], inwards: Array, width: float
) -> tuple[list[Array], list[int]]:
    """Return the planes of the levels of a facing, with normals into the wall, and the level of each stone."""
    normal = np.sum([stone.support(inwards)[:3] for stone in stones], axis=0)
    normal = normal / np.linalg.norm(normal)
    depths = np.array([float((stone.solid.vertices @ normal).max()) for stone in stones])
    first: list[float] = []
    for depth in np.sort(depths).tolist():
        if not first or depth - first[-1] > width:
            first.append(depth)
    level = np.searchsorted(first, depths, side="right") - 1
    planes = [np.append(normal, depths[level == k].max()) for k in range(len(first))]
    return planes, level.tolist()


def _beds(rows: Sequence[Strip], deep: Sequence[_Deep]) -> list[tuple[_Line, ...]]:
    """Return the planes of each bed that end the space below and begin that above: one plane if possible.

    With open joints some stones may reach across the bed, by less than the joints are open: closing the joints will
    take them back.
    """
    planes = [rows[0].lower, *(row.upper for row in rows)]
    if not deep:
        return [(_Line(plane, ON_PLANE),) for plane in planes]
    spans = np.array([[stone.above(plane) for stone in deep] for plane in planes])
    lowest, highest = np.abs(spans[:, :, 0]).argmin(axis=0), np.abs(spans[:, :, 1]).argmin(axis=0)
    beds: list[tuple[_Line, ...]] = []
    for k, plane in enumerate(planes):
        ups, downs = spans[k, highest == k, 1], spans[k, lowest == k, 0]
        below, above = _one_or_two(downs, ups, 0.0)
        if len(ups) and len(downs) and above - below < float(np.median(downs) - np.median(ups)):
            across = 0.5 * (above - below)
            beds.append((_Line(_moved(plane, below + across), across + ON_PLANE),))
        else:
            heights = sorted({below, above})
            beds.append(tuple(_Line(_moved(plane, height), ON_PLANE) for height in heights))
    return beds


def _one_or_two(begins: Array, ends: Array, otherwise: float) -> Interval:
    """Return a place between the ends of stones and the starts of others; two, if some begin before others end."""
    last = float(ends.max()) if len(ends) else -np.inf
    first = float(begins.min()) if len(begins) else np.inf
    if last > first:
        return first, last
    place = min(max(otherwise, last), first)
    return place, place


def _moved(plane: Array, by: float) -> Array:
    return np.append(plane[:3], plane[3] + by)


def _grid(
    wall: FacingWall,
    rows: Sequence[Strip],
    lines: Sequence[_Line],
    planes: Sequence[Array],
    deep: Sequence[_Deep],
    settings: InfillSettings,
) -> CellGrid:
    """Return the cells of one storey, marked if they belong to the core."""
    covered = [_covered(wall, row, settings) for row in rows]
    here = [
        block
        for block in deep
        if block.above(lines[0].plane)[1] > lines[0].slack
        and block.above(lines[-1].plane)[0] < -lines[-1].slack
    ]
    places = _places(here, covered)
    filled = np.zeros((max(len(places) - 1, 0), len(lines) - 1, len(planes) - 1), np.bool_)
    along = np.array([block.along for block in here]).reshape(-1, 2)
    above = np.array([[block.above(line.plane) for block in here] for line in lines]).reshape(
        len(lines), -1, 2
    )
    for i, (left, right) in enumerate(pairwise(places)):
        middle = 0.5 * (left + right)
        for j, (lower, upper) in enumerate(pairwise(lines)):
            height = 0.5 * (height_of(lower.plane, middle) + height_of(upper.plane, middle))
            row = next(
                k for k, row in enumerate(rows) if k + 1 == len(rows) or height < height_of(row.upper, middle)
            )
            filled[i, j] = any(start <= middle <= stop for start, stop in covered[row])
            reach = np.minimum(along[:, 1], right) - np.maximum(along[:, 0], left)
            inside = (above[j, :, 1] > lower.slack) & (-above[j + 1, :, 0] > upper.slack)
            for k in np.flatnonzero((reach > ON_PLANE) & inside).tolist():
                filled[i, j, here[k].cells] = False
    return CellGrid(np.array(places), np.array([line.plane for line in lines]), np.array(planes), filled)


def _covered(wall: FacingWall, row: Strip, settings: InfillSettings) -> list[Interval]:
    """Return the intervals along a strip with stones in front and behind."""
    spans = [_spans(row, side, settings) for side in (wall.front, wall.back)]
    both = [(max(a, c), min(b, d)) for a, b in spans[0] for c, d in spans[1]]
    return sorted(interval for interval in both if interval[1] > interval[0])


def _spans(row: Strip, stones: Sequence[FacingStone], settings: InfillSettings) -> list[Interval]:
    spans: list[Interval] = []
    for stretch in stretches(row, stones, settings):
        if spans and stretch.start - spans[-1][1] < settings.max_joint:
            spans[-1] = (spans[-1][0], max(spans[-1][1], stretch.stop))
        else:
            spans.append((stretch.start, stretch.stop))
    return spans


def _places(deep: Sequence[_Deep], covered: Sequence[Sequence[Interval]]) -> list[float]:
    """Return the cuts of the storey along the wall: sides of deeper stones, and ends of a facing."""
    marks = [(place, kind) for stone in deep for place, kind in zip(stone.along, (True, False), strict=True)]
    ends = sorted(place for spans in covered for span in spans for place in span)
    if not ends:
        return []
    places: list[float] = []
    group: list[tuple[float, bool]] = []
    for mark in [*sorted(marks), (np.inf, True)]:
        if group and mark[0] - group[0][0] > _SNAP:
            begins, stops = (np.array([p for p, begin in group if begin is kind]) for kind in (True, False))
            pair = _one_or_two(begins, stops, float(np.mean([p for p, _ in group])))
            places += sorted(set(pair))
            group = []
        group.append(mark)
    inner = [place for place in places if ends[0] + _SNAP < place < ends[-1] - _SNAP]
    for end in [ends[0], ends[-1], *ends]:
        if all(abs(end - place) > _SNAP for place in inner):
            inner.append(end)
    return sorted(inner)
