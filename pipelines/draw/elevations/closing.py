"""Elevations of the distance by which simplifying, or closing the joints, moved each corner."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechanics.arrays import Array
from pipelines.draw.elevations.closing_shapes import ClosingShapes, DrawnStone
from pipelines.draw.elevations.sheet import (
    CODES,
    INK,
    PALE,
    extent,
    frame_elevation,
    new_sheet,
    palette,
    project,
    save_sheet,
    sheet_size,
    write_codes,
)
from pipelines.draw.offscreen.parts import FINEST_SCALE, robust_ceiling
from survey.conventions import STEEPEST
from survey.geometry.solids import Solid, area_vector
from survey.geometry.watertight import triangulate
from survey.quality.facades import Facade

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

VisibleFace = tuple[Array, tuple[int, ...]]

_UNKNOWN = "#dcd9d4"
_SEEN = np.cos(STEEPEST)  # faces turned farther away are not drawn
_LABELS = {"simplified": "moved by simplifying the stone [mm]", "moved": "moved by closing the joints [mm]"}


def draw_moved(path: Path, shapes: ClosingShapes, facade: Facade, step: str) -> None:
    """Draw how far each corner of a facade's stones was moved, in colour.

    Parameters
    ----------
    path : PNG
    shapes : stones and joints to draw
    facade : its stones are drawn, in its frame
    step : "simplified": on the stones as surveyed, with lines about those that became others; "moved": in closing the
        joints, on the stones as simplified, with lines about all as simulated
    """
    shown_stones = back_to_front(shapes.stones, facade)
    simplified = step == "simplified"
    values = [1e3 * (stone.simplified if simplified else stone.moved) for stone in shown_stones]
    faces = [visible_faces(stone.surveyed if simplified else stone.simple, facade) for stone in shown_stones]
    finite = np.concatenate(values)
    finite = finite[np.isfinite(finite)]
    end, _ = robust_ceiling(finite, FINEST_SCALE)
    low, high = extent([corners for face in faces for corners, _ in face])
    figure = new_sheet(sheet_size(high - low))
    axes = figure.subplots()
    shading = _shade_all(axes, faces, values, end)
    hatch(axes, shown_stones, faces)
    after = [
        (stone.simple if simplified else stone.closed, stone.simplified if simplified else stone.moved)
        for stone in shown_stones
    ]
    changed = [solid for solid, moved in after if np.nanmax(moved, initial=0.0) > 1e-3 * FINEST_SCALE]
    _outline(axes, [corners for solid in changed for corners, _ in visible_faces(solid, facade)])
    shade = [float(np.nanmean(moved)) / end if np.isfinite(moved).any() else np.nan for moved in values]
    name_stones(axes, shown_stones, faces, shade)
    frame_elevation(axes, facade, low, high, _title(shapes.scene, facade, step, shown_stones, values))
    if shading is not None:
        beyond = "max" if finite.max() > end else "neither"
        figure.colorbar(shading, ax=axes, label=_LABELS[step], shrink=0.75, pad=0.02, extend=beyond)
    _legend(
        figure,
        step,
        any(shown_stone.hypothesis for shown_stone in shown_stones),
        len(finite) < sum(map(len, values)),
    )
    save_sheet(figure, path)


def back_to_front(stones: Sequence[DrawnStone], facade: Facade) -> list[DrawnStone]:
    """Sort the facade's stones, the farthest from the viewer first, so that nearer ones are drawn over them."""
    out = facade.frame.axes[2]
    return sorted((stones[i] for i in facade.members.tolist()), key=lambda stone: float(stone.centroid @ out))


def visible_faces(solid: Solid, facade: Facade) -> list[VisibleFace]:
    """List the faces of a solid that look to the viewer: corners (k, 2) in the elevation, and their indices."""
    faces = []
    for face in solid.faces:
        area = area_vector(solid.vertices[list(face)])
        if area @ facade.frame.axes[2] > _SEEN * float(np.linalg.norm(area)):
            faces.append((project(solid.vertices[list(face)], facade), face))
    return faces


def hatch(axes: "Axes", stones: Sequence[DrawnStone], faces: Sequence[Sequence[VisibleFace]]) -> None:
    """Hatch hypothetical stones."""
    from matplotlib.collections import PolyCollection

    guessed = [
        corners for stone, face in zip(stones, faces, strict=True) if stone.hypothesis for corners, _ in face
    ]
    if guessed:
        axes.add_collection(
            PolyCollection(guessed, facecolors="none", edgecolors=INK, linewidths=0.6, hatch="///", alpha=0.5)
        )


def name_stones(
    axes: "Axes", stones: Sequence[DrawnStone], faces: Sequence[Sequence[VisibleFace]], shade: Sequence[float]
) -> None:
    """Write the code of each stone on its largest face, unless there are too many stones.

    Parameters
    ----------
    shade : where on the colour scale each is, from 0 to 1; NaN where it has no colour
    """
    named = [
        (stone.code, max((corners for corners, _ in face), key=_area), dark)
        for stone, face, dark in zip(stones, faces, shade, strict=True)
        if face
    ]
    if named and len(named) <= CODES:
        codes, corners, dark = zip(*named, strict=True)
        write_codes(axes, codes, corners, np.array(dark))


def guess_key() -> Any:
    """Make the legend entry of the hatching."""
    from matplotlib.patches import Patch

    return Patch(
        facecolor="none", edgecolor=INK, hatch="///", alpha=0.5, label="hypothetical stone, not surveyed"
    )


def _shade_all(
    axes: "Axes", faces: Sequence[Sequence[VisibleFace]], values: Sequence[Array], end: float
) -> Any:
    """Colour all faces by the values at their corners; return the mappable of the scale, None without any value."""
    from matplotlib.collections import PolyCollection

    coloured = [
        (corners, moved[list(indices)])
        for face, moved in zip(faces, values, strict=True)
        for corners, indices in face
    ]
    unknown = [corners for corners, moved in coloured if not np.isfinite(moved).all()]
    axes.add_collection(PolyCollection(unknown, facecolors=_UNKNOWN, edgecolors="none"))
    fans = [_fan(corners, moved) for corners, moved in coloured if np.isfinite(moved).all()]
    shading = None
    if fans:
        points, heights, triangles = zip(*fans, strict=True)
        starts = np.cumsum([0, *map(len, points)])[:-1]
        x, y = np.concatenate(points).T
        rows = np.concatenate([triangle + start for triangle, start in zip(triangles, starts, strict=True)])
        # triangles are drawn in order, so that nearer stones cover those behind
        shading = axes.tripcolor(
            x,
            y,
            np.concatenate(heights),
            triangles=rows,
            shading="gouraud",
            cmap=palette(_UNKNOWN),
            clim=(0.0, end),
        )
    outlines = [corners for corners, _ in coloured]
    axes.add_collection(PolyCollection(outlines, facecolors="none", edgecolors=PALE, linewidths=0.9))
    return shading


def _fan(corners: Array, values: Array) -> tuple[Array, Array, NDArray[np.intp]]:
    """Divide a polygon into triangles about its middle or, where these would turn over, from its corners."""
    count = len(corners)
    middle = corners.mean(axis=0)
    turns = corners - middle
    following = np.roll(turns, -1, axis=0)
    if ((turns[:, 0] * following[:, 1] - turns[:, 1] * following[:, 0]) > 0.0).all():
        rim = np.arange(count)
        triangles = np.column_stack([rim, np.roll(rim, -1), np.full(count, count)])
        return np.vstack([corners, middle]), np.append(values, values.mean()), triangles
    flat = Solid("", np.column_stack([corners, np.zeros(count)]), (tuple(range(count)),))
    return corners, values, triangulate(flat)


def _outline(axes: "Axes", polygons: Sequence[Array]) -> None:
    from matplotlib.collections import PolyCollection

    axes.add_collection(
        PolyCollection(polygons, facecolors="none", edgecolors=INK, linewidths=0.7, linestyles="--")
    )


def _area(polygon: Array) -> float:
    x, y = (polygon - polygon[0]).T
    return float(abs((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()))


def _title(
    scene: str, facade: Facade, step: str, stones: Sequence[DrawnStone], values: Sequence[Array]
) -> str:
    what = "what simplifying moved" if step == "simplified" else "what closing the joints moved"
    largest = [float(np.nanmax(moved, initial=0.0)) for moved in values]
    worst = int(np.argmax(largest))
    most = f"; {stones[worst].code} most, by {largest[worst]:.1f} mm" if largest[worst] > 0.0 else "; nothing"
    return f"{scene}, {facade.name}: {what}{most}"


def _legend(figure: "Figure", step: str, guessed: bool, unknown: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    after = "as simplified" if step == "simplified" else "as simulated"
    keys: list[Any] = [Line2D([], [], color=INK, linewidth=0.7, linestyle="--", label=after)]
    if guessed:
        keys.append(guess_key())
    if unknown:
        keys.append(Patch(facecolor=_UNKNOWN, edgecolor="none", label="not known"))
    figure.legend(handles=keys, loc="outside lower left", ncols=len(keys), frameon=False, fontsize=9)
