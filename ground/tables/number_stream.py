"""Large tables of numbers read in pieces: every row has the same columns, which are separated alike.

The separator and the decimal mark are those of the first row. Lines before it are titles, of which the last one with a
field for each column names them; it may begin with ``#`` or ``//``. Lines of one whole number are skipped: each scan of
a PTS file begins with its number of points.
"""

import codecs
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from ground.errors import SurveyError
from ground.tables.columns import LONGEST_HEAD, places_of
from ground.tables.numbers import is_number, unreadable
from ground.tables.text_lines import LONGEST_LINE

_NUMBER = re.compile(r"\s*\"?[-+]?[\d.]")
_FORTRAN = re.compile(r"(?<=\d)[dD](?=[-+]?\d)")
_COUNTED = 20  # rows whose first numbers count 1, 2, 3, … before it is taken for a column of point numbers


@dataclass(frozen=True)
class NumberStream:
    """File of numbers of which only the head has been read.

    Attributes
    ----------
    path : of the file
    encoding : of its text
    head : number of lines before the first row
    first : fields of the first row
    names : of the columns; () where they have none
    places : place of each wanted column that is named
    separator : between fields; None: blanks
    commas : whether decimals have a comma
    even : whether every field of a row is a number, so that rows of another length are noticed
    """

    path: Path
    encoding: str
    head: int
    first: tuple[str, ...]
    names: tuple[str, ...]
    places: Mapping[str, int]
    separator: str | None
    commas: bool
    even: bool

    def chunks(self, lines: int, columns: Sequence[int]) -> Iterator[NDArray[np.float64]]:
        """Yield the numbers (n, k) of the given columns, of at most so many lines at a time.

        Raises
        ------
        SurveyError
            naming the line that is not like the others
        """
        with self._open() as file:
            for _ in range(self.head):
                file.readline()
            before = self.head
            while batch := list(islice(file, lines)):
                rows = ["" if line.strip().isdigit() else line for line in batch]
                if any(map(str.strip, rows)):
                    yield self._parsed(rows, before, columns)
                before += len(batch)

    def _open(self) -> TextIO:
        return self.path.open(encoding=self.encoding, errors="replace")

    def _parsed(self, lines: list[str], before: int, columns: Sequence[int]) -> NDArray[np.float64]:
        if not self.even and any(self._width(line) != len(self.first) for line in lines if line.strip()):
            raise self._wrong(lines, before, columns)
        texts = [line.replace(",", ".") for line in lines] if self.commas else lines
        if any(_FORTRAN.search(line) for line in self.first):
            texts = [_FORTRAN.sub("e", line) for line in texts]
        quote = '"' if any('"' in line for line in lines[:1]) else None
        picked = None if self.even else columns
        try:
            rows: NDArray[np.float64] = np.loadtxt(
                texts, delimiter=self.separator, comments="#", ndmin=2, usecols=picked, quotechar=quote
            )
        except ValueError as error:
            raise self._wrong(lines, before, columns) from error
        if self.even and rows.shape[1] != len(self.first):
            raise self._wrong(lines, before, columns)
        return (
            rows
            if picked is not None or list(columns) == list(range(rows.shape[1]))
            else rows[:, list(columns)]
        )

    def _width(self, line: str) -> int:
        return len(_fields(line.split("#")[0], self.separator))

    def _wrong(self, lines: Sequence[str], before: int, columns: Sequence[int]) -> SurveyError:
        """Make the error of the first line that is not like the others."""
        remedy = "write: x y z, with equal columns in all lines"
        for number, line in enumerate(lines, start=before + 1):
            parts = _fields(line.split("#")[0], self.separator)
            wanted = range(len(parts)) if self.even else columns
            if any(parts) and (
                len(parts) != len(self.first) or not all(_is_float(parts[k], self.commas) for k in wanted)
            ):
                what = f"{line.strip()[:60]!r} is not a point like the others"
                return SurveyError(what, where=f"{self.path}:{number}", remedy=remedy)
        return SurveyError("lines that are no points", where=f"{self.path}:{before + 1}", remedy=remedy)


def open_numbers(path: Path, wanted: Mapping[str, Sequence[str]]) -> NumberStream:
    """Open a large table of numbers.

    Parameters
    ----------
    path : of the file
    wanted : names of columns by what they are

    Raises
    ------
    SurveyError
        if none of the first lines is a row, or the names lack a coordinate
    """
    try:
        encoding = _encoding(path)
        with path.open(encoding=encoding, errors="replace") as file:
            lines = list(islice(file, LONGEST_HEAD + _COUNTED))
    except OSError as error:
        raise unreadable(path, error) from error
    titles: list[str] = []
    for head, line in enumerate(lines[:LONGEST_HEAD]):
        separator, commas = _style(line)
        cells = _fields(line, separator)
        names = _names(titles, len(cells), separator)
        places = places_of(names, wanted, f"{path}:{head}")
        starts = _NUMBER.match(line) is not None and not line.strip().isdigit()
        if names and {*"xyz"} <= set(places):
            starts = all(_is_float(cells[places[axis]], commas) for axis in "xyz")
        if starts:
            if len([cell for cell in cells if _is_float(cell, commas)]) < len("xyz"):
                break
            _check(path, head, titles, names, places)
            even = all(_is_float(cell, commas) for cell in cells) and not line.rstrip().endswith(
                separator or "\n"
            )
            stream = NumberStream(
                path, encoding, head, tuple(cells), tuple(names), places, separator, commas, even
            )
            _check_counted(stream, lines[head:])
            return stream
        titles.append(line)
    raise SurveyError(
        f"no line with x, y and z among the first {LONGEST_HEAD}",
        where=str(path),
        remedy="a point cloud in text has one point to a line: x y z",
    )


def _encoding(path: Path) -> str:
    with path.open("rb") as file:
        start = file.read(LONGEST_LINE)
    if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    try:
        start[: start.rfind(b"\n") + 1].decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def _fields(line: str, separator: str | None) -> list[str]:
    """Return the fields of a line, without an empty one at its end."""
    cells = [word.strip().strip('"') for word in line.strip().split(separator)]
    return cells[:-1] if len(cells) > 1 and not cells[-1] else cells


def _style(line: str) -> tuple[str | None, bool]:
    """Return the separator, None for blanks, and whether decimals have a comma."""
    if ";" in line:
        return ";", "," in line
    if "\t" in line.strip() or len(line.split()) >= 3:
        blank = len([word for word in line.split() if word.strip(",")]) >= 3
        ends = all(word.endswith(",") for word in line.split()[:2])
        return (",", False) if ends else (None, blank and "," in line)
    return ",", False


def _is_float(text: str, commas: bool = False) -> bool:
    text = _FORTRAN.sub("e", text)
    return is_number(text, commas) or text.lower() in ("nan", "inf", "-inf")


def _names(titles: Sequence[str], count: int, separator: str | None) -> list[str]:
    """Return the names of the columns: the last title that has as many fields; otherwise an empty list."""
    for title in reversed(titles):
        names = _fields(title.strip().lstrip("/#").strip(), separator)
        if len(names) == count and not any(is_number(name) for name in names):
            return names
    return []


def _check(
    path: Path, head: int, titles: Sequence[str], names: Sequence[str], places: Mapping[str, int]
) -> None:
    """Refuse grids of heights, and names of columns with some of the coordinates only."""
    if any(title.lower().startswith("ncols") for title in titles):
        raise SurveyError(
            "a grid of heights, not points", where=f"{path}:1", remedy="export it as points: x y z"
        )
    missing = [axis for axis in "xyz" if axis not in places]
    if names and len(missing) == 1:
        raise SurveyError(
            f"no column {missing[0]} among {', '.join(names)[:200]}",
            where=f"{path}:{head}",
            remedy="name the columns x, y and z",
        )


def _check_counted(stream: NumberStream, lines: Sequence[str]) -> None:
    """Refuse columns without names of which the first one counts the rows."""
    rows = [_fields(line, stream.separator) for line in lines[:_COUNTED]]
    numbers = [int(cells[0]) if cells[0].isdigit() else -1 for cells in rows]
    counted = numbers[0] >= 0 and numbers == [numbers[0] + k for k in range(len(rows))]
    if not stream.places and len(stream.first) > 3 and len(rows) > 2 and counted:
        raise SurveyError(
            "the first column counts the rows, and the columns have no names",
            where=f"{stream.path}:{stream.head + 1}",
            remedy="begin the file with the names of the columns, e.g. id x y z",
        )
