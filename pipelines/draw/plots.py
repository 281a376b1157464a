"""Plots of curves: the time series of a run, and the capacity of a pushover."""

import io
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from mechanics.arrays import Array
from mechanics.results.result import RunHistory
from pipelines.draw.elevations.sheet import new_sheet

if TYPE_CHECKING:
    from mechanics.limit.pushover import Pushover

ROW = 80  # characters in a line of a title
_CURVES = (
    ("speed", "speed [m/s]", "#8a3b12"),
    ("balance", "unbalanced force / weight", "#1f5f8b"),
    ("natural_map", "residual η of the contact law", "#6b7a2a"),
)


def history_svg(history: RunHistory) -> str:
    """Plot speed, balance and residual against time; return an SVG element."""
    figure = new_sheet((8.5, 3.6))
    axes = figure.subplots()
    for name, label, colour in _CURVES:
        values = _positive(getattr(history, name))
        axes.semilogy(history.time, values, label=label, color=colour, marker="." if len(values) < 30 else "")
    axes.set_xlabel("simulated time [s]")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)  # above the curves
    out = io.StringIO()
    figure.savefig(out, format="svg")
    text = out.getvalue()
    return text[text.index("<svg") :]


def draw_capacity(path: Path, title: str, curve: "Pushover", bound: float) -> None:
    """Draw λ against the way of the stone that is led, with the bound and the limit load with which it began."""
    figure = new_sheet((7.0, 4.2))
    axes = figure.subplots()
    millimetres = 1e3 * curve.displacement
    axes.plot(
        millimetres, np.where(curve.calm, curve.multiplier, np.nan), color="#1f5f8b", label="borne at rest"
    )
    hit = ~curve.calm
    if hit.any():
        span = np.clip(curve.multiplier[hit], 0.0, 1.2 * bound)
        axes.plot(millimetres[hit], span, ".", color="#b0b0b0", label="inertia counts")
    axes.axhline(bound, color="#8a3b12", linestyle="--", label="bound")
    axes.axhline(curve.limit, color="#6b7a2a", linestyle=":", label="limit load")
    axes.set_xlim(left=0.0)
    axes.set_ylim(0.0, 1.2 * bound)
    axes.set_xlabel(f"way of {curve.control} along the load [mm]")
    axes.set_ylabel("λ [-]")
    wrapped = "\n".join(part for line in title.splitlines() for part in wrap(line, ROW))
    axes.set_title(wrapped, fontsize=10, parse_math=False)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, loc="upper right")
    figure.savefig(path)


def _positive(values: Array) -> Array:
    """Replace zeros by NaN, since a logarithmic axis has no place for them."""
    return np.where(values > 0.0, values, np.nan)
