"""Gaps between the voussoirs of arches, from the angles at which their joints point to the centre."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import cdist

from survey.arrays import Array
from survey.conventions import GROUP, MOST, SLOPED, SOME, WEAR
from survey.unseen.missing.settings import MissingSettings
from survey.unseen.missing.sides import Elevation, FlatStone, Line, line_through, meeting

Ends = tuple[int, int]

_WEDGES = {"voussoir", "keystone"}
_REACH = 3.4  # lengths of a voussoir to the next one, where one or two are missing
_OFF_CENTRE = 0.15  # radii: largest distance of a springer's joint from the centre
_ONE_SKEWBACK = SLOPED  # angle within which sides of springers are one skewback
_SHORTEST = SOME  # sine of the least rise of a skewback
_CROWDED = MOST  # of a voussoir's angle: largest overlap of two of one ring
_LEVEL = WEAR  # metres: height difference of the ends of a level extrados


@dataclass(frozen=True)
class _Side:
    """A side that points to the centre: its line, its angle clockwise from the vertical, its two ends."""

    line: Line
    angle: float
    inner: Array
    outer: Array


@dataclass(frozen=True)
class ArchGap:
    """A gap of missing voussoirs in an arch.

    Attributes
    ----------
    left, right : the stones beside it
    sides : their sides towards it
    count : number of missing voussoirs
    keystone : index of the one at the crown of an arch without a keystone; None if there is none
    centre : of the arch, (2,) [m]
    usual : usual angle of a voussoir [rad]
    """

    left: FlatStone
    right: FlatStone
    sides: tuple[_Side, _Side]
    count: int
    keystone: int | None
    centre: Array
    usual: float


def arch_gaps(elevation: Elevation, settings: MissingSettings) -> tuple[ArchGap, ...]:
    """Return the gaps between the voussoirs of every arch, and between them and its springers, from left to right."""
    gaps: list[ArchGap] = []
    for wedges in _arches(elevation):
        centre = _centre(wedges)
        if centre is None:
            continue
        row = [sides for stone in wedges if (sides := _sides(stone, centre)) is not None]
        springers = [stone for stone in elevation.stones if stone.block.kind == "springer"]
        row += _springing(springers, centre, row) if row else []
        row.sort(key=lambda entry: entry[1].angle + entry[2].angle)
        gaps += _gaps(row, centre, settings)
    return tuple(gaps)


def voussoir_outlines(gap: ArchGap, joint: float) -> list[Array]:
    """Return the outlines (4, 2) of the missing voussoirs: intrados left and right, extrados right and left."""
    left, right = gap.sides
    inside = 0.5 * (left.inner + right.inner)
    first, last = left.line.moved(inside, joint), right.line.moved(inside, joint)
    angles = np.linspace(left.angle, right.angle, gap.count + 1)[1:-1]
    cuts = [Line(gap.centre, np.array([np.sin(a), np.cos(a)])) for a in angles.tolist()]
    lines = [first]
    for cut in cuts:
        lines += [_offset(cut, -0.5 * joint), _offset(cut, 0.5 * joint)]
    lines.append(last)
    outlines = []
    for k in range(gap.count):
        first_line, second_line = lines[2 * k], lines[2 * k + 1]
        corners = [
            _on(first_line, gap, False),
            _on(second_line, gap, False),
            _on(second_line, gap, True),
            _on(first_line, gap, True),
        ]
        outlines.append(np.array(corners))
    return outlines


def _on(line: Line, gap: ArchGap, outer: bool) -> Array:
    """Return the end of a joint: on the line between the neighbours' corners, or on their arc."""
    first, second = ((side.outer if outer else side.inner) for side in gap.sides)
    straight = meeting(line, line_through(first, second))
    if gap.count == 1 or (outer and abs(second[1] - first[1]) < _LEVEL):
        return straight
    arms = [point - gap.centre for point in (first, second, straight)]
    angles = [float(np.arctan2(arm[0], arm[1])) for arm in arms]
    share = (angles[2] - angles[0]) / (angles[1] - angles[0])
    radius = (1.0 - share) * np.linalg.norm(arms[0]) + share * np.linalg.norm(arms[1])
    out: Array = gap.centre + radius * arms[2] / np.linalg.norm(arms[2])
    return out


def _offset(line: Line, by: float) -> Line:
    """Return the parallel to an upward line, at a distance to its right."""
    return Line(line.point + by * np.array([line.direction[1], -line.direction[0]]), line.direction)


def _arches(elevation: Elevation) -> list[list[FlatStone]]:
    """Return rows of voussoirs and keystones with at most two missing between neighbours."""
    stones = [stone for stone in elevation.stones if stone.block.kind in _WEDGES]
    if len(stones) < GROUP:
        return []
    centres = np.array([stone.centre for stone in stones])
    apart = cdist(centres, centres)
    usual = float(np.median(np.sort(apart, axis=1)[:, 1]))
    graph = coo_array(apart <= _REACH * usual)
    count, member = connected_components(graph, directed=False)
    groups = [[stone for stone, k in zip(stones, member, strict=True) if k == n] for n in range(count)]
    return [group for group in groups if len(group) >= GROUP]


def _centre(stones: Sequence[FlatStone]) -> Array | None:
    """Return the point nearest to the joints of an arch; None if they are parallel.

    The joints are first taken to be the sides that face along the row, then those that face around the centre.
    """
    crowd = np.mean([stone.centre for stone in stones], axis=0)
    along = [_along(stone, stones) for stone in stones]
    for _ in range(3):
        normals, places = [], []
        for stone, towards in zip(stones, along, strict=True):
            for sign in (1.0, -1.0):
                ends = stone.side_ends(sign * towards)
                if ends is None or stone.worn & set(ends):
                    continue
                line = line_through(*stone.outline[list(ends)])
                normals.append([-line.direction[1], line.direction[0]])
                places.append(line.point)
        if len(normals) < GROUP:
            return None
        rows = np.array(normals)
        right = (rows * (np.array(places) - crowd)).sum(axis=1)
        if np.linalg.svd(rows, compute_uv=False)[1] < 0.1:
            return None
        centre: Array = crowd + np.linalg.lstsq(rows, right, rcond=None)[0]
        radial = [(stone.centre - centre) / np.linalg.norm(stone.centre - centre) for stone in stones]
        along = [np.array([line[1], -line[0]]) for line in radial]
    return centre


def _along(stone: FlatStone, stones: Sequence[FlatStone]) -> Array:
    """Return the direction of the row at a stone: from its nearest neighbour, or to it."""
    others = sorted(
        (neighbour for neighbour in stones if neighbour is not stone),
        key=lambda neighbour: float(np.linalg.norm(neighbour.centre - stone.centre)),
    )
    run = others[0].centre - stone.centre
    out: Array = run / np.linalg.norm(run)
    return out


def _sides(stone: FlatStone, centre: Array) -> tuple[FlatStone, _Side, _Side] | None:
    """Return a voussoir with its left and right sides; None if it lacks one."""
    radial = (stone.centre - centre) / np.linalg.norm(stone.centre - centre)
    clockwise = np.array([radial[1], -radial[0]])
    ends = [stone.side_ends(sign * clockwise) for sign in (-1.0, 1.0)]
    left, right = ends
    if left is None or right is None:
        return None
    return stone, _side(stone, left, right, centre), _side(stone, right, left, centre)


def _side(stone: FlatStone, ends: Ends, opposite: Ends | None, centre: Array) -> _Side:
    """Return one side; a worn corner is put where the side reaches as far as the opposite one."""
    inner, outer = _by_distance(stone, ends, centre)
    sound = [k for k in (inner, outer) if k not in stone.worn]
    middle = stone.outline[[inner, outer]].mean(axis=0) - centre
    if len(sound) == 2:
        line = line_through(stone.outline[inner], stone.outline[outer])
    else:
        line = Line(stone.outline[sound[0] if sound else inner], middle / np.linalg.norm(middle))
    others = (inner, outer) if opposite is None else _by_distance(stone, opposite, centre)
    corners = [
        stone.outline[k]
        if k not in stone.worn
        else _mended(stone.outline[k], stone.outline[opposite_corner], line, centre)
        for k, opposite_corner in zip((inner, outer), others, strict=True)
    ]
    about = 0.5 * (corners[0] + corners[1]) - centre
    return _Side(line, float(np.arctan2(about[0], about[1])), corners[0], corners[1])


def _by_distance(stone: FlatStone, ends: Ends, centre: Array) -> Ends:
    """Return the ends of a side, that at the intrados first."""
    distances = np.linalg.norm(stone.outline[list(ends)] - centre, axis=1)
    return ends if distances[0] < distances[1] else (ends[1], ends[0])


def _mended(worn: Array, end: Array, line: Line, centre: Array) -> Array:
    """Restore the end of a side whose corner is worn: as far out as the other end of its edge, or as high."""
    up = line.direction if line.direction @ (worn - centre) > 0.0 else -line.direction
    start = line.point - up * float((line.point - centre) @ up)
    beside = float(np.linalg.norm(start - centre))
    reach = float(np.sqrt(max(float((end - centre) @ (end - centre)) - beside**2, 0.0)))
    choices = [start + reach * up]
    if abs(up[1]) > 0.2:
        choices.append(line.point + up * float((end[1] - line.point[1]) / up[1]))
    return min(choices, key=lambda point: float(np.linalg.norm(point - worn)))


def _springing(
    springers: Sequence[FlatStone], centre: Array, row: Sequence[tuple[FlatStone, _Side, _Side]]
) -> list[tuple[FlatStone, _Side, _Side]]:
    """Return the skewbacks on both sides of an arch: each one from all springers on top of one another."""
    radii = [
        float(np.linalg.norm(point - centre)) for _, side, _ in row for point in (side.inner, side.outer)
    ]
    middle = float(np.mean([stone.centre[0] for stone, _, _ in row]))
    springing = []
    for sign in (1.0, -1.0):
        sides = []
        for stone in springers:
            if (
                sign * (stone.centre[0] - middle) < 0.0
                and (side := _skewback(stone, sign, centre)) is not None
            ):
                reach = float(np.linalg.norm(0.5 * (side.inner + side.outer) - centre))
                if 0.8 * min(radii) <= reach <= 1.2 * max(radii):
                    sides.append((reach, stone, side))
        if sides:
            sides.sort(key=lambda side: side[0])
            nearest = sides[0][2]
            same = [side for _, _, side in sides if abs(side.angle - nearest.angle) < _ONE_SKEWBACK]
            ends = nearest.inner, same[-1].outer
            about = 0.5 * (ends[0] + ends[1]) - centre
            whole = _Side(line_through(*ends), float(np.arctan2(about[0], about[1])), *ends)
            springing.append((sides[0][1], whole, whole))
    return springing


def _skewback(stone: FlatStone, sign: float, centre: Array) -> _Side | None:
    """Return the side of a springer that points to the centre; to the right of it for a `sign` of 1."""
    best: tuple[float, Ends] | None = None
    for k in range(len(stone.outline)):
        ends = (k, (k + 1) % len(stone.outline))
        run = stone.outline[ends[1]] - stone.outline[ends[0]]
        length = float(np.linalg.norm(run))
        if sign * float(run[1]) < _SHORTEST * length or set(ends) <= stone.worn:
            continue
        arm = centre - stone.outline[ends[0]]
        passing = abs(float(run[0] * arm[1] - run[1] * arm[0])) / length
        if passing <= _OFF_CENTRE * float(np.linalg.norm(arm)) and (best is None or passing < best[0]):
            best = passing, ends
    return None if best is None else _side(stone, best[1], None, centre)


def _gaps(
    row: Sequence[tuple[FlatStone, _Side, _Side]], centre: Array, settings: MissingSettings
) -> list[ArchGap]:
    """Return the gaps between the stones of a row."""
    turns = np.array([right.angle - left.angle for stone, left, right in row if stone.block.kind in _WEDGES])
    usual = float(np.median(turns))
    gaps = []
    crown = 0.5 * (row[0][1].angle + row[-1][2].angle)
    has_keystone = any(stone.block.kind == "keystone" for stone, _, _ in row)
    for (left, _, end), (right, begin, _) in pairwise(row):
        if begin.angle - end.angle < -_CROWDED * usual:
            return []  # two rings, or no arch
        radius = float(np.linalg.norm(0.5 * (end.inner + end.outer) - centre))
        if left.block.kind not in _WEDGES and right.block.kind not in _WEDGES:
            continue
        if (
            begin.angle - end.angle
        ) * radius < settings.max_joint or begin.angle - end.angle < _CROWDED * usual:
            continue
        count = max(1, round((begin.angle - end.angle) / usual))
        if count > settings.max_stones:
            continue
        middles = end.angle + (np.arange(count) + 0.5) / count * (begin.angle - end.angle)
        nearest = int(np.abs(middles - crown).argmin())
        at_crown = not has_keystone and abs(float(middles[nearest]) - crown) < 0.25 * usual
        gaps.append(ArchGap(left, right, (end, begin), count, nearest if at_crown else None, centre, usual))
    return gaps
