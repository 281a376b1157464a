"""Capacity curve of a pushover as a picture."""

from pathlib import Path

import numpy as np

from mechanics.limit.pushover import Pushover
from pipelines.draw.elevations.sheet import new_sheet

__all__ = ["draw_capacity"]


def draw_capacity(path: Path, title: str, curve: Pushover, bound: float) -> None:
    """Draw λ against the way of the stone that is led, with the bound and the limit load with which it began."""
    figure = new_sheet((7.0, 4.2))
    axes = figure.subplots()
    way = 1e3 * curve.displacement
    axes.plot(way, np.where(curve.calm, curve.multiplier, np.nan), color="#1f5f8b", label="borne at rest")
    hit = ~curve.calm
    if hit.any():
        span = np.clip(curve.multiplier[hit], 0.0, 1.2 * bound)
        axes.plot(way[hit], span, ".", color="#b0b0b0", label="inertia counts")
    axes.axhline(bound, color="#8a3b12", linestyle="--", label="bound")
    axes.axhline(curve.limit, color="#6b7a2a", linestyle=":", label="limit load, candidate")
    axes.set_xlim(left=0.0)
    axes.set_ylim(0.0, 1.2 * bound)
    axes.set_xlabel(f"way of {curve.control} along the load [mm]")
    axes.set_ylabel("λ [-]")
    axes.set_title(title, fontsize=9)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, loc="upper right")
    figure.savefig(path)
