"""Figures of a run of disks, as in papers: layers, velocities, force chains, shear, and the curves of the cells."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.planar.measures.trishear import Trishear
from pipelines.draw.elevations.sheet import new_sheet
from pipelines.geology.observe import WHOLE, Fields

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_curves", "draw_instant", "draw_trishear"]

_WIDE = 10.0  # of a figure [inch]
_ROW = 130  # characters in a line of a footnote
_LAYERS = (
    "#c9a26b",
    "#8a3b12",
    "#e3c78f",
    "#5f5a4f",
    "#d9b38c",
    "#6b7a2a",
)  # colours, from the base in turns
_ARROWS = 600  # of velocities, at most
_STRONGEST = 3.0  # width of a line of the strongest force [point]
_SHARE = 0.99  # of the values that the scale of shear covers [-]


def draw_instant(
    folder: Path, fields: Fields, radius: Array, layer: Ints, walls: Array, quality: str
) -> list[str]:
    """Draw the deformed layers, velocities, force chains and local shear of one instant; return the names of the files.

    Parameters
    ----------
    folder : for the pictures
    radius, layer : (nd,)
    walls : (nw, 2, 2) ends of the walls now [m]
    quality : a line about overlaps and residuals, for every figure
    """
    names = []
    for name, draw in (
        ("layers", _layers),
        ("velocity", _velocities),
        ("forces", _forces),
        ("shear", _shears),
    ):
        figure = new_sheet(_size(fields, radius))
        axes = figure.subplots()
        title = draw(axes, fields, radius, layer)
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


def _disks(axes: "Axes", fields: Fields, radius: Array, **more: Any) -> Any:
    from matplotlib.collections import EllipseCollection

    width = 2.0 * radius
    disks = EllipseCollection(
        width,
        width,
        np.zeros(len(radius)),
        units="xy",
        offsets=fields.position[: len(radius), :2],
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


def _velocities(axes: "Axes", fields: Fields, radius: Array, layer: Ints) -> str:
    _disks(axes, fields, radius, facecolors="#e8e2d6")
    chosen = np.linspace(0, len(radius) - 1, min(_ARROWS, len(radius))).astype(np.int64)
    place, velocity = fields.position[chosen], fields.velocity[chosen]
    arrows = axes.quiver(
        place[:, 0], place[:, 1], velocity[:, 0], velocity[:, 1], color="#1f5f8b", width=0.0015, angles="xy"
    )
    largest = float(np.hypot(velocity[:, 0], velocity[:, 1]).max())
    key = float(f"{largest or 1.0:.1g}")
    axes.quiverkey(arrows, 0.92, 1.05, key, f"{key:g} m/s", fontproperties={"size": 7})
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
    panels = (
        ("p", "p [kPa]", 1e-3),
        ("q", "q [kPa]", 1e-3),
        ("lambda_x", "λx [-]", 1.0),
        ("lambda_y", "λy [-]", 1.0),
        ("anisotropy", "anisotropy of the fabric [-]", 1.0),
        ("porosity", "porosity [-]", 1.0),
    )
    for axes, (column, label, unit) in zip(figure.subplots(3, 2, sharex=True).flat, panels, strict=True):
        for name, values in rows.items():
            style = {"color": "grey", "linestyle": ":"} if name == WHOLE else {}
            axes.plot(values["time"], unit * values[column], label=name, linewidth=0.9, **style)
        for time in phases:
            axes.axvline(time, color="black", linewidth=0.5, linestyle="--")
        axes.set_ylabel(label, fontsize=8)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
    figure.axes[0].legend(frameon=False, fontsize=7, ncols=2)
    for axes in figure.axes[-2:]:
        axes.set_xlabel("time [s]", fontsize=8)
    _footnote(figure, quality)
    figure.savefig(path, dpi=150)
