"""Stones of the matrix, and their scenes."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from mechanics.scene import shapes
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.law import Law
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene, TimeSettings
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element

G = 9.81


def box(
    code: str,
    low: Sequence[float],
    high: Sequence[float],
    density: float = 2400.0,
    fidelity: Fidelity = Fidelity.RIGID,
    young: float = 1e9,
    mesh_size: float | None = None,
) -> Block:
    """An axis-parallel stone from corner `low` (3,) to corner `high` (3,) [m]."""
    material = Material(f"{code}'s", density, young, 0.2)
    return shapes.box(code, low, high, material, fidelity=fidelity, mesh_size=mesh_size, element=Element.HEX8)


def ground(half: float = 5.0, depth: float = 1.0) -> Block:
    """A fixed stone whose top is z = 0."""
    return box("ground", [-half, -half, -depth], [half, half, 0.0], fidelity=Fidelity.FIXED)


def column(count: int, ratio: float = 1.0, size: float = 1.0) -> tuple[Block, ...]:
    """Equal stones on the ground; the topmost is `ratio` times as heavy as the lowest, in equal steps."""
    wide, high = 0.5 * size, 0.25 * size
    heavy = 2400.0 * ratio ** (np.arange(count) / max(count - 1, 1))
    stones = (
        box(f"B{i}", [0, 0, i * high], [wide, wide, (i + 1) * high], float(heavy[i])) for i in range(count)
    )
    return (ground(5.0 * size, size), *stones)


def wall(columns: int, courses: int) -> tuple[Block, ...]:
    """Bricks of 0.3 m × 0.15 m × 0.1 m in running bond on the ground."""
    blocks = [ground()]
    for row in range(courses):
        ends = [*range(columns + 1)] if row % 2 == 0 else [0, *(np.arange(columns) + 0.5), columns]
        blocks += [
            box(f"{row}-{k}", [0.3 * a, 0, 0.1 * row], [0.3 * b, 0.15, 0.1 * (row + 1)])
            for k, (a, b) in enumerate(pairwise(ends))
        ]
    return tuple(blocks)


def slabs(count: int) -> tuple[Block, ...]:
    """Slabs of 1 m × 1 m × 1 cm on each other, each turned by 17° against the one below."""
    blocks = [ground()]
    for i in range(count):
        co, si = np.cos(np.radians(17.0 * i)), np.sin(np.radians(17.0 * i))
        one = box(f"S{i}", [-0.5, -0.5, 0.01 * i], [0.5, 0.5, 0.01 * (i + 1)])
        corners = one.vertices.copy()
        corners[:, :2] = corners[:, :2] @ np.array([[co, si], [-si, co]])
        blocks.append(replace(one, vertices=corners))
    return tuple(blocks)


def elastic_column(young: float, size: float = 1.0, density: float = 2000.0) -> tuple[Block, ...]:
    """Two deformable stones on the ground, 0.4 m wide and 0.3 m high, times a size."""
    half, high = 0.2 * size, 0.3 * size
    return (
        ground(size, size),
        *(
            box(
                f"E{i}",
                [-half, -half, high * i],
                [half, half, high * (i + 1)],
                density,
                Fidelity.DEFORMABLE,
                young,
                half,
            )
            for i in range(2)
        ),
    )


def moved(blocks: Sequence[Block], shift: Sequence[float]) -> tuple[Block, ...]:
    """All stones, shifted (3,) [m]."""
    return tuple(replace(block, vertices=block.vertices + np.array(shift)) for block in blocks)


def volume(block: Block) -> float:
    """Of a parallelepiped whose first corner is joined to corners 1, 3 and 4 [m³]."""
    return float(abs(np.linalg.det(block.vertices[[1, 3, 4]] - block.vertices[0])))


def standing(
    blocks: Sequence[Block],
    *,
    friction: float = 0.6,
    slope: float = 0.0,
    law: Law | None = None,
    steps: int = 20,
    **time: Any,
) -> Scene:
    """A scene under its weight, that ends when it rests; `slope` tilts gravity about y [°]."""
    angle = np.radians(slope)
    settings = TimeSettings(**{"step": 2e-3, "theta": 1.0} | time)
    return Scene(
        "extreme",
        tuple(blocks),
        gravity=(G * float(np.sin(angle)), 0.0, -G * float(np.cos(angle))),
        contact=ContactSettings(law or DryJoint(friction)),
        time=replace(settings, duration=steps * settings.step),
    )
