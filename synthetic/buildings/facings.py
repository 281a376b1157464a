"""A wall of two facings and a hidden core, with headers that reach into it and through stones."""

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random
from types import MappingProxyType

import numpy as np

from survey.records.survey import OBSERVER, Station
from synthetic.bond import Bed, Piece, PlannedStone, planned, upright
from synthetic.building import Draft, SyntheticBuilding, flat_stone, measured_building
from synthetic.buildings.walls import bed_heights, plan_courses
from synthetic.frame import BATTER, Movement, WallFrame, build_stone, wall_frame

BACK = "inside"
"""Name of the station from which the second facing was seen."""

_DEPTHS = {"header": 0.45, "stretcher": 0.26}  # of the stones of a facing [m]
_EVERY = 2.4  # distance of through stones along a course [m]
_COURSES = 3  # courses from one row of through stones to the next
_LENGTH = 0.40  # of a through stone along the wall [m]


@dataclass(frozen=True)
class TwoFacings:
    """A synthetic wall of two facings.

    Attributes
    ----------
    building : all stones; through stones were surveyed in the first facing, with the depth of the wall
    first, second : codes of the stones of each facing, without through stones
    through : codes of the through stones
    thickness : from face to face [m]
    storeys : first and last course of each storey
    """

    building: SyntheticBuilding
    first: tuple[str, ...]
    second: tuple[str, ...]
    through: tuple[str, ...]
    thickness: float
    storeys: tuple[tuple[int, int], ...]


def two_facings(
    length: float = 5.0,
    courses: int = 10,
    seed: int = 1,
    *,
    thickness: float = 1.1,
    storeys: int = 2,
    upper: tuple[int, float] = (0, 0.0),
    batter: float = BATTER,
    movement: Movement = MappingProxyType({}),
    measured: int | None = None,
) -> TwoFacings:
    """Build a wall of two facings and measure both.

    Parameters
    ----------
    length : of the wall [m]
    courses : of both facings, whose beds are at the same heights
    seed : of Python's own generator, whose stream is the same everywhere
    thickness : from face to face; more than 0.95, so that headers of both sides do not meet [m]
    storeys : number of storeys; a record's zone names its facing and storey
    upper : number of courses of the first facing above the second one, and the depth of their stones [m]
    batter : angle by which it leans back [rad]
    movement : of the stones since they were laid
    measured : seed of the joints, wear and noise alone, so that the same stones are measured again; None: as `seed`

    Returns
    -------
    TwoFacings. Codes are F<course>-<number> in the first facing, B… in the second, T… for through stones
    """
    rng = Random(seed)
    heights = bed_heights(rng, courses)
    ends = (-0.5 * length, 0.5 * length)
    through = _through(heights, ends)
    front = wall_frame(batter)
    back = WallFrame(
        front.origin - thickness * front.axes[2], np.array([-front.axes[0], front.axes[1], -front.axes[2]])
    )
    spans = [(courses * k // storeys + 1, courses * (k + 1) // storeys) for k in range(storeys)]
    drafts: list[Draft] = []
    for letter, frame in (("F", front), ("B", back)):
        top = courses - upper[0]
        mirrored = through if letter == "F" else [[_mirrored(piece) for piece in row] for row in through]
        for number, course in enumerate(plan_courses(rng, heights, ends, through=mirrored), start=1):
            beds = Bed(heights[number - 1]), Bed(heights[number])
            zone = f"{letter} storey {next(k for k, s in enumerate(spans, start=1) if number <= s[1])}"
            for k, piece in enumerate(course.pieces, start=1):
                passes = piece in mirrored[number - 1]
                if letter == "B" and (passes or number > top):
                    continue
                depth = upper[1] if number > top else thickness if passes else None
                code = f"{'T' if passes else letter}{number:02d}-{k:02d}"
                plan = planned(code, piece, *beds, number)[0]
                drafts.append(_draft(plan, frame, zone, depth, rng))
    stations = [
        Station(name, np.round(frame.place(np.array([[0.5, 1.5]]), 8.0)[0], 4))
        for name, frame in ((OBSERVER, front), (BACK, back))
    ]
    base = [draft.stone.plan.code for draft in drafts if draft.stone.plan.course == 1]
    rng = rng if measured is None else Random(measured)
    building = measured_building(
        "wall of two facings", drafts, _DEPTHS, stations, base, rng, movement=movement
    )
    codes = {letter: tuple(s.code for s in building.solids if s.code[0] == letter) for letter in "FBT"}
    return TwoFacings(
        building=building,
        first=codes["F"],
        second=codes["B"],
        through=codes["T"],
        thickness=thickness,
        storeys=tuple(spans),
    )


def _through(heights: Sequence[float], ends: tuple[float, float]) -> list[list[Piece]]:
    """Place through stones by course: one above the other in every third course, offset in turn."""
    out: list[list[Piece]] = [[] for _ in heights[1:]]
    for course in range(1, len(out), _COURSES):
        middle = 0.5 * (heights[course] + heights[course + 1])
        start = ends[0] + (1.1 if course // _COURSES % 2 else 1.9)
        while start + _LENGTH + 0.9 < ends[1]:
            out[course].append(Piece("header", upright(start, middle), upright(start + _LENGTH, middle)))
            start += _EVERY
    return out


def _mirrored(piece: Piece) -> Piece:
    """Mirror a stone with upright ends, as seen from the other side."""
    left, right = (-line.point[0] for line in (piece.right, piece.left))
    return Piece(piece.kind, upright(left, piece.left.point[1]), upright(right, piece.left.point[1]))


def _draft(plan: PlannedStone, frame: WallFrame, zone: str, through: float | None, rng: Random) -> Draft:
    """Draft a stone of a facing; one with a depth of its own has two faces parallel to the wall."""
    stone = (
        flat_stone(plan, through, frame)
        if through is not None
        else build_stone(plan, _DEPTHS[plan.kind], frame, rng)
    )
    station = BACK if plan.code.startswith("B") else None
    return Draft(stone, frame, plan.corners, zone=zone, station=station, seen_depth=through is not None)
