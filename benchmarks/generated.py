"""Scenes of any size, made when they are needed: running-bond walls, and boxes of disks."""

from itertools import pairwise

import numpy as np

from benchmarks.scenes import BlockScene
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import SolverSettings

__all__ = ["box_faces", "disk_box", "running_bond"]

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
