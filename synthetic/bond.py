"""Courses of headers and stretchers in running bond, beds level or sagging, laid out in the plane of the wall.

Coordinates (s, t): s along the wall to the right as seen from outside, t up the wall, metres.
"""

import math
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from random import Random

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array

WIDTHS = {"header": (0.31, 0.46), "stretcher": (0.48, 0.80)}  # least and largest width of each kind [m]
CLEARANCES = (0.09, 0.06, 0.03)  # preferred, then allowed, between head joints of neighbouring courses [m]
_REST = 2.4  # length of the end of a run, which is filled as a whole so that it ends at the stop [m]
_TILT = math.radians(0.8)  # largest tilt of a head joint off the perpendicular


@dataclass(frozen=True)
class PlanLine:
    """Straight line through `point` along `direction` in the wall plane."""

    point: tuple[float, float]
    direction: tuple[float, float]

    def at(self, t: float) -> float:
        """Return s where the line crosses height t."""
        return self.point[0] + (t - self.point[1]) * self.direction[0] / self.direction[1]


@dataclass(frozen=True)
class PlannedStone:
    """One stone as the masons planned it, without mortar.

    Attributes
    ----------
    code, kind, course : as in the survey
    corners : (4, 2) counter-clockwise; side k runs from corner k to the next [m]
    joint : whether side k touches other stones; the other sides are free
    """

    code: str
    kind: str
    course: int | None
    corners: Array
    joint: tuple[bool, bool, bool, bool]


def level(t: float) -> PlanLine:
    """Return the bed line at height t."""
    return PlanLine((0.0, t), (1.0, 0.0))


def upright(s: float, t: float, rng: Random | None = None) -> PlanLine:
    """Return the head joint through (s, t): up to 0.8° off with `rng`, as masons work; exactly upright without."""
    tilt = 0.0 if rng is None else rng.uniform(-_TILT, _TILT)
    return PlanLine((s, t), (math.sin(tilt), math.cos(tilt)))


def crossing(a: PlanLine, b: PlanLine) -> tuple[float, float]:
    """Return the point in which two lines cross."""
    (px, py), (ux, uy) = a.point, a.direction
    (qx, qy), (vx, vy) = b.point, b.direction
    along = ((qx - px) * vy - (qy - py) * vx) / (ux * vy - uy * vx)
    return px + along * ux, py + along * uy


def fill(
    rng: Random, start: float, stop: float, below: Iterable[float], clearance: float
) -> list[tuple[str, float]]:
    """Fill a stretch of a course with headers and stretchers in random order.

    Parameters
    ----------
    rng : random numbers
    start, stop : ends of the stretch [m]
    below : head joints of the course below [m]
    clearance : least distance of a joint from those below [m]

    Returns
    -------
    (kind, end of the stone) from left to right; the last ends at `stop`
    """
    avoid = list(below)
    for _ in range(20_000):
        kinds: list[str] = []
        widths: list[float] = []
        while sum(widths) < stop - start - 0.5 * WIDTHS["header"][0]:
            kinds.append(rng.choice(("header", "stretcher")))
            widths.append(rng.uniform(*WIDTHS[kinds[-1]]))
        stretch = (stop - start) / sum(widths)
        widths = [width * stretch for width in widths]
        ends = [start + sum(widths[: i + 1]) for i in range(len(widths))]
        fits = all(WIDTHS[k][0] <= w <= WIDTHS[k][1] for k, w in zip(kinds, widths, strict=True))
        fits = fits and all(len(set(kinds[i : i + 3])) > 1 for i in range(len(kinds) - 2))  # no three alike
        if fits and all(abs(end - joint) >= clearance for end in ends[:-1] for joint in avoid):
            return list(zip(kinds, [*ends[:-1], stop], strict=True))
    raise GeometryError(
        f"no bond found from s = {start:.3f} to {stop:.3f} m", remedy="allow joints nearer to those below"
    )


@dataclass(frozen=True)
class Piece:
    """One stone of a course: its kind, and the lines that it lies between."""

    kind: str
    left: PlanLine
    right: PlanLine


@dataclass(frozen=True)
class Bed:
    """A bed joint: level, or a polygon through the head joints of the course below.

    Attributes
    ----------
    height : at s = 0 [m]
    corners : (s, t) of its bends from left to right; none if it is level
    """

    height: float
    corners: tuple[tuple[float, float], ...] = ()

    def crossing(self, line: PlanLine) -> tuple[float, float]:
        """Return the point where a nearly upright line meets the bed."""
        if not self.corners:
            return crossing(line, level(self.height))
        before = bisect_left(self.corners, (line.at(self.height), 0.0)) - 1
        before = min(max(before, 0), len(self.corners) - 2)
        (s, t), (to_s, to_t) = self.corners[before : before + 2]
        return crossing(line, PlanLine((s, t), (to_s - s, to_t - t)))

    def bends(self, start: float, stop: float) -> list[tuple[float, float]]:
        """Return the corners of the bed strictly between two places."""
        return [(s, t) for s, t in self.corners if start + 1e-6 < s < stop - 1e-6]


def fill_run(
    rng: Random, start: PlanLine, stop: PlanLine, height: float, below: Sequence[float]
) -> list[Piece]:
    """Fill a run of a course, of any length.

    Parameters
    ----------
    rng : random numbers
    start, stop : lines at its ends
    height : at which the widths of stones are measured [m]
    below : head joints of the course below, sorted [m]
    """
    for clearance in CLEARANCES:
        for _ in range(5):
            try:
                ends = _ends(rng, start.at(height), stop.at(height), below, clearance)
            except GeometryError:
                continue
            lines = [start, *(upright(end, height, rng) for _, end in ends[:-1]), stop]
            return [Piece(kind, *pair) for (kind, _), pair in zip(ends, pairwise(lines), strict=True)]
    raise GeometryError(f"no bond found from s = {start.at(height):.3f} to {stop.at(height):.3f} m")


def planned(
    code: str, piece: Piece, bottom: Bed, top: Bed, course: int
) -> tuple[PlannedStone, tuple[int, ...]]:
    """Outline a stone between two beds; return the side of four that each side belongs to, too."""
    lower = [bottom.crossing(piece.left), bottom.crossing(piece.right)]
    bends = bottom.bends(lower[0][0], lower[1][0])
    corners = [lower[0], *bends, lower[1], top.crossing(piece.right), top.crossing(piece.left)]
    plan = PlannedStone(code, piece.kind, course, np.array(corners), (True,) * 4)
    return plan, (*(0,) * (len(bends) + 1), 1, 2, 3)


def _ends(
    rng: Random, start: float, stop: float, below: Sequence[float], clearance: float
) -> list[tuple[str, float]]:
    """Return the kind and the end of each stone."""
    out: list[tuple[str, float]] = []
    while stop - start > _REST:
        kind, end = _next(rng, start, [kind for kind, _ in out[-2:]], below, clearance)
        out.append((kind, end))
        start = end
    near = below[bisect_left(below, start - clearance) : bisect_left(below, stop + clearance)]
    return out + fill(rng, start, stop, near, clearance)


def _next(
    rng: Random, start: float, last: list[str], below: Sequence[float], clearance: float
) -> tuple[str, float]:
    for _ in range(200):
        kind = rng.choice(("header", "stretcher"))
        end = start + rng.uniform(*WIDTHS[kind])
        at = bisect_left(below, end - clearance)
        if last != [kind, kind] and (at == len(below) or below[at] > end + clearance):
            return kind, end
    raise GeometryError(f"no stone fits at s = {start:.3f} m", remedy="allow joints nearer to those below")
