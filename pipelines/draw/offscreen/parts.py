"""Common parts of the pictures drawn by PyVista: jobs, sheet, camera, edges, colours and their scale."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor, log10
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np

from ground.units import MILLI
from mechanics.arrays import Array, Bools, Ints
from survey.conventions import FINEST

_INSIDE, _OUTSIDE = "#1f5f8b", "#c4302b"  # resultants within and outside the kern
_LONGEST = 0.12  # the longest stroke of a resultant, over the wall's diagonal
SIZE = (1600, 1300)
_ROW, _LINES = 84, 3  # characters in a line of a title, and lines for which there is room
_EDGE = "#3a3733"
PLAIN, INK = "#c9c6c0", "#222222"
LIGHT: dict[str, Any] = {"ambient": 0.55, "diffuse": 0.5, "specular": 0.0}
FINEST_SCALE = FINEST / MILLI  # shortest scale of movements and widths: less is not worth a colour [mm]
_ROBUST = 98.0  # percentile of the values at which a colour scale ends
_AZIMUTH = np.deg2rad(-24.0)
OBLIQUELY = np.deg2rad(14.0)
"""Elevation of the viewer above a wall, so that its depth can be seen [rad]."""


@dataclass(frozen=True)
class Colouring:
    """Values of a quantity with their colour scale.

    Attributes
    ----------
    values : (n,) in the unit of the scalar bar; NaN is drawn grey
    title : of the scalar bar, with unit
    top : end of the scale
    intervals : number of intervals of the scalar bar, so that its labels are round numbers
    saturated : whether some values lie above the end
    palette : name of a matplotlib colour map, and the part of it that is used
    """

    values: Array
    title: str
    top: float
    intervals: int
    saturated: bool
    palette: tuple[str, float]


@dataclass(frozen=True)
class DrawnResultants:
    """Resultants of joints.

    Attributes
    ----------
    places : (r, 3) where they meet the pressed joints [m]
    forces : (r, 3) on one of the two stones [N]
    in_kern : (r,) whether they are within the kern
    """

    places: Array
    forces: Array
    in_kern: Bools


def nice_ceiling(value: float) -> tuple[float, int]:
    """Round a positive value up; return the round number, and the count of round intervals that divide it."""
    tenth = 10.0 ** (floor(log10(value)) - 1)
    scales = [(count * step, count) for step in (2, 3, 5, 10, 20) for count in (4, 5, 6)]
    end, intervals = min(scale for scale in scales if scale[0] * tenth * (1.0 + 1e-9) >= value)
    return end * tenth, intervals


def robust_ceiling(values: Array, finest: float) -> tuple[float, int]:
    """Round up the 98th percentile of the finite values, at least `finest`, like `nice_ceiling`."""
    finite = values[np.isfinite(values)]
    return nice_ceiling(max(float(np.percentile(finite, _ROBUST)) if len(finite) else 0.0, finest))


def new_plotter(pyvista: Any) -> Any:
    """Make an empty picture, without a window."""
    plotter = pyvista.Plotter(off_screen=True, window_size=list(SIZE), lighting="none")
    plotter.set_background("white")
    return plotter


def save_picture(plotter: Any, path: Path, title: str, note: str) -> None:
    """Write a picture as PNG, with a title above and an optional note below."""
    lines = [part for line in title.splitlines() for part in wrap(line, _ROW) or [""]]
    size = 15 if len(lines) <= _LINES else 12
    if size < 15:
        lines = [part for line in title.splitlines() for part in wrap(line, _ROW * 15 // size) or [""]]
    plotter.add_text("\n" + "\n".join(lines), position="upper_edge", font_size=size, color=INK)
    if note:
        plotter.add_text("\n".join(wrap(note, _ROW)) + "\n", position="lower_edge", font_size=15, color=INK)
    plotter.enable_anti_aliasing("ssaa")
    plotter.screenshot(str(path))
    plotter.close()


def add_coloured(plotter: Any, mesh: Any, colours: Colouring, *, lit: bool = True) -> None:
    """Add a mesh in the colours of its "value", with their scale; without light the colours are exact."""
    light = LIGHT if lit else {"lighting": False}
    plotter.add_mesh(
        mesh,
        scalars="value",
        cmap=_palette(*colours.palette),
        clim=(0.0, colours.top),
        show_scalar_bar=False,
        **light,
    )
    _add_scalar_bar(plotter, colours)


def add_glass(pyvista: Any, plotter: Any, points: Array, triangles: Ints) -> None:
    """Add the stones as glass, so that their joints can be seen."""
    plotter.add_mesh(mesh_of(pyvista, points, triangles), color=PLAIN, opacity=0.15, lighting=False)


def add_edges(pyvista: Any, plotter: Any, points: Array, edges: Ints) -> None:
    """Add the edges of the stones, slightly in front of their faces so that they are not half hidden."""
    toward = plotter.camera.position - np.array(plotter.camera.focal_point)
    lines = pyvista.PolyData()
    lines.points = points + 1e-4 * toward
    lines.lines = np.column_stack([np.full(len(edges), 2), edges]).ravel()
    plotter.add_mesh(lines, color=_EDGE, line_width=2.5, lighting=False)


def add_resultants(pyvista: Any, plotter: Any, points: Array, shown: DrawnResultants) -> None:
    """Add a stroke through each joint of a scene with these points, along its resultant and proportional to it."""
    force = np.linalg.norm(shown.forces, axis=1)
    reach = _LONGEST * float(np.linalg.norm(np.ptp(points, axis=0)))
    half = 0.5 * reach * shown.forces / force.max(initial=1e-300)
    for rows, colour in ((shown.in_kern, _INSIDE), (~shown.in_kern, _OUTSIDE)):
        if not rows.any():
            continue
        ends = np.stack([shown.places[rows] + sign * half[rows] for sign in (-1, 1)], axis=1)
        count = len(ends)
        strokes = pyvista.PolyData()
        strokes.points = ends.reshape(-1, 3)
        strokes.lines = np.column_stack([np.full(count, 2), np.arange(2 * count).reshape(-1, 2)]).ravel()
        plotter.add_mesh(strokes, color=colour, line_width=6.0, lighting=False)
        heads = pyvista.PolyData(shown.places[rows])
        plotter.add_mesh(heads, color=colour, point_size=11.0, render_points_as_spheres=True, lighting=False)


def _palette(name: str, part: float) -> Any:
    """Return the lighter part of a colour map: the edges of stones cannot be seen on its darkest part."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps[name](np.linspace(0.0, part, 256)))


def mesh_of(pyvista: Any, points: Array, triangles: Ints) -> Any:
    """Make a PyVista mesh of triangles."""
    return pyvista.PolyData(points, faces=np.column_stack([np.full(len(triangles), 3), triangles]).ravel())


def fan_polygons(polygons: Sequence[Array]) -> tuple[Array, Ints, Ints]:
    """Divide convex polygons, (k, 3) each, into triangles; return corners, triangles and the polygon of each."""
    starts = np.cumsum([0, *map(len, polygons)]).tolist()
    fans = [
        [(start, start + k, start + k + 1) for k in range(1, len(polygon) - 1)]
        for start, polygon in zip(starts, polygons, strict=False)
    ]
    return (
        np.concatenate([*polygons, np.zeros((0, 3))]),
        np.array([triangle for fan in fans for triangle in fan], dtype=np.int64).reshape(-1, 3),
        np.repeat(np.arange(len(fans)), [len(fan) for fan in fans]),
    )


def _add_scalar_bar(plotter: Any, colours: Colouring) -> None:
    step = colours.top / colours.intervals
    decimals = max(0, ceil(-log10(step) - 1e-9))
    decimals += round(step * 10**decimals, 6) % 1 > 0
    plotter.add_scalar_bar(
        title=colours.title + (" (and above)" if colours.saturated else "") + "\n",
        n_labels=colours.intervals + 1,
        fmt=f"%.{decimals}f",
        color=INK,
        title_font_size=26,
        label_font_size=24,
        position_x=0.25,
        position_y=0.03,
        width=0.5,
        height=0.085,
    )


def place_camera(
    pyvista: Any, plotter: Any, points: Array, towards: Array, up: Array, elevation: float = OBLIQUELY
) -> None:
    """Look at the middle of the wall from its outside, a little from the side and from above.

    Parameters
    ----------
    points : (n, 3) that must be in the picture [m]
    towards, up : (3,) to the viewer, and upwards; not parallel
    elevation : of the viewer above the middle, negative below [rad]
    """
    up = up / np.linalg.norm(up)
    front = towards - (towards @ up) * up
    front /= np.linalg.norm(front)
    right = np.cross(up, front)
    level = np.cos(_AZIMUTH) * front + np.sin(_AZIMUTH) * right
    view = np.cos(elevation) * level + np.sin(elevation) * up
    side = np.cross(up, view)
    side /= np.linalg.norm(side)
    top = np.cross(view, side)
    across, along = points @ side, points @ top
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    middle = middle + side * ((across.min() + across.max()) / 2 - middle @ side)
    middle = middle + top * ((along.min() + along.max()) / 2 - middle @ top)
    width, height = np.ptp(across), np.ptp(along)
    # room above for the title and below for the scalar bar: the wall takes 74 % of the height
    visible = max(height / 0.74, width / 0.92 * SIZE[1] / SIZE[0])
    camera = plotter.camera
    camera.parallel_projection = True
    camera.parallel_scale = visible / 2
    focus = middle - top * 0.03 * visible
    reach = 10.0 * float(np.linalg.norm(np.ptp(points, axis=0)))
    camera.focal_point, camera.position, camera.up = focus, focus + reach * view, top
    camera.clipping_range = (reach / 10, reach * 2)
    for direction, strength in ((view + 0.6 * top - 0.5 * side, 0.85), (view + 0.2 * side, 0.35)):
        plotter.add_light(
            pyvista.Light(position=focus + reach * direction, focal_point=focus, intensity=strength)
        )
