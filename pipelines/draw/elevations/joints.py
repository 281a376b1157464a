"""Elevations of joints: surveyed width, joints left open, and overlaps."""

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanics.arrays import Array
from pipelines.draw.elevations.closing import back_to_front, guess_key, hatch, name_stones, visible_faces
from pipelines.draw.elevations.closing_shapes import ClosingShapes, DrawnJoint, Place
from pipelines.draw.elevations.sheet import (
    FLAG,
    INK,
    PALE,
    extent,
    frame_elevation,
    new_sheet,
    project,
    save_sheet,
    sheet_size,
)
from pipelines.draw.offscreen.parts import FINEST_SCALE, robust_ceiling
from survey.conventions import LARGEST, STEEPEST
from survey.joints.grown_leaf import Opening
from survey.quality.facades import Facade

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_STONE, _OUTLINE, _OVERLAP, _NEGATIVE = "#efede9", "#d8d4cc", "#000000", "#cc79a7"
_EDGE_ON = np.sin(STEEPEST)  # joints turned farther to the viewer lie behind the faces
_WIDE = 125  # characters of a line below the picture
_LINE = 0.185  # height of such a line [in]


def draw_joints(path: Path, shapes: ClosingShapes, facade: Facade) -> None:
    """Draw the joints of a facade, coloured by their surveyed width, with marks at gaps and overlaps.

    Parameters
    ----------
    path : PNG
    shapes : stones and joints to draw
    facade : its stones are drawn, in its frame
    """
    from matplotlib.collections import PolyCollection

    shown_stones = back_to_front(shapes.stones, facade)
    codes = {stone.code for stone in shown_stones}
    faces = [visible_faces(stone.closed, facade) for stone in shown_stones]
    flat = [corners for face in faces for corners, _ in face]
    low, high = extent(flat)
    shown = [joint for joint in shapes.joints if _is_seen(joint, facade, codes)]
    marked = [place for place in shapes.places if codes & {*place.stones}]
    openings = [opening for opening in shapes.openings if codes & {*opening.stones}]
    keys = _keys(
        shown, marked, len(shapes.places), any(shown_stone.hypothesis for shown_stone in shown_stones)
    )
    keys += [_open_key()] if openings else []
    width, height = sheet_size(high - low)
    figure = new_sheet((width, height + _LINE * len(keys)))
    axes = figure.subplots()
    axes.add_collection(PolyCollection(flat, facecolors=_STONE, edgecolors=PALE, linewidths=0.6))
    outlines = [
        corners for stone in shown_stones if stone.grown for corners, _ in visible_faces(stone.simple, facade)
    ]
    axes.add_collection(PolyCollection(outlines, facecolors=_OUTLINE, edgecolors=PALE, linewidths=0.6))
    hatch(axes, shown_stones, faces)
    name_stones(axes, shown_stones, faces, [float("nan")] * len(shown_stones))
    closed = [drawn for drawn in shown if not drawn.joint.left_open]
    left = [drawn for drawn in shown if drawn.joint.left_open]
    stroke = float(np.clip(28.0 / np.sqrt(len(shown_stones)), 0.8, 3.2))
    _add_closed(figure, axes, closed, facade, stroke)
    _add_open(axes, left, facade, stroke)
    _mark(axes, marked, facade)
    _draw_openings(axes, openings, facade)
    frame_elevation(axes, facade, low, high, _title(shapes.scene, facade, closed, left))
    if keys:
        figure.legend(handles=keys, loc="outside lower left", ncols=1, frameon=False, fontsize=9)
    save_sheet(figure, path)


def _add_closed(
    figure: "Figure", axes: "Axes", joints: Sequence[DrawnJoint], facade: Facade, stroke: float
) -> None:
    """Draw closed joints as lines in the colours of their widths, with a colour scale."""
    from matplotlib.collections import LineCollection

    if not joints:
        return
    width = np.array([1e3 * joint.joint.width for joint in joints])
    end, _ = robust_ceiling(width, FINEST_SCALE)
    lines = LineCollection(
        [_trace(joint, facade) for joint in joints],
        array=width,
        cmap=_width_colours(),
        clim=(0.0, end),
        linewidths=stroke,
        capstyle="round",
    )
    axes.add_collection(lines)
    ends = {(True, True): "both", (True, False): "min", (False, True): "max"}
    beyond = ends.get((bool((width < 0.0).any()), bool((width > end).any())), "neither")
    label = "width of the joint as surveyed [mm]"
    figure.colorbar(lines, ax=axes, label=label, shrink=0.75, pad=0.02, extend=beyond)


def _add_open(axes: "Axes", joints: Sequence[DrawnJoint], facade: Facade, stroke: float) -> None:
    """Draw open joints as double lines."""
    from matplotlib.collections import LineCollection

    traces = [_trace(joint, facade) for joint in joints]
    for colour, share in ((FLAG, 2.4), ("white", 1.0)):
        axes.add_collection(LineCollection(traces, colors=colour, linewidths=share * stroke))


def _draw_openings(axes: "Axes", openings: Sequence[Opening], facade: Facade) -> None:
    """Draw the edges of openings dashed, and write the size of each into it."""
    from matplotlib.collections import LineCollection

    for opening in openings:
        edges = project(opening.front.reshape(-1, 3), facade).reshape(-1, 2, 2)
        axes.add_collection(
            LineCollection(list(edges), colors=INK, linewidths=1.0, linestyles="dashed", zorder=4)
        )
        (x, y), (width, height) = 0.5 * (edges.min(axis=(0, 1)) + edges.max(axis=(0, 1))), opening.size
        text = f"open\n{width:.2f} × {height:.2f} m"
        axes.annotate(text, (x, y), ha="center", va="center", fontsize=7.0, color=INK, clip_on=True)


def _open_key() -> Any:
    """Make the legend entry of openings."""
    from matplotlib.lines import Line2D

    return Line2D([], [], color=INK, linestyle="dashed", label="opening: wider than mortar, stays open")


def _is_seen(joint: DrawnJoint, facade: Facade, codes: set[str]) -> bool:
    """Return True for a joint of the facade's stones that is seen edge on."""
    return bool(
        codes & {*joint.joint.stones} and abs(float(joint.joint.normal @ facade.frame.axes[2])) < _EDGE_ON
    )


def _trace(joint: DrawnJoint, facade: Facade) -> Array:
    """Find the line where a joint meets the face of the wall: its ends (2, 2) in the elevation."""
    if joint.polygon is None:
        along = np.cross(joint.joint.normal, facade.frame.axes[2])
        reach = 0.5 * np.sqrt(max(joint.joint.area, 0.0)) * along / max(float(np.linalg.norm(along)), 1e-9)
        return project(np.array([joint.joint.centroid - reach, joint.joint.centroid + reach]), facade)
    out = joint.polygon @ facade.frame.axes[2]
    front = joint.polygon[out >= 0.5 * (out.min() + out.max())]
    along = np.cross(joint.joint.normal, facade.frame.axes[2])
    place = front @ along
    return project(front[[int(place.argmin()), int(place.argmax())]], facade)


def _width_colours() -> Any:
    """Return a colour map from yellow-green to violet, distinct from the vermilion of open joints."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps["viridis_r"](np.linspace(0.12, 1.0, 256))).with_extremes(under=_NEGATIVE)


def _mark(axes: "Axes", marked: Sequence[Place], facade: Facade) -> None:
    """Mark each gap and overlap, and number the first of them."""
    for number, place in enumerate(marked, start=1):
        x, y = project(place.centroid, facade)
        marker, colour = ("D", _OVERLAP) if place.kind == "overlap" else ("o", FLAG)
        size = 12.0 if number <= LARGEST else 5.0
        axes.plot([x], [y], marker, color=colour, markersize=size, markeredgecolor="white", zorder=5)
        if number <= LARGEST:
            axes.annotate(
                str(number),
                (x, y),
                color="white",
                ha="center",
                va="center",
                fontsize=7.0,
                fontweight="bold",
                zorder=6,
            )


def _title(scene: str, facade: Facade, closed: Sequence[DrawnJoint], left: Sequence[DrawnJoint]) -> str:
    mean = ""
    if closed:
        width = float(np.mean([drawn.joint.width for drawn in closed]))
        mean = f", {1e3 * width:.1f} mm wide on average"
    return f"{scene}, {facade.name}: {len(closed)} joints closed{mean}; {len(left)} left open"


def _keys(shown: Sequence[DrawnJoint], marked: Sequence[Place], places: int, guessed: bool) -> list[Any]:
    """Make the legend: the signs, and one line for each numbered place."""
    from matplotlib.lines import Line2D

    keys: list[Any] = [guess_key()] if guessed else []
    if any(drawn.joint.left_open for drawn in shown) or any(drawn.kind == "gap" for drawn in marked):
        keys.append(
            Line2D([], [], color=FLAG, marker="o", linewidth=5.0, markersize=9.0, label="gap: left open")
        )
    if any(place.kind == "overlap" for place in marked):
        keys.append(
            Line2D([], [], color=_OVERLAP, marker="D", linewidth=0.0, markersize=8.0, label="overlap")
        )
    if any(drawn.joint.width < 0.0 for drawn in shown):
        keys.append(Line2D([], [], color=_NEGATIVE, linewidth=3.0, label="the faces overlapped as surveyed"))
    lines = [
        textwrap.shorten(f"{number}: {place.text}", _WIDE, placeholder=" …")
        for number, place in enumerate(marked[:LARGEST], start=1)
    ]
    if places > len(lines):
        elsewhere = " (some on other sides)" if places > len(marked) else ""
        lines.append(f"and {places - len(lines)} more{elsewhere}: moma check -v lists them all")
    return keys + [Line2D([], [], linewidth=0.0, label=line) for line in lines]
