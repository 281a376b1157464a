"""Pictures of oriented photographs: a plan of the network with rays and ellipses, residuals and outlines on them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanics.arrays import Array
from pipelines.draw.elevations.sheet import FLAG, INK, PALE, PLAIN, new_sheet, save_sheet
from survey.conventions import NEGLIGIBLE, PER_CENT
from survey.orientation.oriented import Oriented
from survey.orientation.projection import project

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_RAYS = 4000  # rays drawn in the plan
_ELLIPSES = 400  # ellipses drawn in the plan
_NAMED = 40  # photographs named in the plan
_PHOTOS = 24  # photographs whose residuals are drawn: those with the largest first
_READABLE = 0.04  # length of a typical residual over the width of its photograph
_PARTS = 8  # pieces of a side of an outline, which the lens bends
_DRAWN = 6  # photographs on which outlines are drawn: those with most marks of stones
_MARGIN = PER_CENT  # of the width of a photograph, shown around outlines
_LONG = 1500  # pixels of the longer side of a picture that is laid under a drawing
_FAINT = 0.75  # opacity of such a picture
_VISIBLE = NEGLIGIBLE  # semi-axis of a typical ellipse over the extent of the network


def draw_network(path: Path, values: Mapping[str, Any]) -> float:
    """Draw stations, rays, points and their ellipses from above and from the side; return the ellipses' scale.

    Parameters
    ----------
    path : PNG
    values : of `orientation_values`
    """
    from matplotlib.collections import EllipseCollection, LineCollection

    stations = np.array([[photo["x"], photo["y"], photo["z"]] for photo in values["photos"]])
    points = np.array([point["xyz"] for point in values["points"]]).reshape(-1, 3)
    covariances = np.array([point["covariance"] for point in values["points"]]).reshape(-1, 3, 3)
    control = {point["id"] for point in values["control"]}
    controlled = np.array([point["id"] in control for point in values["points"]], dtype=bool)
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
        axes.plot(*points[~controlled][:, flat].T, ".", color=INK, markersize=1.5)
        axes.plot(
            *points[controlled][:, flat].T, "^", color=PLAIN, markersize=5, label="control and check points"
        )
        axes.plot(*stations[:, flat].T, "s", color=FLAG, markersize=4, label="photographs")
        width, height, turn = _ellipses(covariances[some][:, flat][:, :, flat])
        axes.add_collection(
            EllipseCollection(
                2 * factor * width, 2 * factor * height, turn, units="xy", offsets=points[some][:, flat],
                offset_transform=axes.transData, facecolors="none", edgecolors=PLAIN, linewidths=0.5,
            )
        )  # fmt: skip
        if len(stations) <= _NAMED:
            for photo, place in zip(values["photos"], stations[:, flat], strict=True):
                axes.annotate(photo["name"], place, xytext=(3, 3), textcoords="offset points", fontsize=6)
        axes.set_aspect("equal")
        axes.set_xlabel(names[0])
        axes.set_ylabel(names[1])
        axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=7)
    save_sheet(figure, path)
    return factor


def _rays(values: Mapping[str, Any], stations: Array, points: Array) -> Array:
    photo = {photo["name"]: k for k, photo in enumerate(values["photos"])}
    point = {point["id"]: k for k, point in enumerate(values["points"])}
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


def draw_photo_residuals(
    path: Path, values: Mapping[str, Any], pictures: Mapping[str, Path]
) -> tuple[int, float]:
    """Draw the residuals of marks as vectors on each photograph; return how many photographs, and how much is enlarged.

    Parameters
    ----------
    path : PNG
    values : of `orientation_values`
    pictures : files of the photographs themselves, by their names
    """
    marks = values["marks"]
    size = {camera["name"]: camera["size"] for camera in values["cameras"]}
    photos = sorted(values["photos"], key=lambda photo: -(photo["rms"] or 0.0))[:_PHOTOS]
    names = {photo["name"] for photo in photos}
    photos = [photo for photo in values["photos"] if photo["name"] in names]
    off = np.array(
        [(a, b) if a is not None else (0.0, 0.0) for a, b in zip(marks["vx"], marks["vy"], strict=True)]
    )
    at = np.column_stack([marks["x"], marks["y"]]).reshape(-1, 2)
    of = np.array(marks["photo"])
    verdict = np.array(marks["verdict"])
    lengths = np.hypot(*off.reshape(-1, 2).T)
    typical = float(np.median(lengths[lengths > 0.0])) if (lengths > 0.0).any() else 1.0
    width = max(size[photo["camera"]][0] for photo in photos)
    factor = float(f"{_READABLE * width / typical:.1g}")
    columns = min(4, len(photos))
    rows = -(-len(photos) // columns)
    figure = new_sheet((11.0, 2.2 * rows + 0.4))
    grid = np.atleast_1d(figure.subplots(rows, columns, squeeze=False)).ravel()
    for axes, photo in zip(grid, photos, strict=False):
        mine = of == photo["name"]
        if photo["name"] in pictures:
            _lay_under(axes, pictures[photo["name"]], size[photo["camera"]])
        _vectors(axes, at[mine], factor * off[mine], verdict[mine] != "")
        w, h = size[photo["camera"]]
        axes.set_xlim(0, w)
        axes.set_ylim(h, 0)
        axes.set_title(
            f"{photo['name']}: {photo['marks']} marks, rms {photo['rms'] or 0.0:.2f} px",
            fontsize=7,
            color=INK,
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
    colours = [FLAG if is_wrong else PLAIN for is_wrong in wrong]
    axes.add_collection(LineCollection(list(lines), colors=colours, linewidths=0.7))
    axes.plot(*at.T, ".", color=INK, markersize=1.0)


def _lay_under(axes: "Axes", picture: Path, size: Sequence[int]) -> None:
    """Lay a photograph under a drawing in the pixels of its camera."""
    from PIL import Image

    with Image.open(picture) as opened:
        opened.draft("RGB", (_LONG, _LONG))
        shown = opened.convert("RGB")
    shown.thumbnail((_LONG, _LONG))
    axes.imshow(np.asarray(shown), extent=(0, size[0], size[1], 0), alpha=_FAINT, zorder=0)


@dataclass(frozen=True)
class DrawnOutline:
    """A stone whose face is drawn on photographs.

    Attributes
    ----------
    code : of the stone
    corners : (nv, 3) of its face [m]
    normal : (3,) outward
    marks : places on photographs behind its corners and points [px], by the name of the photograph
    drawn : name of the photograph on which the whole outline was drawn; None if it was not
    """

    code: str
    corners: Array
    normal: Array
    marks: Mapping[str, Array]
    drawn: str | None


def draw_outlines(
    path: Path, oriented: Oriented, stones: Sequence[DrawnOutline], pictures: Mapping[str, Path]
) -> tuple[str, ...]:
    """Draw the outlines of stones on the photographs with most of their marks; return the names of these.

    Parameters
    ----------
    path : PNG
    oriented : the photographs
    stones : in the frame of the photographs
    pictures : files of the photographs themselves, by their names
    """
    count = {
        photo.name: sum(len(stone.marks.get(photo.name, ())) for stone in stones) for photo in oriented.photos
    }
    drawn_on = {stone.drawn for stone in stones}
    best = sorted(count, key=lambda name: (name not in drawn_on, -count[name]))
    chosen = sorted(name for name in best[:_DRAWN] if count[name])
    columns = min(2, len(chosen))
    rows = -(-len(chosen) // columns)
    figure = new_sheet((11.0, 3.9 * rows))
    grid = np.atleast_1d(figure.subplots(rows, columns, squeeze=False)).ravel()
    for axes, name in zip(grid, chosen, strict=False):
        f = oriented.index(name, str(path))
        if name in pictures:
            _lay_under(axes, pictures[name], oriented.camera(f).size)
        _outlines(axes, oriented, f, stones)
        axes.set_title(name, fontsize=7, color=INK)
    for axes in grid:
        axes.set_aspect("equal")
        axes.set_xticks([])
        axes.set_yticks([])
    for axes in grid[len(chosen) :]:
        axes.set_visible(False)
    save_sheet(figure, path)
    return tuple(chosen)


def _outlines(axes: "Axes", oriented: Oriented, f: int, stones: Sequence[DrawnOutline]) -> None:
    from matplotlib.collections import LineCollection

    photo, camera = oriented.photos[f], oriented.camera(f)
    width, height = camera.size
    lines, colours, marks = list[Array](), list[str](), list[Array]()
    part = np.arange(_PARTS)[:, None] / _PARTS
    for stone in stones:
        if photo.name in stone.marks:
            marks.append(stone.marks[photo.name])
        if stone.normal @ (oriented.station(f) - stone.corners.mean(axis=0)) <= 0.0:
            continue
        sides = zip(stone.corners, np.roll(stone.corners, -1, axis=0), strict=True)
        along = np.concatenate([a + part * (b - a) for a, b in sides])
        seen = project(camera, oriented.rotation(f), oriented.station(f), along)
        if np.isfinite(seen).all() and ((seen > 0.0) & (seen < (width, height))).all(axis=1).any():
            lines.append(np.concatenate([seen, seen[:1]]))
            colours.append(FLAG if stone.drawn == photo.name else PLAIN)
    axes.add_collection(LineCollection(lines, colors=colours, linewidths=0.8))
    if marks:
        axes.plot(*np.concatenate(marks).T, ".", color=INK, markersize=1.5)
    shown = np.concatenate([*lines, *marks])
    margin = _MARGIN * width
    low = np.maximum(shown.min(axis=0) - margin, 0.0)
    high = np.minimum(shown.max(axis=0) + margin, (width, height))
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(high[1], low[1])
