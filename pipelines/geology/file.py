"""Geological scene files: TOML text → a GeologyScene in which every key has been checked."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, cast

import numpy as np

from ground.errors import SceneError
from ground.settings import Setting
from ground.toml.keys import Numbers, build, keys_of, read_table
from ground.toml.lines import key_lines, parse_toml, read_text
from ground.toml.schema import TomlDocument, check_table, nearest, tables_of
from mechanics.planar.measures.cells import Cell
from mechanics.scene.loads.motions import ImposedMotion
from pipelines.geology.experiments.biaxial import Biaxial
from pipelines.geology.experiments.deposition import Deposition
from pipelines.geology.experiments.experiment import Experiment
from pipelines.geology.experiments.fault import Fault
from pipelines.geology.experiments.fold import Fold
from pipelines.geology.experiments.repose import Repose
from pipelines.geology.experiments.wedge import Wedge
from pipelines.geology.observe import WHOLE
from pipelines.geology.settings import DiskContact, GeologyOutput, Layer, SampleSettings, Stepping, Sweeping

EXPERIMENTS: Mapping[str, type[Any]] = {
    "deposit": Deposition,
    "fold": Fold,
    "fault": Fault,
    "biaxial": Biaxial,
    "wedge": Wedge,
    "repose": Repose,
}
"""Experiments by the name of their table, which is that of their command."""

_TABLES: Mapping[str, type[Any]] = {
    "sample": SampleSettings,
    "contact": DiskContact,
    "time": Stepping,
    "solver": Sweeping,
    "output": GeologyOutput,
}


@dataclass(frozen=True, kw_only=True)
class _Title:
    """Table [scene]."""

    name: Annotated[str | None, Setting("Title; by default the name of the file.")] = None
    note: Annotated[
        str, Setting("What a reader of the results has to know first, as a choice that was made.")
    ] = ""


@dataclass(frozen=True, kw_only=True)
class _CellTable:
    """Table [[cells]]."""

    name: Annotated[str, Setting("Name of the cell.")]
    centre: Annotated[Numbers, Setting("x and y at the start.", "m")]
    radius: Annotated[float, Setting("Radius at the start.", "m", above=0)]


_CORNERS = 73  # of the polygon that stands for a cell
_START = "see docs/howto/geology.md for a scene to start from"


@dataclass(frozen=True)
class GeologyScene:
    """A geological scene as its author wrote it, checked, with all defaults filled in.

    Attributes
    ----------
    document : file and lines, for error messages
    text : the file, as it is kept with the run
    name : title
    note : what a reader of the results has to know first; "": nothing
    kind : of `EXPERIMENTS`
    cells : followed through the run
    layers : of other materials than `[sample]` and `[contact]` say, from below; () if there are none
    """

    document: TomlDocument
    text: str
    name: str
    note: str
    kind: str
    sample: SampleSettings
    contact: DiskContact
    time: Stepping
    solver: Sweeping
    output: GeologyOutput
    experiment: Experiment
    cells: tuple[Cell, ...]
    layers: tuple[Layer, ...] = ()

    @property
    def tables(self) -> Mapping[str, Any]:
        """Tables of settings, by name."""
        return {
            "sample": self.sample,
            "contact": self.contact,
            "time": self.time,
            "solver": self.solver,
            self.kind: self.experiment,
        }


def read_geology(path: str | Path, kind: str) -> GeologyScene:
    """Read and check the scene file of an experiment.

    Raises
    ------
    SceneError : with file and line, at the first mistake
    """
    return parse_geology(read_text(path, SceneError, missing="no such scene file"), str(path), kind)


def parse_geology(text: str, path: str, kind: str) -> GeologyScene:
    """Check the text of the scene file of an experiment; `path` is for the messages."""
    toml = parse_toml(text, path, SceneError, _START)
    document = TomlDocument(path, key_lines(text))
    allowed = ["scene", *_TABLES, kind, "cells", "layers"]
    for name in toml:
        if name not in allowed:
            other = (
                f"this is a scene of `moma geology {name}`" if name in EXPERIMENTS else nearest(name, allowed)
            )
            document.fail(f"unknown table [{name}]", name, remedy=other)
    if kind not in toml:
        document.fail(f"no table [{kind}]", remedy=_START)
    title = read_table(document, ("scene",), _table(document, toml, "scene"), _Title)
    tables = {name: _built(document, toml, name, owner) for name, owner in _TABLES.items()}
    scene = GeologyScene(
        document=document,
        text=text,
        name=title.name or Path(path).stem,
        note=title.note,
        kind=kind,
        experiment=cast(Experiment, _built(document, toml, kind, EXPERIMENTS[kind])),
        cells=_cells(document, toml),
        layers=_layers(document, toml),
        **tables,
    )
    _check_cells(scene)
    _check_motion(scene)
    return scene


def _check_cells(scene: GeologyScene) -> None:
    """Refuse a cell that reaches out of the sample by more than a disk."""
    experiment, slack, turn = scene.experiment, scene.sample.largest, np.linspace(0.0, 2.0 * np.pi, _CORNERS)
    for number, cell in enumerate(scene.cells):
        x = cell.centre[0] + cell.radius * np.cos(turn)
        y = cell.centre[1] + cell.radius * np.sin(turn)
        top = experiment.top(np.clip(x, 0.0, experiment.length))
        out = np.max([-x, x - experiment.length, -y, y - top], axis=0)
        worst = int(np.argmax(out))
        if out[worst] > slack:
            scene.document.fail(
                f"cell {cell.name!r} reaches out of the sample by {out[worst]:.4g} m at "
                f"({x[worst]:.4g}, {y[worst]:.4g}); it is {experiment.length:g} m long, "
                f"and {top[worst]:.4g} m high there",
                "cells",
                str(number),
                remedy="place it within the sample, or make it smaller",
            )


def _check_motion(scene: GeologyScene) -> None:
    """Refuse walls that the experiment moves by more than a disk's radius in a step: they would pass through disks."""
    time, smallest = scene.time, scene.sample.smallest
    with scene.document.at(scene.kind):
        setup = scene.experiment.setup(time.step, time.step * time.steps)
    for motion in (motion for motion in setup.loads.motions if isinstance(motion, ImposedMotion)):
        way = time.step * float(np.linalg.norm(np.atleast_2d(motion.velocity.value), axis=1).max())
        if way > smallest:
            scene.document.fail(
                f"in a step of {time.step:g} s the wall {min(motion.stones)!r} goes {way:.4g} m, more than the "
                f"smallest radius, {smallest:g} m: it would pass through disks",
                "time",
                "step",
                remedy=f"take a step of {time.step * smallest / way:.2g} s or less",
            )


def _table(document: TomlDocument, toml: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    content = toml.get(name, {})
    if not isinstance(content, dict):
        document.fail(f"{name!r} is not a table", name, remedy=f"write [{name}] on a line of its own")
    return content


def _built(document: TomlDocument, toml: Mapping[str, Any], name: str, owner: type[Any]) -> Any:
    values = check_table(document, (name,), _table(document, toml, name), keys_of(owner))
    with document.at(name):
        return build(owner, values)


def _layers(document: TomlDocument, toml: Mapping[str, Any]) -> tuple[Layer, ...]:
    layers: list[Layer] = []
    for number, (place, content) in enumerate(tables_of(document, toml, "layers")):
        layers.append(read_table(document, place, content, Layer, f"[[layers]] {number + 1}"))
        if number and layers[-1].top <= layers[-2].top:
            document.fail(
                f"top = {layers[-1].top:g} is not above that of the layer before, {layers[-2].top:g}",
                *place,
                "top",
                remedy="give the layers from below",
            )
    return tuple(layers)


def _cells(document: TomlDocument, toml: Mapping[str, Any]) -> tuple[Cell, ...]:
    cells: dict[str, Cell] = {}
    for number, (place, content) in enumerate(tables_of(document, toml, "cells")):
        cell = read_table(document, place, content, _CellTable, f"[[cells]] {number + 1}")
        if len(cell.centre) != 2:
            document.fail(f"centre = {list(cell.centre)}", *place, "centre", remedy="give x and y")
        if cell.name == WHOLE:
            document.fail(f"{WHOLE!r} is the name of all disks", *place, "name", remedy="give another name")
        if cell.name in cells:
            document.fail(f"cell {cell.name!r} is given twice", *place, "name")
        with document.at(*place):
            cells[cell.name] = Cell(cell.name, (cell.centre[0], cell.centre[1]), cell.radius)
    return tuple(cells.values())
