"""Scenes of the benchmarks: blocks as files, walls, columns and arches of any size, and boxes of disks."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import UsageError
from mechanics.arrays import Array, Bools
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import (
    Block,
    ContactSettings,
    Fidelity,
    LawRule,
    Method,
    Scene,
    SolverSettings,
    Start,
    TimeSettings,
)
from mechanics.scene.shapes import BOX_FACES, box, box_corners
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element

# length, height and depth of a brick [m]
_BRICK = (0.30, 0.10, 0.15)
_DENSITY = 2400.0  # where nothing else is said [kg/m³]
# head joints of deformable walls are open by this, so that they never touch [m]
_HEAD_JOINT = 1e-3
_ELASTIC = Material("stone", density=_DENSITY, young=5e9, poisson=0.2)
# what holds the base of a deformable wall at its bottom does not break
_GLUE = MortarJoint(friction=1.0, tension=1e5, shear=1e5)


# --- scenes of rigid blocks, as files and for the engine ---


@dataclass(frozen=True)
class BlockScene:
    """Convex blocks under gravity.

    Attributes
    ----------
    name : of the file
    vertices : per block its corners (n, 3) [m]
    faces : per block its faces, corner indices counter-clockwise seen from outside
    support : (nb,) blocks that never move
    friction : Coulomb's μ everywhere [-]
    density : of all blocks [kg/m³]
    gravity : downwards, along -z [m/s²]
    """

    name: str
    vertices: tuple[Array, ...]
    faces: tuple[tuple[tuple[int, ...], ...], ...]
    support: Bools
    friction: float = 0.5
    density: float = _DENSITY
    gravity: float = 9.81


def list_scenes(folder: Path, only: tuple[str, ...] = ()) -> list[Path]:
    """Return the scene files of a folder, small ones first.

    Raises
    ------
    UsageError : if there are none, or one that is asked for is missing
    """
    if not folder.is_dir():
        raise UsageError("no such folder", where=str(folder), remedy="name the folder with the .npz scenes")
    files = {
        path.stem: path for path in sorted(folder.glob("*.npz"), key=lambda p: (p.stat().st_size, p.name))
    }
    missing = [name for name in only if name not in files]
    if missing or not files:
        raise UsageError(
            f"no scene {', '.join(missing)}" if missing else "no .npz files",
            where=str(folder),
            remedy=f"it has {', '.join(files)}" if files else "name the folder with the scenes",
        )
    return [path for name, path in files.items() if not only or name in only]


def read_scene(path: Path) -> BlockScene:
    """Read `verts` (nv, 3) and `vptr`, `faces` (nf, 4) and `fptr`, `support`, `friction`, `density`, `gravity`."""
    with np.load(path) as data:
        try:
            verts, vptr, faces, fptr = (data[key] for key in ("verts", "vptr", "faces", "fptr"))
            return BlockScene(
                path.stem,
                tuple(verts[a:b].astype(float) for a, b in itertools.pairwise(vptr)),
                tuple(
                    tuple(tuple(int(i) for i in face) for face in faces[a:b])
                    for a, b in itertools.pairwise(fptr)
                ),
                data["support"].astype(bool),
                *(float(data[key]) for key in ("friction", "density", "gravity")),
            )
        except KeyError as missing:
            remedy = "see benchmarks/README.md for what a scene holds"
            raise UsageError(f"{missing.args[0]}", where=str(path), remedy=remedy) from None


def write_scene(scene: BlockScene, path: Path) -> None:
    """Write what `read_scene` reads; all faces have the same number of corners."""
    sizes = [len(vertices) for vertices in scene.vertices], [len(faces) for faces in scene.faces]
    vptr, fptr = (np.concatenate([[0], np.cumsum(size)]) for size in sizes)
    np.savez(
        path,
        verts=np.concatenate(scene.vertices),
        vptr=vptr,
        faces=np.array([face for faces in scene.faces for face in faces]),
        fptr=fptr,
        support=scene.support,
        friction=scene.friction,
        density=scene.density,
        gravity=scene.gravity,
    )


def engine_scene(
    scene: BlockScene, step: float, theta: float, tolerance: float, sweeps: int, sweeping: bool = False
) -> Scene:
    """Return the same scene for `mechanics`, with four contact points for each pair of faces, as LMGC90 has them.

    `sweeping`: solve by Gauss–Seidel alone.
    """
    material = Material("stone", scene.density, young=1e10, poisson=0.2)
    blocks = tuple(
        Block(f"b{n}", vertices, faces, material, Fidelity.FIXED if fixed else Fidelity.RIGID)
        for n, (vertices, faces, fixed) in enumerate(
            zip(scene.vertices, scene.faces, scene.support, strict=True)
        )
    )
    return Scene(
        scene.name,
        blocks,
        gravity=(0.0, 0.0, -scene.gravity),
        contact=ContactSettings(law=DryJoint(friction=scene.friction)),
        time=TimeSettings(step=step, theta=theta, stop_at_equilibrium=False),
        solver=SolverSettings(
            Method.NSGS if sweeping else Method.AUTO, tolerance=tolerance, max_iterations=sweeps
        ),
    )


def running_bond(bricks: int, courses: int, friction: float = 0.5, density: float = _DENSITY) -> BlockScene:
    """Return a wall `bricks` long and `courses` high, half bricks at the edges of odd courses, on a fixed slab."""
    length, height, depth = _BRICK
    cells = [(-length / 2, (bricks + 0.5) * length, -height, 0.0)]
    for course in range(courses):
        bottom = course * height
        cells += [(a, b, bottom, bottom + height) for a, b in pairwise(_cuts(bricks, course % 2 == 1))]
    corners = tuple(box_corners((x0, 0.0, z0), (x1, depth, z1)) for x0, x1, z0, z1 in cells)
    support = np.arange(len(cells)) < 1
    faces = (BOX_FACES,) * len(cells)
    return BlockScene(f"wall_{bricks}x{courses}", corners, faces, support, friction, density)


def rigid_scenes() -> tuple[BlockScene, ...]:
    """Return the columns, arches and walls on which rigid engines are compared; small ones first."""
    scenes = {f"column_{n}": _column(n) for n in (10, 50)} | {f"arch_{n}": _arch(n) for n in (15, 45)}
    scenes |= {f"wall_{n}x{n}": _wall(n) for n in (10, 20, 40)}
    named = (
        BlockScene(name, tuple(blocks), (BOX_FACES,) * len(blocks), np.arange(len(blocks)) < fixed)
        for name, (blocks, fixed) in scenes.items()
    )
    return tuple(sorted(named, key=lambda scene: len(scene.vertices)))


def _column(count: int) -> tuple[list[Array], int]:
    """Blocks of 0.5 × 0.5 × 0.25 m one upon the other on a slab; corners of each, and how many are fixed."""
    blocks = [box_corners((-0.5, -0.5, -0.2), (0.5, 0.5, 0.0))]
    blocks += [box_corners((-0.25, -0.25, 0.25 * k), (0.25, 0.25, 0.25 * (k + 1))) for k in range(count)]
    return blocks, 1


def _arch(count: int) -> tuple[list[Array], int]:
    """Voussoirs 0.3 m thick and 0.5 m deep on a semicircle of 2 m, on two abutments."""
    blocks = [box_corners((x - 0.25, -0.35, -0.3), (x + 0.25, 0.35, 0.0)) for x in (-2.0, 2.0)]
    ring = ((1.85, -0.25), (1.85, 0.25), (2.15, 0.25), (2.15, -0.25))
    cuts = pairwise(np.linspace(np.pi, 0.0, count + 1).tolist())
    blocks += [np.array([(r * np.cos(a), y, r * np.sin(a)) for a in ends for r, y in ring]) for ends in cuts]
    return blocks, 2


def _wall(count: int) -> tuple[list[Array], int]:
    """Courses of bricks of 0.30 × 0.15 × 0.10 m, as many as a course has, half bricks at the edges, on a slab."""
    length, height, depth = _BRICK
    blocks = [box_corners((-0.1, -0.1, -0.2), (count * length + 0.1, depth + 0.1, 0.0))]
    for course in range(count):
        low, high = course * height, (course + 1) * height
        cuts = _cuts(count, course % 2 == 1).tolist()
        blocks += [box_corners((a, 0.0, low), (b, depth, high)) for a, b in pairwise(cuts)]
    return blocks, 1


def _cuts(bricks: int, halves: bool) -> Array:
    """Ends of the bricks of a course, with half bricks at its edges or without [m]."""
    joints: Array = _BRICK[0] * np.arange(bricks + 1.0)
    return np.concatenate([[0.0], joints[:-1] + _BRICK[0] / 2, joints[-1:]]) if halves else joints


# --- tall and heavy scenes, and the problem of their first step ---


def column(densities: Sequence[float] | Array) -> list[Block]:
    """Return blocks of 0.5 × 0.5 × 0.25 m, one on the other, from the lowest up [kg/m³]."""
    boxes = [
        _rigid(f"B{n}", (0, 0, 0.25 * n), (0.5, 0.5, 0.25 * (n + 1)), float(density))
        for n, density in enumerate(densities)
    ]
    return [_ground(), *boxes]


def thick_wall(bricks: int, courses: int, leaves: int = 3) -> list[Block]:
    """Return leaves of bricks of 0.3 × 0.15 × 0.1 m side by side, head joints staggered by course and by leaf."""
    boxes = [
        _rigid(
            f"{course}-{leaf}-{n}", (a, 0.15 * leaf, 0.1 * course), (b, 0.15 * (leaf + 1), 0.1 * (course + 1))
        )
        for course in range(courses)
        for leaf in range(leaves)
        for n, (a, b) in enumerate(pairwise(_cuts(bricks, (course + leaf) % 2 == 1)))
    ]
    return [_ground(), *boxes]


def _ground() -> Block:
    return _rigid("ground", (-20, -20, -1), (20, 20, 0), fidelity=Fidelity.FIXED)


def _rigid(
    code: str,
    low: Sequence[float],
    high: Sequence[float],
    density: float = _DENSITY,
    fidelity: Fidelity = Fidelity.RIGID,
) -> Block:
    return box(code, low, high, Material(f"stone {density:.3g}", density, 1e10, 0.2), fidelity=fidelity)


def first_problem(blocks: Sequence[Block], friction: float = 0.6, tilt: float = 0.0) -> ContactProblem:
    """Return the contact problem of the first step of 1 ms; `tilt` of the ground about y [°]."""
    angle = np.radians(tilt)
    return problem_of(
        Scene(
            "tall",
            tuple(blocks),
            gravity=(9.81 * float(np.sin(angle)), 0.0, -9.81 * float(np.cos(angle))),
            contact=ContactSettings(DryJoint(friction)),
            time=TimeSettings(step=1e-3, theta=0.5, stop_at_equilibrium=False),
        )
    )


def problem_of(scene: Scene) -> ContactProblem:
    """Return the contact problem of the first step of a scene."""
    taken: list[ContactProblem] = []

    def take(problem: ContactProblem, start: ContactStart) -> ContactSolution:
        taken.append(problem)
        return ContactSolution(start.impulse, start.velocity, 0, 0.0, True)

    model, start = build_model(scene)
    Simulation(model, start, solver=take).step()
    return taken[0]


# --- deformable walls ---


def wall_scene(
    bricks: int,
    courses: int,
    element: Element,
    start: Start,
    size: float = _BRICK[0] / 4,
    step: float = 1e-4,
    theta: float = 0.505,
    duration: float = 1.0,
    base: bool = True,
) -> Scene:
    """Return a deformable running bond on an elastic base that is held at its bottom, or on rigid ground.

    Head joints are open, μ = 0.5.
    """
    length, height, depth = _BRICK
    wide = bricks * length
    cells = [("base", 0.0, wide, 0)] if base else []
    for row in range(len(cells), courses + len(cells)):
        cells += [
            (f"{row}-{k + 1}", a + _HEAD_JOINT / 2, b - _HEAD_JOINT / 2, row)
            for k, (a, b) in enumerate(pairwise(_cuts(bricks, row % 2 == 0)))
        ]
    mesh: dict[str, Any] = {"mesh_size": size, "element": element}
    blocks = [
        box("ground", (0.0, 0.0, -height), (wide, depth, 0.0), _ELASTIC, fidelity=Fidelity.FIXED, **mesh)
    ]
    blocks += [
        box(
            code,
            (low, 0.0, row * height),
            (high, depth, (row + 1) * height),
            _ELASTIC,
            fidelity=Fidelity.DEFORMABLE,
            **mesh,
        )
        for code, low, high, row in cells
    ]
    held = (LawRule(frozenset({"ground"}), frozenset({"base"}), _GLUE),) if base else ()
    return Scene(
        f"deformable wall {bricks} x {courses}",
        tuple(blocks),
        contact=ContactSettings(DryJoint(0.5), rules=held, alert_distance=_HEAD_JOINT / height / 2),
        time=TimeSettings(step, theta, duration, start=start),
    )


# --- disks ---


def disk_box(columns: int, rows: int, radius: float = 0.01, sweeps: int = 2000) -> PlanarScene:
    """Return disks in hexagonal packing, `columns` wide and `rows` high, in a box that just holds them."""
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
