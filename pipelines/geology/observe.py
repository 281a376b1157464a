"""Observation of a run of disks: rows of the cells and of the whole sample, and instants of all disks."""

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

import numpy as np

from archmodel.quantities import quantities_of
from mechanics.arrays import Array, Ints
from mechanics.planar.measures.cells import Cell, layer_members, members, shape_of
from mechanics.planar.measures.tensors import deformation, fabric_of, mean_stress, moments
from mechanics.planar.measures.tessellation import Tessellation, tessellation
from mechanics.planar.result import PlanarInstant

_EXPERIMENT = "experiment.csv"  # rows of what an experiment observes
WHOLE = "whole sample"
"""Name of the rows of all disks."""

CELL_COLUMNS = tuple(quantities_of("cell of disks"))
"""Columns of the rows of a cell."""


@dataclass(frozen=True)
class Fields:
    """All disks at one instant.

    Attributes
    ----------
    step, time : number of the step, [s]
    position, velocity : (nb, 3) of disks, then walls
    pressure : (nd,) mean pressure in the share of each disk, 0 where it has none [Pa]
    volume, shear : (nd,) local deformation since the start (`DiskDeformation`) [-]
    bodies : (n, 2) of contacts that transmit a force: candidate and antagonist, numbered as the rows of `position`
    point, normal : (n, 2) of these [m], and from antagonist to candidate [-]
    force : (n, 2) mean force over the step on the candidate, in x and y [N]
    gap : (n,) negative: overlap [m]
    """

    step: int
    time: float
    position: Array
    velocity: Array
    pressure: Array
    volume: Array
    shear: Array
    bodies: Ints
    point: Array
    normal: Array
    force: Array
    gap: Array

    @property
    def force_normal(self) -> Array:
        """Normal forces (n,), compression positive [N]."""
        return np.asarray((self.normal * self.force).sum(axis=1))

    @property
    def force_tangential(self) -> Array:
        """Tangential forces (n,), along the normal turned by +90° [N]."""
        return np.asarray(self.normal[:, 0] * self.force[:, 1] - self.normal[:, 1] * self.force[:, 0])

    @property
    def branches(self) -> Array:
        """Lines (n, 2, 2) between the centres of two disks, or from a disk to the point on a wall [m]."""
        first, second = self.bodies.T
        on_wall = second >= len(self.pressure)
        far = np.where(on_wall[:, None], self.point, self.position[second, :2])
        return np.stack([self.position[first, :2], far], axis=1)


class ObservedRun:
    """Rows and instants of a run, written as it goes on; a resumed run writes those after its checkpoint again.

    Parameters
    ----------
    folder : for the files, which exists
    cells : followed by the disks that they hold at the start
    start : (nd, 2) centres at the start [m]
    radius : (nd,) [m]
    thickness : of the slice [m]
    layer : (nd,) number of the layer of each disk, 0 at the base: layers are followed too; None: they are not
    observables : of the experiment, by centres at the start and now, radii and time (`Observed`); None: it has none

    Raises
    ------
    SceneError : a cell has too few disks
    """

    def __init__(
        self,
        folder: Path,
        cells: Sequence[Cell],
        start: Array,
        radius: Array,
        thickness: float,
        layer: Ints | None = None,
        observables: Callable[[Array, Array, Array, float], Mapping[str, float]] | None = None,
    ) -> None:
        self._folder, self._start, self._radius, self._thickness = folder, start, radius, thickness
        groups: dict[str, Ints] = {cell.name: members(cell, start) for cell in cells}
        layers = {} if layer is None else layer_members(layer)
        self._groups = layers | groups | {WHOLE: np.arange(len(radius))}
        self._observables = observables
        self._reference = tessellation(start, radius)
        self._last: tuple[PlanarInstant, Tessellation, Array] | None = None

    def row(self, instant: PlanarInstant) -> None:
        """Add a row to the file of each cell, and of the whole sample."""
        place = instant.position[: len(self._radius), :2]
        shares, moment = self._measured(instant)
        for number, (name, group) in enumerate(self._groups.items()):
            values = self._values(instant, name, group, place, shares, moment)
            _append(
                self._folder / f"cell-{number:03d}.csv", {column: values[column] for column in CELL_COLUMNS}
            )
        if self._observables is not None:
            seen = self._observables(self._start, place, self._radius, instant.time)
            _append(self._folder / _EXPERIMENT, {"step": instant.step, "time": instant.time, **seen})

    def _measured(self, instant: PlanarInstant) -> tuple[Tessellation, Array]:
        """Return the tessellation and the moments of the disks, made once for rows and fields of the same instant."""
        if self._last is None or self._last[0] is not instant:
            count, contacts, centre = len(self._radius), instant.contacts, instant.position[:, :2]
            shares = tessellation(centre[:count], self._radius)
            moment = moments(count, centre, contacts.bodies, contacts.point, contacts.force)
            self._last = instant, shares, moment
        return self._last[1:]

    def _values(
        self,
        instant: PlanarInstant,
        name: str,
        group: Ints,
        place: Array,
        shares: Tessellation,
        moment: Array,
    ) -> dict[str, float]:
        chosen = np.zeros(len(self._radius), dtype=bool)
        chosen[group] = True
        contacts = instant.contacts
        shape = shape_of(self._start[group], place[group])
        # disks at the rim have a part of their area only
        inner = chosen & shares.inside
        stress = mean_stress(moment[inner], max(float(shares.share[inner].sum()), 1e-300), self._thickness)
        fabric = fabric_of(chosen, contacts.bodies, contacts.normal, contacts.force, self._radius, shares)
        return {
            "step": instant.step,
            "time": instant.time,
            "x": float(shape.centre[0]),
            "y": float(shape.centre[1]),
            "lambda_x": float(shape.extent[0]),
            "lambda_y": float(shape.extent[1]),
            "spread_x": float(shape.spread[0]),
            "spread_y": float(shape.spread[1]),
            "volume": shape.volume,
            "shear": shape.shear,
            "turned": float(np.degrees(shape.turned)),
            "sigma_xx": float(stress.tensor[0, 0]),
            "sigma_yy": float(stress.tensor[1, 1]),
            "sigma_xy": float(stress.tensor[0, 1]),
            "p": stress.pressure,
            "q": stress.deviator,
            "direction": float(np.degrees(stress.direction)),
            "anisotropy": fabric.anisotropy,
            "a": fabric.density,
            "fabric_direction": float(np.degrees(fabric.direction)),
            "coordination": fabric.coordination,
            "porosity": fabric.porosity,
        }

    def fields(self, instant: PlanarInstant) -> None:
        """Keep all disks at this instant."""
        count, contacts = len(self._radius), instant.contacts
        place = instant.position[:count, :2]
        shares, moment = self._measured(instant)
        area = np.where(shares.share > 0, shares.share, np.inf) * self._thickness
        strain = deformation(self._start, place, self._reference)
        bears = contacts.force.any(axis=1)
        arrays: dict[str, Any] = {
            "step": instant.step,
            "time": instant.time,
            "position": instant.position,
            "velocity": instant.velocity,
            "pressure": 0.5 * np.trace(moment, axis1=1, axis2=2) / area,
            "volume": strain.volume,
            "shear": strain.shear,
            **{
                name: getattr(contacts, name)[bears] for name in ("bodies", "point", "normal", "force", "gap")
            },
        }
        path = self._folder / f"fields-{instant.step:08d}.npz"
        fresh = path.with_suffix(".new")
        with fresh.open("wb") as file:
            np.savez_compressed(file, **arrays)
        fresh.replace(path)

    def rows(self, every: int) -> dict[str, dict[str, Array]]:
        """Return the columns of the rows of each `every`-th step and the last, by cell, in the order of steps."""
        return {
            name: read_rows(self._folder / f"cell-{number:03d}.csv", every)
            for number, name in enumerate(self._groups)
        }

    def experiment_rows(self, every: int) -> dict[str, Array]:
        """Return the columns of what the experiment observes, by rows as `rows`; none if it observes nothing."""
        return {} if self._observables is None else read_rows(self._folder / _EXPERIMENT, every)

    def instants(self, wanted: Callable[[int], bool]) -> "Instants":
        """Return the instants of the steps that are wanted and the last, in the order of steps."""
        paths = sorted(self._folder.glob("fields-*.npz"))
        chosen = [path for path in paths if wanted(int(path.stem.partition("-")[2])) or path == paths[-1]]
        return Instants(tuple(chosen))


@dataclass(frozen=True)
class Instants(Sequence[Fields]):
    """Instants in files, read as they are asked for: those of a long run do not fit into memory."""

    paths: tuple[Path, ...]

    def __len__(self) -> int:
        return len(self.paths)

    @overload
    def __getitem__(self, index: int) -> Fields: ...
    @overload
    def __getitem__(self, index: slice) -> "Instants": ...
    def __getitem__(self, index: int | slice) -> "Fields | Instants":
        """Read an instant, or choose some."""
        if isinstance(index, slice):
            return Instants(self.paths[index])
        with np.load(self.paths[index]) as data:
            arrays = {name: data[name] for name in data.files}
        return Fields(**arrays | {"step": int(arrays["step"]), "time": float(arrays["time"])})


def read_rows(path: Path, every: int = 1) -> dict[str, Array]:
    """Return the columns of a file of rows; of rows of one step the last, and none that a kill cut short.

    A run that was stopped leaves a row of the instant at which it was; it is left out if there is a later one, and its
    step is no multiple of `every`.
    """
    rows: dict[int, list[float]] = {}
    with path.open(encoding="utf-8", newline="") as file:
        columns, *lines = csv.reader(file)
    for values in lines:
        if len(values) == len(columns):
            rows[int(values[0])] = [float(value) for value in values[1:]]
    steps = sorted(step for step in rows if step % every == 0 or step == max(rows))
    table = np.array([rows[step] for step in steps]).reshape(-1, len(columns) - 1)
    return dict(zip(columns, [np.array(steps), *table.T], strict=True))


def _append(path: Path, values: Mapping[str, float]) -> None:
    """Add a row to a file, which begins with the names of its columns."""
    new = not path.exists()
    with path.open("a", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        if new:
            writer.writerow(values)
        writer.writerow([repr(value) for value in values.values()])
