"""One storey of a tower on three sides: two facings with a core, quoins, windows, vaults, two phases.

::

              back
        B │ │      │ │ C      Wall A, in front, has a window, as has B on the left; jambs of its inner facing may be
          │ │      │ │        splayed, below a rear arch. A passage under a barrel vault leads through C. Above the
          │ └──────┘ │        level break the second phase begins with a thin course; its courses are lower than those
          └──────────┘        of the first. A rib vault may span the room.
               A
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from random import Random
from types import MappingProxyType

import numpy as np

from survey.arrays import Array
from survey.extrusion.extrusion import prism
from survey.records.survey import Station
from synthetic.bond import Bed, Piece, PlannedStone, planned
from synthetic.building import (
    Draft,
    SolidDraft,
    SyntheticBuilding,
    flat_stone,
    measured_building,
    observer,
)
from synthetic.buildings.openings import ArchShape, Opening, plan_opening
from synthetic.buildings.ribs import RibVaultShape
from synthetic.buildings.storey_vault import STANDING, StoreyVault, plan_vault
from synthetic.buildings.storey_walls import (
    FOOT,
    HALF,
    OTHER,
    THICKNESS,
    StoreyWall,
    corbel_pieces,
    corner_pieces,
    mirrored,
    storey_walls,
    through_pieces,
)
from synthetic.buildings.walls import LaidCourse, plan_courses
from synthetic.frame import Movement, build_stone

_DEPTHS = {
    "bonder": THICKNESS,
    "header": 0.45,
    "jamb": HALF,
    "keystone": HALF,
    "quoin": HALF,
    "springer": HALF,
    "stretcher": 0.28,
    "voussoir": HALF,
}  # of the stones of a facing, by their part in the plan [m]
_HEIGHTS = ((0.26, 0.34), (0.23, 0.29))  # of the courses of each phase [m]
_LEVELLING = 0.15  # height of the first course of the second phase [m]
_BREAK = 0.6  # share of the courses that belong to the first phase
_WINDOW = (0.45, 0.70)  # half the width of a window outside and inside, where it widens in a step [m]
_SPLAYED = (0.45, 0.65)  # the same of a window that widens along splayed jambs [m]
_PASSAGE = (0.60, 0.60)  # the same of the passage, which runs straight through [m]
_LEAVES = (0.47, 0.63)  # depths of the stones of its sides and vault, in turn, so that they bond [m]
_OPEN = 10  # least number of courses of a storey with openings
_EYES = 0.6  # part of the height of the jambs at which they are modelled: higher, where courses are lower
_WIDTH = 7.0  # of the tower outside, along wall A [m]
_DEPTH = 5.6  # of the tower outside, along the other walls [m]
_VAULTED = 6.0  # the same of an elaborate storey, whose room has place for a square bay [m]


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

    building: SyntheticBuilding
    level_break: int
    corners: Array
    outward: Mapping[str, Array]
    vault: RibVaultShape | None


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
    walls = storey_walls(_WIDTH, depth)
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
        drafts, solids = drafts + webs, [*solids, *vault.corbels(HALF), *ribs]
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


def _rib_vault(front: StoreyWall, heights: Sequence[float]) -> StoreyVault | None:
    """Plan the rib vault over the square room behind a wall."""
    along, up, out = front.frame.axes
    half = 0.5 * _WIDTH - THICKNESS
    return plan_vault(heights, half, FOOT - (THICKNESS + half) * out, np.array([along, -out, up]))


def _before_windows(wall: StoreyWall, depth: float, jambs: Sequence[SolidDraft]) -> Station:
    """Return the station in the middle of the room, before both windows, from which their jambs are modelled."""
    heights = [z for jamb in jambs for z in jamb.solid.vertices[:, 2]]
    middle = FOOT + 0.5 * (THICKNESS + depth) * wall.frame.axes[0]
    return observer(np.array([*middle[:2], (1.0 - _EYES) * min(heights) + _EYES * max(heights)]))


def _bed_heights(rng: Random, courses: int, level_break: int) -> list[float]:
    heights = [0.0]
    for course in range(1, courses + 1):
        least, largest = _HEIGHTS[course > level_break]
        height = _LEVELLING if course == level_break + 1 else rng.uniform(least, largest)
        heights.append(heights[-1] + height)
    return heights


def _wall(
    wall: StoreyWall, heights: Sequence[float], elaborate: bool, vault: StoreyVault | None, rng: Random
) -> Iterator[Draft | SolidDraft]:
    """Draft the stones of both facings of a wall."""
    halves = _PASSAGE if wall.passage else _SPLAYED if elaborate else _WINDOW
    outer, inner = (
        _opening(wall, half, heights, elaborate) if len(heights) > _OPEN else None for half in halves
    )
    corbel_course = 0 if vault is None else vault.course
    corners = [
        list(corner_pieces(wall, number, heights, corbel=number == corbel_course))
        for number in range(1, len(heights))
    ]
    widest = [_kept_clear(outer, inner, number) for number in range(1, len(heights))]
    through = [
        list(through_pieces(wall, number, 0.5 * (low + high), widest[number - 1]))
        for number, (low, high) in enumerate(pairwise(heights), start=1)
    ]
    given = [[*a, *b] for a, b in zip(corners, through, strict=True)]
    courses = plan_courses(rng, heights, wall.ends, outer, through=given)
    yield from _facing(wall, "O", _with_springers(courses, outer, heights), through, outer, heights, rng)
    ends = tuple(-end for end in wall.inner_ends[::-1])
    given = [[mirrored(piece) for piece in row] for row in through]
    if vault is not None:
        given[corbel_course - 1] += corbel_pieces(wall, (ends[0], ends[1]), 0.5 * sum(vault.beds))
    courses = plan_courses(rng, heights, (ends[0], ends[1]), inner, through=given)
    pieces = _with_springers(courses, inner, heights)
    partial = [[p for p in piece if p not in row] for piece, row in zip(pieces, given, strict=True)]
    splay = halves if elaborate and not wall.passage else None
    flush = (0, 0) if vault is None else vault.flush
    for draft in _facing(wall, "I", partial, [[]] * len(partial), inner, heights, rng, flush):
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


def _opening(wall: StoreyWall, half: float, heights: Sequence[float], elaborate: bool) -> Opening:
    """Lay out a window between a quarter and half of the height, or the passage from the second course."""
    courses = len(heights) - 1
    if wall.passage and elaborate:
        return plan_opening(ArchShape.SEMICIRCULAR, half, heights, min(7, courses - 8))
    if wall.passage:
        return plan_opening(ArchShape.SEGMENTAL, half, heights, min(7, courses - 6))
    sill = max(2, round(0.25 * courses))
    opening = plan_opening(ArchShape.SEGMENTAL, half, heights, sill + min(6, courses - 7) - 1)
    return replace(opening, jambs=(sill + 1, opening.jambs[1]))


def _with_springers(
    courses: Sequence[LaidCourse], opening: Opening | None, heights: Sequence[float]
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


def _facing(
    wall: StoreyWall,
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
        own = [piece for piece in pieces if piece.kind != OTHER]
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
    wall: StoreyWall,
    side: str,
    plan: PlannedStone,
    depth: float,
    turn: int,
    rng: Random,
    *,
    flush: bool = False,
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
        if depth >= HALF or lines_passage or flush
        else build_stone(plan, depth, frame, rng)
    )
    return Draft(stone, frame, plan.corners, zone=zone, station=zone, seen_depth=seen)
