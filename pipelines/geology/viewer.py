"""Viewer of a run of disks: layers, cells and fields in time."""

from collections.abc import Sequence

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.planar.measures.cells import Cell, members
from pipelines.geology.observe import Instants
from pipelines.reports.page.model import Column, Lines, Model, Motion, Stones

_CORNERS = 12  # of a disk as drawn
_MAX_VALUES = 600_000  # disks times instants in a page
_CHAINS = 3000  # forces that are drawn at the end, the largest first
_FORCE = "#8a3b12"


def disks_model(
    name: str, radius: Array, layer: Ints, start: Array, cells: Sequence[Cell], instants: Instants
) -> Model:
    """Return the model of a run of disks, in the plane of x and y, which stands upright in the viewer.

    Parameters
    ----------
    name : of the scene
    radius, layer, start : (nd,), (nd,), (nd, 2) of the disks at the start
    cells : followed groups of disks
    instants : with places and fields of all disks
    """
    count = len(radius)
    most = int(np.clip(_MAX_VALUES // max(count, 1), 2, 200))
    rows = np.unique(np.linspace(0, len(instants) - 1, min(len(instants), most)).round().astype(int))
    chosen = [instants[row] for row in rows.tolist()]
    centres = _upright(start)
    shift = np.stack([_upright(frame.position[:count, :2]) - centres for frame in chosen])
    turn = np.zeros_like(shift)
    turn[:, :, 1] = -np.stack([frame.position[:count, 2] for frame in chosen])
    fields = (
        ("mean pressure", "Pa", np.stack([frame.pressure for frame in chosen])),
        ("shear since the start", "-", np.stack([frame.shear for frame in chosen])),
        ("change of area", "-", np.stack([frame.volume for frame in chosen])),
        ("speed", "m/s", np.stack([np.hypot(*frame.velocity[:count, :2].T) for frame in chosen])),
    )
    motion = Motion(
        np.array([frame.time for frame in chosen]),
        centres,
        shift,
        turn,
        np.zeros(count, dtype=bool),
        None,
        fields,
    )
    last = chosen[-1]
    strongest = np.argsort(-last.force_normal)[:_CHAINS]
    chains = [_upright(line) for line in last.branches[strongest]]
    notes = [f"Force chains are the {len(chains)} strongest contacts of the last instant."]
    if len(chosen) < len(instants):
        notes.append(
            f"{len(chosen)} of {len(instants)} instants are in this page; the folder arrays has them all."
        )
    return Model(
        title=name,
        stones=_disks(centres, radius),
        columns=[
            Column("layer", "layer", None, [f"{number + 1}" for number in layer.tolist()], "Disk"),
            Column("cell", "cell", None, _cells(cells, start), "Disk"),
            Column("radius", "radius", "m", radius, "Disk"),
        ],
        motion=motion,
        lines=[Lines("Force chains at the end", _FORCE, chains)],
        colour="layer",
        towards=np.array([0.0, -1.0, 0.0]),
        axes=("x", "–", "y"),
        notes=notes,
    )


def _upright(flat: Array) -> Array:
    """Return places (…, 2) of the plane of x and y as (…, 3) of an upright one."""
    return np.stack([flat[..., 0], np.zeros(flat.shape[:-1]), flat[..., 1]], axis=-1)


def _disks(centres: Array, radius: Array) -> Stones:
    """Return a polygon for each disk; its first corner tells its turn by an edge to the centre."""
    count = len(radius)
    angle = 2.0 * np.pi * np.arange(_CORNERS) / _CORNERS
    ring = np.column_stack([np.cos(angle), np.zeros(_CORNERS), np.sin(angle)])
    rim = centres[:, None] + radius[:, None, None] * ring
    vertices = np.concatenate([centres[:, None], rim], axis=1).reshape(-1, 3)
    k = np.arange(_CORNERS)
    fan = np.column_stack([np.zeros(_CORNERS, np.int64), 1 + k, 1 + (k + 1) % _CORNERS])
    sides = np.concatenate([fan[:, 1:], [[0, 1]]])
    first = (_CORNERS + 1) * np.arange(count)[:, None, None]
    return Stones(
        [f"disk {number}" for number in range(1, count + 1)],
        vertices,
        np.repeat(np.arange(count), _CORNERS + 1),
        (first + fan).reshape(-1, 3),
        (first + sides).reshape(-1, 2),
    )


def _cells(cells: Sequence[Cell], start: Array) -> list[str | None]:
    names: list[str | None] = [None] * len(start)
    for cell in cells:
        for number in members(cell, start).tolist():
            names[number] = cell.name
    return names
