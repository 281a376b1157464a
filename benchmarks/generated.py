"""Scenes of any size, made when they are needed: running-bond walls, columns, arches, and boxes of disks."""

from itertools import pairwise

import numpy as np

from benchmarks.scenes import BlockScene
from mechanics.arrays import Array
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import SolverSettings

__all__ = ["box_faces", "disk_box", "rigid_scenes", "running_bond"]

# length, height and depth of a brick [m]
_BRICK = (0.30, 0.10, 0.15)
# corners of a box with bits x, y, z of their index; faces counter-clockwise seen from outside
_FACES = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6))


def box_faces() -> tuple[tuple[int, ...], ...]:
    """The faces of a box whose corner i has the bits of i as coordinates x, y, z."""
    return _FACES


def running_bond(bricks: int, courses: int, friction: float = 0.5, density: float = 2400.0) -> BlockScene:
    """A wall `bricks` long and `courses` high, half bricks at the edges of odd courses, on a fixed slab."""
    length, height, depth = _BRICK
    cells = [(-length / 2, (bricks + 0.5) * length, -height, 0.0)]
    for course in range(courses):
        if course % 2 == 0:
            joints = np.arange(bricks + 1) * length
        else:
            joints = np.concatenate([[0.0], (np.arange(bricks) + 0.5) * length, [bricks * length]])
        bottom = course * height
        cells += [(a, b, bottom, bottom + height) for a, b in pairwise(joints)]
    corners = tuple(
        np.array([[(x0, x1)[i & 1], (0.0, depth)[i >> 1 & 1], (z0, z1)[i >> 2]] for i in range(8)])
        for x0, x1, z0, z1 in cells
    )
    support = np.zeros(len(cells), dtype=bool)
    support[0] = True
    faces = (_FACES,) * len(cells)
    return BlockScene(f"wall_{bricks}x{courses}", corners, faces, support, friction, density, 9.81)


def rigid_scenes() -> tuple[BlockScene, ...]:
    """Columns, semicircular arches and running-bond walls, on which rigid engines are compared; small ones first."""
    scenes = {f"column_{n}": _column(n) for n in (10, 50)} | {f"arch_{n}": _arch(n) for n in (15, 45)}
    scenes |= {f"wall_{n}x{n}": _wall(n) for n in (10, 20, 40)}
    named = (_around(name, *cells) for name, cells in scenes.items())
    return tuple(sorted(named, key=lambda scene: len(scene.vertices)))


def _column(count: int) -> tuple[list[Array], int]:
    """Blocks of 0.5 × 0.5 × 0.25 m one upon the other on a slab; corners of each, and how many are fixed."""
    blocks = [_ring_box((-0.5, 0.5), (-0.5, 0.5), (-0.2, 0.0))]
    half = (-0.25, 0.25)
    return blocks + [_ring_box(half, half, (0.25 * k, 0.25 * (k + 1))) for k in range(count)], 1


def _arch(count: int) -> tuple[list[Array], int]:
    """Voussoirs 0.3 m thick and 0.5 m deep on a semicircle of 2 m, on two abutments."""
    blocks = [_ring_box((x - 0.25, x + 0.25), (-0.35, 0.35), (-0.3, 0.0)) for x in (-2.0, 2.0)]
    for low, high in pairwise(np.linspace(np.pi, 0.0, count + 1)):
        ring = [(r, y) for r, y in ((1.85, -0.25), (1.85, 0.25), (2.15, 0.25), (2.15, -0.25))]
        blocks.append(
            np.array([(r * np.cos(a), y, r * np.sin(a)) for a in (low, high) for r, y in ring], dtype=float)
        )
    return blocks, 2


def _wall(count: int) -> tuple[list[Array], int]:
    """Courses of bricks of 0.30 × 0.15 × 0.10 m, as many as a course has, half bricks at the edges, on a slab."""
    length, height, depth = _BRICK
    blocks = [_ring_box((-0.1, count * length + 0.1), (-0.1, depth + 0.1), (-0.2, 0.0))]
    for course in range(count):
        joints = np.arange(count + 1) * length
        if course % 2:
            joints = np.concatenate([[0.0], joints[:-1] + length / 2, [count * length]])
        z = course * height, (course + 1) * height
        blocks += [_ring_box(x, (0.0, depth), z) for x in pairwise(joints.tolist())]
    return blocks, 1


def _ring_box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Array:
    """Corners (8, 3) of a box, the lower ones first, each four counter-clockwise seen from above."""
    return np.array([(x[i], y[j], k) for k in z for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))])


def _around(name: str, blocks: list[Array], fixed: int) -> BlockScene:
    """Blocks of which the first ones are fixed, with corners as of `_ring_box`."""
    faces = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
    support = np.arange(len(blocks)) < fixed
    return BlockScene(name, tuple(blocks), (faces,) * len(blocks), support, 0.5, 2400.0, 9.81)


def disk_box(columns: int, rows: int, radius: float = 0.01, sweeps: int = 2000) -> PlanarScene:
    """Disks in hexagonal packing, `columns` wide and `rows` high, in a box that just holds them."""
    rise = np.sqrt(3.0) * radius
    disks = tuple(
        Disk(f"d{row}_{column}", ((2 * column + 1 + row % 2) * radius, radius + row * rise), radius)
        for row in range(rows)
        for column in range(columns)
    )
    wide, high = (2 * columns + 1) * radius, rows * 2 * radius
    walls = (
        Wall("floor", (0.0, 0.0), (wide, 0.0)),
        Wall("left", (0.0, 0.0), (0.0, high)),
        Wall("right", (wide, 0.0), (wide, high)),
    )
    return PlanarScene(
        f"disks_{columns}x{rows}",
        disks,
        walls,
        law=DryJoint(friction=0.3),
        time=PlanarTime(step=1e-4),
        solver=SolverSettings(tolerance=1e-30, max_iterations=sweeps),
    )
