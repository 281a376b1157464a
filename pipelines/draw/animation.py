"""`motion.gif`: a short animation of a run."""

from pathlib import Path

import numpy as np

from mechanics.arrays import Array
from mechanics.results.result import Result
from pipelines.draw.offscreen.animation import MovingSurface
from pipelines.draw.offscreen.surfaces import support_motion, wall_surface
from pipelines.draw.pictures import draw_apart

MOTION = "motion.gif"
"""Name of the file."""

_MAX_PICTURES = 60  # pictures
_LONG = 5.0  # time that they take [s]
_SEEN = 0.03  # largest displacement as drawn over the extent of the scene, where less would not be seen [-]


def draw_motion(result: Result, folder: Path, towards: Array) -> str:
    """Draw the motion as GIF, seen from the side `towards`; return the file name.

    Displacements are exaggerated where they would not be seen, by a round factor that the title states, and count from
    the supports where these move as one.

    Raises
    ------
    MissingLibraryError : VTK cannot be loaded or cannot draw on this machine
    """
    rows = np.unique(
        np.linspace(0, len(result.frames) - 1, min(len(result.frames), _MAX_PICTURES)).round().astype(int)
    )
    frames = [result.frames[row] for row in rows.tolist()]
    surface = wall_surface(result)
    start = np.concatenate([body.reference for body in result.bodies])
    moved = np.stack([np.concatenate(frame.positions) - start for frame in frames])
    moved -= np.stack([support_motion(result.bodies, frame.positions) for frame in frames])[:, None]
    size = float(np.ptp(start, axis=0).max())
    largest = float(np.linalg.norm(moved, axis=2).max())
    factor = 1.0 if largest > _SEEN * size or largest == 0.0 else float(f"{_SEEN * size / largest:.1g}")
    up = -np.array(result.scene.gravity)
    job = {
        "path": str((folder / MOTION).absolute()),
        "title": f"{result.scene.name}: displacements × {factor:g}",
        "towards": np.asarray(towards).tolist(),
        "up": up.tolist() if up.any() else [0.0, 0.0, 1.0],
        "pause": _LONG / max(len(frames), 1),
    }
    moving = MovingSurface(
        start + factor * moved, surface.triangles, surface.edges, np.array([frame.time for frame in frames])
    )
    draw_apart("pipelines.draw.offscreen.animation", moving, [job])
    return MOTION
