"""One storey of a tower on three sides: two facings with a core, quoins, windows, vaults, two phases.

::

              back
        B │ │      │ │ C      Wall A, in front, has a window, as has B on the left; jambs of its inner facing may be
          │ │      │ │        splayed, below a rear arch. A passage under a barrel vault leads through C. Corners are
          │ └──────┘ │        solid: in each course a quoin lies along one wall and a bonder, as deep as the walls are
          └──────────┘        thick, beside it in the other; in the next course they change places. Through stones tie
               A              the facings. Above the level break the second phase begins with a thin course; its
                              courses are lower than those of the first. A rib vault may span the room.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from random import Random
from types import MappingProxyType

import numpy as np

from survey.arrays import Array
from survey.extrusion.extrusion import prism
from survey.records.survey import Station
from survey.synthetic.bond import PlannedStone, upright
from survey.synthetic.building import Building, Draft, SolidDraft, flat_stone, measured_building, observer
from survey.synthetic.buildings.openings import Arch, Opening, plan_opening
from survey.synthetic.buildings.ribs import RibVaultShape
from survey.synthetic.buildings.storey_vault import PROJECTION, STANDING, StoreyVault, plan_vault
from survey.synthetic.buildings.walls import Course, plan_courses
from survey.synthetic.coursing import Bed, Piece, planned
from survey.synthetic.frame import Movement, WallFrame, build_stone

__all__ = ["THICKNESS", "TowerStorey", "tower_storey"]

THICKNESS = 1.1
"""Thickness of the walls [m]."""

_HALF = 0.5 * THICKNESS
_DEPTHS = {
    "bonder": THICKNESS,
    "header": 0.45,
    "jamb": _HALF,
    "keystone": _HALF,
    "quoin": _HALF,
    "springer": _HALF,
    "stretcher": 0.28,
    "voussoir": _HALF,
}  # of the stones of a facing, by their part in the plan [m]
_QUOIN = 1.4  # length of a quoin along the wall that it lies in [m]
_HEIGHTS = ((0.26, 0.34), (0.23, 0.29))  # of the courses of each phase [m]
_LEVELLING = 0.15  # height of the first course of the second phase [m]
_BREAK = 0.6  # share of the courses that belong to the first phase
_WINDOW = (0.45, 0.70)  # half the width of a window outside and inside, where it widens in a step [m]
_SPLAYED = (0.45, 0.65)  # the same of a window that widens along splayed jambs [m]
_PASSAGE = (0.60, 0.60)  # the same of the passage, which runs straight through [m]
_LEAVES = (0.47, 0.63)  # depths of the stones of its sides and vault, in turn, so that they bond [m]
_THROUGH = (1.0, 0.40, 2.4)  # of through stones: distance from the end of a run, length, distance of two [m]
_RELIEF = 0.01  # distance of the inner facings of B and C from that of A, whose faces are not flush [m]
_EVERY = 3  # courses from one row of through stones to the next
_OPEN = 10  # least number of courses of a storey with openings
_EYES = 0.6  # part of the height of the jambs at which they are modelled: higher, where courses are lower
_WIDTH = 7.0  # of the tower outside, along wall A [m]
_DEPTH = 5.6  # of the tower outside, along the other walls [m]
_VAULTED = 6.0  # the same of an elaborate storey, whose room has place for a square bay [m]
_FOOT = np.array([48.6, 23.9, 11.4])  # middle of the foot of wall A in the site [m]
_AZIMUTH = math.radians(14.0)  # of wall A against the x axis


@dataclass(frozen=True)
class TowerStorey:
    """A synthetic storey.

    Attributes
    ----------
    building : its stones; zones name wall and side
    level_break : last course of the first phase
    corners : (2, 3) feet of the corners at the left and the right end of wall A [m]
    outward : of each wall by its letter, (3,) [-]
    vault : dimensions of the rib vault over its room; None: there is none
    """

    building: Building
    level_break: int
    corners: Array
    outward: Mapping[str, Array]
    vault: RibVaultShape | None


@dataclass(frozen=True)
class _Wall:
    """One of the three walls, seen from outside.

    Attributes
    ----------
    letter : A, B or C
    frame : of its outer face; s = 0 at the axis of its opening
    ends : of the outer face [m]
    corners : whether there is a corner at its left and its right end
    passage : whether its opening is the passage; else a window
    """

    letter: str
    frame: WallFrame
    ends: tuple[float, float]
    corners: tuple[bool, bool]
    passage: bool

    @property
    def inner_ends(self) -> tuple[float, float]:
        """Ends of the inner face, in places of the outer one [m]."""
        inset = THICKNESS + (0.0 if self.letter == "A" else _RELIEF)
        left, right = (inset if corner else 0.0 for corner in self.corners)
        return self.ends[0] + left, self.ends[1] - right

    @property
    def inner_frame(self) -> WallFrame:
        """Frame of the inner face, seen from inside."""
        along, up, out = self.frame.axes
        return WallFrame(self.frame.origin - THICKNESS * out, np.array([-along, up, -out]))


def tower_storey(
    courses: int = 40,
    seed: int = 1,
    *,
    elaborate: bool = False,
    blunders: float = 0.12,
    movement: Movement = MappingProxyType({}),
    measured: int | None = None,
) -> TowerStorey:
    """Build the storey and measure all its faces.

    Parameters
    ----------
    courses : 2 or more; with fewer than 10 the walls have no openings
    seed : of Python's own generator, whose stream is the same everywhere
    elaborate : whether the windows widen along splayed jambs, modelled as closed solids, a semicircular barrel vault
        spans the passage, and a rib vault the room, if the walls are high enough; else windows widen in a step, the
        vault of the passage is segmental, and the room, less deep, has none
    blunders : gross errors per stone
    movement : of the stones since they were laid
    measured : seed of the joints, wear and noise alone, so that the same stones are measured again; None: as `seed`

    Returns
    -------
    TowerStorey. Codes are AO<course>-<number> in the outer facing of wall A, AI… in the inner one, and so on for B and
    C; of the arches AO-V<number>; of the corbels AI<course>-K<number>; of the rib vault as of `rib_vault`
    """
    rng = Random(seed)
    level_break = round(_BREAK * courses)
    heights = _bed_heights(rng, courses, level_break)
    depth = _VAULTED if elaborate else _DEPTH
    walls = _walls(_WIDTH, depth)
    vault = _rib_vault(walls[0], heights) if elaborate else None
    stones = [stone for wall in walls for stone in _wall(wall, heights, elaborate, vault, rng)]
    drafts = [stone for stone in stones if isinstance(stone, Draft)]
    solids = [stone for stone in stones if isinstance(stone, SolidDraft)]
    base = [draft.stone.plan.code for draft in drafts if draft.stone.plan.course == 1]
    depths = {kind: value for kind, value in _DEPTHS.items() if kind != "bonder"}
    stations = [
        Station(f"{wall.letter} {side}", np.round(frame.place(np.array([[0.3, 1.6]]), away)[0], 4))
        for wall in walls
        for side, frame, away in (("outer", wall.frame, 9.0), ("inner", wall.inner_frame, 2.0))
    ]
    if solids:
        stations.append(_before_windows(walls[-1], depth, solids))
    if vault is not None:
        webs, ribs = vault.webs_and_ribs(rng)
        drafts, solids = drafts + webs, [*solids, *vault.corbels(_HALF), *ribs]
        base += STANDING
        depths["web_stone"] = vault.shape.thickness
    count = round(blunders * len(drafts))
    rng = rng if measured is None else Random(measured)
    building = measured_building(
        "tower storey",
        drafts,
        depths,
        stations,
        base,
        rng,
        blunders=count,
        movement=movement,
        modelled=solids,
    )
    front = walls[0]
    corners = front.frame.place(np.array([[end, 0.0] for end in front.ends]))
    outward = {wall.letter: wall.frame.axes[2] for wall in walls}
    return TowerStorey(building, level_break, corners, outward, None if vault is None else vault.shape)


def _rib_vault(front: _Wall, heights: Sequence[float]) -> StoreyVault | None:
    """Plan the rib vault over the square room behind a wall."""
    along, up, out = front.frame.axes
    half = 0.5 * _WIDTH - THICKNESS
    return plan_vault(heights, half, _FOOT - (THICKNESS + half) * out, np.array([along, -out, up]))


def _before_windows(wall: _Wall, depth: float, jambs: Sequence[SolidDraft]) -> Station:
    """Return the station in the middle of the room, before both windows, from which their jambs are modelled."""
    heights = [z for jamb in jambs for z in jamb.solid.vertices[:, 2]]
    middle = _FOOT + 0.5 * (THICKNESS + depth) * wall.frame.axes[0]
    return observer(np.array([*middle[:2], (1.0 - _EYES) * min(heights) + _EYES * max(heights)]))


def _bed_heights(rng: Random, courses: int, level_break: int) -> list[float]:
    heights = [0.0]
    for course in range(1, courses + 1):
        least, largest = _HEIGHTS[course > level_break]
        height = _LEVELLING if course == level_break + 1 else rng.uniform(least, largest)
        heights.append(heights[-1] + height)
    return heights


def _walls(width: float, depth: float) -> tuple[_Wall, ...]:
    """Lay out the three walls; openings of B and C are in the middle of their inner faces."""
    x = np.array([math.cos(_AZIMUTH), math.sin(_AZIMUTH), 0.0])
    y, up = np.array([-x[1], x[0], 0.0]), np.array([0.0, 0.0, 1.0])
    half, middle = 0.5 * width, 0.5 * (THICKNESS + depth)
    places = (
        ("A", _FOOT, x, (-half, half), (True, True), False),
        ("B", _FOOT - half * x + middle * y, -y, (middle - depth, middle), (False, True), False),
        ("C", _FOOT + half * x + middle * y, y, (-middle, depth - middle), (True, False), True),
    )
    return tuple(
        _Wall(letter, WallFrame(origin, np.array([along, up, np.cross(along, up)])), ends, corners, passage)
        for letter, origin, along, ends, corners, passage in places
    )


def _wall(
    wall: _Wall, heights: Sequence[float], elaborate: bool, vault: StoreyVault | None, rng: Random
) -> Iterator[Draft | SolidDraft]:
    """Draft the stones of both facings of a wall."""
    halves = _PASSAGE if wall.passage else _SPLAYED if elaborate else _WINDOW
    outer, inner = (
        _opening(wall, half, heights, elaborate) if len(heights) > _OPEN else None for half in halves
    )
    corbels = 0 if vault is None else vault.course
    corners = [
        list(_corners(wall, number, heights, corbel=number == corbels)) for number in range(1, len(heights))
    ]
    widest = [_kept_clear(outer, inner, number) for number in range(1, len(heights))]
    through = [
        list(_through(wall, number, 0.5 * (low + high), widest[number - 1]))
        for number, (low, high) in enumerate(pairwise(heights), start=1)
    ]
    given = [[*a, *b] for a, b in zip(corners, through, strict=True)]
    courses = plan_courses(rng, heights, wall.ends, outer, through=given)
    yield from _facing(wall, "O", _with_springers(courses, outer, heights), through, outer, heights, rng)
    ends = tuple(-end for end in wall.inner_ends[::-1])
    given = [[_mirrored(piece) for piece in row] for row in through]
    if vault is not None:
        given[corbels - 1] += _corbels(wall, (ends[0], ends[1]), 0.5 * sum(vault.beds))
    courses = plan_courses(rng, heights, (ends[0], ends[1]), inner, through=given)
    pieces = _with_springers(courses, inner, heights)
    own = [[p for p in one if p not in row] for one, row in zip(pieces, given, strict=True)]
    splay = halves if elaborate and not wall.passage else None
    flush = (0, 0) if vault is None else vault.flush
    for draft in _facing(wall, "I", own, [[]] * len(own), inner, heights, rng, flush):
        yield _splayed(draft, *splay) if splay is not None and draft.stone.plan.kind == "jamb" else draft


def _kept_clear(outer: Opening | None, inner: Opening | None, number: int) -> float:
    """Return the distance from the axis within which a course has no through stones [m]."""
    if (
        outer is None
        or inner is None
        or not outer.jambs[0] - 1 <= number <= max(outer.arch[1], inner.arch[1]) + 1
    ):
        return 0.0
    return max(outer.reach, inner.reach) + 0.7  # with the stones beside the opening


def _opening(wall: _Wall, half: float, heights: Sequence[float], elaborate: bool) -> Opening:
    """Lay out a window between a quarter and half of the height, or the passage from the second course."""
    courses = len(heights) - 1
    if wall.passage and elaborate:
        return plan_opening(Arch.SEMICIRCULAR, half, heights, min(7, courses - 8))
    if wall.passage:
        return plan_opening(Arch.SEGMENTAL, half, heights, min(7, courses - 6))
    sill = max(2, round(0.25 * courses))
    opening = plan_opening(Arch.SEGMENTAL, half, heights, sill + min(6, courses - 7) - 1)
    return replace(opening, jambs=(sill + 1, opening.jambs[1]))


def _with_springers(
    courses: Sequence[Course], opening: Opening | None, heights: Sequence[float]
) -> list[list[Piece]]:
    """Return the stones of the courses; those beside an arch are springers, which bear its thrust in half the wall."""
    out = []
    for number, course in enumerate(courses, start=1):
        edges = opening.edges(number, 0.5 * (heights[number - 1] + heights[number])) if opening else None
        ends = () if edges is None or edges[2] == "jamb" else edges[:2]
        out.append(
            [
                replace(piece, kind="springer") if piece.right in ends or piece.left in ends else piece
                for piece in course.pieces
            ]
        )
    return out


def _corners(wall: _Wall, number: int, heights: Sequence[float], *, corbel: bool) -> Iterator[Piece]:
    """Yield the stones of the corners in a course; the end of a quoin of the other wall is one "of another wall".

    Behind a corbel the other stone is a quoin, too, half as deep.
    """
    middle = 0.5 * (heights[number - 1] + heights[number])
    along = (number % 2 == 1) == (wall.letter == "A")
    beside = "quoin" if corbel else "bonder"
    kinds = (("quoin", 0.0, _QUOIN),) if along else ((_OTHER, 0.0, _HALF), (beside, _HALF, THICKNESS))
    for corner, place, right in zip(wall.corners, wall.ends, (1.0, -1.0), strict=True):
        for kind, start, stop in kinds if corner else ():
            left, end = sorted((place + right * start, place + right * stop))
            yield Piece(kind, upright(left, middle), upright(end, middle))


_OTHER = "of another wall"


def _corbels(wall: _Wall, ends: tuple[float, float], middle: float) -> Iterator[Piece]:
    """Yield what corbels take of the course of an inner facing, seen from inside, as stones "of another wall"."""
    for corner, end, right in zip(wall.corners[::-1], ends, (1.0, -1.0), strict=True):
        if corner:
            corbel = PROJECTION - (0.0 if wall.letter == "A" else _RELIEF)
            left, stop = sorted((end, end + right * corbel))
            yield Piece(_OTHER, upright(left, middle), upright(stop, middle))


def _through(wall: _Wall, number: int, middle: float, opening: float) -> Iterator[Piece]:
    """Yield the through stones of a course, clear of corners and of the opening [m]."""
    if number % _EVERY != 2:
        return
    first, length, apart = _THROUGH
    left, right = (
        end + sign * (_QUOIN if corner else 0.0)
        for end, sign, corner in zip(wall.ends, (1, -1), wall.corners, strict=True)
    )
    offset = 0.0 if number // _EVERY % 2 else 0.5 * apart
    for start, stop in ((left, -opening), (opening, right)) if opening else ((left, right),):
        place = start + first + offset
        while place + length + first <= stop:
            yield Piece("header", upright(place, middle), upright(place + length, middle))
            place += apart


def _mirrored(piece: Piece) -> Piece:
    """Mirror a stone with upright ends, as seen from the other side."""
    left, right = (-line.point[0] for line in (piece.right, piece.left))
    return Piece(piece.kind, upright(left, piece.left.point[1]), upright(right, piece.left.point[1]))


def _facing(
    wall: _Wall,
    side: str,
    courses: Sequence[Sequence[Piece]],
    through: Sequence[Sequence[Piece]],
    opening: Opening | None,
    heights: Sequence[float],
    rng: Random,
    flush: tuple[int, int] = (0, 0),
) -> Iterator[Draft]:
    """Draft the stones of one facing, course by course, then those of the arch; faces of some courses are flush."""
    for number, pieces in enumerate(courses, start=1):
        beds = Bed(heights[number - 1]), Bed(heights[number])
        own = [piece for piece in pieces if piece.kind != _OTHER]
        for k, piece in enumerate(own, start=1):
            plan = planned(f"{wall.letter}{side}{number:02d}-{k:02d}", piece, *beds, number)[0]
            depth = THICKNESS if piece in through[number - 1] else _DEPTHS[piece.kind]
            yield _draft(wall, side, plan, depth, number, rng, flush=flush[0] <= number <= flush[1])
    arch = opening.voussoirs() if opening else []
    for number, plan in enumerate(arch, start=1):
        named = replace(plan, code=f"{wall.letter}{side}-{plan.code}")
        # the vault's stones lie before and behind each other: their numbers run from opposite ends
        rank = number if side == "O" else len(arch) + 1 - number
        yield _draft(wall, side, named, _DEPTHS[plan.kind], rank, rng)


def _splayed(draft: Draft, outside: float, inside: float) -> SolidDraft:
    """Give a jamb of the inner facing an oblique reveal: behind its face the window is as wide as outside."""
    plan, frame = draft.stone.plan, draft.frame
    behind = plan.corners.copy()
    at_reveal = np.isclose(np.abs(behind[:, 0]), inside, rtol=0.0, atol=1e-9)
    behind[at_reveal, 0] *= outside / inside
    solid = prism(plan.code, frame.place(plan.corners), frame.place(behind, -draft.stone.depth))
    return SolidDraft(solid, plan.kind, plan.course)


def _draft(
    wall: _Wall, side: str, plan: PlannedStone, depth: float, turn: int, rng: Random, *, flush: bool = False
) -> Draft:
    """Draft a stone; those that meet others in the wall have no relief, and a depth that is seen in an opening."""
    frame = wall.frame if side == "O" else wall.inner_frame
    zone = f"{wall.letter} {'outer' if side == 'O' else 'inner'}"
    lines_passage = wall.passage and plan.kind in ("jamb", "keystone", "voussoir")
    if lines_passage:
        depth = _LEAVES[(turn + (side == "O")) % 2]
    seen = lines_passage or depth == THICKNESS
    if plan.kind == "bonder":
        plan = replace(plan, kind="quoin")
    stone = (
        flat_stone(plan, depth, frame)
        if depth >= _HALF or lines_passage or flush
        else build_stone(plan, depth, frame, rng)
    )
    return Draft(stone, frame, plan.corners, zone=zone, station=zone, seen_depth=seen)
