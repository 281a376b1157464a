"""Pictures of oriented photographs: a plan of the network with rays and ellipses, and residuals on each photograph."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanics.arrays import Array
from pipelines.draw.elevations.sheet import FLAG, INK, PALE, PLAIN, new_sheet, save_sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_network", "draw_photo_residuals"]

_RAYS = 4000  # rays drawn in the plan
_ELLIPSES = 400  # ellipses drawn in the plan
_NAMED = 40  # photographs named in the plan
_PHOTOS = 24  # photographs whose residuals are drawn: those with the largest first
_READABLE = 0.04  # length of a typical residual over the width of its photograph
_VISIBLE = 0.02  # semi-axis of a typical ellipse over the extent of the network


def draw_network(path: Path, values: Mapping[str, Any]) -> float:
    """Draw stations, rays, points and their ellipses from above and from the side; return the ellipses' scale.

    Parameters
    ----------
    path : PNG
    values : of `orientation_values`
    """
    from matplotlib.collections import EllipseCollection, LineCollection

    stations = np.array([[one["x"], one["y"], one["z"]] for one in values["photos"]])
    points = np.array([one["xyz"] for one in values["points"]]).reshape(-1, 3)
    covariances = np.array([one["covariance"] for one in values["points"]]).reshape(-1, 3, 3)
    control = {one["id"] for one in values["control"]}
    held = np.array([one["id"] in control for one in values["points"]], dtype=bool)
    rays = _rays(values, stations, points)
    some = np.linspace(0, len(points) - 1, min(len(points), _ELLIPSES)).astype(int)
    everything = np.concatenate([stations, points])
    extent = float(np.ptp(everything, axis=0).max()) or 1.0
    sizes = (
        np.sqrt(np.maximum(np.linalg.eigvalsh(covariances[some])[:, -1], 0.0)) if len(some) else np.zeros(1)
    )
    typical = float(np.median(sizes[sizes > 0.0])) if (sizes > 0.0).any() else 1.0
    factor = float(f"{_VISIBLE * extent / typical:.1g}")
    figure = new_sheet((11.0, 6.0))
    for axes, (across, up), names in zip(
        figure.subplots(1, 2), ((0, 1), (0, 2)), (("x [m]", "y [m]"), ("x [m]", "z [m]")), strict=True
    ):
        flat = [across, up]
        axes.add_collection(LineCollection(list(rays[:, :, flat]), colors=PALE, linewidths=0.25, alpha=0.6))
        axes.plot(*points[~held][:, flat].T, ".", color=INK, markersize=1.5)
        axes.plot(*points[held][:, flat].T, "^", color=PLAIN, markersize=5, label="control and check points")
        axes.plot(*stations[:, flat].T, "s", color=FLAG, markersize=4, label="photographs")
        width, height, turn = _ellipses(covariances[some][:, flat][:, :, flat])
        axes.add_collection(
            EllipseCollection(
                2 * factor * width, 2 * factor * height, turn, units="xy", offsets=points[some][:, flat],
                offset_transform=axes.transData, facecolors="none", edgecolors=PLAIN, linewidths=0.5,
            )
        )  # fmt: skip
        if len(stations) <= _NAMED:
            for one, place in zip(values["photos"], stations[:, flat], strict=True):
                axes.annotate(one["name"], place, xytext=(3, 3), textcoords="offset points", fontsize=6)
        axes.set_aspect("equal")
        axes.set_xlabel(names[0])
        axes.set_ylabel(names[1])
        axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=7)
    save_sheet(figure, path)
    return factor


def _rays(values: Mapping[str, Any], stations: Array, points: Array) -> Array:
    photo = {one["name"]: k for k, one in enumerate(values["photos"])}
    point = {one["id"]: k for k, one in enumerate(values["points"])}
    pairs = [
        (photo[f], point[i])
        for f, i in zip(values["marks"]["photo"], values["marks"]["point"], strict=True)
        if i in point
    ]
    chosen = np.linspace(0, len(pairs) - 1, min(len(pairs), _RAYS)).astype(int)
    return np.array([(stations[pairs[k][0]], points[pairs[k][1]]) for k in chosen]).reshape(-1, 2, 3)


def _ellipses(covariances: Array) -> tuple[Array, Array, Array]:
    """Return semi-axes and the direction of the larger [°] of plane ellipses."""
    sizes, axes = np.linalg.eigh(covariances)
    sizes = np.sqrt(np.maximum(sizes, 0.0))
    return sizes[:, 1], sizes[:, 0], np.degrees(np.arctan2(axes[:, 1, 1], axes[:, 0, 1]))


def draw_photo_residuals(path: Path, values: Mapping[str, Any]) -> tuple[int, float]:
    """Draw the residuals of marks as vectors on each photograph; return how many photographs, and how much is enlarged.

    Parameters
    ----------
    path : PNG
    values : of `orientation_values`
    """
    marks = values["marks"]
    size = {one["name"]: one["size"] for one in values["cameras"]}
    photos = sorted(values["photos"], key=lambda one: -(one["rms"] or 0.0))[:_PHOTOS]
    names = {one["name"] for one in photos}
    photos = [one for one in values["photos"] if one["name"] in names]
    off = np.array(
        [(a, b) if a is not None else (0.0, 0.0) for a, b in zip(marks["vx"], marks["vy"], strict=True)]
    )
    at = np.column_stack([marks["x"], marks["y"]]).reshape(-1, 2)
    of = np.array(marks["photo"])
    verdict = np.array(marks["verdict"])
    lengths = np.hypot(*off.reshape(-1, 2).T)
    typical = float(np.median(lengths[lengths > 0.0])) if (lengths > 0.0).any() else 1.0
    width = max(size[one["camera"]][0] for one in photos)
    factor = float(f"{_READABLE * width / typical:.1g}")
    columns = min(4, len(photos))
    rows = -(-len(photos) // columns)
    figure = new_sheet((11.0, 2.2 * rows + 0.4))
    grid = np.atleast_1d(figure.subplots(rows, columns, squeeze=False)).ravel()
    for axes, one in zip(grid, photos, strict=False):
        mine = of == one["name"]
        _vectors(axes, at[mine], factor * off[mine], verdict[mine] != "")
        w, h = size[one["camera"]]
        axes.set_xlim(0, w)
        axes.set_ylim(h, 0)
        axes.set_title(
            f"{one['name']}: {one['marks']} marks, rms {one['rms'] or 0.0:.2f} px", fontsize=7, color=INK
        )
    for axes in grid:
        axes.set_aspect("equal")
        axes.set_xticks([])
        axes.set_yticks([])
    for axes in grid[len(photos) :]:
        axes.set_visible(False)
    save_sheet(figure, path)
    return len(photos), factor


def _vectors(axes: "Axes", at: Array, off: Array, wrong: Sequence[bool] | Array) -> None:
    from matplotlib.collections import LineCollection

    lines = np.stack([at, at + off], axis=1)
    colours = [FLAG if one else PLAIN for one in wrong]
    axes.add_collection(LineCollection(list(lines), colors=colours, linewidths=0.7))
    axes.plot(*at.T, ".", color=INK, markersize=1.0)
