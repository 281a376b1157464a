"""Figures of a run of disks, as in papers: layers, velocities, force chains, shear, and the curves of the cells."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from archmodel.quantities import quantities_of
from mechanics.arrays import Array, Ints
from mechanics.planar.measures.trishear import Trishear
from pipelines.draw.elevations.sheet import new_sheet
from pipelines.geology.observe import WHOLE, Fields
from survey.conventions import PER_CENT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDE = 10.0  # of a figure [inch]
_ROW = 130  # characters in a line of a footnote
_LAYERS = (
    *("#c9a26b", "#8a3b12", "#e3c78f", "#5f5a4f", "#6b7a2a", "#d98c5f", "#3f6f6b", "#f2e6c9"),
    *("#a3a08f", "#b8860b"),
)  # colours, from the base; more layers than these take them in turns
_CELL = "#1f3fbf"  # colour of the disks of a cell among the layers
_ARROWS = 600  # of velocities, at most
_STRONGEST = 3.0  # width of a line of the strongest force [point]
_SHARE = 1.0 - PER_CENT  # of the values that the scale of shear covers [-]


def draw_instant(
    folder: Path,
    fields: Fields,
    radius: Array,
    layer: Ints,
    walls: Array,
    followed: Mapping[str, Ints],
    quality: str,
) -> list[str]:
    """Draw layers and cells, velocities, force chains and local shear of one instant; return the names of the files.

    Of the start the layers alone are drawn.

    Parameters
    ----------
    folder : for the pictures
    radius, layer : (nd,)
    walls : (nw, 2, 2) ends of the walls now [m]
    followed : disks of each cell
    quality : a line about overlaps and residuals, for every figure
    """
    names = []
    drawings = (("layers", _layers), ("velocity", _velocities), ("forces", _forces), ("shear", _shears))
    for name, draw in drawings if fields.step else drawings[:1]:
        figure = new_sheet(_size(fields, radius))
        axes = figure.subplots()
        title = draw(axes, fields, radius, layer)
        if draw is _layers:
            _mark_cells(axes, fields, radius, followed)
        _frame(axes, fields, radius, walls)
        axes.set_title(f"{title}, t = {fields.time:g} s, step {fields.step}", fontsize=9)
        _footnote(figure, quality)
        names.append(f"{name}-{fields.step:08d}.png")
        figure.savefig(folder / names[-1], dpi=150)
    return names


def _size(fields: Fields, radius: Array) -> tuple[float, float]:
    place = fields.position[: len(radius), :2]
    wide, high = np.ptp(place, axis=0)
    return _WIDE, float(np.clip(1.2 + _WIDE * high / wide, 2.0, _WIDE))


def _footnote(figure: "Figure", quality: str) -> None:
    """Write the line about overlaps and residuals below the axes, which make room for it."""
    figure.supxlabel("\n".join(wrap(quality, _ROW)), x=0.01, ha="left", fontsize=8)


def _frame(axes: "Axes", fields: Fields, radius: Array, walls: Array) -> None:
    from matplotlib.collections import LineCollection

    place = fields.position[: len(radius), :2]
    low, high = place.min(axis=0), place.max(axis=0)
    margin = 0.02 * np.ptp(place[:, 0])
    axes.add_collection(LineCollection(list(walls), colors="black", linewidths=1.0))
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]", fontsize=8)
    axes.set_ylabel("y [m]", fontsize=8)
    axes.tick_params(labelsize=7)


def _disks(axes: "Axes", fields: Fields, radius: Array, group: Ints | None = None, **more: Any) -> Any:
    """Draw all disks, or those of a group."""
    from matplotlib.collections import EllipseCollection

    chosen = np.arange(len(radius)) if group is None else group
    width = 2.0 * radius[chosen]
    disks = EllipseCollection(
        width,
        width,
        np.zeros(len(chosen)),
        units="xy",
        offsets=fields.position[chosen, :2],
        offset_transform=axes.transData,
        linewidths=0.0,
        **more,
    )
    axes.add_collection(disks)
    return disks


def _layers(axes: "Axes", fields: Fields, radius: Array, layer: Ints) -> str:
    colours = np.array(_LAYERS)[layer % len(_LAYERS)]
    _disks(axes, fields, radius, facecolors=list(colours))
    return "Marker layers"


def _mark_cells(axes: "Axes", fields: Fields, radius: Array, followed: Mapping[str, Ints]) -> None:
    """Draw the disks of the cells over the others, and the names of the cells above them."""
    for name, group in followed.items():
        _disks(axes, fields, radius, group, facecolors=_CELL)
        place = fields.position[group, :2]
        axes.annotate(
            name, (float(place[:, 0].mean()), float(place[:, 1].max())), ha="center", va="bottom", fontsize=7
        )


def _velocities(axes: "Axes", fields: Fields, radius: Array, layer: Ints) -> str:
    _disks(axes, fields, radius, facecolors="#e8e2d6")
    chosen = np.linspace(0, len(radius) - 1, min(_ARROWS, len(radius))).astype(np.int64)
    place, velocity = fields.position[chosen], fields.velocity[chosen]
    arrows = axes.quiver(
        place[:, 0], place[:, 1], velocity[:, 0], velocity[:, 1], color="#1f5f8b", width=0.0015, angles="xy"
    )
    largest = float(np.hypot(velocity[:, 0], velocity[:, 1]).max())
    key = float(f"{largest or 1.0:.1g}")
    axes.quiverkey(arrows, 0.92, 1.05, key, f"{key:g} m/s", labelpos="W", fontproperties={"size": 7})
    return "Velocities"


def _forces(axes: "Axes", fields: Fields, radius: Array, layer: Ints) -> str:
    from matplotlib.collections import LineCollection

    _disks(axes, fields, radius, facecolors="#f3efe6")
    pressed, force = fields.force_normal > 0, fields.force_normal
    if not pressed.any():
        return "Force chains: no contact is pressed"
    strongest = float(force.max())
    width = _STRONGEST * force[pressed] / strongest
    lines = LineCollection(
        list(fields.branches[pressed]), linewidths=width, colors="#8a3b12", capstyle="round"
    )
    axes.add_collection(lines)
    return f"Force chains, strongest {strongest / 1e3:.3g} kN"


def _shears(axes: "Axes", fields: Fields, radius: Array, layer: Ints) -> str:
    from matplotlib import colormaps

    values = np.where(np.isfinite(fields.shear), fields.shear, 0.0)
    disks = _disks(axes, fields, radius, cmap=colormaps["magma_r"])
    disks.set_array(values)
    disks.set_clim(0.0, float(np.quantile(values, _SHARE)) or 1.0)
    bar = axes.figure.colorbar(disks, ax=axes, fraction=0.02, pad=0.01)
    bar.ax.tick_params(labelsize=7)
    return "Local shear, ln of the ratio of principal stretches since the start"


def draw_trishear(
    folder: Path, fields: Fields, radius: Array, model: Trishear, speed: float, quality: str
) -> str:
    """Draw the velocities of the disks above those of a trishear with its triangle now; return the name of the file.

    Parameters
    ----------
    folder : for the picture
    fields : of the instant
    radius : (nd,)
    model : the trishear, as it was at the start
    speed : rate of slip [m/s]
    quality : a line about overlaps and residuals
    """
    place = fields.position[: len(radius), :2]
    wide, high = _size(fields, radius)
    figure = new_sheet((wide, 2.0 * high))
    chosen = np.linspace(0, len(radius) - 1, min(_ARROWS, len(radius))).astype(np.int64)
    advance = model.ratio * speed * fields.time
    along = np.array([np.cos(model.dip), np.sin(model.dip)])
    tip = np.array(model.tip) + advance * along
    far = 2.0 * float(np.ptp(place[:, 1])) + float(np.ptp(place[:, 0]))
    turns = (model.dip + model.half_angle, model.dip - model.half_angle)
    sides = [np.array([tip, tip + far * np.array([np.cos(turn), np.sin(turn)])]) for turn in turns]
    for axes, velocity, title in zip(
        figure.subplots(2, 1),
        (fields.velocity[: len(radius), :2], model.velocity(place, speed, advance)),
        ("Velocities of the disks", "Velocities of the trishear that comes nearest to their motion"),
        strict=True,
    ):
        _disks(axes, fields, radius, facecolors="#e8e2d6")
        axes.quiver(
            *place[chosen].T,
            *velocity[chosen].T,
            color="#1f5f8b",
            width=0.0015,
            angles="xy",
            scale=30.0 * speed,
        )
        _frame(axes, fields, radius, np.array(sides))
        axes.set_title(f"{title}, t = {fields.time:g} s", fontsize=9)
    _footnote(figure, quality)
    name = f"trishear-{fields.step:08d}.png"
    figure.savefig(folder / name, dpi=150)
    return name


def draw_curves(
    path: Path, rows: Mapping[str, Mapping[str, Array]], phases: Sequence[float], quality: str
) -> None:
    """Draw pressure, deviator, λx, λy, anisotropy and porosity of the cells against time.

    Parameters
    ----------
    path : of the picture
    rows : columns by cell (`ObservedRun.rows`)
    phases : instants at which a phase ends [s]
    quality : a line about overlaps and residuals
    """
    figure = new_sheet((_WIDE, 7.0))
    quantities = quantities_of("cell of disks")
    columns = ("p", "q", "lambda_x", "lambda_y", "anisotropy", "porosity")
    for axes, column in zip(figure.subplots(3, 2, sharex=True).flat, columns, strict=True):
        label, unit = quantities[column].label, quantities[column].unit
        size, unit = (1e-3, "kPa") if unit == "Pa" else (1.0, unit)
        for name, values in rows.items():
            style = {"color": "grey", "linestyle": ":"} if name == WHOLE else {}
            axes.plot(values["time"], size * values[column], label=name, linewidth=0.9, **style)
        for time in phases:
            axes.axvline(time, color="black", linewidth=0.5, linestyle="--")
        axes.set_ylabel(f"{label} [{unit}]", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
    figure.axes[0].legend(frameon=False, fontsize=7, ncols=2)
    for axes in figure.axes[-2:]:
        axes.set_xlabel("time [s]", fontsize=8)
    _footnote(figure, quality)
    figure.savefig(path, dpi=150)


def draw_course(path: Path, rows: Mapping[str, Array], phases: Sequence[float], quality: str) -> None:
    """Draw what an experiment observes against time; quantities of one unit share a panel.

    Parameters
    ----------
    path : of the picture
    rows : columns `step`, `time`, and others whose names end with their unit
    phases : instants at which a phase ends [s]
    quality : a line about overlaps and residuals
    """
    names = [name for name in rows if name not in ("step", "time")]
    units = list(dict.fromkeys(name.rpartition(" ")[2] for name in names))
    figure = new_sheet((_WIDE, 0.6 + 2.4 * len(units)))
    panels = figure.subplots(len(units), 1, sharex=True, squeeze=False)[:, 0]
    for axes, unit in zip(panels, units, strict=True):
        for name in (name for name in names if name.endswith(unit)):
            axes.plot(rows["time"], rows[name], label=name.removesuffix(unit).strip(), linewidth=0.9)
        for time in phases:
            axes.axvline(time, color="black", linewidth=0.5, linestyle="--")
        axes.set_ylabel(unit, fontsize=8)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
        axes.legend(frameon=False, fontsize=7)
    panels[-1].set_xlabel("time [s]", fontsize=8)
    _footnote(figure, quality)
    figure.savefig(path, dpi=150)


def draw_shapes(
    path: Path, instants: Sequence[Fields], radius: Array, followed: Mapping[str, Ints], quality: str
) -> None:
    """Draw the disks of each cell (rows) at each instant (columns), all at one scale in a row.

    Parameters
    ----------
    path : of the picture
    instants : whose cells are drawn
    radius : (nd,) [m]
    followed : disks of each cell
    quality : a line about overlaps and residuals
    """
    wide = _WIDE / max(len(instants), 4)
    figure = new_sheet((wide * len(instants), 1.0 + wide * len(followed)))
    panels = figure.subplots(len(followed), len(instants), squeeze=False)
    for row, (name, group) in zip(panels, followed.items(), strict=True):
        places = [fields.position[group, :2] for fields in instants]
        half = 0.55 * max(float(np.ptp(place, axis=0).max()) for place in places) + float(radius.max())
        for axes, fields, place in zip(row, instants, places, strict=True):
            _disks(axes, fields, radius, group, facecolors=_CELL)
            middle = 0.5 * (place.min(axis=0) + place.max(axis=0))
            axes.set_xlim(middle[0] - half, middle[0] + half)
            axes.set_ylim(middle[1] - half, middle[1] + half)
            axes.set_aspect("equal")
            axes.tick_params(labelsize=5)
            axes.set_title(f"{name}, t = {fields.time:g} s", fontsize=7)
    _footnote(figure, quality)
    figure.savefig(path, dpi=150)
