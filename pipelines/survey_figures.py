"""The pictures of a survey report: elevations, residuals, bed lines."""

import logging
import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing import nice_ceiling
from survey.courses import SIGNIFICANT, CourseLine
from survey.facades import Facade
from survey.quality import Histogram, StoneQuality

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

__all__ = ["draw_courses", "draw_elevation", "draw_residuals"]

Array = NDArray[np.float64]

_DPI = 150
_INK, _PALE, _UNKNOWN = "#222222", "#a9a59e", "#dcd9d4"
_FLAG, _PLAIN_LINE = "#d55e00", "#0072b2"  # vermilion and blue of Okabe and Ito: told apart by everybody
_PALETTE = (
    "YlGnBu"  # from light to dark: the order is seen in print too, and by those who do not see all colours
)
_LIGHTER = 0.8  # part of it that is used: on its darkest part codes and outlines cannot be seen
_CODES = 250  # stones that can be named on an elevation
_ROBUST = 98.0  # per cent of the stones that the colour scale reaches
_FINEST = 0.01  # the colour scale ends here at least: smaller residuals are not worth a colour [mm]
_LARGEST = 0.45  # the largest deviation of a bed is drawn so large, in distances between courses


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
    figure = _figure(_sheet(high - low))
    axes = figure.subplots()
    rms = np.array([one.rms * 1e3 if one.measured and one.redundancy else np.nan for one in own])
    end, _ = nice_ceiling(
        max(float(np.nanpercentile(rms, _ROBUST)), _FINEST) if np.isfinite(rms).any() else 1.0
    )
    fine = 0.9 if len(own) <= 2000 else 0.15
    faces = PolyCollection(
        polygons, array=rms, cmap=_palette(), clim=(0.0, end), edgecolors=_PALE, linewidths=fine
    )
    axes.add_collection(faces)
    marked = [polygon for polygon, one in zip(polygons, own, strict=True) if one.code in flagged]
    if marked:
        axes.add_collection(
            PolyCollection(marked, facecolors="none", edgecolors=_FLAG, linewidths=max(1.8 * fine, 0.6))
        )
    if len(own) <= _CODES:
        _write_codes(axes, own, polygons, rms / end)
    _frame_elevation(axes, facade, low, high)
    over = bool(np.nanmax(rms, initial=0.0) > end)
    figure.colorbar(
        faces, ax=axes, label="rms of the points about their plane [mm]", shrink=0.75, pad=0.02,
        extend="max" if over else "neither",
    )  # fmt: skip
    _legend(axes, bool(marked), bool(np.isnan(rms).any()))
    _save(figure, path)


def draw_residuals(path: Path, residuals: Histogram, verdict: str) -> None:
    """Draw how often standardised residuals fall where, beside the normal distribution."""
    figure = _figure((8.0, 4.2))
    axes = figure.subplots()
    middles, width = (residuals.edges[:-1] + residuals.edges[1:]) / 2.0, np.diff(residuals.edges)
    total = int(residuals.counts.sum())
    axes.bar(middles, residuals.counts, width, color="#9fb8cd", edgecolor="white", label=f"{total} residuals")
    fine = np.linspace(residuals.edges[0], residuals.edges[-1], 400)
    normal = total * width[0] * np.exp(-(fine**2) / 2.0) / math.sqrt(2.0 * math.pi)
    axes.plot(fine, normal, color=_FLAG, linewidth=2.0, label="expected, if the stated sigma is right")
    axes.set_xlabel("residual over its own standard deviation [-]; the end bars hold all beyond")
    axes.set_ylabel("points and corners")
    axes.set_title("\n".join(_wrapped(verdict, 90)), fontsize=10, color=_INK)
    axes.legend(frameon=False, loc="upper left")
    axes.spines[["top", "right"]].set_visible(False)
    _save(figure, path)


def draw_courses(path: Path, lines: Sequence[CourseLine]) -> None:
    """Draw the bed lines of one facade at their heights, what they differ from level made larger.

    Parameters
    ----------
    path : PNG
    lines : courses of one facade
    """
    levels = np.array([line.level for line in lines])
    factor = _exaggeration(lines, levels)
    figure = _figure((10.0, float(np.clip(2.0 + 0.42 * len(lines), 3.5, 24.0))))
    axes = figure.subplots()
    right = max(float(line.along[-1]) for line in lines)
    left = min(float(line.along[0]) for line in lines)
    small = len(lines) > 60
    for line, y in zip(lines, levels, strict=True):
        colour = _FLAG if _is_deformed(line) else _PLAIN_LINE
        _draw_bed(axes, line, factor, colour, small)
        if not small:
            axes.annotate(
                _label(line), (right, y), (8, 0), textcoords="offset points", va="center", fontsize=8, color=colour,
                annotation_clip=False, parse_math=False,
            )  # fmt: skip
    axes.set_xlim(left - 0.02 * (right - left), right + 0.02 * (right - left))
    axes.set_xlabel("along the facade, to the right of the viewer [m]")
    axes.set_ylabel("height of the bed [m]")
    axes.set_title(
        f"Bed lines of {lines[0].facade}: deviations from level drawn {factor:g} times as large\n"
        "bars: ± one standard deviation of a corner; grey: level; orange: slope or sag beyond chance",
        fontsize=10, color=_INK,
    )  # fmt: skip
    axes.spines[["top", "right"]].set_visible(False)
    _save(figure, path)


def _draw_bed(axes: "Axes", line: CourseLine, factor: float, colour: str, small: bool) -> None:
    from matplotlib.collections import LineCollection

    axes.plot(line.along[[0, -1]], [line.level] * 2, color=_PALE, linewidth=0.8, zorder=1)
    size, thick = (1.5, 0.6) if small else (3.5, 1.0)
    axes.errorbar(
        line.along,
        line.level + factor * (line.height - line.level),
        factor * line.sigma,
        fmt="o", markersize=size, color=_INK, ecolor=_PALE, elinewidth=thick, zorder=2,
    )  # fmt: skip
    places = np.column_stack([line.along, line.level + factor * (line.height - line.level)])
    strokes = LineCollection(
        [places[list(ends)] for ends in _stones(line)], colors=_INK, linewidths=thick, zorder=3
    )
    axes.add_collection(strokes, autolim=False)
    if line.slope is not None:
        fine = np.linspace(line.along[0], line.along[-1], 2 if _curvature(line) == 0.0 else 50)
        axes.plot(
            fine,
            line.level + factor * (_fitted(line, fine) - line.level),
            color=colour,
            linewidth=1.6,
            zorder=4,
        )


def _fitted(line: CourseLine, along: Array) -> Array:
    """The straight line of a course, or, where it sags or hogs beyond chance, its parabola [m]."""
    half = line.span / 2.0
    bulge = float((((line.along - line.middle) / half) ** 2).mean()) - ((along - line.middle) / half) ** 2
    fitted: Array = line.level + (line.slope or 0.0) * (along - line.middle) + _curvature(line) * bulge
    return fitted


def _curvature(line: CourseLine) -> float:
    """The sag, if it is beyond chance [m]."""
    found = line.sag_probability is not None and line.sag_probability < SIGNIFICANT
    return line.sag if found and line.sag is not None else 0.0


def _stones(line: CourseLine) -> list[tuple[int, int]]:
    """First and last corner of each stone of a course that has two."""
    found: dict[str, list[int]] = {}
    for i, code in enumerate(line.codes):
        found.setdefault(code, []).append(i)
    return [(rows[0], rows[-1]) for rows in found.values() if len(rows) > 1]


def _is_deformed(line: CourseLine) -> bool:
    chances = (line.slope_probability, line.sag_probability)
    return any(chance is not None and chance < SIGNIFICANT for chance in chances)


def _label(line: CourseLine) -> str:
    course = f"{line.course}" if line.zone is None else f"{line.zone} {line.course}"
    if line.slope is None or line.slope_sigma is None:
        return f"{course}: not determined"
    text = f"{course}: {line.slope * 1e3:+.1f} ± {line.slope_sigma * 1e3:.1f} mm/m"
    if line.sag is not None and line.sag_sigma is not None:
        text += f", mid-span {line.sag * 1e3:+.1f} ± {line.sag_sigma * 1e3:.1f} mm"
    return text


def _exaggeration(lines: Sequence[CourseLine], levels: Array) -> float:
    """A round factor by which the deviations fill a good part of the room between courses."""
    gaps = np.diff(np.unique(np.round(levels, 3)))
    room = float(np.median(gaps)) if len(gaps) else 0.3
    largest = max(float((np.abs(line.height - line.level) + line.sigma).max()) for line in lines)
    wanted = _LARGEST * room / largest
    decade = 10.0 ** math.floor(math.log10(wanted))
    steps = (1.0, 2.0, 5.0, 10.0)
    return max(1.0, decade * max(step for step in steps if step * decade <= wanted))


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
            colour = "white" if math.isfinite(dark) and dark > 0.7 else _INK
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
    axes.set_title(f"{facade.name}{looks}: {count} stone{'s' if count > 1 else ''}", fontsize=11, color=_INK)
    axes.spines[["top", "right"]].set_visible(False)


def _legend(axes: "Axes", marked: bool, unknown: bool) -> None:
    from matplotlib.patches import Patch

    keys = []
    if marked:
        keys.append(Patch(facecolor="none", edgecolor=_FLAG, linewidth=1.8, label="measure again"))
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


def _figure(size: tuple[float, float]) -> "Figure":
    # matplotlib tells on stderr that it builds its font cache, once per machine
    logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)
    from matplotlib.figure import Figure

    return Figure(figsize=size, layout="constrained")


def _save(figure: "Figure", path: Path) -> None:
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", "Glyph"
        )  # codes in scripts that the font does not have show as boxes
        figure.savefig(path, dpi=_DPI)
