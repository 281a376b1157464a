"""Long courses in running bond, beds level or sagging, and the stones between two beds."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from random import Random

import numpy as np

from moma.errors import GeometryError
from survey.synthetic.bond import WIDTHS, Line, PlannedStone, crossing, fill, level, upright

__all__ = ["CLEARANCES", "Bed", "Piece", "fill_run", "planned"]


CLEARANCES = (0.09, 0.06, 0.03)  # preferred, then allowed, between head joints of neighbouring courses [m]
_REST = 2.4  # length of the end of a run, which is filled as a whole so that it ends at the stop [m]


@dataclass(frozen=True)
class Piece:
    """One stone of a course: its kind, and the lines that it lies between."""

    kind: str
    left: Line
    right: Line


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

    def crossing(self, line: Line) -> tuple[float, float]:
        """Return the point where a nearly upright line meets the bed."""
        if not self.corners:
            return crossing(line, level(self.height))
        before = bisect_left(self.corners, (line.at(self.height), 0.0)) - 1
        before = min(max(before, 0), len(self.corners) - 2)
        (s, t), (to_s, to_t) = self.corners[before : before + 2]
        return crossing(line, Line((s, t), (to_s - s, to_t - t)))

    def bends(self, start: float, stop: float) -> list[tuple[float, float]]:
        """Return the corners of the bed strictly between two places."""
        return [(s, t) for s, t in self.corners if start + 1e-6 < s < stop - 1e-6]


def fill_run(rng: Random, start: Line, stop: Line, height: float, below: Sequence[float]) -> list[Piece]:
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
        near = bisect_left(below, end - clearance)
        if last != [kind, kind] and (near == len(below) or below[near] > end + clearance):
            return kind, end
    raise GeometryError(f"no stone fits at s = {start:.3f} m", remedy="allow joints nearer to those below")
