"""Scenes of rigid blocks as the benchmarks store them, read and turned into scenes of the engine."""

import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import (
    Block,
    ContactSettings,
    Fidelity,
    Method,
    Scene,
    SolverSettings,
    TimeSettings,
)
from mechanics.stones.materials import Material
from moma.errors import UsageError

__all__ = ["BlockScene", "engine_scene", "list_scenes", "read_scene", "write_scene"]


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
    friction: float
    density: float
    gravity: float


def list_scenes(folder: Path, only: tuple[str, ...] = ()) -> list[Path]:
    """The scene files of a folder, small ones first.

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
                float(data["friction"]),
                float(data["density"]),
                float(data["gravity"]),
            )
        except KeyError as missing:
            raise UsageError(
                f"{missing.args[0]}",
                where=str(path),
                remedy="see benchmarks/README.md for what a scene holds",
            ) from None


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
    """The same scene for `mechanics`, with four contact points for each pair of faces, as LMGC90 has them.

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
