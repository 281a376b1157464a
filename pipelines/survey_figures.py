"""The pictures of a survey report: elevations and residuals."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing import nice_ceiling
from pipelines.sheets import FLAG, INK, PALE, new_sheet, save_sheet
from survey.facades import Facade
from survey.quality import Histogram, StoneQuality

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap

__all__ = ["draw_elevation", "draw_residuals"]

Array = NDArray[np.float64]

_UNKNOWN = "#dcd9d4"
_PALETTE = (
    "YlGnBu"  # from light to dark: the order is seen in print too, and by those who do not see all colours
)
_LIGHTER = 0.8  # part of it that is used: on its darkest part codes and outlines cannot be seen
_CODES = 250  # stones that can be named on an elevation
_ROBUST = 98.0  # per cent of the stones that the colour scale reaches
_FINEST = 0.01  # the colour scale ends here at least: smaller residuals are not worth a colour [mm]


def draw_elevation(path: Path, facade: Facade, stones: Sequence[StoneQuality], flagged: set[str]) -> None:
    """Draw the stones of a facade, coloured by how well their planes fit; those to measure again are outlined.

    Parameters
    ----------
    path : PNG
    facade : which stones, and the frame to draw them in
    stones : all stones of the survey
    flagged : codes of stones to measure again
    """
    from matplotlib.collections import PolyCollection

    own = [stones[i] for i in facade.members.tolist()]
    polygons = [_elevated(one, facade) for one in own]
    low, high = _extent(polygons)
    figure = new_sheet(_sheet(high - low))
    axes = figure.subplots()
    rms = np.array([one.rms * 1e3 if one.measured and one.redundancy else np.nan for one in own])
    end, _ = nice_ceiling(
        max(float(np.nanpercentile(rms, _ROBUST)), _FINEST) if np.isfinite(rms).any() else 1.0
    )
    fine = 0.9 if len(own) <= 2000 else 0.15
    faces = PolyCollection(
        polygons, array=rms, cmap=_palette(), clim=(0.0, end), edgecolors=PALE, linewidths=fine
    )
    axes.add_collection(faces)
    marked = [polygon for polygon, one in zip(polygons, own, strict=True) if one.code in flagged]
    if marked:
        axes.add_collection(
            PolyCollection(marked, facecolors="none", edgecolors=FLAG, linewidths=max(1.8 * fine, 0.6))
        )
    if len(own) <= _CODES:
        _write_codes(axes, own, polygons, rms / end)
    _frame_elevation(axes, facade, low, high)
    figure.colorbar(
        faces, ax=axes, label="rms of the points about their plane [mm]", shrink=0.75, pad=0.02,
        extend="max" if np.nanmax(rms, initial=0.0) > end else "neither",
    )  # fmt: skip
    _legend(axes, bool(marked), bool(np.isnan(rms).any()))
    save_sheet(figure, path)


def draw_residuals(path: Path, residuals: Histogram, verdict: str) -> None:
    """Draw how often standardised residuals fall where, beside the normal distribution."""
    figure = new_sheet((8.0, 4.2))
    axes = figure.subplots()
    middles, width = (residuals.edges[:-1] + residuals.edges[1:]) / 2.0, np.diff(residuals.edges)
    total = int(residuals.counts.sum())
    axes.bar(middles, residuals.counts, width, color="#9fb8cd", edgecolor="white", label=f"{total} residuals")
    fine = np.linspace(residuals.edges[0], residuals.edges[-1], 400)
    normal = total * width[0] * np.exp(-(fine**2) / 2.0) / math.sqrt(2.0 * math.pi)
    axes.plot(fine, normal, color=FLAG, linewidth=2.0, label="expected, if the stated sigma is right")
    axes.set_xlabel("residual over its own standard deviation [-]; the end bars hold all beyond")
    axes.set_ylabel("points and corners")
    axes.set_title("\n".join(_wrapped(verdict, 90)), fontsize=10, color=INK)
    axes.legend(frameon=False, loc="upper left")
    axes.spines[["top", "right"]].set_visible(False)
    save_sheet(figure, path)


def _elevated(stone: StoneQuality, facade: Facade) -> Array:
    """Outline in the elevation: along the facade, and up; z at the origin of a standing one [m]."""
    flat = facade.frame.flatten(stone.outline)
    if facade.azimuth is not None:
        flat[:, 1] += facade.frame.origin[2]
    return flat


def _extent(polygons: Sequence[Array]) -> tuple[Array, Array]:
    low = np.min([polygon.min(axis=0) for polygon in polygons], axis=0)
    high = np.max([polygon.max(axis=0) for polygon in polygons], axis=0)
    return low, high


def _sheet(size: Array) -> tuple[float, float]:
    """Size of the sheet [in] that shows a facade with room for the scale, neither thin nor flat."""
    width, height = np.maximum(size, 1e-3)
    shape = float(np.clip(height / width, 0.25, 2.0))
    return (11.0, 11.0 * 0.82 * shape + 1.4) if shape <= 1.0 else (10.0 / shape + 2.6, 11.0)


def _write_codes(
    axes: "Axes", stones: Sequence[StoneQuality], polygons: Sequence[Array], shade: Array
) -> None:
    """Each stone's name in its middle, as large as its width allows, light on dark and dark on light."""
    figure = axes.figure
    width, height = (float(one) for one in figure.get_size_inches())  # type: ignore[union-attr]
    low, high = _extent(polygons)
    scale = 0.95 * min(0.82 * width / float(high[0] - low[0]), (height - 1.4) / float(high[1] - low[1]))
    for stone, polygon, dark in zip(stones, polygons, shade, strict=True):
        room = float(np.ptp(polygon[:, 0])) * scale * 72.0
        tall = float(np.ptp(polygon[:, 1])) * scale * 72.0
        size = min(9.0, 0.85 * room / (0.62 * max(len(stone.code), 1)), 0.6 * tall)
        if size >= 3.5:
            colour = "white" if math.isfinite(dark) and dark > 0.7 else INK
            x, y = polygon.mean(axis=0)
            axes.text(
                x, y, stone.code, ha="center", va="center", fontsize=size, color=colour, parse_math=False
            )


def _frame_elevation(axes: "Axes", facade: Facade, low: Array, high: Array) -> None:
    margin = 0.02 * float((high - low).max())
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    axes.set_xlabel("along the facade, to the right of the viewer [m]")
    axes.set_ylabel("height [m]" if facade.azimuth is not None else "across [m]")
    looks = "" if facade.azimuth is None else f", looks to {facade.azimuth:.0f}° from y, clockwise"
    count = len(facade.members)
    axes.set_title(f"{facade.name}{looks}: {count} stone{'s' if count > 1 else ''}", fontsize=11, color=INK)
    axes.spines[["top", "right"]].set_visible(False)


def _legend(axes: "Axes", marked: bool, unknown: bool) -> None:
    from matplotlib.patches import Patch

    keys = []
    if marked:
        keys.append(Patch(facecolor="none", edgecolor=FLAG, linewidth=1.8, label="measure again"))
    if unknown:
        keys.append(
            Patch(
                facecolor=_UNKNOWN,
                edgecolor="none",
                label="not known: on a photograph, modelled, or no more points than a plane needs",
            )
        )
    if keys:
        axes.figure.legend(handles=keys, loc="outside lower left", ncols=2, frameon=False, fontsize=9)


def _palette() -> "Colormap":
    """The lighter part of the colour map, on which codes and outlines are still seen."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps[_PALETTE](np.linspace(0.0, _LIGHTER, 256))).with_extremes(bad=_UNKNOWN)


def _wrapped(text: str, width: int) -> list[str]:
    import textwrap

    return textwrap.wrap(text, width)
