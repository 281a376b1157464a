"""Courses of headers and stretchers in running bond, laid out in the plane of the wall.

Coordinates (s, t): s along the wall to the right as seen from outside, t up the wall, metres.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from random import Random

from moma.errors import GeometryError
from survey.arrays import Array

__all__ = ["Line", "PlannedStone", "crossing", "fill", "level", "upright"]


WIDTHS = {"header": (0.31, 0.46), "stretcher": (0.48, 0.80)}  # least and largest width of each kind [m]
_TILT = math.radians(0.8)  # largest tilt of a head joint off the perpendicular


@dataclass(frozen=True)
class Line:
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


def level(t: float) -> Line:
    """Return the bed line at height t."""
    return Line((0.0, t), (1.0, 0.0))


def upright(s: float, t: float, rng: Random | None = None) -> Line:
    """Return the head joint through (s, t): up to 0.8° off with `rng`, as masons work; exactly upright without."""
    tilt = 0.0 if rng is None else rng.uniform(-_TILT, _TILT)
    return Line((s, t), (math.sin(tilt), math.cos(tilt)))


def crossing(a: Line, b: Line) -> tuple[float, float]:
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
