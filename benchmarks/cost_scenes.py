"""Scenes from which the cost of runs was learnt, and others on which it is tried: `benchmarks.cost`."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from benchmarks.generated import box_faces
from mechanics.arrays import Array
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene, Start, TimeSettings
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element

__all__ = ["KINDS", "Case"]


_STONE = Material("stone", density=2400.0, young=5e9, poisson=0.2)
# length, depth and height of a stone [m]
_BRICK = (0.6, 0.4, 0.3)


@dataclass(frozen=True)
class Case:
    """One scene to be measured.

    Attributes
    ----------
    kind : a name among `KINDS`
    stones : about how many
    element : of deformable stones; empty: rigid ones
    size : of the mesh [m]
    mode : *static*: from the static equilibrium; *relaxation*: kinetic relaxation; *motion*: 60 steps of free motion;
        *asleep*: steps in which all sleep
    """

    kind: str
    stones: int
    element: str = ""
    size: float = 0.15
    mode: str = "static"

    def scene(self) -> Scene:
        """The scene."""
        solids = KINDS[self.kind](self.stones)
        fidelity = Fidelity.DEFORMABLE if self.element else Fidelity.RIGID
        kind = Element(self.element) if self.element else Element.TET4
        blocks = tuple(
            Block(
                f"b{n}", corners, box_faces(), _STONE, Fidelity.FIXED if fixed else fidelity, self.size, kind
            )
            for n, (corners, fixed) in enumerate(solids)
        )
        return Scene(
            f"{self.kind} of {self.stones}", blocks, contact=ContactSettings(DryJoint(0.6)), time=self._time()
        )

    def _time(self) -> TimeSettings:
        if self.mode == "static":
            return TimeSettings(1e-3, 1.0, 1.0, start=Start.EQUILIBRIUM)
        if self.mode == "relaxation":
            return TimeSettings(1e-2, 1.0, 2.0, relaxation=True)
        sleep = 1e-2 if self.mode == "asleep" else 0.0
        return TimeSettings(1e-3, 0.5, 0.06, stop_at_equilibrium=False, sleep=sleep)


def _box(low: tuple[float, float, float], high: tuple[float, float, float]) -> Array:
    return np.array([[(low[k], high[k])[i >> k & 1] for k in range(3)] for i in range(8)])


def _courses(bricks: int, courses: int, depth: float, at: float = 0.0) -> list[tuple[Array, bool]]:
    """Running bond from y = `at` on, without its ground."""
    length, _, height = _BRICK
    solids = []
    for course in range(courses):
        joints = np.arange(bricks + 1) * length
        if course % 2:
            joints = np.concatenate([[0.0], (np.arange(bricks) + 0.5) * length, [bricks * length]])
        solids += [
            (_box((a, at, course * height), (b, at + depth, (course + 1) * height)), False)
            for a, b in pairwise(joints)
        ]
    return solids


def _ground(wide: float, deep: float) -> tuple[Array, bool]:
    return _box((-1.0, -1.0, -0.5), (wide + 1.0, deep + 1.0, 0.0)), True


def _wall(stones: int) -> list[tuple[Array, bool]]:
    """Twice as many courses as stones in each."""
    bricks = max(2, round(np.sqrt(stones / 2)))
    courses = max(2, round(stones / (bricks + 0.5)))
    return [_ground(bricks * _BRICK[0], _BRICK[1]), *_courses(bricks, courses, _BRICK[1])]


def _leaves(stones: int) -> list[tuple[Array, bool]]:
    """A wall of three leaves, the middle one in larger stones."""
    bricks = max(2, round(np.sqrt(stones / 3)))
    courses = max(2, round(stones / 3 / (bricks + 0.5)))
    length, depth, height = _BRICK
    leaves = [solid for k in (0, 2) for solid in _courses(bricks, courses, depth, k * depth)]
    core = [
        (_box((a, depth, 0.0), (a + length, 2 * depth, courses * height)) + _lift(c, height, courses), False)
        for c in range(courses)
        for a in np.arange(bricks) * length
    ]
    return [_ground(bricks * length, 3 * depth), *leaves, *core]


def _lift(course: int, height: float, courses: int) -> Array:
    """What takes a corner of a stone as high as the wall to its course."""
    top = np.array([i >> 2 & 1 for i in range(8)])
    lift = np.zeros((8, 3))
    lift[:, 2] = height * (course + top) - top * courses * height
    return lift


def _pillars(stones: int) -> list[tuple[Array, bool]]:
    """Pillars of twelve drums."""
    count = max(1, round(stones / 12))
    length, depth, height = _BRICK
    drums = [
        (_box((2 * k * length, 0.0, i * height), ((2 * k + 1) * length, depth, (i + 1) * height)), False)
        for k in range(count)
        for i in range(12)
    ]
    return [_ground(2 * count * length, depth), *drums]


def _portals(stones: int) -> list[tuple[Array, bool]]:
    """Storeys of pillars of three drums, with lintels from the middle of one to that of the next."""
    count = max(2, round(np.sqrt(stones / 3)))
    storeys = max(1, round(stones / (4 * count - 1)))
    length, depth, height = _BRICK
    solids = [_ground(3 * count * length, depth)]
    for storey in range(storeys):
        foot = 4 * storey * height
        for k in range(count):
            left, middle = 3 * k * length, (3 * k + 0.5) * length
            solids += [
                (_box((left, 0.0, foot + i * height), (left + length, depth, foot + (i + 1) * height)), False)
                for i in range(3)
            ]
            if k + 1 < count:
                # the outer ones lie on the whole of their pillar
                start = left if k == 0 else middle
                end = middle + 3 * length + (0.5 * length if k + 2 == count else 0.0)
                top = foot + 3 * height
                solids.append((_box((start, 0.0, top), (end, depth, top + height)), False))
    return solids


def _vault(stones: int) -> list[tuple[Array, bool]]:
    """A barrel vault: rings of 15 stones that touch each other, every other turned by half a stone."""
    count, solids = max(1, round(stones / 15)), []
    for k in range(count):
        cuts = [-0.2, *np.pi * np.arange(16) / 15, np.pi + 0.2]
        if k % 2:
            cuts = [-0.2, 0.0, *np.pi * (np.arange(15) + 0.5) / 15, np.pi, np.pi + 0.2]
        solids += [
            (_voussoir(a, b, 0.5 * k, (2.2, 2.7)), i in (0, len(cuts) - 2))
            for i, (a, b) in enumerate(pairwise(cuts))
        ]
    return solids


def _arch(stones: int) -> list[tuple[Array, bool]]:
    """Semicircular arches of 25 voussoirs, each on its own springers, thickness 0.2 of the mean radius."""
    count = max(1, round(stones / 25))
    solids = []
    for k in range(count):
        angle = np.pi * np.arange(-1, 27) / 25
        angle[0], angle[-1] = -0.2, np.pi + 0.2
        for i, (a, b) in enumerate(pairwise(angle)):
            solids.append((_voussoir(a, b, 2.0 * k), i in (0, 26)))
    return solids


def _voussoir(start: float, end: float, y: float, radii: tuple[float, float] = (1.8, 2.2)) -> Array:
    inner, outer = radii
    rays = [(inner, end), (inner, start), (outer, end), (outer, start)]
    places = np.array([[r * np.cos(a), r * np.sin(a)] for r, a in rays])
    # bit 0 from end to start, bit 1 along y, bit 2 outwards
    return np.array([[*places[(i & 1) + 2 * (i >> 2 & 1)], y + (i >> 1 & 1) * 0.5] for i in range(8)])[
        :, [0, 2, 1]
    ]


def _opening(stones: int) -> list[tuple[Array, bool]]:
    """A wall with a door in its middle, below a lintel."""
    bricks = max(4, round(np.sqrt(stones)))
    courses = max(4, round(stones / (bricks + 0.5) / 0.9))
    length, depth, height = _BRICK
    middle, half, top = bricks * length / 2, max(0.8, bricks * length / 8), courses // 2
    solids = [_ground(bricks * length, depth)]
    for corners, _ in _courses(bricks, courses, depth):
        low, high = corners[0, 0], corners[-1, 0]
        course = round(corners[0, 2] / height)
        if course < top:
            left, right = max(low, middle + half), min(high, middle - half)
            pieces = [(low, right)] if low < middle - half else []
            pieces += [(left, high)] if high > middle + half else []
        elif course == top:
            pieces = [(low, min(high, middle - half - 0.3))] if low < middle - half - 0.31 else []
            pieces += [(max(low, middle + half + 0.3), high)] if high > middle + half + 0.31 else []
        else:
            pieces = [(low, high)]
        solids += [
            (_box((a, 0.0, course * height), (b, depth, (course + 1) * height)), False)
            for a, b in pieces
            if b - a > 0.05
        ]
    lintel = (middle - half - 0.3, 0.0, top * height), (middle + half + 0.3, depth, (top + 1) * height)
    return [*solids, (_box(*lintel), False)]


def _column(stones: int) -> list[tuple[Array, bool]]:
    """Columns of 25 drums, each wider than high, side by side."""
    count = max(1, round(stones / 25))
    drums = [
        (_box((3.0 * k, 0.0, 0.4 * i), (3.0 * k + 1.2, 1.2, 0.4 * (i + 1))), False)
        for k in range(count)
        for i in range(25)
    ]
    return [_ground(3.0 * count, 1.2), *drums]


KINDS: Mapping[str, Callable[[int], list[tuple[Array, bool]]]] = {
    "wall": _wall,
    "leaves": _leaves,
    "pillars": _pillars,
    "portals": _portals,
    "vault": _vault,
    "arch": _arch,
    "opening": _opening,
    "column": _column,
}
