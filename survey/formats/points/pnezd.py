"""Point lists as total stations export them: number, coordinates, and a description that carries a code.

``PNEZD`` is point, northing, easting, elevation, description; ``PENZD`` has the easting first. x is the easting, y the
northing, z the elevation, in metres. Fields are separated by commas, semicolons, tabs or blanks; everything after the
fourth separator is the description. Decimals have a point or, where fields are not separated by commas, a comma. A
first line without digits names the columns and is skipped. A line that begins with ``#`` is a comment. The
description is parsed by a code template (`survey.formats.points.code_template`).
"""

from dataclasses import replace
from itertools import chain, islice
from pathlib import Path

import numpy as np

from moma.errors import SurveyError
from survey.formats.fields import shown
from survey.formats.options import ReadingOptions
from survey.formats.points.code_template import STATION, CodeFields, CodeTemplate
from survey.formats.points.decimals import Decimals
from survey.formats.points.point_table import PointTable, TableStone
from survey.formats.text_lines import TextLines
from survey.records.survey import Station, SurveyStream

__all__ = ["open_penzd", "open_pnezd"]

_CODES = "{block}:{role}"
_SEPARATORS = ("\t", ";", ",", None)  # None: any blanks
_LOOK_AHEAD = 100  # lines in which the first good one must be found
_LONGEST_NAME = 64
_NOTHING = float("nan")


def open_pnezd(path: Path, options: ReadingOptions | None = None) -> SurveyStream:
    """Read a list of point, northing, easting, elevation, description; return its stones one by one.

    Parameters
    ----------
    path : the file
    options : the code template, by default {block}:{role}; kind and sigma of the stones; the head of another file

    Returns
    -------
    SurveyStream : its head also has the stations of the list

    Raises
    ------
    SurveyError
        naming file and line, if the list as a whole is wrong
    UsageError
        if the code template is wrong
    """
    return _open(Path(path), options or ReadingOptions(), "yxz")


def open_penzd(path: Path, options: ReadingOptions | None = None) -> SurveyStream:
    """Read a list of point, easting, northing, elevation, description, otherwise as `open_pnezd`."""
    return _open(Path(path), options or ReadingOptions(), "xyz")


def _open(path: Path, options: ReadingOptions, axes: str) -> SurveyStream:
    template = CodeTemplate(options.codes or _CODES)
    lines = TextLines(path)
    rows = lines.rows()
    ahead = list(islice(rows, _LOOK_AHEAD))
    if ahead and not any(one.isdigit() for one in ahead[0][1]):
        del ahead[0]
    if not ahead:
        raise lines.fail(lines.end, "the list has no points", "add one line per point")
    reader = _ListReader(lines, ahead, axes, template, options)
    for number, line in chain(ahead, rows):
        reader.take(line, number)
    head = options.head_for(path)
    head = replace(head, stations=(*head.stations, *reader.stations.values()))
    return SurveyStream(head, reader.table.records())


class _ListReader:
    """Reader of the lines of a list."""

    def __init__(
        self,
        lines: TextLines,
        ahead: list[tuple[int, str]],
        axes: str,
        template: CodeTemplate,
        options: ReadingOptions,
    ) -> None:
        self._path, self._fail = lines.path, lines.fail
        self._template, self._kind = template, options.kind
        self.table = PointTable(lines.path, options.sigma)
        self._description, self._code = "", template.parse("")
        self._axes = axes
        self._x, self._y = axes.index("x"), axes.index("y")
        self._separator = self._find_separator(ahead)
        self._decimals = Decimals(lines.path, commas=self._separator != ",")
        self._lines_of: dict[str, int] = {}
        self._known = {} if options.head is None else {one.name: one for one in options.head.stations}
        self.stations: dict[str, Station] = {}

    def take(self, line: str, number: int) -> None:
        """Read one line."""
        block: str | None = None
        try:
            parts = self._split(line)
            if len(parts) != 5:
                block = self._likely_block(line)
                raise self._fail(
                    number, f"{len(parts)} fields, not 5", "write point, two coordinates, elevation, code"
                )
            name, a, b, c, description = parts
            if description != self._description:  # adjacent lines mostly have the same
                self._description, self._code = description, self._template.parse(description)
            code = self._code
            if code is None:
                block = self._likely_block(line)
                raise self._fail(
                    number,
                    f"description {shown(description)} is not of the form {self._template.text}",
                    "correct it, or give the code template that the list was made with",
                )
            block = None if code.role == STATION else code.block
            self._check_name(name, number)
            place = self._decimals.place((a, b, c), self._axes, number)
            self._add(code, name, (place[self._x], place[self._y], place[2]), number)
        except SurveyError as error:
            self.table.refuse(block, error, number)

    def _add(self, code: CodeFields, name: str, place: tuple[float, float, float], number: int) -> None:
        if code.role == STATION:
            before = self._known.get(code.block) or self.stations.get(code.block)
            if before is not None:
                raise self._fail(
                    number, f"station {code.block} a second time", f"the first is on line {before.line}"
                )
            self.stations[code.block] = Station(code.block, np.array(place), number)
            return
        stone = self.table.stones.get(code.block)
        kind = self._kind if code.kind is None else code.kind
        if stone is None:
            stone = TableStone(code.block, kind, code.course, number, zone=code.zone)
            self.table.stones[code.block] = stone
        elif stone.error is None and (stone.kind, stone.course, stone.zone) != (kind, code.course, code.zone):
            raise self._fail(
                number,
                f"kind, course or zone of block {code.block} differs from line {stone.line}",
                "give every point of a block the same",
            )
        stone.add_place(code.role == "vertex", place, _NOTHING, name)
        stone.add_line(number)

    def _likely_block(self, line: str) -> str | None:
        """Return the stone of a line with a field too many or too few; None if it cannot be known."""
        rest: list[str] = [line]
        while len(rest := rest[-1].split(self._separator, 1)) == 2:
            code = self._template.parse(rest[1].strip())
            if code is not None and code.role != STATION:
                return code.block
        return None

    def _check_name(self, name: str, number: int) -> None:
        if not name or not name.isprintable() or len(name) > _LONGEST_NAME:
            raise self._fail(number, f"point {shown(name)} is not a number or name", "number the points")
        if (before := self._lines_of.setdefault(name, number)) != number:
            raise self._fail(number, f"point {name} a second time", f"the first is on line {before}")

    def _find_separator(self, ahead: list[tuple[int, str]]) -> str | None:
        """Return the separator of the fields in the first line that has coordinates."""
        for number, line in ahead:
            for self._separator in _SEPARATORS:
                parts = self._split(line)
                decimals = Decimals(self._path, commas=self._separator != ",")
                if len(parts) == 5 and _has_coordinates(parts, decimals, number):
                    return self._separator
        number, line = ahead[0]
        raise self._fail(
            number,
            f"{shown(line)} is not a point with two coordinates, an elevation and a description",
            "separate the fields by commas, semicolons, tabs or blanks",
        )

    def _split(self, line: str) -> list[str]:
        if self._separator is None:
            return [one.strip() for one in line.split(None, 4)]
        return [one.strip() for one in line.split(self._separator, 4)]


def _has_coordinates(parts: list[str], decimals: Decimals, number: int) -> bool:
    try:
        decimals.place((parts[1], parts[2], parts[3]), "abc", number)
    except SurveyError:
        return False
    return True
