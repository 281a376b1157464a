"""Time series for ParaView: all disks, the contacts that transmit a force, and the cells."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from mechanics.arrays import Array
from mechanics.planar.measures.cells import Cell
from pipelines.geology.observe import CELL_COLUMNS, Fields
from pipelines.geology.sample import PreparedSample
from pipelines.results.vtu import LINE, POLYGON, VERTEX, UnstructuredGrid, cells_of, write_pvd, write_vtu

__all__ = ["write_series"]

_CORNERS = 48  # of the polygon that stands for a cell
_UNITS = {
    "radius": "m",
    "velocity": "m/s",
    "spin": "rad/s",
    "turn": "rad",
    "pressure": "Pa",
    "force": "N",
    "force_normal": "N",
    "force_tangential": "N",
    "gap": "m",
    "time": "s",
    **dict.fromkeys(("x", "y"), "m"),
    **dict.fromkeys(("sigma_xx", "sigma_yy", "sigma_xy", "p", "q"), "Pa"),
    **dict.fromkeys(("turned", "direction", "fabric_direction"), "°"),
}


def write_series(
    folder: Path,
    instants: Sequence[Fields],
    sample: PreparedSample,
    cells: Sequence[Cell],
    rows: Mapping[str, Mapping[str, Array]],
) -> None:
    """Write `fields.pvd`, `contacts.pvd` and, if there are cells, `cells.pvd` with a file for each instant.

    Parameters
    ----------
    folder : for the files
    instants : of all disks
    cells : followed through the run
    rows : columns by cell; that nearest to each instant is taken
    """
    series: dict[str, list[tuple[float, str]]] = {"fields": [], "contacts": []}
    if cells:
        series["cells"] = []
    for name in series:
        (folder / name).mkdir()
    for fields in instants:
        grids = {"fields": _disks(fields, sample), "contacts": _contacts(fields)}
        if cells:
            grids["cells"] = _cells(fields, cells, rows)
        for name, grid in grids.items():
            path = f"{name}/{fields.step:08d}.vtu"
            write_vtu(folder / path, grid)
            series[name].append((fields.time, path))
    for name, datasets in series.items():
        write_pvd(folder / f"{name}.pvd", datasets)


def _space(vectors: Array) -> Array:
    """Return vectors of the plane (n, 2) as vectors of space (n, 3)."""
    return np.column_stack([vectors, np.zeros(len(vectors))])


def _disks(fields: Fields, sample: PreparedSample) -> UnstructuredGrid:
    """Return a point for each disk."""
    count = len(sample.radius)
    data = {
        "radius": sample.radius,
        "layer": sample.layer,
        "velocity": _space(fields.velocity[:count, :2]),
        "spin": fields.velocity[:count, 2],
        "turn": fields.position[:count, 2],
        "pressure": fields.pressure,
        "volume": fields.volume,
        "shear": fields.shear,
    }
    cells = cells_of(VERTEX, np.arange(count)[:, None].tolist())
    return UnstructuredGrid(_space(fields.position[:count, :2]), cells, data, {}, _UNITS)


def _contacts(fields: Fields) -> UnstructuredGrid:
    """Return a line for each contact, with its values at both ends, as tubes of force chains need them."""
    count = len(fields.bodies)
    data = {
        "force": _space(fields.force),
        "force_normal": fields.force_normal,
        "force_tangential": fields.force_tangential,
        "gap": fields.gap,
    }
    lines = cells_of(LINE, np.arange(2 * count).reshape(-1, 2).tolist())
    ends = {name: np.repeat(values, 2, axis=0) for name, values in data.items()}
    return UnstructuredGrid(
        _space(fields.branches.reshape(-1, 2)), lines, ends, {"bodies": fields.bodies}, _UNITS
    )


def _cells(
    fields: Fields, cells: Sequence[Cell], rows: Mapping[str, Mapping[str, Array]]
) -> UnstructuredGrid:
    """Return an ellipse for each cell, its circle at the start stretched by λx and λy, with its row."""
    turn = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)
    points, data = [], {column: np.zeros(len(cells)) for column in CELL_COLUMNS}
    for number, cell in enumerate(cells):
        row = rows[cell.name]
        nearest = int(np.argmin(np.abs(row["step"] - fields.step)))
        for column, values in data.items():
            values[number] = row[column][nearest]
        axes = cell.radius * np.array([data["lambda_x"][number], data["lambda_y"][number]])
        middle = np.array([data["x"][number], data["y"][number]])
        points.append(middle + axes * np.column_stack([np.cos(turn), np.sin(turn)]))
    corners = np.arange(len(cells) * _CORNERS).reshape(len(cells), _CORNERS).tolist()
    return UnstructuredGrid(_space(np.vstack(points)), cells_of(POLYGON, corners), {}, data, _UNITS)
