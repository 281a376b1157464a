"""Pictures of a result, drawn off screen by PyVista."""

import sys
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.draw.catalogue import PICTURES
from pipelines.draw.offscreen.jobs import run_job
from pipelines.draw.offscreen.parts import (
    LIGHT,
    PLAIN,
    Colouring,
    DrawnResultants,
    add_coloured,
    add_edges,
    add_glass,
    add_resultants,
    mesh_of,
    new_plotter,
    nice_ceiling,
    place_camera,
    save_picture,
)
from pipelines.draw.offscreen.surfaces import WallSurface

_FIXED = "#a3a09a"


def colouring(surface: WallSurface, quantity: str, top: float | None) -> Colouring:
    """Choose values, scale and palette of one of FIELDS, or of the `pressure` of the joints' triangles.

    The scale ends at `top`, rounded up; without it, at the largest value.
    """
    picture = PICTURES[quantity]
    raw = surface.joint_pressure if quantity == "pressure" else surface.field(quantity)
    largest = float(np.nanmax(raw, initial=0.0))
    end, intervals = nice_ceiling(top or largest or 1.0)
    scale, unit = picture.unit_of(end)
    return Colouring(
        values=raw * scale,
        title=f"{picture.scale} [{unit}]" if unit else picture.scale,
        top=end * scale,
        intervals=intervals,
        saturated=largest > end * (1.0 + 1e-9),
        palette=picture.palette,
    )


def draw(surface: WallSurface, path: Path, job: dict[str, Any]) -> None:
    """Draw one picture as PNG; `job` has quantity, top, title, towards (to the viewer), up and optionally note."""
    import pyvista

    plotter = new_plotter(pyvista)
    if job["quantity"] == "resultants":
        add_glass(pyvista, plotter, surface.points, surface.triangles)
        add_resultants(
            pyvista,
            plotter,
            surface.points,
            DrawnResultants(surface.resultant_points, surface.resultants, surface.in_kern),
        )
    elif job["quantity"] == "pressure":
        add_glass(pyvista, plotter, surface.points, surface.triangles)
        _add_joints(pyvista, plotter, surface, colouring(surface, "pressure", job["top"]))
    else:
        _add_stones(pyvista, plotter, surface, colouring(surface, job["quantity"], job["top"]))
    place_camera(pyvista, plotter, surface.points, np.array(job["towards"]), np.array(job["up"]))
    add_edges(pyvista, plotter, surface.points, surface.edges)
    save_picture(plotter, path, job["title"], job.get("note", ""))


def _add_stones(pyvista: Any, plotter: Any, surface: WallSurface, colours: Colouring) -> None:
    finite = np.isfinite(colours.values)[surface.triangles].all(axis=1) & ~surface.fixed
    for rows, colour in ((~finite & surface.fixed, _FIXED), (~finite & ~surface.fixed, PLAIN)):
        if rows.any():
            mesh = mesh_of(pyvista, surface.points, surface.triangles[rows])
            plotter.add_mesh(mesh, color=colour, **LIGHT)
    if finite.any():
        mesh = mesh_of(pyvista, surface.points, surface.triangles[finite])
        mesh.point_data["value"] = colours.values
        add_coloured(plotter, mesh, colours)


def _add_joints(pyvista: Any, plotter: Any, surface: WallSurface, colours: Colouring) -> None:
    mesh = mesh_of(pyvista, surface.joint_points, surface.joint_triangles)
    mesh.cell_data["value"] = colours.values
    add_coloured(plotter, mesh, colours)


if __name__ == "__main__":
    sys.exit(run_job(WallSurface, draw))
