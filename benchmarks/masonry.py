"""Arches, walls, piers and columns in one plane or two, as stones: what profiles are measured on.

All corners are sharp. Stones stand on fixed blocks as wide as they are.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from mechanics.arrays import Array
from mechanics.scene.scene import Block, Fidelity
from mechanics.stones.materials import Material

__all__ = [
    "arch_on",
    "box",
    "column",
    "courses",
    "flying_arch",
    "pier",
    "running_bond",
    "semicircular_arch",
    "trilith",
    "two_spans",
]

# a sound limestone
_STONE = Material("limestone", 2400.0, young=1e10, poisson=0.2)


def prism(
    code: str, polygon: Sequence[Sequence[float]] | Array, depth: float, fidelity: Fidelity = Fidelity.RIGID
) -> Block:
    """A convex polygon (n, 2) of the x–z plane, counter-clockwise with x to the right and z up, drawn along y."""
    flat = np.asarray(polygon, dtype=float)
    n = len(flat)
    front, back = (np.column_stack([flat[:, 0], np.full(n, y), flat[:, 1]]) for y in (-depth / 2, depth / 2))
    sides = [(i, n + i, n + (i + 1) % n, (i + 1) % n) for i in range(n)]
    faces = (tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1)), *sides)
    return Block(code, np.vstack([front, back]), faces, _STONE, fidelity)


def box(code: str, low: Sequence[float], high: Sequence[float], fidelity: Fidelity = Fidelity.RIGID) -> Block:
    """An axis-parallel stone from corner `low` (3,) to corner `high` (3,)."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    whole = prism(code, [(x0, z0), (x1, z0), (x1, z1), (x0, z1)], y1 - y0, fidelity)
    return Block(code, whole.vertices + np.array([0.0, (y0 + y1) / 2, 0.0]), whole.faces, _STONE, fidelity)


def running_bond(
    rows: Sequence[Sequence[float]], length: float, height: float, depth: float, grounded: bool = False
) -> tuple[Block, ...]:
    """Courses from bottom to top, lists of stone lengths over `length`; negative ones are left open.

    They stand on a fixed slab, or, with `grounded`, on their lowest course, which is fixed.
    """
    wide = length * sum(map(abs, rows[0]))
    slab = box("base", (0, -depth / 2, -height), (wide, depth / 2, 0), Fidelity.FIXED)
    blocks = [] if grounded else [slab]
    for row, course in enumerate(rows):
        fidelity = Fidelity.FIXED if grounded and row == 0 else Fidelity.RIGID
        ends = length * np.concatenate([[0.0], np.cumsum(np.abs(course))])
        blocks += [
            box(
                f"{row + 1}-{k + 1}",
                (a, -depth / 2, row * height),
                (b, depth / 2, (row + 1) * height),
                fidelity,
            )
            for k, (a, b) in enumerate(pairwise(ends))
            if course[k] > 0
        ]
    return tuple(blocks)


def courses(count: int, rows: int) -> list[list[float]]:
    """A running bond: courses that begin and end with half a stone, in turn with `count` whole ones."""
    whole, halves = [1.0] * count, [0.5, *[1.0] * (count - 1), 0.5]
    return [whole if row % 2 else halves for row in range(rows)]


def semicircular_arch(
    count: int, thickness: float, radius: float = 1.0, depth: float | None = None
) -> tuple[Block, ...]:
    """Straight-faced voussoirs about the mean radius, joints on rays through the centre, on two fixed springers."""
    inner, outer = radius - thickness / 2, radius + thickness / 2
    deep = thickness if depth is None else depth
    feet = [
        prism(code, [(x0, -thickness), (x1, -thickness), (x1, 0.0), (x0, 0.0)], deep, Fidelity.FIXED)
        for code, x0, x1 in (("right", inner, outer), ("left", -outer, -inner))
    ]
    return (*feet, *arch_on("V", (0.0, 0.0), (inner, outer), (0.0, np.pi), count, deep))


def arch_on(
    prefix: str,
    centre: tuple[float, float],
    radii: tuple[float, float],
    angles: tuple[float, float],
    count: int,
    depth: float,
) -> tuple[Block, ...]:
    """Voussoirs between two radii [m] and two angles from the x axis [rad]."""
    ends = np.linspace(*angles, count + 1)
    inner, outer = radii

    def on(radius: float, angle: float) -> tuple[float, float]:
        return centre[0] + radius * float(np.cos(angle)), centre[1] + radius * float(np.sin(angle))

    return tuple(
        prism(f"{prefix}{k + 1}", [on(inner, a), on(outer, a), on(outer, b), on(inner, b)], depth)
        for k, (a, b) in enumerate(pairwise(ends))
    )


def two_spans() -> tuple[Block, ...]:
    """Two segmental arches of seven voussoirs over 1.5 m on a pier and two abutments, each of three courses.

    The lowest course is fixed.
    """
    centre, low, high = 1.2, np.radians(40.0), np.radians(140.0)
    (x0, z0), (x1, z1) = ((r * np.cos(low), r * np.sin(low)) for r in (1.0, 1.3))
    inner, outer, edge = centre + x0, centre + x1, centre + x0 + 0.9
    at, back = centre - x0, centre - x1
    cap = [(-at, 0.3), (at, 0.3), (at, z0), (back, z1), (-back, z1), (-at, z0)]
    abutment = np.array([(inner, 0.3), (edge, 0.3), (edge, z1), (outer, z1), (inner, z0)])
    stones = [
        prism("P3", cap, 0.3),
        prism("R3", abutment, 0.3),
        prism("L3", abutment[::-1] * [-1.0, 1.0], 0.3),
    ]
    for name, a, b in (("P", -at, at), ("R", inner, edge), ("L", -edge, -inner)):
        stones += [
            box(f"{name}1", (a, -0.15, -0.5), (b, 0.15, -0.1), Fidelity.FIXED),
            box(f"{name}2", (a, -0.15, -0.1), (b, 0.15, 0.3)),
        ]
    spans = (
        arch_on(name, (x, 0.0), (1.0, 1.3), (float(low), float(high)), 7, 0.3)
        for name, x in (("A", -centre), ("B", centre))
    )
    return (*stones, *(stone for span in spans for stone in span))


def pier(rows: int = 6) -> tuple[Block, ...]:
    """Courses of two stones that cross those below, a slab on them, and a stone in one corner of it.

    The lowest course is fixed.
    """
    wide, height = 0.8, 0.35
    stones: list[Block] = []
    for row in range(rows):
        for k in (0, 1):
            x = (0.0, wide) if row % 2 else (k * wide / 2, (k + 1) * wide / 2)
            y = (k * wide / 2, (k + 1) * wide / 2) if row % 2 else (0.0, wide)
            low, high = (x[0], y[0], row * height), (x[1], y[1], (row + 1) * height)
            fidelity = Fidelity.RIGID if row else Fidelity.FIXED
            stones.append(box(f"{row + 1}-{k + 1}", low, high, fidelity))
    top = rows * height
    stones.append(box("slab", (0, 0, top), (wide, wide, top + 0.25)))
    return (*stones, box("load", (0.05, 0.1, top + 0.25), (0.55, 0.5, top + 0.85)))


def flying_arch() -> tuple[Block, ...]:
    """Six voussoirs of a sixth of a circle that lean from a fixed foot against a wall of three stones with a coping."""
    low, high, centre = float(np.radians(30.0)), float(np.radians(90.0)), (0.0, 0.0)
    on = [(r * np.cos(low), r * np.sin(low)) for r in (1.5, 1.8)]
    (x0, z0), (x1, z1) = on
    foot = prism(
        "foot",
        [(x0, z0 - 0.4), (x1 + 0.3, z0 - 0.4), (x1 + 0.3, z1), (x1, z1), (x0, z0)],
        0.3,
        Fidelity.FIXED,
    )
    wall = [box("wall 1", (-1.0, -0.2, 0.7), (0.0, 0.2, 1.1), Fidelity.FIXED)]
    wall += [box(f"wall {k + 2}", (-1.0, -0.2, 1.1 + 0.4 * k), (0.0, 0.2, 1.5 + 0.4 * k)) for k in range(2)]
    coping = box("coping", (-1.0, -0.2, 1.9), (-0.1, 0.2, 2.2))
    return (foot, *wall, coping, *arch_on("V", centre, (1.5, 1.8), (low, high), 6, 0.3))


def trilith() -> tuple[Block, ...]:
    """Two posts of two stones each, of which the lower is fixed, a lintel on them, and a stone on one half of it."""
    stones = []
    for name, x in (("L", 0.0), ("R", 1.5)):
        stones += [
            box(f"{name}1", (x, 0, 0), (x + 0.45, 0.4, 0.6), Fidelity.FIXED),
            box(f"{name}2", (x, 0, 0.6), (x + 0.45, 0.4, 1.3)),
        ]
    lintel = box("lintel", (-0.1, 0, 1.3), (2.05, 0.4, 1.7))
    return (*stones, lintel, box("load", (0.3, 0.05, 1.7), (0.9, 0.35, 2.2)))


def column(
    drums: int = 6, foot: float = 0.8, top: float = 0.6, height: float = 0.5, sides: int = 8
) -> tuple[Block, ...]:
    """Drums of so many sides whose diameter shrinks from `foot` to `top`, on a fixed one."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = 0.5 * np.column_stack([np.cos(angle), np.sin(angle)])
    walls = ((k, (k + 1) % sides, sides + (k + 1) % sides, sides + k) for k in range(sides))
    faces = (tuple(range(sides - 1, -1, -1)), tuple(range(sides, 2 * sides)), *walls)
    blocks = []
    for number in range(-1, drums):
        levels = (number, number + 1)
        wide = [foot + (top - foot) * max(k, 0) / drums for k in levels]
        rings = [
            np.column_stack([w * ring, np.full(sides, k * height)]) for w, k in zip(wide, levels, strict=True)
        ]
        fidelity = Fidelity.FIXED if number < 0 else Fidelity.RIGID
        code = "base" if number < 0 else f"drum {number + 1}"
        blocks.append(Block(code, np.vstack(rings), faces, _STONE, fidelity))
    return tuple(blocks)
