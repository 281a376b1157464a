"""Pictures of mechanisms: stones displaced along their velocities, and the resultants of their joints."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.limit.assembly import RigidAssembly
from mechanics.limit.joints import Resultants
from mechanics.limit.limit_load import Mechanism
from mechanics.scene.scene import Block
from pipelines.draw.loading import DRAWN_DISPLACEMENT
from pipelines.draw.offscreen.mechanism import MechanismSurface
from pipelines.draw.pictures import draw_apart
from survey.geometry.solids import Solid
from survey.geometry.watertight import triangulate


def draw_mechanisms(
    folder: Path,
    blocks: Sequence[Block],
    on: RigidAssembly,
    limits: Sequence[tuple[str, Mechanism, Resultants | None]],
    towards: Array,
) -> list[str]:
    """Draw each mechanism that moves, and the resultants of the joints at its limit; return the file names.

    Parameters
    ----------
    folder : of the pictures, which exists
    blocks, on : the stones
    limits : title, mechanism and resultants; None: there are none
    towards : (3,) to the viewer

    Raises
    ------
    MissingLibraryError : VTK cannot be loaded or cannot draw on this machine
    """
    corners = np.concatenate([block.vertices for block in blocks])
    owner = np.repeat(np.arange(len(blocks)), [len(block.vertices) for block in blocks])
    way = DRAWN_DISPLACEMENT * float(np.ptp(corners, axis=0).max())
    moved, places, forces, kerns = [], [], [], []
    pictures: list[dict[str, Any]] = []
    arm = corners - on.state.centre[owner]
    for number, (title, mechanism, carried) in enumerate(limits, start=1):
        velocity = mechanism.velocity[owner]
        ways = velocity[:, :3] + np.cross(velocity[:, 3:], arm)
        ways *= way / max(float(np.linalg.norm(ways, axis=1).max()), 1e-300)
        for name, there in (("mechanism", mechanism.velocity.any()), ("forces", carried is not None)):
            if there:
                pictures.append(
                    {
                        "path": str((folder / f"{name}-{number}.png").absolute()),
                        "number": number - 1,
                        "forces": name == "forces",
                        "title": title,
                        "towards": towards.tolist(),
                        "up": (-np.asarray(on.model.gravity(0.0))).tolist(),
                    }
                )
        moved.append(corners + ways)
        empty = np.full((len(on.joints.bodies), 3), np.nan)
        places.append(empty if carried is None else carried.place)
        forces.append(empty if carried is None else carried.force)
        kerns.append(np.zeros(len(empty), dtype=bool) if carried is None else carried.kern <= 1.0)
    if pictures:
        triangles, edges = _triangles_and_edges(blocks)
        surface = MechanismSurface(
            corners,
            np.stack(moved),
            triangles,
            edges,
            np.stack(places),
            np.stack(forces),
            np.stack(kerns),
        )
        draw_apart("pipelines.draw.offscreen.mechanism", surface, pictures)
    return [Path(picture["path"]).name for picture in pictures]


def _triangles_and_edges(blocks: Sequence[Block]) -> tuple[Ints, Ints]:
    """Return the triangles (nt, 3) and the edges (ne, 2) of all stones, as numbers of their corners."""
    starts = np.cumsum([0, *(len(block.vertices) for block in blocks[:-1])])
    triangles = [
        triangulate(Solid(block.code, block.vertices, block.faces)) + start
        for block, start in zip(blocks, starts, strict=True)
    ]
    edges = [
        [
            (a + start, b + start)
            for face in block.faces
            for a, b in zip(face, face[1:] + face[:1], strict=True)
        ]
        for block, start in zip(blocks, starts, strict=True)
    ]
    return np.concatenate(triangles).astype(np.int64), np.sort(np.concatenate(edges), axis=1)
