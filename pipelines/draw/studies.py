"""Pictures of a study: its samples, the shares of the variance, and the stones that are worth a measurement."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.arrays import Array
from pipelines.draw.elevations.sheet import new_sheet
from survey.conventions import LARGEST

_BLUE, _RED, _GREY = "#1f5f8b", "#8a3b12", "#b0b0b0"


def draw_samples(path: Path, name: str, values: Array, level: float | None) -> None:
    """Draw the histogram of samples (m,), their cumulative curve, and the level of failure."""
    finite = np.sort(values[np.isfinite(values)])
    figure = new_sheet((7.0, 3.8))
    axes = figure.subplots()
    axes.hist(finite, bins="auto", color=_GREY)
    axes.set_xlabel(name)
    axes.set_ylabel("samples")
    curve = axes.twinx()
    curve.plot(finite, np.arange(1, len(finite) + 1) / len(finite), color=_BLUE)
    curve.set_ylabel("share of the samples below [-]")
    curve.set_ylim(0.0, 1.0)
    if level is not None:
        axes.axvline(level, color=_RED, linestyle="--")
    figure.savefig(path)


def draw_weighted(path: Path, name: str, values: Array, weights: Array, level: float | None) -> None:
    """Draw samples (m,) about design points as bars: how many there are, and the probability that they stand for."""
    finite = np.isfinite(values)
    figure = new_sheet((7.0, 3.8))
    axes = figure.subplots()
    _, edges, _ = axes.hist(values[finite], bins="auto", color=_GREY)
    axes.set_xlabel(name)
    axes.set_ylabel("samples")
    shares, _ = np.histogram(values[finite], edges, weights=weights[finite] / len(values))
    stands = axes.twinx()
    stands.stairs(shares, edges, color=_BLUE)
    stands.set_ylabel("probability [-]")
    stands.set_ylim(bottom=0.0)
    if level is not None:
        axes.axvline(level, color=_RED, linestyle="--")
    figure.savefig(path)


def draw_fragility(path: Path, name: str, rows: Sequence[Mapping[str, Any]], small: bool) -> None:
    """Draw the probability of failure at levels, with its interval; small ones on a logarithmic axis."""
    figure = new_sheet((7.0, 3.8))
    axes = figure.subplots()
    level = [row["level"] for row in rows]
    axes.fill_between(
        level, [row["low"] for row in rows], [row["high"] for row in rows], color=_GREY, alpha=0.5
    )
    axes.plot(level, [row["probability"] for row in rows], color=_BLUE)
    axes.set_xlabel(f"level of {name}")
    axes.set_ylabel("probability of failure [-]")
    if small:
        axes.set_yscale("log")
    else:
        axes.set_ylim(0.0, 1.0)
    axes.grid(alpha=0.3)
    figure.savefig(path)


def draw_tornado(path: Path, shares: Mapping[str, float]) -> None:
    """Draw shares of the variance as bars, the largest first."""
    rows = sorted(shares.items(), key=lambda row: -row[1])[:LARGEST]
    figure = new_sheet((7.0, 0.8 + 0.3 * len(rows)))
    axes = figure.subplots()
    axes.barh([name for name, _ in rows], [100.0 * share for _, share in rows], color=_BLUE)
    axes.invert_yaxis()
    axes.set_xlabel("share of the variance [%]")
    figure.savefig(path)


def draw_shares(path: Path, outlines: Mapping[str, Array], shares: Mapping[str, float]) -> None:
    """Draw stones on their elevation, by the variance that the best measurement of each takes away.

    Parameters
    ----------
    outlines : by code, corners (n, 2) on the elevation [m]
    shares : by code [-]
    """
    figure = new_sheet((7.0, 6.0))
    from matplotlib.collections import PolyCollection

    axes = figure.subplots()
    codes = list(outlines)
    values = np.array([100.0 * shares.get(code, 0.0) for code in codes])
    drawn = PolyCollection(
        [outlines[code] for code in codes], array=values, cmap="Blues", edgecolors="#555555"
    )
    drawn.set_clim(0.0, max(float(values.max(initial=0.0)), 1e-9))
    axes.add_collection(drawn)
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.set_xlabel("along the wall [m]")
    axes.set_ylabel("height [m]")
    figure.colorbar(drawn, label="variance that a measurement takes away [%]", shrink=0.8)
    figure.savefig(path)
