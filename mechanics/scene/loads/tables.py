"""Tables of numbers from text files and workbooks: time series, and the rows of accelerograms.

The rules are those of survey tables (`survey.formats.tables`): UTF-8, UTF-16 with a mark, or Windows' Latin-1; fields
separated by semicolons, tabs, commas or blanks, in quotes or not; decimal commas where commas do not separate fields;
Excel's ``sep=`` line, comments (#), blank lines, and lines with names of columns before the numbers are passed over.
"""

import codecs
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.scene.loads.time_series import History
from moma.errors import SceneError

__all__ = ["Table", "fail_at", "number_at", "numbered_lines", "read_columns", "read_history", "read_table"]

_WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
_SAMPLE = 50  # lines by which the separator is found
_COMMA_DECIMALS = re.compile(r"[+-]?\d+(?:,\d+)?(?:[eE][+-]?\d+)?")
_STATED = re.compile(r'"?sep=(.)"?')


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
    lines: list[int] = []
    rows: list[list[float]] = []
    names: tuple[str, ...] = ()
    notes: list[str] = []
    for number, cells in _cells(path, notes):
        if not rows and not _is_number(cells[0]):
            names = tuple(cells)
            notes.append(" ".join(cells))
            continue
        if rows and len(cells) != len(rows[0]):
            fail_at(path, number, f"{len(cells)} columns", f"give {columns}")
        rows.append([number_at(path, number, cell) for cell in cells])
        lines.append(number)
    if len(rows) < 2:
        raise SceneError(f"{len(rows)} rows of numbers", where=str(path), remedy=f"give {columns}")
    return Table(names if len(names) == len(rows[0]) else (), tuple(notes), np.array(lines), np.array(rows))


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


def _cells(path: str | Path, notes: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Yield the fields of each row that is not empty; comments go to `notes`."""
    data = _bytes(path)
    if data.startswith(_WORKBOOKS):
        yield from _sheet(path)
        return
    lines = []
    for number, line in enumerate(_text(data).splitlines(), start=1):
        text, _, comment = line.partition("#")
        if comment.strip():
            notes.append(comment.strip())
        if text.strip(" \t,;"):
            lines.append((number, text.strip()))
    stated = _STATED.fullmatch(lines[0][1]) if lines else None
    if stated:
        del lines[0]
    separator = stated[1] if stated else _separator([text for _, text in lines[:_SAMPLE]])
    for number, text in lines:
        cells = text.replace('"', "").split(separator) if separator else text.replace('"', "").split()
        cells = [one.strip() for one in cells]
        while len(cells) > 1 and not cells[-1]:
            del cells[-1]
        if separator != ",":
            cells = [one.replace(",", ".") if _COMMA_DECIMALS.fullmatch(one) else one for one in cells]
        yield number, cells


def _separator(lines: Sequence[str]) -> str:
    """Return the separator of fields; empty: blanks, with which decimals may have commas."""
    numeric = [one for one in lines if one[:1].isdigit() or one[:1] in '+-."'] or lines
    for one in (";", "\t", "|"):
        if any(one in line for line in numeric):
            return one
    if any("," in line for line in numeric):
        words = [word for line in numeric for word in line.split()]
        several = any(len(line.split()) > 1 for line in numeric)
        decimal = all(_COMMA_DECIMALS.fullmatch(word) for word in words)
        if not decimal or not (
            several or (all(line.count(",") == 1 for line in numeric) and _is_one(numeric))
        ):
            return ","
    return ""


def _is_one(lines: Sequence[str]) -> bool:
    """Return whether ``0,05`` is one number in all lines: what stands before the comma repeats, unlike times."""
    return len({line.strip('"').partition(",")[0] for line in lines}) <= len(lines) // 2


def _sheet(path: str | Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows of the first sheet of a workbook that has any."""
    from python_calamine import CalamineError, CalamineWorkbook

    try:
        book = CalamineWorkbook.from_filelike(io.BytesIO(_bytes(path)))
        tables = [book.get_sheet_by_name(name).to_python(skip_empty_area=False) for name in book.sheet_names]
    except (CalamineError, OSError, ValueError) as error:
        raise SceneError(
            f"looks like a workbook, but cannot be read: {str(error)[:100]}",
            where=str(path),
            remedy="save it as CSV",
        ) from None
    for number, row in enumerate(next((one for one in tables if any(map(any, one))), []), start=1):
        cells = [str(one).strip() for one in row]
        while cells and not cells[-1]:
            del cells[-1]
        if cells:
            yield number, [one.replace(",", ".") if _COMMA_DECIMALS.fullmatch(one) else one for one in cells]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
