"""The window bay of data/samples/window: twelve courses, a sill, jambs and a segmental arch with a level back.

Courses 1–2 carry the sill (3), the jambs (4–7) frame the opening, the arch spans courses 8–9 between the
skewbacks of the springers, courses 10–12 load it. The arch's joints are radial, its intrados is a chord
polygon, its extrados is the bed line of course 10, so that every stone is a quadrilateral.
"""

import json
import math
from dataclasses import dataclass, replace
from itertools import pairwise
from random import Random

import numpy as np

from survey.records.survey import OBSERVER, DepthRule, Station, Survey, SurveyHead
from synthetic.bond import PlanLine, PlannedStone, crossing, fill, level, upright
from synthetic.frame import TrueStone, WallFrame, build_stone, wall_frame
from synthetic.measure import SIGMA, MeasuredStone, add_blunders, measure_stone

SEED = 2000
BLUNDERS = 12  # points with a gross error
SOURCE = "synthetic value, chosen for this sample"
OWN_SOURCE = "synthetic value, as if measured at the open end of the panel"
OWN_DEPTH_SIGMA = 0.01
DEPTHS = {
    "header": (0.50, 0.03),
    "jamb": (0.45, 0.03),
    "keystone": (0.42, 0.02),
    "sill": (0.45, 0.02),
    "springer": (0.45, 0.03),
    "stretcher": (0.38, 0.03),
    "voussoir": (0.42, 0.02),
}  # depth and its standard deviation [m]

LEFT, RIGHT = -2.35, 2.45  # ends of the panel [m]; s = 0 is the axis of the window
HEIGHT = 3.90  # of the panel [m]
COURSES = 12
SILL_COURSE, JAMB_COURSES, ARCH_COURSES = 3, (4, 5, 6, 7), (8, 9)
HALF_OPENING = 0.60  # half the width of the window [m]
SILL_BEARING = 0.20  # length of the sill beyond the opening [m]
RISE = 0.20  # of the intrados above its springing [m]
VOUSSOIRS = 7
JAMB_LENGTHS = (0.42, 0.62)  # short and long in turn, so that the jambs bond with the wall [m]
CLEARANCE = 0.09  # between head joints of neighbouring courses [m]
CLEARANCE_OVER_ARCH = 0.05  # the same above the arch, whose joints are closer [m]


@dataclass(frozen=True)
class WindowBay:
    """A survey with its truth.

    Attributes
    ----------
    survey : contents of the file
    frame : the wall's frame in the site
    stones, measured : the true stones and their measurements, in the same order
    """

    survey: Survey
    frame: WallFrame
    stones: tuple[TrueStone, ...]
    measured: tuple[MeasuredStone, ...]


def make_window(seed: int = SEED) -> WindowBay:
    """Build the wall and measure it; the same seed gives the same survey.

    Parameters
    ----------
    seed : of Python's own generator, whose stream is the same everywhere
    """
    rng = Random(seed)
    frame = wall_frame()
    plans, depths_random = _plan(rng), Random(f"depths of {seed}")
    seen = [plan.kind == "header" and not all(plan.joint[1::2]) for plan in plans]
    depths = [
        DEPTHS[p.kind][0] + (depths_random.randint(-4, 4) / 100 if s else 0.0)
        for p, s in zip(plans, seen, strict=True)
    ]
    stones = [build_stone(plan, round(d, 2), frame, rng) for plan, d in zip(plans, depths, strict=True)]
    measured = [measure_stone(stone, frame, rng) for stone in stones]
    measured = [_with_own_depth(m, st) if s else m for m, st, s in zip(measured, stones, seen, strict=True)]
    measured = add_blunders(measured, [stone.normal for stone in stones], BLUNDERS, rng)
    rules = tuple(DepthRule(kind, depth, sigma, SOURCE) for kind, (depth, sigma) in DEPTHS.items())
    observer = np.round(frame.origin + 9.0 * frame.axes[2] + 0.8 * frame.axes[0] + [0.0, 0.0, 1.2], 4)
    records = tuple(one.record for one in measured)
    head = SurveyHead(
        "window bay (synthetic)", "window.moma", (Station(OBSERVER, observer),), depth_rules=rules
    )
    return WindowBay(Survey(head, records), frame, tuple(stones), tuple(measured))


def truth_text(sample: WindowBay) -> str:
    """Return the truth as JSON, with one line for each entry and for each stone, rounded far below any tolerance."""
    truth = {
        "about": "true geometry of window.moma; indices count from 0 in the order of the file",
        "seed": SEED,
        "sigma": SIGMA,
        "frame": {"origin": _rounded(sample.frame.origin), "axes": _rounded(sample.frame.axes)},
    }
    lines = [f'"{key}": {json.dumps(value)}' for key, value in truth.items()]
    stones = ",\n".join(
        json.dumps(_stone_truth(*pair)) for pair in zip(sample.stones, sample.measured, strict=True)
    )
    return "{\n" + ",\n".join([*lines, f'"stones": [\n{stones}\n]']) + "\n}\n"


@dataclass(frozen=True)
class _Piece:
    """One stone of a course: its kind, and its right end."""

    kind: str
    end: PlanLine


def _plan(rng: Random) -> tuple[PlannedStone, ...]:
    """Lay out all stones, course by course from the ground, left to right, then the arch."""
    beds = _bed_heights(rng)
    radials = _radials(beds[ARCH_COURSES[0] - 1])
    stones: list[PlannedStone] = []
    below: list[float] = []
    for course in range(1, COURSES + 1):
        low, high = beds[course - 1], beds[course]
        runs = _runs(rng, course, low, high, radials, below)
        stones += _course_stones(course, low, high, runs)
        below = [line.at(high) for start, pieces in runs for line in (start, *(p.end for p in pieces))]
        if course == ARCH_COURSES[1]:
            below += [line.at(high) for line in radials]
    return (*stones, *_arch(radials, beds[ARCH_COURSES[0] - 1], beds[ARCH_COURSES[1]]))


def _bed_heights(rng: Random) -> list[float]:
    heights = [rng.uniform(0.31, 0.34) for _ in range(COURSES)]
    scale = HEIGHT / sum(heights)
    return [sum(heights[:k]) * scale for k in range(COURSES + 1)]


def _radials(springing: float) -> list[PlanLine]:
    """Lay out the radial joints of the arch from left to right, the two springings included."""
    radius = (HALF_OPENING**2 + RISE**2) / (2.0 * RISE)
    half_angle = math.asin(HALF_OPENING / radius)
    centre = (0.0, springing + RISE - radius)
    angles = [half_angle * (2.0 * k / VOUSSOIRS - 1.0) for k in range(VOUSSOIRS + 1)]
    out = []
    for angle in angles:
        direction = (math.sin(angle), math.cos(angle))
        out.append(
            PlanLine((centre[0] + radius * direction[0], centre[1] + radius * direction[1]), direction)
        )
    return out


def _runs(
    rng: Random, course: int, low: float, high: float, radials: list[PlanLine], below: list[float]
) -> list[tuple[PlanLine, list[_Piece]]]:
    """Fill the unbroken runs of stones of one course; return the line that each begins at, and its stones."""
    middle = 0.5 * (low + high)
    left, right = upright(LEFT, middle), upright(RIGHT, middle)
    if course in JAMB_COURSES:
        lengths = JAMB_LENGTHS if course % 2 else JAMB_LENGTHS[::-1]
        reveals = upright(-HALF_OPENING, middle), upright(HALF_OPENING, middle)
        ends = [
            upright(-HALF_OPENING - lengths[0], middle, rng),
            upright(HALF_OPENING + lengths[1], middle, rng),
        ]
        kind = "jamb"
    elif course in ARCH_COURSES:
        reveals = radials[0], radials[-1]
        long = 0.72 if course == ARCH_COURSES[0] else 0.88
        ends = [
            upright(-HALF_OPENING - long - 0.06, middle, rng),
            upright(HALF_OPENING + long, middle, rng),
        ]
        kind = "springer"
    elif course == SILL_COURSE:
        half = HALF_OPENING + SILL_BEARING
        ends = [upright(-half, middle, rng), upright(half, middle, rng)]
        before = _plain(rng, left, ends[0], low, middle, below)
        after = _plain(rng, ends[1], right, low, middle, below)
        return [(left, [*before, _Piece("sill", ends[1]), *after])]
    else:
        return [(left, _plain(rng, left, right, low, middle, below))]
    before = _plain(rng, left, ends[0], low, middle, below)
    after = _plain(rng, ends[1], right, low, middle, below)
    return [(left, [*before, _Piece(kind, reveals[0])]), (reveals[1], [_Piece(kind, ends[1]), *after])]


def _plain(
    rng: Random, start: PlanLine, stop: PlanLine, low: float, middle: float, below: list[float]
) -> list[_Piece]:
    over_arch = len(below) > VOUSSOIRS + 12
    clearance = CLEARANCE_OVER_ARCH if over_arch else CLEARANCE
    filled = fill(rng, start.at(middle), stop.at(middle), below, clearance)
    return [_Piece(kind, upright(end, middle, rng)) for kind, end in filled[:-1]] + [
        _Piece(filled[-1][0], stop)
    ]


def _course_stones(
    course: int, low: float, high: float, runs: list[tuple[PlanLine, list[_Piece]]]
) -> list[PlannedStone]:
    bottom, top = level(low), level(high)
    stones: list[PlannedStone] = []
    for start, pieces in runs:
        for line, piece in zip((start, *(p.end for p in pieces)), pieces, strict=False):
            sides = (bottom, piece.end, top, line)
            corners = [crossing(sides[k - 1], sides[k]) for k in range(4)]
            free_ends = (LEFT, RIGHT, -HALF_OPENING, HALF_OPENING)
            joint = (
                course > 1,
                not _is_free(piece.end, free_ends),
                course < COURSES,
                not _is_free(line, free_ends),
            )
            code = f"W{course:02d}-{len(stones) + 1:02d}"
            stones.append(PlannedStone(code, piece.kind, course, np.array(corners), joint))
    return stones


def _is_free(line: PlanLine, ends: tuple[float, ...]) -> bool:
    """Return whether a line is an end of the panel or a reveal of the opening; only those are exactly upright."""
    return line.direction == (0.0, 1.0) and line.point[0] in ends


def _arch(radials: list[PlanLine], springing: float, back: float) -> list[PlannedStone]:
    stones = []
    for rank, (left, right) in enumerate(pairwise(radials), start=1):
        corners = np.array(
            [left.point, right.point, crossing(right, level(back)), crossing(left, level(back))]
        )
        kind = "keystone" if rank == (VOUSSOIRS + 1) // 2 else "voussoir"
        stones.append(PlannedStone(f"V{rank}", kind, None, corners, (False, True, True, True)))
    return stones


def _with_own_depth(measured: MeasuredStone, stone: TrueStone) -> MeasuredStone:
    """Add the depth of a header at the open end of the panel, where it is visible and measured."""
    return replace(
        measured,
        record=replace(
            measured.record, depth=stone.depth, depth_sigma=OWN_DEPTH_SIGMA, depth_source=OWN_SOURCE
        ),
    )


def _stone_truth(stone: TrueStone, measured: MeasuredStone) -> dict[str, object]:
    return {
        "code": stone.plan.code,
        "kind": stone.plan.kind,
        "course": stone.plan.course,
        "normal": _rounded(stone.normal),
        "offset": round(stone.offset, 10),
        "depth": stone.depth,
        "vertices": _rounded(stone.solid.vertices),
        "faces": [list(face) for face in stone.solid.faces],
        "joint_sides": list(stone.plan.joint),
        "half_joints": [round(half, 6) for half in measured.half_joints],
        "worn": measured.worn,
        "worn_corner": measured.worn_corner,
        "worn_points": list(measured.worn_points),
        "worn_vertices": list(measured.worn_vertices),
        "blunders": list(measured.blunders),
    }


def _rounded(values: np.ndarray) -> object:
    return (np.round(values, 10) + 0.0).tolist()
