"""Openings spanned by an arch whose back is level, so that every stone of it has four sides.

A segmental arch stands on skewbacks. The outer ends of a semicircular one are upright, and on either side one
voussoir meets each course of the wall.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np

from synthetic.bond import PlanLine, PlannedStone, crossing, level, upright

_CROWN = 0.3  # least thickness of an arch [m]
_INTRADOS = 0.2  # length of a voussoir's face below, about [m]
_JAMBS = (0.42, 0.62)  # short and long in turn, so that the jambs bond with the wall [m]


class ArchShape(StrEnum):
    """Shape of an arch."""

    SEGMENTAL = "segmental"
    SEMICIRCULAR = "semicircular"


@dataclass(frozen=True)
class Opening:
    """An opening about s = 0 in a wall.

    Attributes
    ----------
    half : half its width [m]
    jambs : its courses from first to last; the arch springs from the last
    arch : courses that the arch spans, from first to last
    radials : joints of the arch from left to right, both ends included
    upright_ends : whether the arch ends at upright lines instead of skewbacks
    reach : largest distance of the arch from the axis [m]
    springing, back : heights at which it begins and ends [m]
    """

    half: float
    jambs: tuple[int, int]
    arch: tuple[int, int]
    radials: tuple[PlanLine, ...]
    upright_ends: bool
    reach: float
    springing: float
    back: float

    def edges(self, course: int, height: float) -> tuple[PlanLine, PlanLine, str] | None:
        """Return the lines where a course ends at the opening, and the kind of stone there; None if it runs through."""
        if self.jambs[0] <= course <= self.jambs[1]:
            return upright(-self.half, height), upright(self.half, height), "jamb"
        if not self.arch[0] <= course <= self.arch[1]:
            return None
        if self.upright_ends:
            return upright(-self.reach, height), upright(self.reach, height), "stretcher"
        return self.radials[0], self.radials[-1], "springer"

    def beside(self, course: int) -> tuple[float, float]:
        """Return the lengths of the stones at the left and right edge of a course [m]."""
        return _JAMBS if course % 2 else _JAMBS[::-1]

    def voussoirs(self) -> list[PlannedStone]:
        """Outline the stones of the arch, from left to right."""
        stones = []
        keystone = (len(self.radials)) // 2
        for rank, (left, right) in enumerate(pairwise(self.radials), start=1):
            corners = np.array([left.point, right.point, self._outer(right), self._outer(left)])
            kind = "keystone" if rank == keystone else "voussoir"
            stones.append(PlannedStone(f"V{rank}", kind, None, corners, (True,) * 4))
        return stones

    def _outer(self, radial: PlanLine) -> tuple[float, float]:
        """Return the outer end of a joint of the arch."""
        if self.upright_ends:
            side = math.copysign(self.reach, radial.point[0])
            s, t = (
                crossing(radial, upright(side, self.springing))
                if abs(radial.direction[0]) > 1e-9
                else (0.0, math.inf)
            )
            if t < self.back - 1e-9:
                return s, t
        return crossing(radial, level(self.back))


def plan_opening(shape: ArchShape, half: float, heights: Sequence[float], jambs: int) -> Opening:
    """Lay out an opening.

    Parameters
    ----------
    shape : of its arch
    half : half its width [m]
    heights : of the beds, the ground first [m]
    jambs : courses from its sill, the top of course 1, to the springing
    """
    foot = 1 + jambs
    rise = half if shape is ArchShape.SEMICIRCULAR else half / 3.0
    top = next(k for k in range(foot + 1, len(heights)) if heights[k] >= heights[foot] + rise + _CROWN)
    springing, back = heights[foot], heights[top]
    if shape is ArchShape.SEMICIRCULAR:
        reach = half + _CROWN
        radials = _semicircle(half, reach, springing, heights[foot : top + 1])
    else:
        radials = _segment(half, rise, springing)
        reach = crossing(radials[-1], level(back))[0]
    return Opening(
        half=half,
        jambs=(2, foot),
        arch=(foot + 1, top),
        radials=tuple(radials),
        upright_ends=shape is ArchShape.SEMICIRCULAR,
        reach=reach,
        springing=springing,
        back=back,
    )


def _segment(half: float, rise: float, springing: float) -> list[PlanLine]:
    radius = (half**2 + rise**2) / (2.0 * rise)
    widest = math.asin(half / radius)
    count = round(2.0 * widest * radius / _INTRADOS) // 2 * 2 + 1
    angles = [widest * (2.0 * k / count - 1.0) for k in range(count + 1)]
    return [_radial(angle, radius, springing + rise - radius) for angle in angles]


def _semicircle(half: float, reach: float, springing: float, beds: Sequence[float]) -> list[PlanLine]:
    """Lay out joints through the ends of the beds, and between the corners of the arch's back."""
    sides = [math.pi / 2.0 - math.atan2(bed - springing, reach) for bed in beds]
    corner = sides[-1]
    count = round(2.0 * corner * half / _INTRADOS) // 2 * 2 + 1
    crown = [corner * (2.0 * k / count - 1.0) for k in range(1, count)]
    return [_radial(angle, half, springing) for angle in (*(-a for a in sides), *crown, *sides[::-1])]


def _radial(angle: float, radius: float, centre: float) -> PlanLine:
    """Return the joint at an angle from upright, positive to the right, with its point on the intrados."""
    direction = (math.sin(angle), math.cos(angle))
    return PlanLine((radius * direction[0], centre + radius * direction[1]), direction)
