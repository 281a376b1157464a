"""Time series of a run as a small plot."""

import io

import numpy as np

from mechanics.results.result import History
from pipelines.arrays import Array
from pipelines.draw.elevations.sheet import new_sheet

__all__ = ["history_svg"]

_CURVES = (
    ("speed", "speed [m/s]", "#8a3b12"),
    ("balance", "unbalanced force / weight", "#1f5f8b"),
    ("natural_map", "residual η of the contact law", "#6b7a2a"),
)


def history_svg(history: History) -> str:
    """Plot speed, balance and residual against time; return an SVG element."""
    figure = new_sheet((8.5, 3.6))
    axes = figure.subplots()
    for name, label, colour in _CURVES:
        values = _positive(getattr(history, name))
        axes.semilogy(history.time, values, label=label, color=colour, marker="." if len(values) < 30 else "")
    axes.set_xlabel("simulated time [s]")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, loc="upper right")
    out = io.StringIO()
    figure.savefig(out, format="svg")
    text = out.getvalue()
    return text[text.index("<svg") :]


def _positive(values: Array) -> Array:
    """Replace zeros by NaN, since a logarithmic axis has no place for them."""
    return np.where(values > 0.0, values, np.nan)
