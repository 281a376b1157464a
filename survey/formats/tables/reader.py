"""Tables of points: one measured point or one outline per row, with or without names of columns.

With names (``--format csv``) the columns come in any order and language (`survey.formats.tables.columns`), after any
title rows. Without names they are lists of a total station: point, northing, easting, elevation, description
(``pnezd``), or with the easting first (``penzd``); everything after the fourth separator is the description. A stone is
given by columns, or by a description that a code template takes apart (`survey.formats.tables.code_template`). The rows
of a stone may lie anywhere. Empty fields mean "not known".
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import SurveyError
from ground.tables.columns import LONGEST_HEAD, plain
from ground.tables.decimals import Decimals
from ground.tables.numbers import EMPTY, is_number, shown
from ground.tables.rows import DATE_REMEDY, ListRows, Row, TextRows, open_rows
from survey.conventions import LISTED, TRIALS
from survey.formats.fields import CODE, KIND, NO_COURSE, NUMBERED_ANEW, code_of, parse_course
from survey.formats.options import ReadingOptions
from survey.formats.tables.axes import (
    ORDERS,
    AxisEvidence,
    both_orders,
    exchanged_station,
    other_order,
    outlines_of,
)
from survey.formats.tables.code_template import CodeFields, CodeTemplate
from survey.formats.tables.columns import ColumnMap, Columns, find_columns, kind_of_column, read_map
from survey.formats.tables.first_rows import (
    are_headed,
    check_names,
    check_stones_repeat,
    note_key,
    with_role,
    with_units,
)
from survey.formats.tables.kinds import kind_of, meant
from survey.formats.tables.point_table import PointTable, TableStone, check_station
from survey.formats.tables.roles import CONTROL, STATION, is_bare, role_of, roles_with
from survey.formats.tables.wkt import outline_of
from survey.records.survey import DEPTH_ORIGINS, Station, SurveyHead, SurveyStream

CODES = "{block}:{role}"
"""Template of descriptions, if none is given."""

NEEDED = ("block", "x", "y", "z")
"""Required columns; `description` serves for `block`, `outline` for the coordinates."""

OPTIONAL = (
    *("kind", "course", "role", "sigma", "depth", "depth_sigma", "depth_source"),
    *("depth_origin", "zone", "station"),
    *("name", "description", "outline"),
)
"""Optional columns."""

_OF_STONES = ("depth", "depth_sigma", "depth_source", "depth_origin", "zone", "station")
_IDENTITY = ("block", "kind", "course", "role", "description")
_LIST = {"pnezd": ("name", "y", "x", "z", "description"), "penzd": ("name", "x", "y", "z", "description")}
_SEPARATORS = ("\t", ";", ",", "|", "")  # empty: any blanks
_SAMPLE = TRIALS  # first stones, by which the order of the axes is judged: habits show in far fewer
_LOOK_AHEAD = LONGEST_HEAD  # rows in which the first good one, or the names of the columns, must be found
_TITLES = 30  # rows before the names of the columns
_CACHED = 4096  # identities
_LONGEST_NAME = 64
_UNKNOWN = EMPTY | {""}
_NOTHING = float("nan")
AnyRows = TextRows | ListRows


def open_csv(path: Path, options: ReadingOptions | None = None) -> SurveyStream:
    """Read a table with names of columns and return its stones one by one.

    Parameters
    ----------
    path : the file, text or a workbook
    options : map of the columns, sheet, code template, kinds, unit; sigma of rows without one; the head of another file

    Returns
    -------
    SurveyStream : without the head of another file, corners must run counter-clockwise seen from outside

    Raises
    ------
    SurveyError
        naming file and line, if the table as a whole is wrong
    UsageError
        if the map of the columns or the code template is wrong
    """
    path = Path(path)
    return _by_roles(
        lambda options: open_table(path, open_rows(path, options.sheet), options), options or ReadingOptions()
    )


def open_table(path: Path, rows: AnyRows, options: ReadingOptions) -> SurveyStream:
    """Read a table from its rows; see `open_csv`."""
    iterator = iter(rows)
    ahead = list(islice(iterator, _LOOK_AHEAD))
    column_map = read_map(options.columns)
    header, columns = _find_header(rows, ahead, column_map, options)
    units, columns = with_units(rows, ahead[header:], columns)
    headed = are_headed(rows, ahead[header + units :], columns)
    data = chain(ahead[header + units :], iterator)
    return _read(path, rows, data, columns, options, titles=ahead[:header], headed=headed)


def is_table(path: Path) -> bool:
    """Return whether the first lines of a text name columns of points of stones, and say which is easting."""
    try:
        rows = open_rows(path)
        ahead = list(islice(iter(rows), _LOOK_AHEAD))
        header, columns = _find_header(rows, ahead, ColumnMap(), ReadingOptions())
        row: Any
        number, row = ahead[header - 1]
        names = rows.cells(row, number)
    except SurveyError:
        return False
    return "outline" in columns.at or {plain(names[columns.at[axis]]) for axis in "xy"}.isdisjoint("xy")


def open_pnezd(path: Path, options: ReadingOptions | None = None) -> SurveyStream:
    """Read a list of point, northing, easting, elevation, description, otherwise as `open_csv`."""
    return _open_list(Path(path), options or ReadingOptions(), "pnezd")


def open_penzd(path: Path, options: ReadingOptions | None = None) -> SurveyStream:
    """Read a list of point, easting, northing, elevation, description, otherwise as `open_csv`."""
    return _open_list(Path(path), options or ReadingOptions(), "penzd")


def _open_list(path: Path, options: ReadingOptions, form: str) -> SurveyStream:
    if options.columns:
        return open_csv(path, options)
    return _by_roles(lambda options: _opened_list(path, options, form), options)


def _by_roles(opened: Callable[[ReadingOptions], SurveyStream], options: ReadingOptions) -> SurveyStream:
    """Open a list; again with S as a corner, "sommet", where it can be no station."""
    try:
        return opened(options)
    except _SommetError:
        stream = opened(replace(options, roles={**options.roles, "s": "vertex"}))
        remark = "role S is read as a corner (sommet), as no station stands at three places"
        return replace(stream, remarks=(*stream.remarks, remark))


def _opened_list(path: Path, options: ReadingOptions, form: str) -> SurveyStream:
    rows = open_rows(path, options.sheet)
    iterator = iter(rows)
    ahead = list(islice(iterator, _LOOK_AHEAD))
    header = 0
    while header < len(ahead) - 1 and header < _TITLES and not _has_digits(ahead[header][1]):
        header += 1
    if ahead and not _has_digits(ahead[header][1]):
        del ahead[:]
    columns = Columns(5, {name: k for k, name in enumerate(_LIST[form])})
    if ahead[header:]:
        rows.delimiter = _list_delimiter(rows, ahead[header:], form)
        header += _further_titles(rows, ahead[header:])
        if header:
            _check_axes(rows, ahead[header - 1], form)
    titles = ahead[:header]
    return _read(path, rows, chain(ahead[header:], iterator), columns, options, form, titles)


def _further_titles(rows: AnyRows, ahead: Sequence[tuple[int, Any]]) -> int:
    """Return the number of rows before the first that begins with the number of a point, or has coordinates."""
    for count, (number, row) in enumerate(ahead[:_TITLES]):
        try:
            cells = rows.cells(row, number, 5)
        except SurveyError:  # told when the row is read
            return count
        numbers = [is_number(cell, rows.delimiter != ",") for cell in cells[:4]]
        if numbers[0] or sum(numbers) > 1:
            return count
    return 0


def _has_digits(row: Row) -> bool:
    return any(character.isdigit() for text in ([row] if isinstance(row, str) else row) for character in text)


def _read(
    path: Path,
    rows: AnyRows,
    data: Iterator[tuple[int, Any]],
    columns: Columns,
    options: ReadingOptions,
    form: str = "",
    titles: Sequence[tuple[int, Any]] = (),
    headed: bool = False,
) -> SurveyStream:
    reader = _RowReader(path, rows, columns, options, form, headed)
    first = 0
    for number, row in data:
        first = first or number
        reader.take(row, number)
    collector = reader.collector
    collector.close()
    if not first:
        what = "list has no points" if form else "table has no points"
        raise rows.fail(rows.end, f"the {what}", "add one line per point")
    names = rows.cells(titles[-1][1], titles[-1][0]) if titles and not form else ()
    if not form and {"block", "course"} <= columns.at.keys() and not columns.joined:
        _check_numbers(rows.path, columns, names, collector.table.stones)
    if not form and "block" in columns.at and "outline" not in columns.at:
        at = columns.at["block"]
        title = names[at] if at < len(names) else str(at + 1)
        if "description" in (kind_of_column(title), *read_map(options.columns).names):
            check_names(rows.path, title, collector.table.stones)
        check_stones_repeat(rows.path, columns, names, collector.table.stones, options.columns)
    head = collector.head
    doubt = _order_remarks(rows, collector, columns, options, form, titles)
    remarks = (*rows.remarks, *reader.remarks, *collector.remarks, *doubt)
    return SurveyStream(head, collector.table.records(), header=first - 1, remarks=remarks)


def _check_numbers(
    path: str, columns: Columns, names: Sequence[str], stones: Mapping[str, TableStone]
) -> None:
    """Refuse a table whose stones are numbered anew in each course."""
    shared = sum(isinstance(stone.error, _AnotherCourseError) for stone in stones.values())
    if 2 * shared <= len(stones):
        return
    both = [names[columns.at[what]] if names else str(columns.at[what] + 1) for what in ("course", "block")]
    raise SurveyError(
        NUMBERED_ANEW,
        where=path,
        remedy=f'name stones by both: --columns "block={"+".join(both)}"',
    )


def _find_header(
    rows: AnyRows, ahead: Sequence[tuple[int, Any]], column_map: ColumnMap, options: ReadingOptions
) -> tuple[int, Columns]:
    """Return the number of rows up to the names of the columns, and the columns; sets the separator."""
    stated, codes = rows.delimiter, options.codes is not None
    best: tuple[int, SurveyError] | None = None
    for k, (number, row) in enumerate(ahead[:_TITLES]):
        rows.delimiter = stated
        for delimiter in rows.delimiters(row):
            rows.delimiter, recognised = delimiter, 0
            try:
                names = rows.cells(row, number)
                recognised = sum(kind_of_column(name) is not None for name in names if name)
                where = f"{rows.path}:{number}" if number else rows.path
                map_with_role = column_map
                if recognised:
                    map_with_role = with_role(rows, ahead[k + 1 :], names, column_map, codes, options.roles)
                columns = find_columns(names, map_with_role, where, codes)
            except SurveyError as error:
                if best is None or recognised > best[0]:
                    best = recognised, error
                continue
            if column_map.numbered and _is_data(rows, names, columns, number):
                return k, replace(columns, notes=())
            return k + 1, columns
    rows.delimiter = stated
    if best is None:
        raise rows.fail(rows.end, "the table is empty: no column 'block'", "begin it with e.g. block,x,y,z")
    if not best[0]:
        _check_named(rows, ahead)
    raise best[1]


def _check_named(rows: AnyRows, ahead: Sequence[tuple[int, Any]]) -> None:
    """Refuse a list of a total station, which has no names of columns."""
    number, row = ahead[0]
    stated = rows.delimiter
    for delimiter in _SEPARATORS if stated is None else (stated,):
        rows.delimiter = delimiter
        if _is_point(rows, row, number):
            raise rows.fail(
                number,
                "the table has no names of columns, but a point with two coordinates, an elevation and a code",
                "give --format pnezd if the northing comes first, or --format penzd if the easting does",
            )
    rows.delimiter = stated


def _is_data(rows: AnyRows, names: Sequence[str], columns: Columns, number: int) -> bool:
    """Return whether the first row holds numbers already, where all columns are given by number."""
    if "outline" in columns.at:
        return True
    decimals = Decimals(rows.path, commas=rows.delimiter != ",", any_mark=True)
    try:
        for axis in "xyz":
            decimals.number(names[columns.at[axis]], axis, number)
    except SurveyError:
        return False
    return True


def _list_delimiter(rows: AnyRows, ahead: Sequence[tuple[int, Any]], form: str) -> str:
    """Return the separator of the fields in the first line that has coordinates."""
    stated = rows.delimiter
    for number, row in ahead:
        for delimiter in _SEPARATORS if stated is None else (stated,):
            rows.delimiter = delimiter
            if _is_point(rows, row, number):
                return delimiter
    rows.delimiter = stated
    number, row = ahead[0]
    text = row if isinstance(row, str) else " ".join(row)
    words = text.split()
    axes = "x=3,y=4" if form == "penzd" else "y=3,x=4"
    coded = len(words) == 5 and all(map(is_number, words[2:])) and not is_number(words[1])
    example = f"name=1,description=2,{axes},z=5" if coded else "block=1,x=2,y=3,z=4"
    raise rows.fail(
        number,
        f"{shown(text)} is not a point with two coordinates, an elevation and a description",
        "separate the fields by commas, semicolons, tabs or blanks; for other columns give "
        f'--format csv --columns "{example}"',
    )


def _is_point(rows: AnyRows, row: Any, number: int) -> bool:
    """Return whether a row has five fields with three coordinates among them."""
    decimals = Decimals(rows.path, commas=rows.delimiter != ",", any_mark=rows.any_mark)
    try:
        parts = rows.cells(row, number, 5)
        if len(parts) == 5:
            decimals.place((parts[1], parts[2], parts[3]), "abc", number)
    except SurveyError:
        return False
    return len(parts) == 5


def _check_axes(rows: AnyRows, header: tuple[int, Any], form: str) -> None:
    """Refuse a list whose own names put the easting where the format has the northing, or the other way."""
    number, row = header
    try:
        names = rows.cells(row, number, 5)
    except SurveyError:
        return
    kinds = [kind_of_column(name) if plain(name) not in ("x", "y") else None for name in names[1:3]]
    alternative = other_order(form)
    if kinds == list(_LIST[alternative][1:3]):
        raise rows.fail(
            number,
            f"the columns are {', '.join(names)[:200]}, which is not the order of {form}",
            f"give --format {alternative}",
        )


def _order_remarks(
    rows: AnyRows,
    collector: "PointCollector",
    columns: Columns,
    options: ReadingOptions,
    form: str,
    titles: Sequence[tuple[int, Any]],
) -> tuple[str, ...]:
    """Refuse a list that speaks against the order of its axes; return a remark if nothing in it tells the order."""
    names = [] if {"x", "y"} & read_map(options.columns).names.keys() else _axis_names(rows, columns, titles)
    if not form and [plain(name) for name in names] != ["x", "y"]:
        return ()  # names of columns tell the axes, as easting and northing do
    if form and [kind_of_column(name) for name in names] == ["x", "y"] and plain(names[0]) != "x":
        return ()
    header_stations = options.head_for(Path(rows.path)).stations
    words = [Path(rows.path).stem, *(text for _, text in getattr(rows, "comments", ()))]
    words += [row if isinstance(row, str) else " ".join(map(str, row)) for _, row in titles]
    stones = [stone for stone in collector.table.stones.values() if stone.vertices]
    evidence = AxisEvidence(
        form,
        words,
        np.concatenate([np.array(stone.vertices).reshape(-1, 3) for stone in stones] or [np.empty((0, 3))]),
        outlines_of(stones[:_SAMPLE], collector.head),
        np.array([station.position for station in header_stations]).reshape(-1, 3),
    )
    if against := "; ".join(evidence.against()):
        what = ORDERS[form] if form else f"{names[0]} as the easting and {names[1]} as the northing"
        raise SurveyError(
            f"read with {what} it may be mirrored: {against}",
            where=rows.path,
            remedy=both_orders(form, names, None if options.codes else CODES),
        )
    if not form or evidence.speaks_for():
        return ()
    return (
        f"read with {ORDERS[form]}, as --format {form} says: nothing in the list confirms it, and with the other "
        f"order (--format {other_order(form)}) the wall would be the mirror image",
    )


def _axis_names(rows: AnyRows, columns: Columns, titles: Sequence[tuple[int, Any]]) -> list[str]:
    """Return the names of the columns of x and y; none where they have none."""
    if not titles or not ({"x", "y"} <= set(columns.at) or columns.corners):
        return []
    number, row = titles[-1]
    try:
        names = rows.cells(row, number)
    except SurveyError:
        return []
    places = columns.corners[0][:2] if columns.corners else (columns.at["x"], columns.at["y"])
    if max(places) >= len(names):
        return []
    return [names[k].rstrip("0123456789") if columns.corners else names[k] for k in places]


@dataclass(frozen=True, slots=True)
class _Identity:
    """The stone and role that a row states."""

    code: str
    name: str
    kind: str | None
    course: int | None
    zone: str | None
    role: str


class PointCollector:
    """Collector of the points of a list, which makes stones of them.

    Parameters
    ----------
    path : of the file, for errors
    options : code template, kinds, sigma, the head of another file
    unique : whether each point has a number of its own

    Attributes
    ----------
    table : the stones
    template : of the descriptions
    roles : of points by the words for them
    """

    def __init__(self, path: Path, options: ReadingOptions, unique: bool) -> None:
        self._path, self._options, self._unique = str(path), options, unique
        self.roles = roles_with(options.roles)
        self.template = CodeTemplate(
            options.codes or CODES, options.roles, numbered=options.codes is not None
        )
        self.table = PointTable(str(path), options.sigma, options.kind)
        self._head = options.head_for(path)
        self._known = {station.name: station for station in self._head.stations}
        self._stations: dict[str, Station] = {}
        self._lines_of: dict[str, int] = {}
        self._misfits: list[tuple[int, str]] | None = []  # until a description of a stone fits
        self._fitted = False  # a description has, if only of a station
        self._control: dict[str, int] = {}
        self._moved: set[str] = set()  # stations that are listed at two places

    @property
    def head(self) -> SurveyHead:
        """The head of the other file, with the stations of the list."""
        return replace(self._head, stations=(*self._head.stations, *self._stations.values()))

    def close(self) -> None:
        """Check that the template fits any description, and that most kinds are known."""
        if self._misfits and not self._fitted:
            self._refuse_template(self._misfits)
        stones = [
            stone for stone in self.table.stones.values() if stone.kind is not None and stone.error is None
        ]
        unknown = [stone for stone in stones if stone.kind not in self._options.known_kinds]
        if self._options.known_kinds and 2 * len(unknown) > len(stones):
            words = list(dict.fromkeys(str(stone.kind) for stone in unknown))
            table = ",".join(f"{word}={meant(word, self._options.known_kinds)}" for word in words[:LISTED])
            raise self.fail(
                unknown[0].line,
                f"unknown kinds: {', '.join(words[:LISTED])}",
                f'say what they stand for, e.g. --kinds "{table}"; ashlar is a stone of no special kind',
            )

    def fail(self, line: int, what: str, remedy: str, kind: type[SurveyError] = SurveyError) -> SurveyError:
        """Make an error that names a line of the file."""
        return kind(what, where=f"{self._path}:{line}", remedy=remedy)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on control points that were left out."""
        if not self._control:
            return ()
        words = ", ".join(f"{count} {word}" for word, count in self._control.items())
        return (f"control points belong to no stone and are left out: {words}",)

    def fields(self, description: str, line: int, name: str = "") -> CodeFields:
        """Take a description apart; one that only says that its point is a station or control names it by its number.

        Raises
        ------
        SurveyError
            if it does not fit the template; of the whole file, if no description so far has
        """
        code_fields = self.template.parse(description)
        if code_fields is not None:
            self._fitted = True
            if code_fields.role != STATION:
                self._misfits = None
            return code_fields
        if name and is_bare(description, self.roles):
            return CodeFields(name, None, None, None, self.roles[description.strip().casefold()])
        remedy = "correct it, or give the code template that the list was made with: --codes"
        if not any(map(str.isdigit, description)):
            remedy += f'; if it is no stone, --roles "{description.strip()[:20]}={CONTROL}"'
        if self._misfits is not None:
            if not self._misfits:
                remedy = self.template.expected(description, ())
            self._misfits.append((line, description))
            if len(self._misfits) >= _LOOK_AHEAD:
                self._refuse_template(self._misfits)
        raise self.fail(
            line, f"description {shown(description)} is not of the form {self.template.text}", remedy
        )

    def _refuse_template(self, misfits: Sequence[tuple[int, str]]) -> None:
        line, description = misfits[0]
        more = f", nor is any other of {len(misfits)}" if len(misfits) > 1 else ""
        raise _WrongTemplateError(
            f"description {shown(description)} is not of the form {self.template.text}{more}",
            where=f"{self._path}:{line}",
            remedy=self.template.expected(description, [text for _, text in misfits[1:]]),
        )

    def identity(
        self, block: str, kind: str | None, course: int | None, zone: str | None, role: str, line: int
    ) -> _Identity:
        """Check the names of a stone.

        Raises
        ------
        SurveyError
            if no code can be made of the name, or the kind is not one
        """
        code = code_of(block)
        if not code or len(block) > 2 * _LONGEST_NAME or not block.isprintable():
            what = f"block {shown(block)} is not a block name"
            raise self.fail(line, what, "write e.g. W01-01, at most 64 letters and digits")
        kind_word = None
        if kind:
            kind_word = kind_of(kind, self._options.kinds)
            if KIND.fullmatch(kind_word) is None:
                raise self.fail(
                    line, f"kind {shown(kind)} is not a kind name",
                    f'write e.g. header, or say what it stands for: --kinds "{kind[:40]}=ashlar"',
                )  # fmt: skip
        return _Identity(code, block, kind_word, course, zone, role)

    def stone(self, identity: _Identity, line: int) -> TableStone:
        """Return the stone of a row, made if it is not there yet; not yet kept.

        Raises
        ------
        SurveyError
            if it has another name, kind or course than before
        """
        stone = self.table.stones.get(identity.code)
        if (
            stone is not None and stone.agreed is identity
        ):  # the usual case: the row before was of the same stone
            return stone
        if stone is None:
            return TableStone(
                identity.code, identity.kind, identity.course, line, identity.name, zone=identity.zone
            )
        if stone.error is not None:
            return stone
        if stone.name != identity.name:
            raise self.fail(
                line,
                f"the names {shown(stone.name)} and {shown(identity.name)} both give the code {identity.code}",
                "write one name for one stone, and names that differ in letters or digits for two",
            )
        for name in ("kind", "course", "zone"):
            new, old = getattr(identity, name), getattr(stone, name)
            if new is not None and old is None:
                setattr(stone, name, new)
            elif new is not None and new != old:
                raise self.fail(
                    line,
                    f"kind, course or zone of block {identity.code} differs from line {stone.line}",
                    "give every line of a block the same kind and course",
                    SurveyError if identity.course in (None, stone.course) else _AnotherCourseError,
                )
        stone.agreed = identity
        return stone

    def check_name(self, name: str, line: int) -> None:
        """Check the number of a point, and that it is the only one."""
        if not name or not name.isprintable() or len(name) > _LONGEST_NAME:
            raise self.fail(line, f"point {shown(name)} is not a number or name", "number the points")
        if self._unique and (before := self._lines_of.setdefault(name, line)) != line:
            raise self.fail(line, f"point {name} a second time", f"the first is on line {before}")

    def add_station(self, name: str, place: tuple[float, float, float], line: int) -> None:
        """Add a position of the instrument.

        Raises
        ------
        SurveyError
            if there is another of that name at another place
        """
        before = self._known.get(name) or self._stations.get(name)
        if before is not None:
            if np.array_equal(before.position, place):
                return  # a list names its station at every setup
            corners = any(stone.vertices for stone in self.table.stones.values())
            if name in self._moved and not corners and self.roles["s"] == STATION:
                what = f"station {name} stands at three places: role S, or station, is a corner?"
                raise _SommetError(what, where=f"{self._path}:{line}", remedy="write v for a corner")
            self._moved.add(name)
            remedy = f"the first is on line {before.line}"
            if exchanged_station(np.array(place), before.position):
                remedy += ", with the axes exchanged: --format pnezd is one order, penzd the other"
            raise self.fail(line, f"station {name} a second time", remedy)
        self._stations[name] = Station(name, np.array(place), line)

    def leave_out(self, description: str) -> None:
        """Count a control point."""
        word = description.strip()
        self._control[word] = self._control.get(word, 0) + 1

    def add(
        self, name: str, description: str, place: tuple[float, float, float], line: int, count: int = 1
    ) -> None:
        """Add a point with a description; a wrong one spoils its stone."""
        code: str | None = None
        try:
            fields = self.fields(description, line, name)
            if fields.role == CONTROL:
                self.leave_out(description)
                return
            identity = self.identity(fields.block, fields.kind, fields.course, fields.zone, fields.role, line)
            if fields.role != STATION:
                code = identity.code
            if not all(math.isfinite(value) and abs(value) <= 1e8 for value in place):
                raise self.fail(
                    line, "a coordinate is not finite, or beyond 1e+08 m", "coordinates are in metres"
                )
            self.check_name(name, line)
            if fields.role == STATION:
                self.add_station(identity.code, place, line)
                return
            stone = self.stone(identity, line)
            if stone.error is None:
                stone.add_place(fields.role == "vertex", place, _NOTHING, name)
                self.table.stones[identity.code] = stone
            stone.add_line(line, count)
        except _WrongTemplateError:
            raise
        except SurveyError as error:
            self.table.refuse(code, error, line, count)


class _WrongTemplateError(SurveyError):
    """The code template fits no description of a file."""


class _SommetError(_WrongTemplateError):
    """A role that stands for a station is that of corners."""


class _AnotherCourseError(SurveyError):
    """A stone is in two courses."""


class _RowReader:
    """Reader of the rows of a table; in one that is `headed`, the name of a stone holds for the rows below it."""

    def __init__(
        self,
        path: Path,
        rows: AnyRows,
        columns: Columns,
        options: ReadingOptions,
        form: str,
        headed: bool,
    ) -> None:
        self._rows, self._path, self._fail = rows, rows.path, rows.fail
        self._columns, self._options, self._limit = columns, options, 5 if form else 0
        self._form = form
        self.collector = PointCollector(path, options, unique=bool(form))
        self._table = self.collector.table
        at = columns.at
        self._count = columns.count
        self._pick = itemgetter(
            *(at[column] for column in _IDENTITY if column in at), at.get("block", at.get("description", 0))
        )
        self._by = [column for column in _IDENTITY if column in at]
        self._outline_at = at.get("outline")
        self._corners = [itemgetter(*places) for places in columns.corners]
        self._place = None if self._outline_at is not None else itemgetter(at["x"], at["y"], at["z"])
        self._name_at, self._sigma_at = at.get("name"), at.get("sigma")
        self._of_stones = [(column, at[column]) for column in _OF_STONES if column in at]
        self._notes = [(k, note_key(name)) for k, name in columns.notes]
        unit = options.scale
        self._scale = {
            column: columns.scales.get(column, unit) for column in (*"xyz", "sigma", "depth", "depth_sigma")
        }
        scales = (self._scale["x"], self._scale["y"], self._scale["z"])
        self._decimals = Decimals(rows.path, rows.delimiter != ",", rows.any_mark, scales)
        self._known: dict[Any, _Identity] = {}
        self.remarks: tuple[str, ...] = ()
        if columns.notes:
            notes = ", ".join(name[:40] for _, name in columns.notes)
            self.remarks = (f'kept as notes: {notes}; --columns "ignore=…" leaves columns out',)
        self._name_of_rows = "" if headed else None
        if headed:
            self.remarks += ("rows without the name of a stone are of the stone above them",)

    def _told(self, remark: str) -> None:
        if remark not in self.remarks:
            self.remarks += (remark,)

    def take(self, row: Any, number: int) -> None:
        """Read one row."""
        values: list[str] | None = None
        try:
            values = self._rows.cells(row, number, self._limit)
            if len(values) != self._count:
                self._fit(values, number)
            if self._columns.joined:
                values.append("-".join(values[k] for k in self._columns.joined if values[k]))
            elif self._name_of_rows is not None:
                at = self._columns.at["block"]
                self._name_of_rows = values[at] = values[at] or self._name_of_rows
            key = self._pick(values)
            identity = self._known.get(key)
            if identity is None:
                identity = self._identified(values, number)
                if len(self._known) >= _CACHED:
                    self._known.clear()
                if "description" not in self._columns.at or not is_bare(
                    self._description(values), self.collector.roles
                ):
                    self._known[key] = identity
            if identity.role == CONTROL:
                word = self._columns.at.get("description", self._columns.at.get("role", 0))
                self.collector.leave_out(values[word])
                return
            stone = self._table.stones.get(identity.code)
            if stone is not None and stone.error is not None and identity.role != STATION:
                stone.add_line(number, self._rows.lines_of(row))
            else:
                self._add(identity, values, number, self._rows.lines_of(row))
        except _WrongTemplateError:
            raise
        except SurveyError as error:
            self._table.refuse(self._likely_code(row, values), error, number, self._rows.lines_of(row))

    def _description(self, values: Sequence[str]) -> str:
        return values[self._columns.at["description"]]

    def _fit(self, values: list[str], number: int) -> None:
        """Cut empty fields at the end."""
        if self._form:
            raise self._fail(
                number, f"{len(values)} fields, not 5", "write point, two coordinates, elevation, code"
            )
        if len(values) > self._count and not any(values[self._count :]):
            del values[self._count :]
        if len(values) != self._count:
            raise self._fail(number, f"{len(values)} fields for {self._count} columns", "fill every column")

    def _identified(self, values: Sequence[str], number: int) -> _Identity:
        """Find out which stone a row is of, and what its point is."""
        cells = {column: values[self._columns.at[column]] for column in self._by}
        role = "vertex"
        block, kind, course, zone = cells.get("block", ""), cells.get("kind"), None, None
        if "block" in cells and self._rows.is_date(block, number, self._columns.at["block"]):
            raise self._fail(number, f"the name of a stone is a date, {block}", DATE_REMEDY)
        if "description" in cells:
            name = values[self._name_at] if self._name_at is not None else ""
            fields = self.collector.fields(cells["description"], number, name)
            block, kind = block or fields.block, kind or fields.kind
            course, zone, role = fields.course, fields.zone, fields.role
        if (text := cells.get("course", "")).casefold() in NO_COURSE:
            self._told(f"{text!r} is no number of a course; stones with it have none")
        elif text:
            course = parse_course(text, f"{self._path}:{number}")
        if "role" in cells:
            stated = role_of(cells["role"], self.collector.roles)
            if stated is None:
                word = cells["role"].rstrip("0123456789")[:20] or "…"
                raise self._fail(
                    number,
                    f"role {shown(cells['role'])}",
                    f"write vertex (v) or point (p), or station (s); or say what it stands for: --roles "
                    f'"{word}=point"',
                )
            role = stated
        return self.collector.identity(block, kind, course, zone, role, number)

    def _add(self, identity: _Identity, values: Sequence[str], number: int, count: int) -> None:
        name = None
        if self._name_at is not None:
            name = values[self._name_at]
            if name or self._form:
                self.collector.check_name(name, number)
        if self._place is None:
            self._add_outline(identity, values, number, count)
            return
        texts = self._place(values)
        place = self._decimals.place(texts, "xyz", number)
        if identity.role == STATION:
            self.collector.add_station(identity.code, place, number)
            return
        sigma = _NOTHING
        if self._sigma_at is not None and (text := values[self._sigma_at]).lower() not in _UNKNOWN:
            sigma = self._decimals.length(text, "sigma", number, self._scale["sigma"])
        stone = self._stone_of(identity, values, number)
        stone.add_place(identity.role == "vertex", place, sigma, name)
        stone.add_line(number, count)

    def _add_outline(self, identity: _Identity, values: Sequence[str], number: int, count: int) -> None:
        if self._corners:
            texts = [place for pick in self._corners if any(place := pick(values))]
            corners = np.array([self._decimals.place(place, "xyz", number) for place in texts])
        else:
            outline = outline_of(values[self._outline_at or 0], f"{self._path}:{number}")
            corners = self._options.scale * outline
        sigma = _NOTHING
        if self._sigma_at is not None and (text := values[self._sigma_at]).lower() not in _UNKNOWN:
            sigma = self._decimals.length(text, "sigma", number, self._scale["sigma"])
        if identity.code in self._table.stones:
            before = self._table.stones[identity.code]
            same_course = None in (identity.course, before.course) or identity.course == before.course
            raise self._fail(
                number,
                f"block {identity.code} a second time",
                f"the first is on line {before.line}; draw one outline for each",
                SurveyError if same_course else _AnotherCourseError,
            )
        stone = self._stone_of(identity, values, number)
        for corner in corners.tolist():
            stone.add_place(True, (corner[0], corner[1], corner[2]), sigma, None)
        stone.add_line(number, count)

    def _stone_of(self, identity: _Identity, values: Sequence[str], number: int) -> TableStone:
        """Return the stone of a row, with what the row says of all of it."""
        stone = self.collector.stone(identity, number)
        if stone.agreed is identity and not self._of_stones and not self._notes:
            return stone
        for name, k in self._of_stones:
            if values[k].lower() not in _UNKNOWN:
                self._set(stone, name, values[k], number)
        for k, key in self._notes:
            if values[k]:
                stone.add_note(key, values[k])
        self._table.stones[identity.code] = stone
        return stone

    def _set(self, stone: TableStone, name: str, text: str, number: int) -> None:
        """Set a value of the whole block from one of its rows."""
        value: float | str = text
        if name in ("depth", "depth_sigma"):
            value = self._decimals.length(text, name, number, self._scale[name])
        elif name == "station":
            check_station(text, self.collector.head, f"{self._path}:{number}")
        elif name == "depth_origin":
            if text not in DEPTH_ORIGINS:
                remedy = f"write one of {', '.join(DEPTH_ORIGINS)}"
                raise self._fail(number, f"origin of a depth {shown(text)}", remedy)
        elif not text.isprintable() or (name == "zone" and ('"' in text or len(text) > _LONGEST_NAME)):
            raise self._fail(number, f"{name} {shown(text)} is not a name", "write printable words")
        before = getattr(stone, name)
        if before not in (None, value):
            shown_value, first = (
                f"{number_or_text:g} m" if isinstance(number_or_text, float) else shown(number_or_text)
                for number_or_text in (value, before)
            )
            raise self._fail(number, f"{name} {shown_value}, but {first} before", f"give a block one {name}")
        setattr(stone, name, value)

    def _likely_code(self, row: Any, values: list[str] | None) -> str | None:
        """Return the stone that a wrong row names; None if it cannot be known."""
        at = self._columns.at
        if values is not None and len(values) == self._count and "description" in at:
            parsed = self.collector.template.parse(values[at["description"]])
            if parsed is not None:
                return code_of(parsed.block) or None if parsed.role != STATION else None
        if "block" in at:
            rough = self._rows.rough_cells(row) if values is None else values
            name = rough[at["block"]] if at["block"] < len(rough) else ""
            return (code_of(name) or None) if len(name) <= 2 * _LONGEST_NAME else None
        rest = [row if isinstance(row, str) else ";".join(row)]
        while len(rest := rest[-1].split(self._rows.delimiter or None, 1)) == 2:
            parsed = self.collector.template.parse(rest[1].strip())
            if parsed is not None and parsed.role != STATION and CODE.fullmatch(parsed.block):
                return parsed.block
        return None
