"""Pictures of a survey report: elevations and residuals."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

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
from survey.quality.facades import Facade
from survey.quality.precision import Histogram, StoneQuality

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_elevation", "draw_residuals"]


_UNKNOWN = "#dcd9d4"
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

    own = [stones[i] for i in facade.members.tolist()]
    polygons = [project(one.outline, facade) for one in own]
    low, high = extent(polygons)
    figure = new_sheet(sheet_size(high - low))
    axes = figure.subplots()
    rms = np.array([one.rms * 1e3 if one.measured and one.redundancy else np.nan for one in own])
    end, _ = robust_ceiling(rms, _FINEST if np.isfinite(rms).any() else 1.0)
    fine = 0.9 if len(own) <= 2000 else 0.15
    faces = PolyCollection(
        polygons, array=rms, cmap=palette(_UNKNOWN), clim=(0.0, end), edgecolors=PALE, linewidths=fine
    )
    if photo is not None:
        photo.draw(axes, facade)
        faces.set_alpha(_OVER_PHOTO)
    axes.add_collection(faces)
    marked = [polygon for polygon, one in zip(polygons, own, strict=True) if one.code in flagged]
    if marked:
        axes.add_collection(
            PolyCollection(marked, facecolors="none", edgecolors=FLAG, linewidths=max(1.8 * fine, 0.6))
        )
    if len(own) <= CODES:
        write_codes(axes, [one.code for one in own], polygons, rms / end)
    frame_elevation(axes, facade, low, high, _title(facade))
    figure.colorbar(
        faces, ax=axes, label="rms of the points about their plane [mm]", shrink=0.75, pad=0.02,
        extend="max" if np.nanmax(rms, initial=0.0) > end else "neither",
    )  # fmt: skip
    _legend(axes, bool(marked), bool(np.isnan(rms).any()))
    save_sheet(figure, path)


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
    axes.set_title("\n".join(_wrapped(verdict, 90)), fontsize=10, color=INK)
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


def _wrapped(text: str, width: int) -> list[str]:
    import textwrap

    return textwrap.wrap(text, width)
