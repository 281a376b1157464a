"""Plot of error against CPU time, with the Pareto front."""

import io
import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from survey.conventions import TENTH

_COLOURS = {
    "as written": "#222222",
    "rigid": "#6b7a2a",
    "tet4": "#e0a458",
    "tet10": "#8a3b12",
    "hex8": "#7fb3d5",
    "hex20": "#1f5f8b",
}
_COLOUR = "#8e6c8a"
_FRONT, _BAND = "#555555", "#dddddd"
_AXIS_MINIMUM = 1e-7  # a logarithmic axis has no zero
_HIDDEN = TENTH  # share of the error of the reference at which smaller errors are drawn [-]
_COLUMNS = 3


@dataclass(frozen=True)
class Point:
    """One run: its setting, the kind that gives its colour, CPU time [s] and error [-]."""

    setting: str
    kind: str
    cpu: float
    error: float


@dataclass(frozen=True)
class Panel:
    """One quantity.

    Attributes
    ----------
    title : of the panel
    points : the runs
    front : numbers of the points on it
    reference : setting of the reference run, whose error is estimated
    reference_error : errors below it cannot be distinguished [-]
    recommended : setting to mark; None: none
    """

    title: str
    points: tuple[Point, ...]
    front: tuple[int, ...]
    reference: str
    reference_error: float | None
    recommended: str | None


def trade_png(title: str, panels: Sequence[Panel], asked: float) -> bytes:
    """Draw a panel for each quantity; `asked` is the error below which settings are recommended [-]."""
    # matplotlib reports on stderr, once per machine, that it builds its font cache
    logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)
    from matplotlib.figure import Figure

    columns = max(1, min(_COLUMNS, len(panels)))
    rows = max(1, math.ceil(len(panels) / columns))
    figure = Figure(figsize=(4.6 * columns, 3.7 * rows + 0.7), layout="constrained", dpi=110)
    places = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, panel in zip(places, panels, strict=False):
        _draw(axes, panel, asked)
    for axes in places[len(panels) :]:
        axes.set_axis_off()
    figure.suptitle(title, fontsize=11, parse_math=False)
    _legend(figure, panels)
    out = io.BytesIO()
    figure.savefig(out, format="png")
    return out.getvalue()


def _draw(axes: Any, panel: Panel, asked: float) -> None:
    from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    # errors far below that of the reference cannot be distinguished, so the axis ends there
    least = max(_AXIS_MINIMUM, _HIDDEN * (panel.reference_error or 0.0))

    def seen(error: float) -> float:
        """Return an error as it is drawn, in percent."""
        return 100.0 * max(error, least)

    front = [panel.points[number] for number in panel.front]
    axes.plot(
        [one.cpu for one in front], [seen(one.error) for one in front], color=_FRONT, linewidth=1.0, zorder=1
    )
    for point in panel.points:
        estimated = point.setting == panel.reference
        axes.plot(
            point.cpu,
            seen(point.error),
            marker="D" if estimated else "o",
            markersize=5.5 if point in front else 3.5,
            color=_COLOURS.get(point.kind, _COLOUR),
            fillstyle="none" if estimated else "full",
            linestyle="none",
            zorder=2,
        )
        if point.setting == panel.recommended:
            axes.plot(point.cpu, seen(point.error), "o", markersize=13, color="#c4302b", fillstyle="none")
    for number, point in enumerate(front):
        axes.annotate(
            point.setting,
            (point.cpu, seen(point.error)),
            xytext=(4, 5 if number % 2 else -9),
            textcoords="offset points",
            fontsize=6.5,
        )
    axes.axhline(seen(asked), color="#c4302b", linewidth=0.8, linestyle="--", zorder=0)
    if panel.reference_error:
        bottom = axes.get_ylim()[0]
        axes.axhspan(bottom, seen(panel.reference_error), color=_BAND, zorder=-1)
        axes.set_ylim(bottom=bottom)
    axes.margins(x=0.15)
    axes.set_title(panel.title, fontsize=9)
    axes.set_xlabel("CPU time [s]", fontsize=8)
    axes.set_ylabel("error [%]", fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(alpha=0.25, which="major")


def _legend(figure: Any, panels: Sequence[Panel]) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    kinds = dict.fromkeys(point.kind for panel in panels for point in panel.points)
    handles: list[Any] = [
        Line2D([], [], marker="o", linestyle="none", color=_COLOURS.get(kind, _COLOUR), label=kind)
        for kind in kinds
    ]
    handles += [
        Line2D([], [], marker="D", linestyle="none", color=_FRONT, fillstyle="none", label="reference"),
        Line2D([], [], color=_FRONT, label="front"),
        Line2D([], [], color="#c4302b", linestyle="--", label="error asked for"),
        Line2D([], [], marker="o", linestyle="none", color="#c4302b", fillstyle="none", label="recommended"),
        Patch(color=_BAND, label="estimated error of the reference"),
    ]
    figure.legend(
        handles=handles, loc="outside lower center", ncols=min(len(handles), 6), fontsize=8, frameon=False
    )
