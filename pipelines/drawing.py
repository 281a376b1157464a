"""Pictures of a wall, drawn off screen by PyVista.

This module runs in a process of its own (``python -m pipelines.drawing JOB.json``): a graphics library that
is missing or broken may end the process that uses it, and must not take the results along.
"""

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, floor, log10
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.surfaces import WallSurface, load_surface

__all__ = ["Colouring", "colouring", "draw", "nice_ceiling"]

Array = NDArray[np.float64]

_SIZE = (1600, 1300)
_PLAIN, _FIXED, _EDGE, _INK = "#c9c6c0", "#a3a09a", "#3a3733", "#222222"
_ROUND = {1.0: 5, 1.2: 6, 1.5: 5, 2.0: 4, 2.5: 5, 3.0: 6, 4.0: 4, 5.0: 5, 6.0: 6, 8.0: 4}  # end: intervals
_LIGHT = {"ambient": 0.55, "diffuse": 0.5, "specular": 0.0}
_INSIDE, _OUTSIDE = "#1f5f8b", "#c4302b"  # resultants within and outside the kern
_LONGEST = 0.12  # the longest stroke of a resultant, over the wall's diagonal
_AZIMUTH, _ELEVATION = np.deg2rad(-24.0), np.deg2rad(14.0)  # obliquely, so that depth is seen


@dataclass(frozen=True)
class Colouring:
    """How a quantity is shown.

    Attributes
    ----------
    values : (n,) in the unit of the scalar bar; NaN is drawn grey
    title : of the scalar bar, with unit
    top : end of the scale
    intervals : how many the scalar bar has between its labels, so that these are round numbers
    saturated : whether some values lie above the end
    palette : name of a matplotlib colour map, and how much of it is used
    """

    values: Array
    title: str
    top: float
    intervals: int
    saturated: bool
    palette: tuple[str, float]


def nice_ceiling(value: float) -> tuple[float, int]:
    """A round number that reaches a positive value, and how many round intervals divide it."""
    decade = 10.0 ** floor(log10(value))
    for step, intervals in _ROUND.items():
        if value <= step * decade * (1.0 + 1e-9):
            return step * decade, intervals
    return 10.0 * decade, _ROUND[1.0]


def colouring(surface: WallSurface, quantity: str, top: float | None) -> Colouring:
    """Values, scale and palette of one of FIELDS, or of the `pressure` of the joints' triangles.

    The scale ends at `top`, rounded up; without it, at the largest value.
    """
    title, unit_of, palette = _LOOKS[quantity]
    raw = surface.joint_pressure if quantity == "pressure" else surface.field(quantity)
    largest = float(np.nanmax(raw, initial=0.0))
    end, intervals = nice_ceiling(top or largest or 1.0)
    scale, unit = unit_of(end)
    return Colouring(
        values=raw * scale,
        title=f"{title} [{unit}]" if unit else title,
        top=end * scale,
        intervals=intervals,
        saturated=largest > end * (1.0 + 1e-9),
        palette=palette,
    )


def draw(surface: WallSurface, path: Path, job: dict[str, Any]) -> None:
    """Draw one picture as PNG; `job` has quantity, top, title, towards (to the viewer), up, and maybe a note."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=list(_SIZE), lighting="none")
    plotter.set_background("white")
    if job["quantity"] == "resultants":
        _add_glass(pyvista, plotter, surface)
        _add_resultants(pyvista, plotter, surface)
    elif job["quantity"] == "pressure":
        _add_glass(pyvista, plotter, surface)
        _add_joints(pyvista, plotter, surface, colouring(surface, "pressure", job["top"]))
    else:
        _add_stones(pyvista, plotter, surface, colouring(surface, job["quantity"], job["top"]))
    _place_camera(pyvista, plotter, surface.points, np.array(job["towards"]), np.array(job["up"]))
    _add_edges(pyvista, plotter, surface)
    plotter.add_text("\n" + job["title"], position="upper_edge", font_size=15, color=_INK)
    if job.get("note"):
        plotter.add_text(job["note"] + "\n", position="lower_edge", font_size=13, color=_INK)
    plotter.enable_anti_aliasing("ssaa")
    plotter.screenshot(str(path))
    plotter.close()


def _length_unit(largest: float) -> tuple[float, str]:
    if largest >= 0.1:
        return 1.0, "m"
    return (1e3, "mm") if largest >= 1e-4 else (1e6, "µm")


def _megapascals(_: float) -> tuple[float, str]:
    return 1e-6, "MPa"


def _pascals(largest: float) -> tuple[float, str]:
    return (1e-6, "MPa") if largest >= 1e5 else (1e-3, "kPa")


def _percent(_: float) -> tuple[float, str]:
    return 100.0, "%"


def _ratio(_: float) -> tuple[float, str]:
    return 1.0, ""


# of each quantity: title, factor and unit by the end of the scale, palette
_LOOKS: dict[str, tuple[str, Callable[[float], tuple[float, str]], tuple[str, float]]] = {
    "von_mises": ("Von Mises stress", _megapascals, ("inferno_r", 0.85)),
    "displacement": ("Displacement", _length_unit, ("viridis_r", 1.0)),
    "principal_tension": ("Largest principal stress, tension", _pascals, ("Reds", 1.0)),
    "principal_compression": ("Smallest principal stress, compression", _pascals, ("Blues", 1.0)),
    "utilisation": ("Stress over strength", _ratio, ("YlOrRd", 1.0)),
    "error": ("Estimated error of the stress", _percent, ("Purples", 1.0)),
    "pressure": ("Mean pressure of the joints", _pascals, ("inferno_r", 0.85)),
}


def _add_stones(pyvista: Any, plotter: Any, surface: WallSurface, colours: Colouring) -> None:
    known = np.isfinite(colours.values)[surface.triangles].all(axis=1) & ~surface.fixed
    for rows, colour in ((~known & surface.fixed, _FIXED), (~known & ~surface.fixed, _PLAIN)):
        if rows.any():
            mesh = _mesh(pyvista, surface.points, surface.triangles[rows])
            plotter.add_mesh(mesh, color=colour, **_LIGHT)
    if known.any():
        mesh = _mesh(pyvista, surface.points, surface.triangles[known])
        mesh.point_data["value"] = colours.values
        _add_coloured(plotter, mesh, colours)


def _add_joints(pyvista: Any, plotter: Any, surface: WallSurface, colours: Colouring) -> None:
    mesh = _mesh(pyvista, surface.joint_points, surface.joint_triangles)
    mesh.cell_data["value"] = colours.values
    _add_coloured(plotter, mesh, colours)


def _add_coloured(plotter: Any, mesh: Any, colours: Colouring) -> None:
    plotter.add_mesh(
        mesh,
        scalars="value",
        cmap=_palette(*colours.palette),
        clim=(0.0, colours.top),
        show_scalar_bar=False,
        **_LIGHT,
    )
    _add_scalar_bar(plotter, colours)


def _add_glass(pyvista: Any, plotter: Any, surface: WallSurface) -> None:
    """The stones, so that one sees what is in their joints."""
    mesh = _mesh(pyvista, surface.points, surface.triangles)
    plotter.add_mesh(mesh, color=_PLAIN, opacity=0.15, lighting=False)


def _add_resultants(pyvista: Any, plotter: Any, surface: WallSurface) -> None:
    """A stroke through each joint, along the resultant and as long as it is large."""
    force = np.linalg.norm(surface.resultants, axis=1)
    reach = _LONGEST * float(np.linalg.norm(np.ptp(surface.points, axis=0)))
    half = 0.5 * reach * surface.resultants / force.max(initial=1e-300)
    for rows, colour in ((surface.in_kern, _INSIDE), (~surface.in_kern, _OUTSIDE)):
        if not rows.any():
            continue
        ends = np.stack([surface.resultant_points[rows] + sign * half[rows] for sign in (-1, 1)], axis=1)
        count = len(ends)
        strokes = pyvista.PolyData()
        strokes.points = ends.reshape(-1, 3)
        strokes.lines = np.column_stack([np.full(count, 2), np.arange(2 * count).reshape(-1, 2)]).ravel()
        plotter.add_mesh(strokes, color=colour, line_width=6.0, lighting=False)
        heads = pyvista.PolyData(surface.resultant_points[rows])
        plotter.add_mesh(heads, color=colour, point_size=11.0, render_points_as_spheres=True, lighting=False)


def _add_edges(pyvista: Any, plotter: Any, surface: WallSurface) -> None:
    """Edges of the stones, a hair before their faces so that they are not drawn half hidden."""
    toward = plotter.camera.position - np.array(plotter.camera.focal_point)
    lines = pyvista.PolyData()
    lines.points = surface.points + 1e-4 * toward
    lines.lines = np.column_stack([np.full(len(surface.edges), 2), surface.edges]).ravel()
    plotter.add_mesh(lines, color=_EDGE, line_width=2.5, lighting=False)


def _palette(name: str, part: float) -> Any:
    """The lighter part of a colour map: on its darkest part the edges of the stones cannot be seen."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps[name](np.linspace(0.0, part, 256)))


def _mesh(pyvista: Any, points: Array, triangles: NDArray[np.int64]) -> Any:
    return pyvista.PolyData(points, faces=np.column_stack([np.full(len(triangles), 3), triangles]).ravel())


def _add_scalar_bar(plotter: Any, colours: Colouring) -> None:
    step = colours.top / colours.intervals
    decimals = max(0, ceil(-log10(step) - 1e-9))
    decimals += round(step * 10**decimals, 6) % 1 > 0
    plotter.add_scalar_bar(
        title=colours.title + (" (and above)" if colours.saturated else "") + "\n",
        n_labels=colours.intervals + 1,
        fmt=f"%.{decimals}f",
        color=_INK,
        title_font_size=26,
        label_font_size=24,
        position_x=0.25,
        position_y=0.03,
        width=0.5,
        height=0.085,
    )


def _place_camera(pyvista: Any, plotter: Any, points: Array, towards: Array, up: Array) -> None:
    """Look at the middle of the wall from its outside, a little from the side and from above."""
    up = up / np.linalg.norm(up)
    front = towards - (towards @ up) * up
    front /= np.linalg.norm(front)
    right = np.cross(up, front)
    level = np.cos(_AZIMUTH) * front + np.sin(_AZIMUTH) * right
    view = np.cos(_ELEVATION) * level + np.sin(_ELEVATION) * up
    side = np.cross(up, view)
    side /= np.linalg.norm(side)
    top = np.cross(view, side)
    across, along = points @ side, points @ top
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    middle = middle + side * ((across.min() + across.max()) / 2 - middle @ side)
    middle = middle + top * ((along.min() + along.max()) / 2 - middle @ top)
    width, height = np.ptp(across), np.ptp(along)
    # room above for the title and below for the scalar bar: the wall takes 74 % of the height
    visible = max(height / 0.74, width / 0.92 * _SIZE[1] / _SIZE[0])
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


def _main(job_path: str) -> int:
    """Draw what a job file asks for; exit code 3 if a library cannot be loaded, its message on stdout."""
    job = json.loads(Path(job_path).read_text(encoding="utf-8"))
    try:
        import pyvista  # noqa: F401
    except ImportError as error:
        print(error)
        return 3
    surface = load_surface(Path(job["surface"]))
    for picture in job["pictures"]:
        draw(surface, Path(picture["path"]), picture)
    return 0


if __name__ == "__main__":
    sys.exit(_main(sys.argv[1]))
