"""Pictures of a loading test: the capacity curve with its band and a measured one, and the stones at its end."""

import math
from pathlib import Path
from textwrap import wrap

import numpy as np

from mechanics.arrays import Array
from mechanics.contact.contacts import material_points
from mechanics.dynamics.step import Step
from mechanics.limit.loading_test import LoadingTest
from mechanics.results.postprocess import positions
from pipelines.draw.elevations.sheet import new_sheet
from pipelines.draw.plots import ROW
from survey.conventions import FEW, STEEPEST

DRAWN_DISPLACEMENT = 0.08  # way of the push in the picture over the extent of the stones [-]
_OPEN = FEW  # opening of a joint that is marked, over the displacement of the push [-]
_SEEN = -math.cos(STEEPEST)  # component of a normal towards the viewer up to which a face is drawn [-]


def draw_curve(path: Path, title: str, test: LoadingTest, band: Array | None, measured: Array | None) -> None:
    """Draw force against displacement.

    Parameters
    ----------
    band : (n, 3) displacement, least and largest force of a band about the curve [m, N]; None: there is none
    measured : (n, 2) displacement and force [m, N]; None: nothing was measured
    """
    figure = new_sheet((7.0, 4.4))
    axes = figure.subplots()
    if band is not None:
        places, low, high = band.T
        axes.fill_between(1e3 * places, 1e-3 * low, 1e-3 * high, color="#1f5f8b", alpha=0.2, label="band")
    places, forces = np.insert(test.displacement, 0, 0.0), np.insert(test.force, 0, 0.0)
    axes.plot(1e3 * places, 1e-3 * forces, color="#1f5f8b", label="predicted")
    if measured is not None:
        style = "-" if len(measured) > 30 else "o"
        places, forces = measured.T
        axes.plot(1e3 * places, 1e-3 * forces, style, color="#8a3b12", lw=1.0, label="measured")
    axes.axhline(0.0, color="black", lw=0.5)
    axes.set_xlabel("displacement of the push [mm]")
    axes.set_ylabel("force [kN]")
    axes.set_title("\n".join(wrap(title, ROW)), fontsize=10, parse_math=False)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, loc="best")
    figure.savefig(path)


def draw_pushed(path: Path, title: str, test: LoadingTest, step: Step) -> None:
    """Draw the stones at the end of a step as seen across the push, displacements exaggerated, open joints marked."""
    model, (along, across, up) = test.model, test.rig.axes
    view, loose = np.array([along, up]), np.flatnonzero(~model.fixed).tolist()
    before, now = positions(model, test.settled), positions(model, step.after)
    corners = np.vstack([before[k] for k in loose]) @ view.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    extent = float((high - low).max())
    # by the way of the push: a stone that has fallen out would leave none for the others
    displacement = abs(float(test.displacement[np.abs(test.force).argmax() if step is test.peak else -1]))
    factor = DRAWN_DISPLACEMENT * extent / max(displacement, 1e-9)

    def drawn(start: Array, end: Array) -> Array:
        """Project places (n, 3) at the end of the step, their displacements exaggerated."""
        seen: Array = (start + factor * (end - start)) @ view.T
        return seen

    shown = list[Array]()
    for number in loose:
        block, shape = model.scene.blocks[number], drawn(before[number], now[number])
        for face in map(list, block.faces):
            ring = block.vertices[face]
            normal = np.cross(ring[1] - ring[0], ring[2] - ring[0])
            if normal @ across < _SEEN * np.linalg.norm(normal):
                shown.append(shape[face])
    figure = new_sheet((5.0, 5.0))
    from matplotlib.collections import PolyCollection

    axes = figure.subplots()
    axes.add_collection(PolyCollection(shown, facecolor="#e6dfd0", edgecolor="#4a4a4a", linewidth=0.6))
    contacts, wide = step.active.contacts, step.active.gap > _OPEN * displacement
    kept = ~model.fixed[contacts.bodies[wide]]
    ends = (material_points(contacts, state)[wide][kept] for state in (test.settled, step.after))
    axes.plot(*drawn(*ends).T, ".", color="#c0392b", markersize=3)
    margin = 2 * DRAWN_DISPLACEMENT * extent
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(low[1] - margin, high[1] + margin)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_title(
        "\n".join([*wrap(title, ROW), f"displacements × {factor:.3g}; red: joints that are open"]),
        fontsize=9,
        parse_math=False,
    )
    figure.savefig(path)
