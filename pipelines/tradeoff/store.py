"""Measurements of a tradeoff study, one file for each run, so that it can be continued."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from enum import StrEnum
from functools import singledispatch
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import UsageError
from pipelines.results.checkpoints import write_shared
from pipelines.results.quantities import Quantities, quantities_from
from pipelines.results.summary import as_json
from pipelines.run.assemble import Assembly
from pipelines.scene.file import SceneFile
from pipelines.tuning.overlay import Overlay, overlay_from, overlay_record

INDEX = "trade.json"
_RUNS = "runs"


class Status(StrEnum):
    """Status of a run."""

    DONE = "done"
    FAILED = "failed"
    STOPPED = "stopped"
    NOT_BEGUN = "not begun"


@dataclass(frozen=True)
class Measured:
    """Measurements of one run that has ended.

    Attributes
    ----------
    name, overlay : its setting
    status : of the run
    elapsed : from start to end, including the start of the process [s]
    budget : of the study in which it ended [s]
    reason : why it failed or was stopped
    cpu, wall : time of the work alone: closing joints, simulating [s]
    memory, program_memory : peak of its process, and that before the work began [bytes]
    nodes : of all finite elements
    contacts, steps, unconverged_steps : of the run
    solver : method that found the solutions
    stages : wall time by stage [s]
    quantities : results; None unless it is done
    """

    name: str
    overlay: Overlay
    status: Status
    elapsed: float
    budget: float
    reason: str = ""
    cpu: float = 0.0
    wall: float = 0.0
    memory: int = 0
    program_memory: int = 0
    nodes: int = 0
    contacts: int = 0
    steps: int = 0
    unconverged_steps: int = 0
    solver: str = ""
    stages: Mapping[str, float] | None = None
    quantities: Quantities | None = None


@dataclass(frozen=True)
class Store:
    """The folder of a study.

    Attributes
    ----------
    folder : of the study
    key : of scene, stones and version, see `study_key`; results with other keys in the folder are left alone
    """

    folder: Path
    key: str

    def prepare(self) -> None:
        """Create the folder.

        Raises
        ------
        UsageError : the place holds something else, or cannot be written
        """
        where, remedy = str(self.folder), "name another folder"
        if self.folder.is_symlink() or (self.folder.exists() and not self.folder.is_dir()):
            raise UsageError("is not a folder", where=where, remedy=remedy)
        try:
            if self.folder.is_dir() and any(self.folder.iterdir()) and not (self.folder / _RUNS).is_dir():
                raise UsageError("holds what no study of MOMA wrote", where=where, remedy=remedy)
            (self.folder / _RUNS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UsageError(f"cannot be written: {error.strerror}", where=where, remedy=remedy) from error

    def load(self) -> dict[str, Measured]:
        """Return all runs of this study that have ended, by the name of their setting."""
        measured = {}
        for file in sorted((self.folder / _RUNS).glob("*.json")):
            try:
                record = json.loads(file.read_text(encoding="utf-8"))
                if record.pop("study") == self.key:
                    run_measured = _measured(record)
                    measured[run_measured.name] = run_measured
            except (OSError, ValueError, LookupError, TypeError):
                continue  # not a result of a study: the run is repeated
        return measured

    def keep(self, run: Measured) -> None:
        """Write one run; the file appears whole or not at all."""
        record = {
            "study": self.key,
            **{field.name: getattr(run, field.name) for field in fields(run)},
            "overlay": overlay_record(run.overlay),
            "quantities": None if run.quantities is None else run.quantities.as_record(),
        }
        name = hashlib.sha256(json.dumps([self.key, record["overlay"]]).encode()).hexdigest()[:16]
        self.write(f"{_RUNS}/{name}.json", as_json(record).encode("utf-8"))

    def write(self, name: str, content: bytes) -> None:
        """Write a file of the folder; it appears whole or not at all.

        Raises
        ------
        UsageError : the disk is full, or permission is missing
        """
        target = self.folder / name
        try:
            write_shared(target, content)
        except OSError as error:
            raise UsageError(f"cannot be written: {error.strerror}", where=str(target)) from error


def _measured(record: dict[str, Any]) -> Measured:
    quantities = record["quantities"]
    return Measured(
        **record
        | {
            "overlay": overlay_from(record["overlay"]),
            "status": Status(record["status"]),
            "quantities": None if quantities is None else quantities_from(quantities),
        }
    )


def study_key(scene: SceneFile, assembly: Assembly) -> str:
    """Return a digest of the scene file, of the stones and loads that it stands for, and of the version."""
    digest = hashlib.sha256()
    for part in (version("moma-masonry"), scene.text, assembly.scene):
        _feed(part, digest)
    return digest.hexdigest()[:16]


@singledispatch
def _feed(value: object, digest: Any) -> None:
    """Add a value, with everything that it contains, to the digest."""
    if is_dataclass(value):
        for field in fields(value):
            _feed(field.name, digest)
            _feed(getattr(value, field.name), digest)
    else:
        digest.update(f"{type(value).__name__} {value!r};".encode())


@_feed.register
def _(value: np.ndarray, digest: Any) -> None:
    digest.update(f"array {value.dtype} {value.shape};".encode())
    digest.update(np.ascontiguousarray(value).tobytes())


@_feed.register(tuple)
@_feed.register(list)
def _(value: Any, digest: Any) -> None:
    digest.update(f"row {len(value)};".encode())
    for one in value:
        _feed(one, digest)


@_feed.register(dict)
def _(value: Any, digest: Any) -> None:
    for key in sorted(value, key=str):
        _feed(key, digest)
        _feed(value[key], digest)


@_feed.register(frozenset)
def _(value: Any, digest: Any) -> None:
    _feed(sorted(value, key=str), digest)
