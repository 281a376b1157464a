"""Stones on their way to the database, kept on disk: the database is written only once all of them are good.

So a bad survey leaves the database as it was, and makes none; the database is locked while it is written and
not while planes are fitted; and memory does not grow with the survey.
"""

import pickle
import tempfile
from collections.abc import Iterator
from types import TracebackType
from typing import Self

from archmodel.records import StoneRecord
from moma.errors import SurveyError

__all__ = ["Spool"]

_BATCH = 200
"""Stones that are written at once: what they have in common is written once."""


class Spool:
    """A list of stones that is not in memory; to be used as a context, filled once and read in the same order."""

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
        """Keep one more stone.

        Raises
        ------
        SurveyError
            if there is no room for it on the disk
        """
        self._waiting.append(stone)
        if len(self._waiting) == _BATCH:
            self._flush()

    def __iter__(self) -> Iterator[StoneRecord]:
        if self._waiting:
            self._flush()
        self._file.seek(0)
        for _ in range(self._batches):
            yield from pickle.load(self._file)

    def _flush(self) -> None:
        try:
            pickle.dump(self._waiting, self._file, pickle.HIGHEST_PROTOCOL)
        except OSError as error:
            raise SurveyError(
                f"a temporary file cannot be written: {error.strerror or error}",
                where=tempfile.gettempdir(),
                remedy="make room there, or set TMPDIR to another folder",
            ) from error
        self._waiting.clear()
        self._batches += 1
