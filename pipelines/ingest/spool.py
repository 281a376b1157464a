"""Temporary file for stones on their way to the database, which is written only once all of them are good.

Thus a bad survey leaves the database unchanged and creates none; the database is locked while it is written and
not while planes are fitted; and memory does not grow with the survey.
"""

import math
import pickle
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

import numpy as np

from archmodel.store.stone_record import StoneRecord
from ground.errors import SurveyError
from mechanics.arrays import Array

_BATCH = 200
"""Number of stones written at once, so that common values are pickled once."""


class Spool:
    """List of stones on disk, used as a context: filled once and read in the same order."""

    def __init__(self) -> None:
        self._file = tempfile.TemporaryFile(prefix="moma-")  # noqa: SIM115  (closed by __exit__)
        self._waiting: list[StoneRecord] = []
        self._batches = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def append(self, stone: StoneRecord) -> None:
        """Add one more stone.

        Raises
        ------
        SurveyError
            if there is no space left on the disk
        """
        self._waiting.append(stone)
        if len(self._waiting) == _BATCH:
            self._flush()

    def __iter__(self) -> Iterator[StoneRecord]:
        if self._waiting:
            self._flush()
        self._file.seek(0)
        for _ in range(self._batches):
            yield from _unpacked(*pickle.load(self._file))

    def _flush(self) -> None:
        try:
            pickle.dump(_packed(self._waiting), self._file, pickle.HIGHEST_PROTOCOL)
        except OSError as error:
            raise SurveyError(
                f"a temporary file cannot be written: {error.strerror or error}",
                where=tempfile.gettempdir(),
                remedy="make room there, or set TMPDIR to another folder",
            ) from error
        self._waiting.clear()
        self._batches += 1


@dataclass(frozen=True)
class _Numbers:
    """Placeholder for an array of this shape, whose numbers are kept elsewhere."""

    shape: tuple[int, ...]


def _packed(stones: Sequence[StoneRecord]) -> tuple[list[dict[str, Any]], Array]:
    """Separate stones from their arrays and join these into one, which is much faster than a dozen small ones each."""
    numbers: list[Array] = []
    states = []
    for stone in stones:
        state = dict(vars(stone))
        for name, value in state.items():
            if isinstance(value, np.ndarray) and value.dtype == np.float64:
                numbers.append(value.ravel())
                state[name] = _Numbers(value.shape)
        states.append(state)
    return states, np.concatenate(numbers)


def _unpacked(states: Sequence[dict[str, Any]], numbers: Array) -> Iterator[StoneRecord]:
    """Restore the stones; their arrays are views."""
    start = 0
    for state in states:
        for name, value in state.items():
            if isinstance(value, _Numbers):
                end = start + math.prod(value.shape)
                state[name] = numbers[start:end].reshape(value.shape)
                start = end
        yield StoneRecord(**state)
