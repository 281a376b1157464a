"""Columns of numbers from text files: time series, and the rows of accelerograms."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.scene.loads.time_series import History
from moma.errors import SceneError

__all__ = ["fail_at", "number_at", "numbered_lines", "read_columns", "read_history"]


def read_columns(path: str | Path, columns: str) -> tuple[Ints, Array]:
    """Return line numbers (n,) and numbers (n, k) of a text file with k columns.

    Columns are separated by commas, semicolons, tabs or blanks; one header line, comments (#) and blank lines are
    skipped. `columns` names them, separated by commas.

    Raises
    ------
    SceneError : with file and line
    """
    count = columns.count(",") + 1
    lines: list[int] = []
    rows: list[list[float]] = []
    headed = False
    for number, line in numbered_lines(path):
        text = line.split("#")[0].strip()
        if not text:
            continue
        cells = re.split(r"\s*[,;]\s*|\s+", text)
        if not rows and not headed and not _is_number(cells[0]):
            headed = True
            continue
        if len(cells) != count:
            fail_at(path, number, f"{len(cells)} columns", f"give {columns}")
        rows.append([number_at(path, number, cell) for cell in cells])
        lines.append(number)
    if len(rows) < 2:
        raise SceneError(f"{len(rows)} rows of numbers", where=str(path), remedy=f"give {columns}")
    return np.array(lines), np.array(rows)


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
    try:
        text = Path(path).read_text(encoding="utf-8-sig", errors="replace")
    except FileNotFoundError:
        raise SceneError("no such file", where=str(path), remedy="check the path") from None
    except (OSError, ValueError) as error:  # a path may hold what no file system takes
        raise SceneError(f"cannot be read: {error}", where=repr(str(path)), remedy="check the path") from None
    return enumerate(text.splitlines(), start=1)


def number_at(path: str | Path, line: int, text: str) -> float:
    """Return the number of a text (SceneError unless it is a finite number)."""
    if not _is_number(text) or not np.isfinite(float(text)):
        fail_at(path, line, f"{text[:40]!r} is not a number", "correct it, or take the line away")
    return float(text)


def fail_at(path: str | Path, line: int, what: str, remedy: str) -> NoReturn:
    """Raise a SceneError at a line of a file."""
    raise SceneError(what, where=f"{path}:{line}", remedy=remedy)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
