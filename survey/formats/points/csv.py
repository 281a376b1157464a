"""Tables of points: one measured point per line, as spreadsheets and point exports write them.

The first line names the columns, in any order: ``block,kind,course,role,x,y,z`` and, optionally, ``sigma``,
``depth``, ``depth_sigma``, ``depth_source``, ``zone`` and ``station``. They are separated by commas, semicolons or
tabs; decimals have a point or, where columns are not separated by commas, a comma. ``role`` is ``vertex`` or
``v`` for a corner of the face, in order around it, ``point`` or ``p`` for any other point on it. Lengths are
metres; empty fields mean "not known". The lines of a block may lie anywhere. A line that begins with ``#`` is a
comment; rows of nothing but separators are skipped, and columns without a name at the right are empty.
"""

import csv
from operator import itemgetter
from pathlib import Path

from moma.errors import SurveyError
from survey.formats.fields import CODE, KIND, parse_course, shown
from survey.formats.options import ReadingOptions, whole
from survey.formats.points.decimals import Decimals
from survey.formats.points.point_table import PointTable, TableStone, check_station
from survey.formats.text_lines import TextLines
from survey.records.survey import Survey, SurveyHead, SurveyStream

__all__ = ["NEEDED", "OPTIONAL", "open_csv", "read_csv"]

NEEDED = ("block", "kind", "course", "role", "x", "y", "z")
"""Required columns."""

OPTIONAL = ("sigma", "depth", "depth_sigma", "depth_source", "zone", "station")
"""Optional columns."""

_IS_VERTEX = {"vertex": True, "v": True, "point": False, "p": False}
_DELIMITERS = (",", ";", "\t")
_NOTHING = float("nan")
_LONGEST_NAME = 64


def open_csv(path: Path, options: ReadingOptions | None = None) -> SurveyStream:
    """Read a table of points and return its stones one by one.

    Parameters
    ----------
    path : the file
    options : sigma of lines without one; the head of another file

    Returns
    -------
    SurveyStream : without the head of another file, corners must run counter-clockwise seen from outside

    Raises
    ------
    SurveyError
        naming file and line, if the table as a whole is wrong
    """
    options = options or ReadingOptions()
    lines = TextLines(Path(path))
    head = options.head_for(Path(path))
    rows = lines.rows()
    number, names = next(rows, (1, ""))
    reader = _RowReader(lines, (number, names), head, PointTable(lines.path, options.sigma))
    for number, line in rows:
        reader.take(line, number)
    if reader.table.is_empty:
        raise lines.fail(lines.end, "the table has no points", "add one line per point")
    return SurveyStream(head, reader.table.records())


def read_csv(path: Path, default_sigma: float = 0.003) -> Survey:
    """Read a table of points as a whole.

    Parameters
    ----------
    path : the file
    default_sigma : standard deviation of a coordinate whose line states none [m]

    Raises
    ------
    SurveyError
        naming file and line, when any line is wrong
    """
    return whole(open_csv(path, ReadingOptions(sigma=default_sigma)), Path(path))


class _RowReader:
    """Reader of the lines of a table."""

    def __init__(self, lines: TextLines, names: tuple[int, str], head: SurveyHead, table: PointTable) -> None:
        self._path, self._head, self.table, self._fail = lines.path, head, table, lines.fail
        number, line = names
        self._delimiter = _delimiter(line)
        where = f"{lines.path}:{number}"
        columns = _columns([name.casefold() for name in self._split(line, where)], where)
        self._count = len(columns)
        self._at = {name: columns.index(name) for name in columns}
        self._block_at = self._at["block"]
        self._pick = itemgetter(*(self._at[name] for name in NEEDED))
        self._optional = [(name, self._at[name]) for name in OPTIONAL[1:] if name in self._at]
        self._sigma_at = self._at.get("sigma")
        self._decimals = Decimals(lines.path, commas=self._delimiter != ",")
        self._kinds: dict[str, tuple[str, str]] = {}  # kind and course of each block, as written

    def take(self, line: str, number: int) -> None:
        """Read one line."""
        code: str | None = None
        try:
            code = self._code(line.replace('"', "").split(self._delimiter)) if '"' in line else None
            values = self._split(line, f"{self._path}:{number}")
            code = self._code(values)
            stone = None if code is None else self.table.stones.get(code)
            if stone is not None and stone.error is not None:
                stone.add_line(number)
            else:
                self._take(values, stone, number)
        except SurveyError as error:
            self.table.refuse(code, error, number)

    def _code(self, values: list[str]) -> str | None:
        """Return the block of a line, even of a wrong one; None if it cannot be known."""
        code = values[self._block_at].strip() if self._block_at < len(values) else ""
        return code if code in self.table.stones or CODE.fullmatch(code) else None

    def _take(self, values: list[str], stone: TableStone | None, number: int) -> None:
        if len(values) > self._count and not any(values[self._count :]):
            del values[self._count :]
        if len(values) != self._count:
            raise self._fail(number, f"{len(values)} fields for {self._count} columns", "fill every column")
        code, kind, course, role, x, y, z = self._pick(values)
        kind = kind.lower()
        is_vertex = _IS_VERTEX.get(role)
        if is_vertex is None:
            raise self._fail(number, f"role {shown(role)}", "write vertex or point")
        place = self._decimals.place((x, y, z), "xyz", number)
        sigma = _NOTHING
        if self._sigma_at is not None and (text := values[self._sigma_at]):
            sigma = self._decimals.length(text, "sigma", number)
        if stone is None:
            stone = self._new_stone(code, kind, course, number)
        elif self._kinds[code] != (kind, course):
            raise self._fail(
                number,
                f"kind or course of block {code} differs from line {stone.line}",
                "give every line of a block the same kind and course",
            )
        for name, at in self._optional:
            if values[at]:
                self._set(stone, name, values[at], number)
        self.table.stones[code] = stone
        stone.add_place(is_vertex, place, sigma, "")
        stone.add_line(number)

    def _new_stone(self, code: str, kind: str, course: str, number: int) -> TableStone:
        for name, text, pattern in (("block", code, CODE), ("kind", kind, KIND)):
            if pattern.fullmatch(text) is None:
                raise self._fail(
                    number, f"{name} {shown(text)} is not a {name} name", "write e.g. W01-01, header"
                )
        self._kinds[code] = kind, course
        return TableStone(
            code, kind, parse_course(course, f"{self._path}:{number}") if course else None, number
        )

    def _set(self, stone: TableStone, name: str, text: str, number: int) -> None:
        """Set a value of the whole block from one of its lines."""
        value: float | str = text
        if name in ("depth", "depth_sigma"):
            value = self._decimals.length(text, name, number)
        elif name == "station":
            check_station(text, self._head, f"{self._path}:{number}")
        elif not text.isprintable() or (name == "zone" and ('"' in text or len(text) > _LONGEST_NAME)):
            raise self._fail(number, f"{name} {shown(text)} is not a name", "write printable words")
        before = getattr(stone, name)
        if before not in (None, value):
            found, first = (f"{one:g} m" if isinstance(one, float) else shown(one) for one in (value, before))
            raise self._fail(number, f"{name} {found}, but {first} before", f"give a block one {name}")
        setattr(stone, name, value)

    def _split(self, line: str, where: str) -> list[str]:
        if '"' not in line:
            return [value.strip() for value in line.split(self._delimiter)]
        try:
            (row,) = csv.reader([line], strict=True, delimiter=self._delimiter)
        except csv.Error as error:
            raise SurveyError(
                f"not a table line: {error}", where=where, remedy="check quotes and separators"
            ) from error
        return [value.strip() for value in row]


def _delimiter(line: str) -> str:
    """Return the separator of the column names."""
    return max(_DELIMITERS, key=line.count)


def _columns(names: list[str], where: str) -> list[str]:
    while names and not names[-1]:
        del names[-1]
    expected = ",".join(NEEDED) + "".join(f"[,{name}]" for name in OPTIONAL)
    missing = [name for name in NEEDED if name not in names]
    if missing:
        raise SurveyError(f"no column {missing[0]!r}", where=where, remedy=f"begin with: {expected}")
    for name in names:
        if name not in NEEDED + OPTIONAL or names.count(name) > 1:
            raise SurveyError(
                f"unknown or repeated column {shown(name)}", where=where, remedy=f"use: {expected}"
            )
    return names
