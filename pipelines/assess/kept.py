"""Answers of long work on the disk, so that the same command goes on from there after it was stopped or killed.

Each answer is a file of its own, named by the digest of all that decides on it: where a scene, a stone or a library has
changed since, the answer is not found and the work is done again.
"""

import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import UsageError, storing
from pipelines.results.checkpoints import write_whole
from pipelines.results.folder import locked
from pipelines.run.record import versions


class Kept:
    """Answers in a folder.

    Parameters
    ----------
    place : the folder
    records : dataclasses of which the answers are made, beside arrays and plain values
    """

    def __init__(self, place: Path, records: Sequence[type]) -> None:
        self._place = place
        self._records = {record.__name__: record for record in records}
        self._versions = json.dumps(dict(versions()), sort_keys=True)

    def __len__(self) -> int:
        return sum(1 for _ in self._place.glob("*.json"))

    def get(self, decides: Sequence[str]) -> Any:
        """Return the answer to what these texts decide; None if it is not kept, or damaged."""
        try:
            return self.revived(json.loads(self._file(decides).read_text(encoding="utf-8")))
        except (OSError, ValueError, LookupError, TypeError):
            return None

    def put(self, decides: Sequence[str], answer: Any) -> None:
        """Keep an answer.

        Raises
        ------
        StorageError : the disk is full, for example; answers before are kept
        """
        with storing(
            str(self._place), "what was found before is kept, and the same command goes on from there"
        ):
            write_whole(self._file(decides), json.dumps(self.plain(answer)).encode())

    def _file(self, decides: Sequence[str]) -> Path:
        digest = hashlib.sha256(json.dumps([self._versions, *decides]).encode())
        return self._place / f"{digest.hexdigest()[:32]}.json"

    def plain(self, value: Any) -> Any:
        """Return a value as JSON has it: plain ones as they are, others as a list of their kind and their content."""
        if isinstance(value, np.generic):
            value = value.item()
        if value is None or isinstance(value, bool | int | float | str):
            return value
        if isinstance(value, np.ndarray):
            return ["array", value.dtype.str, value.shape, value.ravel().tolist()]
        if is_dataclass(value) and type(value).__name__ in self._records:
            parts = {field.name: self.plain(getattr(value, field.name)) for field in fields(value)}
            return ["record", type(value).__name__, parts]
        if isinstance(value, Mapping):
            return ["mapping", {key: self.plain(item) for key, item in value.items()}]
        if isinstance(value, list | tuple):
            return [type(value).__name__, [self.plain(item) for item in value]]
        raise TypeError(f"a {type(value).__name__} cannot be kept")

    def revived(self, value: Any) -> Any:
        """Return the value that `plain` made plain."""
        if not isinstance(value, list):
            return value
        match value:
            case ["array", kind, shape, numbers]:
                return np.array(numbers, dtype=kind).reshape(shape)
            case ["record", name, parts]:
                return self._records[name](**{key: self.revived(item) for key, item in parts.items()})
            case ["mapping", parts]:
                return {key: self.revived(item) for key, item in parts.items()}
            case ["tuple", parts]:
                return tuple(self.revived(item) for item in parts)
            case ["list", parts]:
                return [self.revived(item) for item in parts]
        raise ValueError(f"no answer: {value!r}")


@contextmanager
def kept_answers(folder: Path, name: str, records: Sequence[type]) -> Iterator[Kept]:
    """Yield what is kept of unfinished work in the folder of its results.

    It is gone once the results have replaced the folder (`replacing`).

    Parameters
    ----------
    folder : of the results, made if it is not there
    name : of the folder in it
    records : see `Kept`

    Raises
    ------
    UsageError : the folder cannot be made, or another program works there
    """
    place, made = folder / name, not folder.exists()
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"cannot be written: {error.strerror}", where=str(folder), remedy="name another folder"
        ) from error
    store = Kept(place, records)
    with locked(place):
        try:
            yield store
        finally:
            if place.exists() and not len(store):
                shutil.rmtree(place, ignore_errors=True)
                if made:
                    with suppress(OSError):
                        folder.rmdir()
