"""Pictures of mechanisms: the stones where they were, and displaced along their velocities."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.limit.assembly import Assembly
from mechanics.limit.limit_load import Mechanism
from mechanics.scene.scene import Block
from pipelines.arrays import Array
from pipelines.draw.offscreen.mechanism import MechanismSurface
from pipelines.draw.pictures import draw_apart
from survey.geometry.solids import Solid
from survey.geometry.watertight import triangulate

__all__ = ["draw_mechanism"]

_WAY = 0.06  # of the fastest corner over the extent of the scene [-]


def draw_mechanism(
    folder: Path,
    blocks: Sequence[Block],
    on: Assembly,
    mechanisms: Sequence[Mechanism],
    titles: Sequence[str],
    towards: Array,
) -> list[str]:
    """Draw one picture for each mechanism that moves, into an existing folder; return the file names.

    Raises
    ------
    MissingLibraryError : VTK cannot be loaded or cannot draw on this machine
    """
    corners = np.concatenate([block.vertices for block in blocks])
    starts = np.cumsum([0, *(len(block.vertices) for block in blocks)])
    owner = np.repeat(np.arange(len(blocks)), np.diff(starts))
    triangles = np.concatenate(
        [
            triangulate(Solid(block.code, block.vertices, block.faces)) + start
            for block, start in zip(blocks, starts[:-1], strict=True)
        ]
    ).astype(np.int64)
    edges = np.concatenate(
        [
            [
                (a + start, b + start)
                for face in block.faces
                for a, b in zip(face, face[1:] + face[:1], strict=True)
            ]
            for block, start in zip(blocks, starts[:-1], strict=True)
        ]
    )
    way = _WAY * float(np.ptp(corners, axis=0).max())
    moved: list[Array] = []
    pictures: list[dict[str, Any]] = []
    for number, (one, title) in enumerate(zip(mechanisms, titles, strict=True), start=1):
        if not one.velocity.any():
            continue
        arm = corners - on.state.centre[owner]
        ways = one.velocity[owner, :3] + np.cross(one.velocity[owner, 3:], arm)
        ways *= way / max(float(np.linalg.norm(ways, axis=1).max()), 1e-300)
        pictures.append(
            {
                "path": str((folder / f"mechanism-{number}.png").absolute()),
                "number": len(moved),
                "title": title,
                "towards": towards.tolist(),
                "up": (-np.asarray(on.model.gravity(0.0))).tolist(),
            }
        )
        moved.append(corners + ways)
    if pictures:
        surface = MechanismSurface(corners, np.stack(moved), triangles, np.sort(edges, axis=1))
        draw_apart("pipelines.draw.offscreen.mechanism", surface, pictures)
    return [Path(one["path"]).name for one in pictures]
