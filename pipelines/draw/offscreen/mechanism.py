"""Pictures of mechanisms, drawn off screen by PyVista."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from pipelines.draw.catalogue import PICTURES, READABLE
from pipelines.draw.offscreen.jobs import run_job
from pipelines.draw.offscreen.parts import (
    Colouring,
    DrawnResultants,
    add_coloured,
    add_edges,
    add_glass,
    add_resultants,
    mesh_of,
    new_plotter,
    place_camera,
    save_picture,
)

_PALETTE = ("YlOrRd", READABLE)  # colour map, and the part of it that is used
_NOTE = "As the stones begin to move, exaggerated; glass: where they stand"


@dataclass(frozen=True)
class MechanismSurface:
    """Stones where they stand, where mechanisms take them, and the forces in their joints at the limits.

    Attributes
    ----------
    points : (n, 3) corners [m]
    moved : (k, n, 3) the same in each mechanism [m]
    triangles : (nt, 3)
    edges : (ne, 2)
    places, forces : (k, nj, 3) resultants of all joints at each limit, see `DrawnResultants`; NaN without pressure
    in_kern : (k, nj)
    """

    points: Array
    moved: Array
    triangles: Ints
    edges: Ints
    places: Array
    forces: Array
    in_kern: Bools


def draw(surface: MechanismSurface, path: Path, job: dict[str, Any]) -> None:
    """Draw one picture as PNG; `job` has number, whether it shows forces, title, towards (to the viewer) and up."""
    import pyvista

    plotter = new_plotter(pyvista)
    if job["forces"]:
        _draw_forces(pyvista, plotter, surface, path, job)
    else:
        _draw_motion(pyvista, plotter, surface, path, job)


def _draw_forces(
    pyvista: Any, plotter: Any, surface: MechanismSurface, path: Path, job: dict[str, Any]
) -> None:
    number = job["number"]
    pressed = np.isfinite(surface.places[number]).all(axis=1)
    add_glass(pyvista, plotter, surface.points, surface.triangles)
    rows = (values[number][pressed] for values in (surface.places, surface.forces, surface.in_kern))
    add_resultants(pyvista, plotter, surface.points, DrawnResultants(*rows))
    place_camera(pyvista, plotter, surface.points, np.array(job["towards"]), np.array(job["up"]))
    add_edges(pyvista, plotter, surface.points, surface.edges)
    save_picture(plotter, path, f"{job['title']}\nAt the limit", PICTURES["resultants"].note)


def _draw_motion(
    pyvista: Any, plotter: Any, surface: MechanismSurface, path: Path, job: dict[str, Any]
) -> None:
    moved = surface.moved[job["number"]]
    motion = np.linalg.norm(moved - surface.points, axis=1)
    share = motion / max(float(motion.max()), 1e-300)
    mesh = mesh_of(pyvista, moved, surface.triangles)
    mesh.point_data["value"] = share
    add_coloured(plotter, mesh, Colouring(share, "Way over the longest [-]", 1.0, 5, False, _PALETTE))
    add_glass(pyvista, plotter, surface.points, surface.triangles)
    both = np.concatenate([surface.points, moved])
    place_camera(pyvista, plotter, both, np.array(job["towards"]), np.array(job["up"]))
    add_edges(pyvista, plotter, moved, surface.edges)
    save_picture(plotter, path, f"{job['title']}\n{_NOTE}", "")


if __name__ == "__main__":
    sys.exit(run_job(MechanismSurface, draw))
