"""Common parts of elevations: projection, sheet, axes, stone codes."""

import logging
import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ground.errors import MissingLibraryError, missing_library
from mechanics.arrays import Array
from pipelines.draw.catalogue import READABLE
from survey.conventions import LARGELY
from survey.quality.facades import Facade

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure


_DPI = 150
INK, PALE = "#222222", "#a9a59e"
FLAG, PLAIN = "#d55e00", "#0072b2"  # vermilion and blue of Okabe and Ito, safe for colour-blind readers
CODES = 250
"""Largest number of stones named on an elevation."""

_PALETTE = "YlGnBu"  # from light to dark: legible in print and to colour-blind readers
_DARK = LARGELY  # part of the scale beyond which codes are written in white [-]


def project(points: Array, facade: Facade) -> Array:
    """Project points (…, 3) onto the elevation, (…, 2): along the facade, and up (z, if the facade stands) [m]."""
    flat = facade.frame.flatten(points)
    if facade.azimuth is not None:
        flat[..., 1] += facade.frame.origin[2]
    return flat


def extent(polygons: Sequence[Array]) -> tuple[Array, Array]:
    """Return the lowest and highest coordinates (2,) of polygons."""
    low = np.min([polygon.min(axis=0) for polygon in polygons], axis=0)
    high = np.max([polygon.max(axis=0) for polygon in polygons], axis=0)
    return low, high


def sheet_size(size: Array) -> tuple[float, float]:
    """Return the size of a sheet [in] for a facade and its scale, neither too tall nor too wide."""
    width, height = np.maximum(size, 1e-3)
    shape = float(np.clip(height / width, 0.25, 2.0))
    return (11.0, 11.0 * 0.82 * shape + 1.4) if shape <= 1.0 else (10.0 / shape + 2.6, 11.0)


def write_codes(axes: "Axes", codes: Sequence[str], polygons: Sequence[Array], shade: Array) -> None:
    """Write each stone's code in its middle, as large as it allows, light on dark and dark on light.

    Parameters
    ----------
    codes, polygons : of the stones
    shade : (n,) where on the colour scale each is, from 0 to 1; NaN where it has no colour
    """
    figure = axes.figure
    width, height = (float(inches) for inches in figure.get_size_inches())  # type: ignore[union-attr]
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
    """Set axes in metres around the box between two corners."""
    margin = 0.02 * float((high - low).max())
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    axes.set_xlabel("along the facade, to the right of the viewer [m]")
    axes.set_ylabel("height [m]" if facade.azimuth is not None else "across [m]")
    axes.set_title(title, fontsize=11, color=INK, parse_math=False)
    axes.spines[["top", "right"]].set_visible(False)


def palette(unknown: str) -> "Colormap":
    """Return the lighter part of the colour map, on which codes and outlines can be read."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps[_PALETTE](np.linspace(0.0, READABLE, 256))).with_extremes(bad=unknown)


def require_figures() -> None:
    """Refuse figures before long work, rather than after it, where matplotlib cannot be loaded.

    Raises
    ------
    MissingLibraryError : it is absent, or what it needs is
    """
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError as error:
        refusal = missing_library(error) or MissingLibraryError(f"matplotlib cannot be loaded: {error}")
        raise refusal.at("figures") from error


def new_sheet(size: tuple[float, float]) -> "Figure":
    """Make an empty figure of a size in inches, without a window; raise `MissingLibraryError` as `require_figures`."""
    # matplotlib reports on stderr that it builds its font cache, once per machine
    logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)
    require_figures()
    from matplotlib.figure import Figure

    return Figure(figsize=size, layout="constrained")


def save_sheet(figure: "Figure", path: Path) -> None:
    """Write a figure as PNG."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # codes in scripts missing from the font show as boxes
        figure.savefig(path, dpi=_DPI)
