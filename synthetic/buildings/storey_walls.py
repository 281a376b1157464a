"""Plan of the three walls of a storey: their frames, their corners, and the stones that go through them.

::

              back
        B │ │      │ │ C      Corners are solid: in each course a quoin lies along one wall and a bonder, as deep as the
          │ │      │ │        walls are thick, beside it in the other; in the next course they change places. Through
          │ └──────┘ │        stones tie the facings.
          └──────────┘
               A
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from synthetic.bond import Piece, upright
from synthetic.buildings.storey_vault import PROJECTION
from synthetic.frame import WallFrame

THICKNESS = 1.1
"""Thickness of the walls [m]."""
HALF = 0.5 * THICKNESS
"""Half the thickness of the walls [m]."""
OTHER = "of another wall"
"""Kind of a piece whose stone belongs to another wall."""
FOOT = np.array([48.6, 23.9, 11.4])
"""Middle of the foot of wall A in the site [m]."""

_QUOIN = 1.4  # length of a quoin along the wall that it lies in [m]
_THROUGH = (1.0, 0.40, 2.4)  # of through stones: distance from the end of a run, length, distance of two [m]
_RELIEF = 0.01  # distance of the inner facings of B and C from that of A, whose faces are not flush [m]
_EVERY = 3  # courses from one row of through stones to the next
_AZIMUTH = math.radians(14.0)  # of wall A against the x axis


@dataclass(frozen=True)
class StoreyWall:
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


def storey_walls(width: float, depth: float) -> tuple[StoreyWall, ...]:
    """Lay out the three walls; openings of B and C are in the middle of their inner faces."""
    x = np.array([math.cos(_AZIMUTH), math.sin(_AZIMUTH), 0.0])
    y, up = np.array([-x[1], x[0], 0.0]), np.array([0.0, 0.0, 1.0])
    half, middle = 0.5 * width, 0.5 * (THICKNESS + depth)
    places = (
        ("A", FOOT, x, (-half, half), (True, True), False),
        ("B", FOOT - half * x + middle * y, -y, (middle - depth, middle), (False, True), False),
        ("C", FOOT + half * x + middle * y, y, (-middle, depth - middle), (True, False), True),
    )
    return tuple(
        StoreyWall(
            letter, WallFrame(origin, np.array([along, up, np.cross(along, up)])), ends, corners, passage
        )
        for letter, origin, along, ends, corners, passage in places
    )


def corner_pieces(
    wall: StoreyWall, number: int, heights: Sequence[float], *, corbel: bool
) -> Iterator[Piece]:
    """Yield the stones of the corners in a course; the end of a quoin of the other wall is one "of another wall".

    Behind a corbel the other stone is a quoin, too, half as deep.
    """
    middle = 0.5 * (heights[number - 1] + heights[number])
    along = (number % 2 == 1) == (wall.letter == "A")
    beside = "quoin" if corbel else "bonder"
    kinds = (("quoin", 0.0, _QUOIN),) if along else ((OTHER, 0.0, HALF), (beside, HALF, THICKNESS))
    for corner, place, right in zip(wall.corners, wall.ends, (1.0, -1.0), strict=True):
        for kind, start, stop in kinds if corner else ():
            yield _between(kind, place + right * start, place + right * stop, middle)


def corbel_pieces(wall: StoreyWall, ends: tuple[float, float], middle: float) -> Iterator[Piece]:
    """Yield what corbels take of the course of an inner facing, seen from inside, as stones "of another wall"."""
    for corner, end, right in zip(wall.corners[::-1], ends, (1.0, -1.0), strict=True):
        if corner:
            corbel = PROJECTION - (0.0 if wall.letter == "A" else _RELIEF)
            yield _between(OTHER, end, end + right * corbel, middle)


def through_pieces(wall: StoreyWall, number: int, middle: float, opening: float) -> Iterator[Piece]:
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
            yield _between("header", place, place + length, middle)
            place += apart


def mirrored(piece: Piece) -> Piece:
    """Mirror a stone with upright ends, as seen from the other side."""
    return _between(piece.kind, -piece.left.point[0], -piece.right.point[0], piece.left.point[1])


def _between(kind: str, one: float, other: float, middle: float) -> Piece:
    """Return a stone with upright ends at two places, in either order."""
    left, right = sorted((one, other))
    return Piece(kind, upright(left, middle), upright(right, middle))
