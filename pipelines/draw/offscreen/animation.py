"""Animation of a motion as GIF, drawn off screen by PyVista."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.arrays import Array, Ints
from pipelines.draw.offscreen.jobs import run_job
from pipelines.draw.offscreen.parts import LIGHT, PLAIN, SIZE, add_edges, mesh_of, new_plotter, place_camera

_SIZE = tuple(side // 2 for side in SIZE)  # of a picture [px]
_COLOURS = 64  # of the file's palette
_LAST = 8  # the last instant stands as long as so many others


@dataclass(frozen=True)
class MovingSurface:
    """Surfaces of all stones in several instants.

    Attributes
    ----------
    points : (nf, n, 3) [m]
    triangles : (nt, 3)
    edges : (ne, 2)
    times : (nf,) [s]
    """

    points: Array
    triangles: Ints
    edges: Ints
    times: Array


def draw(surface: MovingSurface, path: Path, job: dict[str, Any]) -> None:
    """Draw all instants as one GIF; `job` has title, towards (to the viewer), up, and the seconds between pictures."""
    import pyvista
    from PIL import Image

    pictures = []
    everywhere = surface.points.reshape(-1, 3)
    for points, time in zip(surface.points, surface.times.tolist(), strict=True):
        plotter = new_plotter(pyvista)
        plotter.window_size = list(_SIZE)
        plotter.add_mesh(mesh_of(pyvista, points, surface.triangles), color=PLAIN, **LIGHT)
        place_camera(pyvista, plotter, everywhere, np.array(job["towards"]), np.array(job["up"]))
        add_edges(pyvista, plotter, points, surface.edges)
        plotter.add_text(
            f"{job['title']}\nt = {time:.3g} s", position="upper_left", font_size=9, color="#222222"
        )
        pictures.append(Image.fromarray(plotter.screenshot(None, return_img=True)).quantize(_COLOURS))
        plotter.close()
    pause = round(1e3 * job["pause"])
    pauses = [pause] * (len(pictures) - 1) + [pause * _LAST]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=pauses, loop=0, optimize=True)


if __name__ == "__main__":
    sys.exit(run_job(MovingSurface, draw))
