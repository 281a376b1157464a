"""Arches and piers in one plane or two, as stones: what profiles are measured on.

All corners are sharp. Stones stand on fixed blocks as wide as they are.
"""

import numpy as np

from mechanics.scene.scene import Block, Fidelity
from mechanics.scene.shapes import box, prism, voussoir_arch

__all__ = ["flying_arch", "pier", "trilith", "two_spans"]


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
            box(f"{name}1", (a, -0.15, -0.5), (b, 0.15, -0.1), fidelity=Fidelity.FIXED),
            box(f"{name}2", (a, -0.15, -0.1), (b, 0.15, 0.3)),
        ]
    spans = (
        voussoir_arch(7, (1.0, 1.3), 0.3, (float(low), float(high)), centre=(x, 0.0), prefix=name)
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
            stones.append(box(f"{row + 1}-{k + 1}", low, high, fidelity=fidelity))
    top = rows * height
    stones.append(box("slab", (0, 0, top), (wide, wide, top + 0.25)))
    return (*stones, box("load", (0.05, 0.1, top + 0.25), (0.55, 0.5, top + 0.85)))


def flying_arch() -> tuple[Block, ...]:
    """Six voussoirs of a sixth of a circle that lean from a fixed foot against a wall of three stones with a coping."""
    low, high = float(np.radians(30.0)), float(np.radians(90.0))
    on = [(r * np.cos(low), r * np.sin(low)) for r in (1.5, 1.8)]
    (x0, z0), (x1, z1) = on
    foot = prism(
        "foot",
        [(x0, z0 - 0.4), (x1 + 0.3, z0 - 0.4), (x1 + 0.3, z1), (x1, z1), (x0, z0)],
        0.3,
        fidelity=Fidelity.FIXED,
    )
    wall = [box("wall 1", (-1.0, -0.2, 0.7), (0.0, 0.2, 1.1), fidelity=Fidelity.FIXED)]
    wall += [box(f"wall {k + 2}", (-1.0, -0.2, 1.1 + 0.4 * k), (0.0, 0.2, 1.5 + 0.4 * k)) for k in range(2)]
    coping = box("coping", (-1.0, -0.2, 1.9), (-0.1, 0.2, 2.2))
    return (foot, *wall, coping, *voussoir_arch(6, (1.5, 1.8), 0.3, (low, high)))


def trilith() -> tuple[Block, ...]:
    """Two posts of two stones each, of which the lower is fixed, a lintel on them, and a stone on one half of it."""
    stones = []
    for name, x in (("L", 0.0), ("R", 1.5)):
        stones += [
            box(f"{name}1", (x, 0, 0), (x + 0.45, 0.4, 0.6), fidelity=Fidelity.FIXED),
            box(f"{name}2", (x, 0, 0.6), (x + 0.45, 0.4, 1.3)),
        ]
    lintel = box("lintel", (-0.1, 0, 1.3), (2.05, 0.4, 1.7))
    return (*stones, lintel, box("load", (0.3, 0.05, 1.7), (0.9, 0.35, 2.2)))
