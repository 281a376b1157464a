"""Pictures of closed joints in space, drawn off screen by PyVista."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.arrays import Array, Ints
from pipelines.draw.catalogue import READABLE
from pipelines.draw.offscreen.jobs import run_job
from pipelines.draw.offscreen.parts import (
    FINEST_SCALE,
    LIGHT,
    PLAIN,
    Colouring,
    add_coloured,
    add_edges,
    mesh_of,
    new_plotter,
    place_camera,
    robust_ceiling,
    save_picture,
)

_GAP = "#d55e00"
_OVERLAP = "#000000"
_BALL = 26.0  # diameter of a sign [px]
_MOVED = ("YlGnBu", READABLE)  # colour map, and the part of it that is used
_WIDTH = ("viridis_r", 1.0)


@dataclass(frozen=True)
class ClosingSurface:
    """Faces of the stones and of their joints, fanned into triangles.

    Attributes
    ----------
    points : (n, 3) corners of the stones [m]
    triangles, edges : (nt, 3) and (ne, 2) of the stones
    moved : (n,) distance by which each corner was moved [m]; NaN if unknown
    joint_points : (m, 3) corners of closed joints [m]
    joint_triangles : (k, 3)
    joint_width : (k,) of the joint of each triangle, as surveyed [m]
    gap_points : (p, 3) corners of open joints [m]
    gap_triangles : (q, 3)
    gaps, overlaps : (g, 3) and (o, 3) places [m]
    """

    points: Array
    triangles: Ints
    edges: Ints
    moved: Array
    joint_points: Array
    joint_triangles: Ints
    joint_width: Array
    gap_points: Array
    gap_triangles: Ints
    gaps: Array
    overlaps: Array


def draw(surface: ClosingSurface, path: Path, job: dict[str, Any]) -> None:
    """Draw one picture as PNG.

    Parameters
    ----------
    job : quantity ("moved" or "joints"), label of the scale, title, towards (to the viewer), elevation [rad]
    """
    import pyvista

    plotter = new_plotter(pyvista)
    if job["quantity"] == "moved":
        _add_stones(pyvista, plotter, surface, job["label"])
    else:
        _add_joints(pyvista, plotter, surface, job["label"])
    up = np.array([0.0, 0.0, 1.0])
    place_camera(pyvista, plotter, surface.points, np.array(job["towards"]), up, job["elevation"])
    add_edges(pyvista, plotter, surface.points, surface.edges)
    if job["quantity"] == "joints":
        _add_places(pyvista, plotter, surface)
    save_picture(plotter, path, job["title"], "")


def _add_stones(pyvista: Any, plotter: Any, surface: ClosingSurface, label: str) -> None:
    finite = np.isfinite(surface.moved)[surface.triangles].all(axis=1)
    if not finite.all():
        plotter.add_mesh(mesh_of(pyvista, surface.points, surface.triangles[~finite]), color=PLAIN, **LIGHT)
    if finite.any():
        mesh = mesh_of(pyvista, surface.points, surface.triangles[finite])
        mesh.point_data["value"] = 1e3 * surface.moved
        add_coloured(plotter, mesh, _colouring(1e3 * surface.moved, label, _MOVED))


def _add_joints(pyvista: Any, plotter: Any, surface: ClosingSurface, label: str) -> None:
    if len(surface.joint_triangles):
        mesh = mesh_of(pyvista, surface.joint_points, surface.joint_triangles)
        mesh.cell_data["value"] = 1e3 * surface.joint_width
        add_coloured(plotter, mesh, _colouring(1e3 * surface.joint_width, label, _WIDTH), lit=False)
    if len(surface.gap_triangles):
        gaps = mesh_of(pyvista, surface.gap_points, surface.gap_triangles)
        plotter.add_mesh(gaps, color=_GAP, lighting=False)


def _add_places(pyvista: Any, plotter: Any, surface: ClosingSurface) -> None:
    """Add balls at gaps and overlaps, well in front of the stones, so that none is hidden."""
    toward = np.array(plotter.camera.position) - np.array(plotter.camera.focal_point)
    for places, colour in ((surface.gaps, _GAP), (surface.overlaps, _OVERLAP)):
        if len(places):
            heads = pyvista.PolyData(places + 0.5 * toward)
            plotter.add_mesh(
                heads, color=colour, point_size=_BALL, render_points_as_spheres=True, lighting=False
            )


def _colouring(values: Array, label: str, palette: tuple[str, float]) -> Colouring:
    finite = values[np.isfinite(values)]
    end, intervals = robust_ceiling(values, FINEST_SCALE)
    saturated = bool(finite.max() > end)
    return Colouring(values, label, end, intervals, saturated, palette)


if __name__ == "__main__":
    sys.exit(run_job(ClosingSurface, draw))
