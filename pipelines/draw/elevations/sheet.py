"""What elevations have in common: the plane that they are drawn in, the sheet, the axes, the codes of the stones."""

import logging
import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipelines.arrays import Array
from survey.quality.facades import Facade

__all__ = [
    "CODES",
    "FLAG",
    "INK",
    "PALE",
    "PLAIN",
    "elevated",
    "extent",
    "frame_elevation",
    "new_sheet",
    "palette",
    "save_sheet",
    "sheet_size",
    "write_codes",
]

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap


CODES = 250
"""Stones that can be named on an elevation."""

_PALETTE = (
    "YlGnBu"  # from light to dark: the order is seen in print too, and by those who do not see all colours
)
_LIGHTER = 0.8  # part of it that is used: on its darkest part codes and outlines cannot be seen
_DARK = 0.7  # part of the scale beyond which a code is written in white


def elevated(points: Array, facade: Facade) -> Array:
    """Points (…, 3) in the elevation, (…, 2): along the facade, and up; z at the origin of a standing one [m]."""
    flat = facade.frame.flatten(points)
    if facade.azimuth is not None:
        flat[..., 1] += facade.frame.origin[2]
    return flat


def extent(polygons: Sequence[Array]) -> tuple[Array, Array]:
    """Lowest and highest coordinates (2,) of polygons."""
    low = np.min([polygon.min(axis=0) for polygon in polygons], axis=0)
    high = np.max([polygon.max(axis=0) for polygon in polygons], axis=0)
    return low, high


def sheet_size(size: Array) -> tuple[float, float]:
    """Size of the sheet [in] that shows a facade with room for the scale, neither thin nor flat."""
    width, height = np.maximum(size, 1e-3)
    shape = float(np.clip(height / width, 0.25, 2.0))
    return (11.0, 11.0 * 0.82 * shape + 1.4) if shape <= 1.0 else (10.0 / shape + 2.6, 11.0)


def write_codes(axes: "Axes", codes: Sequence[str], polygons: Sequence[Array], shade: Array) -> None:
    """Each stone's name in its middle, as large as its width allows, light on dark and dark on light.

    Parameters
    ----------
    codes, polygons : of the stones
    shade : (n,) where on the colour scale each is, from 0 to 1; NaN where it has no colour
    """
    figure = axes.figure
    width, height = (float(one) for one in figure.get_size_inches())  # type: ignore[union-attr]
    low, high = extent(polygons)
    scale = 0.95 * min(0.82 * width / float(high[0] - low[0]), (height - 1.4) / float(high[1] - low[1]))
    for code, polygon, dark in zip(codes, polygons, shade, strict=True):
        room = float(np.ptp(polygon[:, 0])) * scale * 72.0
        tall = float(np.ptp(polygon[:, 1])) * scale * 72.0
        size = min(9.0, 0.85 * room / (0.62 * max(len(code), 1)), 0.6 * tall)
        if size >= 3.5:
            colour = "white" if math.isfinite(dark) and dark > _DARK else INK
            x, y = polygon.mean(axis=0)
            axes.text(x, y, code, ha="center", va="center", fontsize=size, color=colour, parse_math=False)


def frame_elevation(axes: "Axes", facade: Facade, low: Array, high: Array, title: str) -> None:
    """Axes in metres about what lies between two corners."""
    margin = 0.02 * float((high - low).max())
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    axes.set_xlabel("along the facade, to the right of the viewer [m]")
    axes.set_ylabel("height [m]" if facade.azimuth is not None else "across [m]")
    axes.set_title(title, fontsize=11, color=INK)
    axes.spines[["top", "right"]].set_visible(False)


def palette(unknown: str) -> "Colormap":
    """The lighter part of the colour map, on which codes and outlines are still seen."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps[_PALETTE](np.linspace(0.0, _LIGHTER, 256))).with_extremes(bad=unknown)


if TYPE_CHECKING:
    from matplotlib.figure import Figure


_DPI = 150
INK, PALE = "#222222", "#a9a59e"
FLAG, PLAIN = "#d55e00", "#0072b2"  # vermilion and blue of Okabe and Ito: told apart by everybody


def new_sheet(size: tuple[float, float]) -> "Figure":
    """An empty figure of so many inches, without a window."""
    # matplotlib tells on stderr that it builds its font cache, once per machine
    logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)
    from matplotlib.figure import Figure

    return Figure(figsize=size, layout="constrained")


def save_sheet(figure: "Figure", path: Path) -> None:
    """Write a figure as PNG."""
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", "Glyph"
        )  # codes in scripts that the font does not have show as boxes
        figure.savefig(path, dpi=_DPI)
