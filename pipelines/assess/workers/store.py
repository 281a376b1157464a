"""Records of samples on the disk, one file each, and the snapshot of all that decides on them.

A record is written whole by the process that made it, and named by what it depends on: the snapshot's hash, and the
point at which the sample was taken. So the records are the truth: a process that is killed loses the sample on which it
worked, and whoever comes next, here or on another machine with the same folder, works on what has no record.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import UsageError, storing
from mechanics.arrays import Array
from pipelines.results.checkpoints import write_shared

_SNAPSHOT = "snapshot-{}.json"
SAMPLES = "samples"
"""Folder of the records."""
_DIGITS = 24  # of a digest in a file's name: two of 10⁹ samples share it with a probability of 10⁻¹¹


@dataclass(frozen=True)
class Sample:
    """Answer at one point.

    Attributes
    ----------
    point : (n,) in standard normal space [-]
    values : of the quantities; None where a quantity has none
    reason : why it failed, is undecided or was lost; empty if it was not
    state : done, failed, undecided or lost
    gradient : (n,) of the first quantity by the point; None: not asked for, or not known
    cpu : processor time [s]
    """

    point: Array
    values: Mapping[str, float]
    state: str = "done"
    reason: str = ""
    gradient: Array | None = None
    cpu: float = 0.0

    @property
    def done(self) -> bool:
        """True where the quantities are known."""
        return self.state == "done"


@dataclass(frozen=True)
class Snapshot:
    """All that decides on the samples of a study, in a file named by its hash.

    Attributes
    ----------
    folder : of the study
    hash : SHA-256 of the content
    """

    folder: Path
    hash: str

    @property
    def path(self) -> Path:
        """The file."""
        return self.folder / _SNAPSHOT.format(self.hash[:_DIGITS])

    def content(self) -> Any:
        """Return the content.

        Raises
        ------
        UsageError : the file is missing or damaged
        """
        try:
            raw = self.path.read_bytes()
        except OSError as error:
            raise UsageError(
                f"cannot be read: {error.strerror}", where=str(self.path), remedy="begin the study again"
            ) from error
        if hashlib.sha256(raw).hexdigest() != self.hash:
            raise UsageError("is damaged", where=str(self.path), remedy="delete it and begin the study again")
        return json.loads(raw)

    @classmethod
    def write(cls, folder: Path, content: Any) -> "Snapshot":
        """Write a content of plain values into a folder, if it is not there yet.

        Raises
        ------
        StorageError : the disk is full, for example
        """
        raw = json.dumps(content, sort_keys=True, ensure_ascii=False).encode()
        made = cls(folder, hashlib.sha256(raw).hexdigest())
        if not made.path.exists():
            _write(made.path, raw)
        return made


@dataclass(frozen=True)
class SampleStore:
    """The records of a snapshot's samples.

    Attributes
    ----------
    snapshot : on which they depend
    """

    snapshot: Snapshot

    def get(self, point: Array, gradient: bool = False) -> Sample | None:
        """Return the sample at a point (n,); None if there is no record, or a damaged one, or none with a gradient."""
        try:
            record = json.loads(self._file(point).read_text(encoding="utf-8"))
            found = Sample(
                np.array(record["point"], dtype=float),
                {name: float("nan") if value is None else value for name, value in record["values"].items()},
                record["state"],
                record["reason"],
                None if record["gradient"] is None else np.array(record["gradient"], dtype=float),
                record["cpu"],
            )
        except (OSError, ValueError, LookupError, TypeError, AttributeError):
            return None
        if found.state == "lost" or not np.array_equal(found.point, point):
            return None
        return None if gradient and found.gradient is None and found.done else found

    def put(self, sample: Sample) -> None:
        """Write a sample; its file appears whole or not at all.

        Raises
        ------
        StorageError : the disk is full, for example; records before stay
        """
        record = {
            "point": sample.point.tolist(),
            "values": {
                name: float(value) if np.isfinite(value) else None for name, value in sample.values.items()
            },
            "state": sample.state,
            "reason": sample.reason,
            "gradient": None if sample.gradient is None else sample.gradient.tolist(),
            "cpu": sample.cpu,
        }
        _write(self._file(sample.point), json.dumps(record, ensure_ascii=False).encode())

    def _file(self, point: Array) -> Path:
        digest = hashlib.sha256(
            self.snapshot.hash.encode() + np.ascontiguousarray(point, dtype="<f8").tobytes()
        )
        name = digest.hexdigest()[:_DIGITS]
        # 256 folders, as file systems slow down with 10⁵ files in a folder
        return self.snapshot.folder / SAMPLES / name[:2] / f"{name}.json"


def _write(path: Path, content: bytes) -> None:
    """Write a file and the folder in which it stands."""
    with storing(str(path.parent), "records before are kept, and the same command goes on from there"):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_shared(path, content)
