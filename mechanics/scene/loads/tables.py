"""Tables of numbers for loads, by the rules of `ground.tables`: time series, and the rows of accelerograms.

Lines before the numbers are titles; what stands after ``#`` is a comment. A wrong table is a mistake in a scene.
"""

import codecs
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np

from ground.errors import SceneError, SurveyError, UsageError
from ground.tables.numbers import is_number
from ground.tables.table import read_table as read_rows
from mechanics.arrays import Array, Ints
from mechanics.scene.loads.time_series import History


@dataclass(frozen=True)
class Table:
    """Numbers of a file.

    Attributes
    ----------
    names : of the columns; () if there are none
    notes : comments and other lines before the numbers
    lines : (n,) line of each row, counted from 1
    rows : (n, k)
    """

    names: tuple[str, ...]
    notes: tuple[str, ...]
    lines: Ints
    rows: Array


def read_table(path: str | Path, columns: str = "numbers in columns") -> Table:
    """Read a table of numbers; `columns` says in words what it should have.

    Raises
    ------
    SceneError : with file and line
    """
    with _scene_errors():
        table = read_rows(Path(path), _is_row, f"give {columns}", comments=True)
    lines: list[int] = []
    rows: list[list[float]] = []
    for row in table.rows:
        if rows and len(row.cells) != len(rows[0]):
            fail_at(path, row.line, f"{len(row.cells)} columns", f"give {columns}")
        rows.append([number_at(path, row.line, table.pointed(cell)) for cell in row.cells])
        lines.append(row.line)
    if len(rows) < 2:
        raise SceneError(f"{len(rows)} rows of numbers", where=str(path), remedy=f"give {columns}")
    notes = tuple(" ".join(one.cells) for one in (*table.comments, *table.titles))
    return Table(table.names, notes, np.array(lines), np.array(rows))


def _is_row(cells: Sequence[str], commas: bool) -> bool:
    """Return whether a line begins with a number, and goes on with numbers if it has decimal commas."""
    return is_number(cells[0], commas)


@contextmanager
def _scene_errors() -> Iterator[None]:
    """Raise mistakes in a table as mistakes in a scene."""
    try:
        yield
    except (SurveyError, UsageError) as error:
        raise SceneError(error.what, where=error.where, remedy=error.remedy) from None


def read_columns(path: str | Path, columns: str) -> tuple[Ints, Array]:
    """Return line numbers (n,) and numbers (n, k) of a table with k columns, which `columns` names with commas.

    Raises
    ------
    SceneError : with file and line
    """
    table = read_table(path, columns)
    if table.rows.shape[1] != columns.count(",") + 1:
        fail_at(path, int(table.lines[0]), f"{table.rows.shape[1]} columns", f"give {columns}")
    return table.lines, table.rows


def read_history(path: str | Path, columns: str) -> History:
    """Read a time series from a file of two columns, or of four for a vector; `columns` names them, time [s] first.

    Raises
    ------
    SceneError : with file and line
    """
    lines, rows = read_columns(path, columns)
    still = np.flatnonzero(np.diff(rows[:, 0]) <= 0)
    if len(still):
        at = int(still[0]) + 1
        what = f"time {rows[at, 0]:g} s comes after {rows[at - 1, 0]:g} s"
        fail_at(path, int(lines[at]), what, "give increasing times")
    return History(rows[:, 0], rows[:, 1] if rows.shape[1] == 2 else rows[:, 1:])


def numbered_lines(path: str | Path) -> Iterator[tuple[int, str]]:
    """Yield the lines of a text file, numbered from 1 (SceneError if it cannot be read)."""
    return enumerate(_text(_bytes(path)).splitlines(), start=1)


def number_at(path: str | Path, line: int, text: str) -> float:
    """Return the number of a text (SceneError unless it is a finite number)."""
    if not _is_number(text) or not np.isfinite(float(text)):
        fail_at(path, line, f"{text[:40]!r} is not a number", "correct it, or take the line away")
    return float(text)


def fail_at(path: str | Path, line: int, what: str, remedy: str) -> NoReturn:
    """Raise a SceneError at a line of a file."""
    raise SceneError(what, where=f"{path}:{line}", remedy=remedy)


def _bytes(path: str | Path) -> bytes:
    try:
        return Path(path).read_bytes()
    except FileNotFoundError:
        raise SceneError("no such file", where=str(path), remedy="check the path") from None
    except (OSError, ValueError) as error:  # a path may hold what no file system takes
        raise SceneError(f"cannot be read: {error}", where=repr(str(path)), remedy="check the path") from None


def _text(data: bytes) -> str:
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16", "replace").lstrip("\ufeff")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
