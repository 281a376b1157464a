"""Time series for ParaView: all disks, the contacts that transmit a force, and the cells."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from archmodel.quantities import units_of
from mechanics.arrays import Array, Ints
from mechanics.planar.measures.cells import Cell, members
from pipelines.geology.observe import CELL_COLUMNS, Fields
from pipelines.geology.sample import PreparedSample
from pipelines.results.vtu import CellType, UnstructuredGrid, cells_of, write_pvd, write_vtu

_UNITS = units_of("disks", "cell of disks")


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
    followed = {cell.name: members(cell, sample.centre) for cell in cells}
    for fields in instants:
        grids = {"fields": _disks(fields, sample, followed), "contacts": _contacts(fields)}
        if cells:
            grids["cells"] = _cells(fields, followed, rows)
        for name, grid in grids.items():
            path = f"{name}/{fields.step:08d}.vtu"
            write_vtu(folder / path, grid)
            series[name].append((fields.time, path))
    for name, datasets in series.items():
        write_pvd(folder / f"{name}.pvd", datasets)


def _space(vectors: Array) -> Array:
    """Return vectors of the plane (n, 2) as vectors of space (n, 3)."""
    return np.column_stack([vectors, np.zeros(len(vectors))])


def _disks(fields: Fields, sample: PreparedSample, followed: Mapping[str, Ints]) -> UnstructuredGrid:
    """Return a point for each disk; `cell` is the number of its cell from 1 on, 0 if it is in none."""
    count = len(sample.radius)
    cell = np.zeros(count, dtype=np.int64)
    for number, group in enumerate(followed.values(), start=1):
        cell[group] = number
    data = {
        "radius": sample.radius,
        "layer": sample.layer,
        "cell": cell,
        "velocity": _space(fields.velocity[:count, :2]),
        "spin": fields.velocity[:count, 2],
        "turn": fields.position[:count, 2],
        "pressure": fields.pressure,
        "volume": fields.volume,
        "shear": fields.shear,
    }
    cells = cells_of(CellType.VERTEX, np.arange(count)[:, None].tolist())
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
    lines = cells_of(CellType.LINE, np.arange(2 * count).reshape(-1, 2).tolist())
    ends = {name: np.repeat(values, 2, axis=0) for name, values in data.items()}
    return UnstructuredGrid(
        _space(fields.branches.reshape(-1, 2)), lines, ends, {"bodies": fields.bodies}, _UNITS
    )


def _cells(
    fields: Fields, followed: Mapping[str, Ints], rows: Mapping[str, Mapping[str, Array]]
) -> UnstructuredGrid:
    """Return the convex hull of the centres of each cell's disks, with its row."""
    points: list[Array] = []
    corners: list[list[int]] = []
    data = {column: np.zeros(len(followed)) for column in CELL_COLUMNS}
    for number, (name, group) in enumerate(followed.items()):
        row = rows[name]
        nearest = int(np.argmin(np.abs(row["step"] - fields.step)))
        for column, values in data.items():
            values[number] = row[column][nearest]
        place = fields.position[group, :2]
        hull = place[ConvexHull(place).vertices]
        first = sum(map(len, points))
        corners.append(list(range(first, first + len(hull))))
        points.append(hull)
    return UnstructuredGrid(_space(np.vstack(points)), cells_of(CellType.POLYGON, corners), {}, data, _UNITS)
