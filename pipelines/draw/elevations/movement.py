"""Elevations of measured beside simulated deformation: bed lines of both, and the misfit of each stone."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mechanics.arrays import Array
from pipelines.draw.elevations.beds import FINER, LARGEST
from pipelines.draw.elevations.sheet import (
    FLAG,
    INK,
    PALE,
    PLAIN,
    extent,
    frame_elevation,
    new_sheet,
    project,
    save_sheet,
    sheet_size,
)
from survey.quality.facades import Facade
from survey.quality.movement import CourseMovement

_DIVERGING = "RdBu_r"  # low is blue, high is red: the same for colour-blind readers


def draw_bed_movement(path: Path, courses: Sequence[CourseMovement]) -> None:
    """Draw the bed lines of one wall at their heights: departure from level, measured and simulated, exaggerated.

    Parameters
    ----------
    path : PNG
    courses : of one wall
    """
    levels = [float(np.mean(course.line.height)) for course in courses]
    room = float(np.median(np.diff(sorted(set(levels))))) if len(set(levels)) > 1 else 0.3
    lines = [
        (course.line.height - level, course.simulated) for course, level in zip(courses, levels, strict=True)
    ]
    simulated = [moved - moved.mean() for _, moved in lines]
    largest = [
        float(max(np.abs(measured).max(), np.abs(own).max(), 1e-6))
        for (measured, _), own in zip(lines, simulated, strict=True)
    ]
    # one bent course does not flatten the others, and their scatter does not look like movement
    reach = [max(extreme, max(largest) / FINER) for extreme in largest]
    factors = [max(1.0, float(f"{LARGEST * room / extreme:.1g}")) for extreme in reach]
    figure = new_sheet((10.0, float(np.clip(2.0 + 0.42 * len(courses), 3.5, 24.0))))
    axes = figure.subplots()
    right = max(float(course.line.along.max()) for course in courses)
    for course, level, (measured, _), own, factor in zip(
        courses, levels, lines, simulated, factors, strict=True
    ):
        along = course.line.along
        axes.plot(along[[0, -1]], [level] * 2, color=PALE, linewidth=0.8, zorder=1)
        axes.errorbar(
            along, level + factor * measured, factor * course.line.sigma, fmt="o-", markersize=2.0,
            color=FLAG, ecolor=PALE, linewidth=0.8, elinewidth=0.8, zorder=2,
        )  # fmt: skip
        axes.plot(along, level + factor * own, color=PLAIN, linewidth=1.6, zorder=3)
        axes.annotate(
            f"{course.line.course}: × {factor:g}", (right, level), (8, 0), textcoords="offset points", va="center",
            fontsize=8, annotation_clip=False, parse_math=False,
        )  # fmt: skip
    line = courses[0].line
    axes.set_xlabel("along the facade, to the right of the viewer [m]")
    axes.set_ylabel("height of the bed [m]")
    axes.set_title(
        f"Bed lines of {line.facade}{f', {line.zone}' if line.zone else ''}: departure from level drawn as many times "
        "as large as stated at the right\norange: measured, bars ± one standard deviation of a corner; blue: simulated",
        fontsize=10, color=INK, parse_math=False,
    )  # fmt: skip
    axes.spines[["top", "right"]].set_visible(False)
    save_sheet(figure, path)


def draw_misfit(
    path: Path, facade: Facade, outlines: Sequence[Array], misfit: Sequence[float], end: float
) -> None:
    """Draw stones of a facade, coloured by measured less simulated height of their beds over its σ.

    Parameters
    ----------
    path : PNG
    facade : in whose frame they are drawn
    outlines : of the stones, each (nv, 3) [m]
    misfit : of each [-]
    end : of the colour scale, at either side [-]
    """
    from matplotlib.collections import PolyCollection

    polygons = [project(outline, facade) for outline in outlines]
    low, high = extent(polygons)
    figure = new_sheet(sheet_size(high - low))
    axes = figure.subplots()
    faces = PolyCollection(
        polygons,
        array=np.array(misfit),
        cmap=_DIVERGING,
        clim=(-end, end),
        edgecolors=PALE,
        linewidths=0.5,
    )
    axes.add_collection(faces)
    figure.colorbar(faces, ax=axes, label="measured less simulated height of the bed, over σ", shrink=0.7)
    frame_elevation(axes, facade, low, high, f"{facade.name}: what the simulated movement leaves unexplained")
    save_sheet(figure, path)
