"""Checkpoints of a run in HDF5: each is written whole or not at all, and checked before a run goes on from it.

A checkpoint is ``checkpoint-STEP.h5``; what grows with every step, the histories and frames, stands in files
``history-STEP.h5`` that are written once and to which the checkpoints refer. Each file appears by a rename after its
content has reached the disk, and has a checksum in the block that HDF5 leaves to its users. The last two checkpoints
are kept, so that one remains if the newest is damaged.

HDF5 holds the arrays, under the names of what they belong to; the data set ``values`` holds all else, as JSON.
"""

import hashlib
import io
import json
import os
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from mechanics.carried import Carried, Rows
from mechanics.contact.contacts import Contacts
from mechanics.contact.shared_area import Recess
from mechanics.dynamics.contact_problem import JointCompliance
from mechanics.dynamics.outcome import StaticStart
from mechanics.dynamics.step import ContactForces
from mechanics.planar.model import PlanarState
from mechanics.planar.result import PlanarFrame
from mechanics.results.contact_result import ContactResult
from mechanics.results.result import Frame, Largest
from mechanics.results.stages import StageResult
from mechanics.scene.laws.law import Terms
from mechanics.scene.state import State
from pipelines.results.vtkhdf import ROOM

_RECORDS = {
    record.__name__: record
    for record in (
        ContactForces,
        ContactResult,
        Contacts,
        Frame,
        JointCompliance,
        Largest,
        PlanarFrame,
        PlanarState,
        Recess,
        StageResult,
        State,
        StaticStart,
        Terms,
    )
}
_HEAD = 512  # bytes that HDF5 leaves to its users; the least that it allows
_VALUES = "values"
_GENERATIONS = 2  # checkpoints that are kept


class DamagedError(Exception):
    """File whose content is not what was written."""


@dataclass(frozen=True)
class Checkpoint:
    """Contents of a checkpoint.

    Attributes
    ----------
    step : after which it was written
    carried : what the run carried then
    notes : what else its writer wished to know again, as JSON has it
    """

    step: int
    carried: Carried
    notes: Mapping[str, Any]


class Checkpoints:
    """Checkpoints in a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._kept: list[str] = []
        self._histories: list[list[str]] = []  # names and checksums
        self._counts: dict[str, int] = {}  # rows that these hold, by name

    def steps(self) -> list[int]:
        """Return the steps after which there is a checkpoint, the last one first."""
        return sorted(
            (int(path.stem.split("-")[1]) for path in self._folder.glob("checkpoint-*.h5")), reverse=True
        )

    def write(self, step: int, carried: Carried, notes: Mapping[str, Any]) -> None:
        """Write a checkpoint; if that fails, those before stay as they are.

        Raises
        ------
        OSError : the disk is full, for example
        """
        store = _Store(self._counts)
        values = store.plain(carried, "")
        histories = list(self._histories)
        if store.rows:
            grown = _Store({})
            content = {name: grown.rows_of(rows, name) for name, rows in store.rows.items()}
            name = f"history-{step:08d}.h5"
            histories.append([name, write_whole(self._folder / name, _image(content, grown.arrays))])
        whole = {"step": step, "notes": dict(notes), "carried": values, "histories": histories}
        name = f"checkpoint-{step:08d}.h5"
        write_whole(self._folder / name, _image(whole, store.arrays))
        self._histories, self._counts = histories, store.counts
        self._kept = [*self._kept, name][-_GENERATIONS:]
        self._remove_others()

    def read(self) -> tuple[Checkpoint | None, list[str]]:
        """Return the last checkpoint that is whole, None if there is none; and what is wrong with later ones."""
        wrong = []
        for step in self.steps():
            name = f"checkpoint-{step:08d}.h5"
            try:
                content = self._read(name)
            except DamagedError as error:
                wrong.append(f"{name} is damaged: {error}")
                continue
            return content, wrong
        return None, wrong

    def _read(self, name: str) -> Checkpoint:
        values, arrays = _contents(self._folder / name)
        rows: dict[str, Rows[Any]] = {}
        for history, checksum in values["histories"]:
            loaded, columns = _contents(self._folder / history, checksum)
            for key, content in loaded.items():
                rows.setdefault(key, Rows()).extend(_revived_rows(content, columns))
        carried = _revived(values["carried"], arrays, rows)
        self._kept, self._histories = [name], values["histories"]
        self._counts = {key: len(row) for key, row in rows.items()}
        return Checkpoint(values["step"], carried, values["notes"])

    def _remove_others(self) -> None:
        """Remove older checkpoints, and what no checkpoint refers to."""
        wanted = {*self._kept, *(name for name, _ in self._histories)}
        for path in self._folder.glob("*.h5"):
            if path.name not in wanted:
                path.unlink(missing_ok=True)


def write_whole(path: Path, content: bytes) -> str:
    """Write a file that appears whole or not at all, also if the power fails; return its checksum."""
    passing = path.with_name(f".{path.name}")
    try:
        with passing.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        passing.replace(path)
    except BaseException:
        passing.unlink(missing_ok=True)
        raise
    # the name is on the disk once the folder is; some systems cannot say so
    with suppress(OSError):
        handle = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
    return hashlib.sha256(content).hexdigest()


def write_shared(path: Path, content: bytes) -> None:
    """Write a file that appears whole or not at all, whoever else writes the same one at the same time."""
    handle, passing = tempfile.mkstemp(prefix=".", suffix=".part", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        Path(passing).chmod(0o644)
        os.replace(passing, path)
    except BaseException:
        Path(passing).unlink(missing_ok=True)
        raise


def _image(values: Any, arrays: Mapping[str, np.ndarray[Any, Any]]) -> bytes:
    """Return an HDF5 file with its checksum, made in memory: HDF5 itself may not survive a disk that is full."""
    import h5py

    encoded = np.frombuffer(json.dumps(values, ensure_ascii=False).encode(), dtype=np.uint8)
    with h5py.File(
        "image", "w", driver="core", backing_store=False, block_size=ROOM, userblock_size=_HEAD
    ) as file:
        file[_VALUES] = encoded
        for name, array in arrays.items():
            file[name] = array
        file.flush()
        # the image leaves the head out
        content = bytes(file.id.get_file_image())
    head = f"MOMA sha256 {hashlib.sha256(content).hexdigest()}\n".encode()
    return head.ljust(_HEAD, b"\0") + content


def _contents(path: Path, checksum: str | None = None) -> tuple[Any, dict[str, Any]]:
    """Return the values and the arrays of a file, if they are what was written."""
    import h5py

    try:
        whole = path.read_bytes()
    except OSError as error:
        raise DamagedError(f"{path.name} cannot be read ({error.strerror})") from error
    head = f"MOMA sha256 {hashlib.sha256(whole[_HEAD:]).hexdigest()}\n".encode()
    if not whole.startswith(head) or checksum not in (None, hashlib.sha256(whole).hexdigest()):
        raise DamagedError(f"the checksum of {path.name} does not match its content")
    arrays: dict[str, Any] = {}
    with h5py.File(io.BytesIO(whole), "r") as file:
        file.visititems(
            lambda name, item: arrays.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None
        )
    return json.loads(bytes(arrays.pop(_VALUES))), arrays


class _Store:
    """Values as JSON can hold them, with the arrays by name, and the rows that are new."""

    def __init__(self, counts: Mapping[str, int]) -> None:
        self.arrays: dict[str, np.ndarray[Any, Any]] = {}
        self.rows: dict[str, Sequence[Any]] = {}
        self.counts = dict(counts)

    def plain(self, value: Any, name: str) -> Any:
        """Return a value as JSON has it: plain ones as they are, others as a list of their kind and their content."""
        if isinstance(value, np.generic):
            value = value.item()
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, np.ndarray):
            return ["array", self._array(value, name)]
        if isinstance(value, csr_array):
            parts = {key: getattr(value, key) for key in ("data", "indices", "indptr")}
            return ["sparse", list(value.shape), self._named(parts, name)]
        if isinstance(value, Rows):
            if len(value) > self.counts.get(name, 0):
                self.rows[name] = value[self.counts.get(name, 0) :]
                self.counts[name] = len(value)
            return ["rows", name]
        if type(value).__name__ in _RECORDS:
            return ["record", type(value).__name__, self._named(dict(_items(value)), name)]
        if isinstance(value, Mapping):
            return ["mapping", self._named(value, name)]
        if isinstance(value, tuple):
            return self._tuple(value, name)
        raise TypeError(f"{name} is a {type(value).__name__}, which no checkpoint holds")

    def rows_of(self, rows: Sequence[Any], name: str) -> Any:
        """Return rows: of numbers and arrays column by column, others one by one."""
        if isinstance(rows[0], tuple) and not hasattr(rows[0], "_fields"):
            columns = (np.array(column) for column in zip(*rows, strict=True))
            return ["columns", [self._array(column, f"{name}/{k}") for k, column in enumerate(columns)]]
        return ["list", [self.plain(row, f"{name}/{k}") for k, row in enumerate(rows)]]

    def _named(self, values: Mapping[str, Any], name: str) -> dict[str, Any]:
        return {key: self.plain(value, f"{name}/{key}" if name else key) for key, value in values.items()}

    def _tuple(self, value: tuple[Any, ...], name: str) -> Any:
        arrays = [entry for entry in value if isinstance(entry, np.ndarray)]
        kinds = {(array.dtype, array.shape[1:], array.ndim > 0) for array in arrays}
        if len(kinds) != 1 or any(entry is not None and not isinstance(entry, np.ndarray) for entry in value):
            return ["tuple", [self.plain(entry, f"{name}/{k}") for k, entry in enumerate(value)]]
        # thousands of small arrays are one large one
        sizes = np.array([-1 if entry is None else len(entry) for entry in value])
        return ["arrays", self._array(np.concatenate(arrays), name), self._array(sizes, f"{name} sizes")]

    def _array(self, array: np.ndarray[Any, Any], name: str) -> str:
        self.arrays[name] = np.char.encode(array, "utf-8") if array.dtype.kind == "U" else array
        return name


def _items(record: Any) -> Iterator[tuple[str, Any]]:
    names = record._fields if hasattr(record, "_fields") else [field.name for field in fields(record)]
    return ((name, getattr(record, name)) for name in names)


def _revived(value: Any, arrays: Mapping[str, Any], rows: Mapping[str, Rows[Any]]) -> Any:
    """Return what `_Store.plain` was given."""
    if not isinstance(value, list):
        return value

    def each(values: Mapping[str, Any]) -> dict[str, Any]:
        """Return a mapping of plain values, each made what it was."""
        return {key: _revived(value, arrays, rows) for key, value in values.items()}

    kind, *content = value
    if kind == "array":
        return _array(arrays[content[0]])
    if kind == "arrays":
        whole, sizes = arrays[content[0]], arrays[content[1]]
        ends = np.cumsum(np.maximum(sizes, 0))
        return tuple(
            None if size < 0 else whole[end - size : end].copy()
            for size, end in zip(sizes, ends, strict=True)
        )
    if kind == "tuple":
        return tuple(_revived(entry, arrays, rows) for entry in content[0])
    if kind == "rows":
        return rows.get(content[0], Rows())
    if kind == "sparse":
        parts = each(content[1])
        return csr_array((parts["data"], parts["indices"], parts["indptr"]), shape=tuple(content[0]))
    if kind == "record":
        return _RECORDS[content[0]](**each(content[1]))
    return each(content[0])


def _revived_rows(value: Any, arrays: Mapping[str, Any]) -> list[Any]:
    kind, content = value
    if kind == "columns":
        # numbers become those of Python again
        columns = [arrays[name].tolist() if arrays[name].ndim == 1 else arrays[name] for name in content]
        return list(zip(*columns, strict=True))
    return [_revived(entry, arrays, {}) for entry in content]


def _array(array: Any) -> Any:
    return np.char.decode(array, "utf-8") if array.dtype.kind == "S" else array
