"""Pictures of a survey report: elevations and residuals."""

import math
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mechanics.arrays import Array
from pipelines.draw.elevations.orthophoto import Orthophoto
from pipelines.draw.elevations.sheet import (
    CODES,
    FLAG,
    INK,
    PALE,
    extent,
    frame_elevation,
    new_sheet,
    palette,
    project,
    save_sheet,
    sheet_size,
    write_codes,
)
from pipelines.draw.offscreen.parts import robust_ceiling
from survey.quality.departures.faces import WallFace
from survey.quality.facades import Facade
from survey.quality.precision import Histogram, StoneQuality

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_UNKNOWN = "#dcd9d4"
_DIVERGING = "RdBu_r"  # blue behind, red in front: safe for colour-blind readers
_MIN_SCALE = 1.0  # shortest scale of departures [mm]
_OVER_PHOTO = 0.45  # opacity of stones on a photograph [-]
_FINEST = 0.01  # shortest colour scale: smaller residuals are not worth a colour [mm]


def draw_elevation(
    path: Path,
    facade: Facade,
    stones: Sequence[StoneQuality],
    flagged: set[str],
    photo: Orthophoto | None = None,
) -> None:
    """Draw the stones of a facade, coloured by the misfit of their planes; outline those to measure again.

    Parameters
    ----------
    path : PNG
    facade : its stones are drawn, in its frame
    stones : all stones of the survey
    flagged : codes of stones to measure again
    photo : of the wall, drawn under the stones
    """
    from matplotlib.collections import PolyCollection

    wall_stones = [stones[i] for i in facade.members.tolist()]
    polygons = [project(wall_stone.outline, facade) for wall_stone in wall_stones]
    low, high = extent(polygons)
    figure = new_sheet(sheet_size(high - low))
    axes = figure.subplots()
    rms = np.array(
        [stone.rms * 1e3 if stone.measured and stone.redundancy else np.nan for stone in wall_stones]
    )
    end, _ = robust_ceiling(rms, _FINEST if np.isfinite(rms).any() else 1.0)
    fine = 0.9 if len(wall_stones) <= 2000 else 0.15
    faces = PolyCollection(
        polygons, array=rms, cmap=palette(_UNKNOWN), clim=(0.0, end), edgecolors=PALE, linewidths=fine
    )
    if photo is not None:
        photo.draw(axes, facade)
        faces.set_alpha(_OVER_PHOTO)
    axes.add_collection(faces)
    marked = [
        polygon
        for polygon, wall_stone in zip(polygons, wall_stones, strict=True)
        if wall_stone.code in flagged
    ]
    if marked:
        axes.add_collection(
            PolyCollection(marked, facecolors="none", edgecolors=FLAG, linewidths=max(1.8 * fine, 0.6))
        )
    if len(wall_stones) <= CODES:
        write_codes(axes, [wall_stone.code for wall_stone in wall_stones], polygons, rms / end)
    frame_elevation(axes, facade, low, high, _title(facade))
    figure.colorbar(
        faces, ax=axes, label="rms of the points about their plane [mm]", shrink=0.75, pad=0.02,
        extend="max" if np.nanmax(rms, initial=0.0) > end else "neither",
    )  # fmt: skip
    _legend(axes, bool(marked), bool(np.isnan(rms).any()))
    save_sheet(figure, path)


def draw_departure(
    path: Path, facade: Facade, stones: Sequence[StoneQuality], walls: Sequence[WallFace]
) -> None:
    """Draw how far each stone of a facade stands before or behind its plane, and before or behind plumb.

    Parameters
    ----------
    path : PNG
    facade : its stones are drawn, in its frame
    stones : all stones of the survey
    walls : departures of the walls of this facade; others are left out
    """
    of_facade = [wall for wall in walls if wall.facade == facade.name]
    members = facade.members.tolist()
    polygons = {i: project(stones[i].outline, facade) for i in members}
    low, high = extent(list(polygons.values()))
    width, height = sheet_size(high - low)
    stacked = high[0] - low[0] > high[1] - low[1]
    figure = new_sheet((width, 2.0 * height) if stacked else (2.0 * width, height))
    panels = list(np.ravel(np.array(figure.subplots(2 if stacked else 1, 1 if stacked else 2))))
    departures = {
        name: {
            int(i): 1e3 * float(v)
            for wall in of_facade
            for i, v in zip(wall.stones, getattr(wall, name), strict=True)
        }
        for name in ("plane", "plumb")
    }
    end = max(
        _MIN_SCALE,
        *(
            float(np.percentile(np.abs(list(values.values())), 98))
            for values in departures.values()
            if values
        ),
    )
    odd = {stone.code for wall in of_facade for stone in wall.odd}
    titles = {"plane": "departure from its plane", "plumb": "departure from plumb"}
    for axes, (name, values) in zip(panels, departures.items(), strict=True):
        _shade(axes, polygons, values, end, [polygons[i] for i in members if stones[i].code in odd])
        if len(members) <= CODES:
            shade = np.array([0.0 if i in values else np.nan for i in members])
            write_codes(axes, [stones[i].code for i in members], [polygons[i] for i in members], shade)
        frame_elevation(axes, facade, low, high, f"{facade.name}: {titles[name]}")
    figure.colorbar(
        panels[0].collections[0], ax=panels, label="in front (red) and behind (blue) [mm]", shrink=0.75, pad=0.02,
        extend="both",
    )  # fmt: skip
    save_sheet(figure, path)


def _shade(
    axes: "Axes",
    polygons: Mapping[int, Array],
    values: Mapping[int, float],
    end: float,
    marked: Sequence[Array],
) -> None:
    """Colour polygons by their values about zero, and outline those that are marked."""
    from matplotlib import colormaps
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import ListedColormap

    numbers = np.array([values.get(i, np.nan) for i in polygons])
    # codes and outlines cannot be read on the darkest parts
    paler = ListedColormap(colormaps[_DIVERGING](np.linspace(0.15, 0.85, 256))).with_extremes(bad=_UNKNOWN)
    faces = PolyCollection(
        list(polygons.values()), array=numbers, cmap=paler, clim=(-end, end), edgecolors=PALE, linewidths=0.6
    )
    axes.add_collection(faces)
    if marked:
        axes.add_collection(PolyCollection(marked, facecolors="none", edgecolors=INK, linewidths=2.0))


def draw_residuals(path: Path, residuals: Histogram, verdict: str) -> None:
    """Draw the histogram of standardised residuals beside the normal distribution."""
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
    axes.set_title("\n".join(textwrap.wrap(verdict, 90)), fontsize=10, color=INK, parse_math=False)
    axes.legend(frameon=False, loc="upper left")
    axes.spines[["top", "right"]].set_visible(False)
    save_sheet(figure, path)


def _title(facade: Facade) -> str:
    looks = "" if facade.azimuth is None else f", looks to {facade.azimuth:.0f}° from y, clockwise"
    count = len(facade.members)
    return f"{facade.name}{looks}: {count} stone{'s' if count > 1 else ''}"


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
