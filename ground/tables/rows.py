"""Rows of tables, from text with any usual separator or from the sheets of a workbook.

Text: fields are separated by commas, semicolons, tabs, bars or blanks, and may be quoted; a quoted field may hold
separators and line ends. A first line ``sep=;`` states the separator, as Excel writes it. Lines that begin with ``#``
and rows of nothing but separators are skipped. Workbooks (XLSX, XLS, XLSB, ODS) are recognised by their content,
whatever the name of the file.
"""

import csv
import io
import math
import re
from collections.abc import Iterator, Sequence
from datetime import date
from itertools import islice
from pathlib import Path
from typing import Any

from ground.errors import SurveyError, UsageError
from ground.tables.numbers import has_groups, shown, ungrouped, unreadable
from ground.tables.text_lines import TextLines

Row = str | Sequence[str]
"""A line of text that is not yet split, or the cells of a sheet."""

DATE_REMEDY = "format the column as text and write the names again: spreadsheets take 1-1 for a date"
"""Remedy for a date where names stand."""

_DELIMITERS = (";", "\t", ",", "|")
_BLANKS = ""
_STATED = re.compile(r'"?sep=(.)"?', re.IGNORECASE)
_WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
_OPEN = "unexpected end of data"  # csv's words for a quoted field that goes on
_WHOLE_FIELD = re.compile(r'(^|[,;\t|])[ ]*"(?:[^"]|"")*"')
_OPEN_FIELD = re.compile(r'(?:^|[,;\t|])[ ]*"')
_LONGEST_FIELD = 40  # lines of a quoted field
_SEPARATORS = " \t,;|"
_MONTH = r"(jan|feb|mar|mär|apr|may|mai|jun|jul|aug|sep|oct|okt|nov|dec|dez)[a-z]*\.?"
_DATE = re.compile(rf"\d{{1,2}}[-. ]+{_MONTH}([-. ]+\d{{2,4}})?|{_MONTH}[-. ]+\d{{1,4}}", re.IGNORECASE)


class TextRows:
    """Rows of a text file.

    Attributes
    ----------
    path : as text, for messages
    end : number of the last line
    delimiter : one character; empty: any blanks; None: not yet known
    remarks : none
    comments : line and text of the comments before the first row, once that has been read
    """

    any_mark = False
    remarks: tuple[str, ...] = ()

    def __init__(self, path: Path) -> None:
        self._lines = TextLines(path)
        self.path, self.end, self.fail = self._lines.path, self._lines.end, self._lines.fail
        self.delimiter: str | None = None
        self.comments: list[tuple[int, str]] = []
        self._stated_on = 0
        for number, line in self._lines:
            text = line.strip()
            if (match := _STATED.match(text)) and not text[match.end() :].strip(_SEPARATORS):
                self.delimiter, self._stated_on = match[1], number
            if text.startswith("#"):
                self.comments.append((number, text.lstrip("# ")))
            elif text:
                break

    def __iter__(self) -> Iterator[tuple[int, str]]:
        """Iterate over (number of the first line, text) of the rows."""
        lines = iter(self._lines)
        waiting: list[tuple[int, str]] = []
        while entry := (waiting.pop(0) if waiting else next(lines, None)):
            number, line = entry
            text = line.strip(_SEPARATORS)
            if not text or text[0] == "#" or number == self._stated_on:
                continue
            if '"' in line and line.count('"') % 2 and _is_open(line):
                line = self._joined(line, waiting, lines)
            yield number, line

    def _joined(self, line: str, waiting: list[tuple[int, str]], lines: Iterator[tuple[int, str]]) -> str:
        """Return the line with those that its last quoted field goes on in, if it has an end."""
        waiting += islice(lines, max(0, _LONGEST_FIELD - len(waiting)))
        whole = line
        for k, (_, following) in enumerate(waiting, start=1):
            whole += "\n" + following
            if not _is_open(whole):
                del waiting[:k]
                return whole
        return line

    def _quoted(self, line: str) -> list[str]:
        (row,) = csv.reader([line], strict=True, delimiter=self.delimiter or " ")
        return row

    def cells(self, row: str, line: int, limit: int = 0) -> list[str]:
        """Split a row into its fields, the last of at most `limit` with all that is left.

        Numbers come without marks between their thousands.

        Raises
        ------
        SurveyError
            if its quotes are wrong
        """
        values = self._split(row, line, limit)
        return [ungrouped(value) for value in values] if has_groups(row) else values

    def _split(self, row: str, line: int, limit: int) -> list[str]:
        if '"' in row and self.delimiter:
            try:
                values = self._quoted(row)
            except csv.Error as error:
                if limit and str(error) != _OPEN and not row.lstrip().startswith('"'):  # inches, say
                    return [word.strip() for word in row.split(self.delimiter, limit - 1)]
                what, remedy = f"not a table line: {error}", "check quotes and separators"
                raise self.fail(line, what, remedy) from error
            values = [" ".join(value.split("\n")).strip() for value in values]
            if limit and len(values) > limit:
                values[limit - 1 :] = [self.delimiter.join(values[limit - 1 :])]
            return values
        if not self.delimiter:
            return [word.strip('"') for word in row.split(None, limit - 1 if limit else -1)]
        return [word.strip() for word in row.split(self.delimiter, limit - 1 if limit else -1)]

    def rough_cells(self, row: str) -> list[str]:
        """Split a row that has wrong quotes, to find the stone that it names."""
        return [word.strip() for word in row.replace('"', "").split(self.delimiter or None)]

    def is_date(self, text: str, line: int, column: int) -> bool:
        """Return whether a field is a date as spreadsheets write it for 1-1: 1-Jan, 01. Jan, Jan 01."""
        return _DATE.fullmatch(text) is not None

    def lines_of(self, row: str) -> int:
        """Return the number of lines that a row takes up."""
        return row.count("\n") + 1 if "\n" in row else 1

    def delimiters(self, row: str) -> Sequence[str]:
        """Return the possible separators of a row, the most frequent first."""
        if self.delimiter is not None:
            return (self.delimiter,)
        bare = re.sub(r'"[^"]*"', "", row)
        delimiters = sorted(
            (delimiter for delimiter in _DELIMITERS if delimiter in bare), key=bare.count, reverse=True
        )
        return delimiters if set(delimiters) - {","} else (*delimiters, _BLANKS)


class ListRows:
    """Rows of a sheet of a workbook, or of another list of cells; see `TextRows`.

    Parameters
    ----------
    path : of the file
    rows : number, from 1, and cells of each; that of the names of columns may be 0
    remarks : on how they were read
    dates : row, from 1, and column, from 0, of cells that hold a date
    """

    any_mark = True
    delimiter: str | None = ";"  # of the rows, when they are written as text

    def __init__(
        self,
        path: str,
        rows: Sequence[tuple[int, list[str]]],
        remarks: tuple[str, ...] = (),
        dates: frozenset[tuple[int, int]] = frozenset(),
    ) -> None:
        self.path, self._rows, self.remarks, self._dates = path, rows, remarks, dates
        self.comments: list[tuple[int, str]] = []
        self.end = max(1, rows[-1][0]) if rows else 1

    def __iter__(self) -> Iterator[tuple[int, Sequence[str]]]:
        return iter(self._rows)

    def cells(self, row: Sequence[str], line: int, limit: int = 0) -> list[str]:
        """Return the cells; those after `limit` are joined by blanks."""
        values = list(row)
        if limit and len(values) > limit:
            values[limit - 1 :] = [" ".join(value for value in values[limit - 1 :] if value)]
        return values

    def rough_cells(self, row: Sequence[str]) -> list[str]:
        """Return the cells."""
        return list(row)

    def is_date(self, text: str, line: int, column: int) -> bool:
        """Return whether a cell is a date."""
        return (line, column) in self._dates

    def lines_of(self, row: Sequence[str]) -> int:
        """Return 1."""
        return 1

    def delimiters(self, row: Sequence[str]) -> Sequence[str]:
        """Return the separator of the rows as text."""
        return (self.delimiter or "",)

    def fail(self, line: int, what: str, remedy: str, kind: type[SurveyError] = SurveyError) -> SurveyError:
        """Make an error that names a row."""
        return kind(what, where=f"{self.path}:{line}" if line else self.path, remedy=remedy)


def _sheet_rows(path: Path, sheet: str | None) -> ListRows:
    """Read the only sheet of a workbook that is not empty, or the named one."""
    from python_calamine import CalamineError, CalamineWorkbook

    try:
        book = CalamineWorkbook.from_filelike(io.BytesIO(path.read_bytes()))  # whatever its ending
        names = list(book.sheet_names)
        if sheet is not None and sheet not in names:
            raise UsageError(
                f"no sheet {shown(sheet)}", where=str(path), remedy=f"sheets: {', '.join(names)}"
            )
        sheets = {name: book.get_sheet_by_name(name) for name in ([sheet] if sheet is not None else names)}
        cells = {key: _spread(content) for key, content in sheets.items()}
        tables = {key: _filled(rows) for key, (rows, _) in cells.items()}
    except (CalamineError, OSError, ValueError) as error:
        raise SurveyError(
            f"looks like a workbook, but cannot be read: {str(error)[:120]}".replace("\n", " "),
            where=str(path),
            remedy="give a workbook (XLSX, ODS, XLS) that is not encrypted, or save the table as CSV",
        ) from error
    if not names:
        raise SurveyError("the workbook has no sheets", where=str(path), remedy="save the table as CSV")
    full = [key for key, rows in tables.items() if rows]
    if len(full) > 1:
        raise UsageError(
            f"the workbook has {len(full)} sheets: {', '.join(full)}",
            where=str(path),
            remedy="name one with --sheet",
        )
    name = full[0] if full else names[0]
    rows, merged = cells.get(name, ([], 0))
    remarks = [f"read from sheet {name!r} of a workbook"]
    if merged:
        remarks.append(f"{merged} merged cells hold for all of their rows")
    dates = frozenset(
        (number, column)
        for number, row in enumerate(rows, start=1)
        for column, cell in enumerate(row)
        if isinstance(cell, date)
    )
    return ListRows(str(path), tables[name], tuple(remarks), dates)


def _spread(sheet: Any) -> tuple[list[list[Any]], int]:
    """Return the cells of a sheet, those merged downwards filled, and the number of such merged cells."""
    rows = [list(row) for row in sheet.to_python(skip_empty_area=False)]
    merged = 0
    for (top, first), (bottom, _) in getattr(sheet, "merged_cell_ranges", None) or ():
        if bottom > top and top < len(rows) and first < len(rows[top]) and rows[top][first] not in ("", None):
            merged += 1
            for row in rows[top + 1 : bottom + 1]:
                row[first] = rows[top][first]
    return rows, merged


def _is_open(text: str) -> bool:
    """Return whether a quoted field begins in a row and does not end there."""
    return _OPEN_FIELD.search(_WHOLE_FIELD.sub(r"\1", text)) is not None


def is_workbook(path: Path) -> bool:
    """Return whether the content of a file is that of a workbook, or of another compressed file.

    Raises
    ------
    SurveyError
        if it cannot be read
    """
    try:
        with path.open("rb") as handle:
            return handle.read(4) in _WORKBOOKS
    except (OSError, ValueError) as error:
        raise unreadable(path, error, "give an existing file") from error


def open_rows(path: Path, sheet: str | None = None) -> TextRows | ListRows:
    """Open the rows of a table.

    Parameters
    ----------
    path : of text or a workbook
    sheet : of a workbook; None: the only one that is not empty

    Raises
    ------
    SurveyError
        if it can be read as neither
    UsageError
        if there is no such sheet, or none of several is named
    """
    if is_workbook(path):
        return _sheet_rows(path, sheet)
    if sheet is not None:
        raise UsageError(
            "a sheet is named, but the file is not a workbook", where=str(path), remedy="leave --sheet out"
        )
    return TextRows(path)


def _filled(rows: Sequence[Sequence[Any]]) -> list[tuple[int, list[str]]]:
    """Return the rows that are not empty or comments, as text, with their numbers."""
    found = []
    for number, row in enumerate(rows, start=1):
        cells = [cell_text(cell) for cell in row]
        full = [cell for cell in cells if cell]
        if full and not (len(full) == 1 and full[0].startswith("#")):
            found.append((number, cells))
    return found


def cell_text(cell: Any) -> str:
    """Return a cell as text; numbers without decimals that are whole, or marks between thousands; nothing for None."""
    if cell is None:
        return ""
    if isinstance(cell, float):
        return (
            str(int(cell)) if math.isfinite(cell) and cell.is_integer() and abs(cell) < 1e15 else repr(cell)
        )
    return ungrouped(" ".join(str(cell).split()))
