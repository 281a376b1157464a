"""Elevation of bed lines with exaggerated deviations."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mechanics.arrays import Array
from pipelines.draw.elevations.sheet import FLAG, INK, PALE, PLAIN, new_sheet, save_sheet
from survey.quality.courses import CourseLine
from survey.quality.departures.beds import BedMovement, WallBeds

if TYPE_CHECKING:
    from matplotlib.axes import Axes


LARGEST = 0.45  # the largest deviation as drawn, over the distance between courses [-]
FINER = 10.0  # largest exaggeration of a course over the smallest [-]


def draw_courses(path: Path, lines: Sequence[CourseLine], walls: Sequence[WallBeds] = ()) -> None:
    """Draw the bed lines of one facade at their heights, with exaggerated deviations from level.

    Parameters
    ----------
    path : PNG
    lines : courses of one facade
    walls : movements of its walls
    """
    levels = np.array([line.level for line in lines])
    factors = _exaggerations(lines, levels)
    figure = new_sheet((10.0, float(np.clip(2.0 + 0.42 * len(lines), 3.5, 24.0))))
    axes = figure.subplots()
    right = max(float(line.along[-1]) for line in lines)
    left = min(float(line.along[0]) for line in lines)
    small = len(lines) > 60
    for line, y, factor in zip(lines, levels, factors, strict=True):
        moved = _movements(line, walls)
        colour = FLAG if moved else PLAIN
        _draw_bed(axes, line, factor, moved, small)
        if not small:
            axes.annotate(
                f"{_label(line)}, × {factor:g}", (right, y), (8, 0), textcoords="offset points", va="center",
                fontsize=8, color=colour, annotation_clip=False, parse_math=False,
            )  # fmt: skip
    margin = max(0.02 * (right - left), 0.01)  # a single corner has a place but no width
    axes.set_xlim(left - margin, right + margin)
    axes.set_xlabel("along the facade, to the right of the viewer [m]")
    axes.set_ylabel("height of the bed [m]")
    axes.set_title(
        f"Bed lines of {lines[0].facade}: deviations from level drawn {_told(factors)} times as large\n"
        "bars: ± one standard deviation of a corner; grey: level; orange: movement that courses share",
        fontsize=10, color=INK, parse_math=False,
    )  # fmt: skip
    axes.spines[["top", "right"]].set_visible(False)
    save_sheet(figure, path)


def _draw_bed(
    axes: "Axes", line: CourseLine, factor: float, moved: Sequence[BedMovement], small: bool
) -> None:
    from matplotlib.collections import LineCollection

    axes.plot(line.along[[0, -1]], [line.level] * 2, color=PALE, linewidth=0.8, zorder=1)
    size, thick = (1.5, 0.6) if small else (3.5, 1.0)
    axes.errorbar(
        line.along,
        line.level + factor * (line.height - line.level),
        factor * line.sigma,
        fmt="o", markersize=size, color=INK, ecolor=PALE, elinewidth=thick, zorder=2,
    )  # fmt: skip
    places = np.column_stack([line.along, line.level + factor * (line.height - line.level)])
    strokes = LineCollection(
        [places[list(ends)] for ends in _stones(line)], colors=INK, linewidths=thick, zorder=3
    )
    axes.add_collection(strokes, autolim=False)
    if line.slope is not None:
        fine = np.linspace(line.along[0], line.along[-1], 400 if moved else 2)
        axes.plot(
            fine,
            line.level + factor * (_fitted(line, moved, fine) - line.level),
            color=FLAG if moved else PLAIN,
            linewidth=1.6,
            zorder=4,
        )


def _fitted(line: CourseLine, moved: Sequence[BedMovement], along: Array) -> Array:
    """Evaluate the movements of a course about its own height or, where there is none, its straight line [m]."""
    if not moved:
        straight: Array = line.level + (line.slope or 0.0) * (along - line.middle)
        return straight
    ends = float(line.along[0]), float(line.along[-1])

    def lift(places: Array) -> Array:
        """Return the sum of the lifts of all movements at some places [m]."""
        return np.asarray(
            np.sum([movement.lift(places, ends) for movement in moved], axis=0), dtype=np.float64
        )

    raised: Array = lift(along) + float((line.height - lift(line.along)).mean())
    return raised


def _movements(line: CourseLine, walls: Sequence[WallBeds]) -> list[BedMovement]:
    """Return the movements of a course."""
    return [
        movement
        for wall in walls
        if wall.zone == line.zone and wall.facade == line.facade
        for movement in wall.movements
        if movement.first <= line.course <= movement.last
    ]


def _stones(line: CourseLine) -> list[tuple[int, int]]:
    """List the first and last corner of each stone that has at least two in the course."""
    found: dict[str, list[int]] = {}
    for i, code in enumerate(line.codes):
        found.setdefault(code, []).append(i)
    return [(rows[0], rows[-1]) for rows in found.values() if len(rows) > 1]


def _label(line: CourseLine) -> str:
    course = f"{line.course}" if line.zone is None else f"{line.zone} {line.course}"
    if line.slope is None or line.slope_sigma is None:
        return f"{course}: not determined"
    text = f"{course}: {line.slope * 1e3:+.1f} ± {line.slope_sigma * 1e3:.1f} mm/m"
    if line.sag is not None and line.sag_sigma is not None:
        text += f", mid-span {line.sag * 1e3:+.1f} ± {line.sag_sigma * 1e3:.1f} mm"
    return text


def _exaggerations(lines: Sequence[CourseLine], levels: Array) -> list[float]:
    """Choose for each course a round factor by which its deviations fill a good part of the space between courses.

    None is more than `FINER` times the least: the scatter of straight courses would look like movement.
    """
    gaps = np.diff(np.unique(np.round(levels, 3)))
    room = float(np.median(gaps)) if len(gaps) else 0.3
    largest = [float((np.abs(line.height - line.level) + line.sigma).max()) for line in lines]
    wanted = [LARGEST * room / max(extreme, 1e-6) for extreme in largest]
    return [max(1.0, _round_down(min(factor, FINER * min(wanted)))) for factor in wanted]


def _round_down(value: float) -> float:
    """Return the largest of 1, 2, 5, 10, … that is not above a value."""
    decade = 10.0 ** math.floor(math.log10(value))
    return decade * max(step for step in (1.0, 2.0, 5.0, 10.0) if step * decade <= value)


def _told(factors: Sequence[float]) -> str:
    """Return the factors in words."""
    low, high = min(factors), max(factors)
    return f"{low:g}" if low == high else f"{low:g} to {high:g} (× at the right)"
