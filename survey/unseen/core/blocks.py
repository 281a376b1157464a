"""Core of a wall as convex blocks that meet the hidden sides of the stones before and behind them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array
from survey.conventions import ROUNDING, TOUCHING
from survey.geometry.half_spaces import intersection
from survey.geometry.solids import Solid, volume_of
from survey.joints.overlaps import LEAST_VOLUME
from survey.unseen.core.courses import Stretch, Strip, height_of, place_of, stretches, strips
from survey.unseen.core.facings import FacingStone, FacingWall
from survey.unseen.core.settings import InfillSettings

_OUT = np.array([0.0, 0.0, 1.0])
_MARGIN = 1.0  # metres around the cut region


@dataclass(frozen=True)
class CoreBlock:
    """A convex part of the core.

    Attributes
    ----------
    solid : in the frame of the wall
    course : number of its course; None if it belongs to none
    between : codes of the stones before and behind it
    """

    solid: Solid
    course: int | None
    between: tuple[str, str]


@dataclass(frozen=True)
class _Cut:
    place: float
    plane: Array


def core_blocks(wall: FacingWall, settings: InfillSettings) -> tuple[CoreBlock, ...]:
    """Fill the core of a wall with blocks, strip by strip from below, from left to right.

    A block lies between two beds and two head joints of either facing, behind the hidden sides of the stones
    around it. Where two joints of different facings nearly coincide, either one of them or the core between them is
    omitted, whichever leaves more of the core.

    Parameters
    ----------
    wall : two facings
    settings : tolerances

    Returns
    -------
    Blocks that overlap neither each other nor a stone
    """
    stones = _Stones((*wall.front, *wall.back))
    blocks: list[CoreBlock] = []
    for strip in strips(wall, settings):
        sides = tuple(stretches(strip, stones_of, settings) for stones_of in (wall.front, wall.back))
        cells = _Cells(strip, sides, stones, settings)
        for left, right in _stretches_of_core(_cuts(sides), cells, settings):
            if (block := cells.block(left, right)) is not None:
                blocks.append(block)
    return tuple(blocks)


def _cuts(sides: Iterable[Sequence[Stretch]]) -> list[_Cut]:
    """Return the head joints of both facings, from left to right, without repetition."""
    cuts = [_Cut(stretch.start, stretch.left) for side in sides for stretch in side]
    cuts += [_Cut(stretch.stop, stretch.right) for side in sides for stretch in side]
    cuts.sort(key=lambda cut: cut.place)
    distinct: list[_Cut] = []
    for cut in cuts:
        if not distinct or cut.place - distinct[-1].place > TOUCHING:
            distinct.append(cut)
    return distinct


def _stretches_of_core(
    cuts: list[_Cut], cells: "_Cells", settings: InfillSettings
) -> list[tuple[_Cut, _Cut]]:
    """Yield pairs of cuts between which there may be a block."""
    gaps: list[tuple[_Cut, _Cut]] = []
    waiting = cuts[:0:-1]
    left = cuts[0] if cuts else None
    while left is not None and waiting:
        here = waiting.pop()
        ends = (here, here)
        if len(waiting) >= 2 and waiting[-1].place - here.place < settings.merge:
            ends = _one_of(left, here, waiting.pop(), waiting[-1], cells)
        gaps.append((left, ends[0]))
        left = ends[1]
    return gaps


def _one_of(left: _Cut, first: _Cut, second: _Cut, right: _Cut, cells: "_Cells") -> tuple[_Cut, _Cut]:
    """Return the end of the block left of two near cuts and the start of that right of them that fill the most."""

    def filled(ends: tuple[_Cut, _Cut]) -> float:
        """Return the volume between two cuts and their ends [m³]."""
        return cells.volume(left, ends[0]) + cells.volume(ends[1], right)

    choices = [(first, first), (second, second)]
    if not cells.crossed(first, second):
        choices.append((first, second))
    return max(choices, key=filled)


class _Stones:
    """The stones of both facings, searchable by place."""

    def __init__(self, stones: Sequence[FacingStone]) -> None:
        self.stones = stones
        self._low = np.array([stone.solid.vertices.min(axis=0) for stone in stones])
        self._high = np.array([stone.solid.vertices.max(axis=0) for stone in stones])

    def near(self, solid: Solid) -> list[FacingStone]:
        """Return the stones whose box meets that of a solid."""
        low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
        meeting = np.flatnonzero(((self._low < high) & (self._high > low)).all(axis=1))
        return [self.stones[i] for i in meeting.tolist()]


class _Cells:
    """The core remaining between two head joints of a strip."""

    def __init__(
        self,
        strip: Strip,
        sides: Sequence[Sequence[Stretch]],
        stones: _Stones,
        settings: InfillSettings,
    ) -> None:
        self.strip, self.sides, self.stones, self.settings = strip, sides, stones, settings
        self._made: dict[tuple[float, float], CoreBlock | None] = {}

    def volume(self, left: _Cut, right: _Cut) -> float:
        """Return the volume of the block between two cuts [m³]."""
        block = self.block(left, right)
        return 0.0 if block is None else volume_of(block.solid)

    def crossed(self, left: _Cut, right: _Cut) -> bool:
        """Return whether two cuts meet within the strip."""
        ends = [height_of(plane, left.place) for plane in (self.strip.lower, self.strip.upper)]
        return any(place_of(left.plane, height) >= place_of(right.plane, height) for height in ends)

    def block(self, left: _Cut, right: _Cut) -> CoreBlock | None:
        """Return the block between two cuts; None if there is no core."""
        key = (left.place, right.place)
        if key not in self._made:
            self._made[key] = self._make(left, right)
        return self._made[key]

    def _make(self, left: _Cut, right: _Cut) -> CoreBlock | None:
        middle = 0.5 * (left.place + right.place)
        over = [
            next((stretch.stone for stretch in side if stretch.start <= middle <= stretch.stop), None)
            for side in self.sides
        ]
        front, back = over
        if front is None or back is None or self.crossed(left, right):
            return None
        planes = [-self.strip.lower, self.strip.upper, -left.plane, right.plane]
        planes += [-front.support(-_OUT), -back.support(_OUT)]
        solid = _carved(planes, self.stones)
        if solid is None:
            return None
        height = height_of(self.strip.upper, middle) - height_of(self.strip.lower, middle)
        if volume_of(solid) < self.settings.min_thickness * height * (right.place - left.place):
            return None
        return CoreBlock(solid, self.strip.course, (front.code, back.code))


def _carved(planes: list[Array], stones: _Stones) -> Solid | None:
    """Intersect half-spaces, less the stones that reach into them: each is cut off by one of its own planes."""
    solid = _common(planes)
    for stone in stones.near(solid) if solid is not None else ():
        if solid is None:
            return None
        if _apart(solid, planes, stone):
            continue
        pieces = [[*planes, -plane] for plane in stone.planes]
        planes = max(pieces, key=lambda some: 0.0 if (piece := _common(some)) is None else volume_of(piece))
        solid = _common(planes)
    return solid


def _apart(solid: Solid, planes: Sequence[Array], stone: FacingStone) -> bool:
    """Return whether a convex solid and a stone have no volume in common."""
    if any((solid.vertices @ plane[:3] >= plane[3] - ROUNDING).all() for plane in stone.planes):
        return True
    if any((stone.solid.vertices @ plane[:3] >= plane[3] - ROUNDING).all() for plane in planes):
        return True
    shared = _common([*planes, *stone.planes])
    return shared is None or volume_of(shared) <= LEAST_VOLUME


def _common(planes: Sequence[Array]) -> Solid | None:
    """Return the intersection of half-spaces; None if it is empty."""
    reach = max(abs(float(plane[3])) for plane in planes) + _MARGIN
    bounds = np.full(3, reach)
    solid = intersection("", [tuple(plane) for plane in planes], -bounds, bounds, ROUNDING)
    return solid if solid is not None and volume_of(solid) > LEAST_VOLUME else None
