"""Small tables read as a whole: points, marks, outlines, time series.

The separator is the one with which most lines are rows of the table. Lines before the first row are titles, of which
the last one names the columns if it has one field for each.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from ground.errors import SurveyError
from ground.tables.columns import LONGEST_HEAD, places_of
from ground.tables.decimals import Decimals
from ground.tables.numbers import is_number, shown
from ground.tables.rows import DATE_REMEDY, ListRows, Row, TextRows, open_rows

_SAMPLE = 50  # lines by which the separator is found
_SEPARATORS: tuple[str, ...] = (";", "\t", "|", ",")
_BLANKS = ""
_TWO_PARTS = re.compile(r'"?[+-]?\d+,\d+"?')

IsRow = Callable[[Sequence[str], bool], bool]
"""Function of the fields of a line, and of whether decimals may have commas: whether it is a row of the table."""


@dataclass(frozen=True)
class TableRow:
    """Row of a table: its line, counted from 1, and its fields."""

    line: int
    cells: tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """Rows of a file.

    Attributes
    ----------
    path : of the file, for messages
    rows : from the first that is one
    titles : lines before the rows
    comments : lines before the rows that begin with #, without it
    commas : whether decimals may have a comma
    decimals : reader of numbers, which keeps to one decimal mark
    source : of the rows
    """

    path: str
    rows: tuple[TableRow, ...]
    titles: tuple[TableRow, ...]
    comments: tuple[TableRow, ...]
    commas: bool
    decimals: Decimals
    source: TextRows | ListRows

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns: the last title, if it has a field for each; otherwise ()."""
        cells = self.titles[-1].cells if self.titles else ()
        return cells if len(cells) == len(self.rows[0].cells) else ()

    def where(self, line: int) -> str:
        """Return the place of a line, for messages."""
        return f"{self.path}:{line}"

    def number(self, text: str, what: str, line: int) -> float:
        """Read one finite decimal number; `what` names it in the error."""
        return self.decimals.number(text, what, line)

    def pointed(self, text: str) -> str:
        """Return a number with a decimal point; any other text as it is."""
        return text.replace(",", ".", 1) if self.commas and is_number(text, True) else text

    def columns(
        self, wanted: Mapping[str, Sequence[str]], least: int
    ) -> tuple[TableRow | None, dict[str, int]]:
        """Return the line that names columns, and the place of each wanted one; (None, {}) without such a line.

        Parameters
        ----------
        wanted : names of columns by what they are
        least : number of wanted columns that make a title or comment a line of names

        Raises
        ------
        SurveyError
            if two columns are one thing
        """
        for row in reversed(self.titles):
            places = places_of(row.cells, wanted, self.where(row.line))
            if len(places) >= least:
                return row, places
        for row in reversed(self.comments):
            with suppress(SurveyError):  # a sentence may name an axis twice
                places = places_of(row.cells, wanted, self.where(row.line))
                if len(places) >= least:
                    return row, places
        return None, {}

    def name(self, row: TableRow, column: int, what: str) -> str:
        """Return the field of a row that is a name.

        Raises
        ------
        SurveyError
            if it is empty, or a date, into which spreadsheets turn names such as 1-1
        """
        text = row.cells[column] if column < len(row.cells) else ""
        if not text:
            raise SurveyError(f"{what} is empty", where=self.where(row.line), remedy="write its name")
        if self.source.is_date(text, row.line, column):
            raise SurveyError(f"{what} is a date, {text}", where=self.where(row.line), remedy=DATE_REMEDY)
        return text

    def check_titles(self, remedy: str) -> None:
        """Refuse a line before the rows that is one but for a mistake.

        Raises
        ------
        SurveyError
            if it has as many fields as the rows, some of them numbers
        """
        for title in self.titles:
            numbers = [cell for cell in title.cells[1:] if is_number(cell, self.commas)]
            if numbers and len(title.cells) == len(self.rows[0].cells):
                raise SurveyError(
                    f"{shown(' '.join(title.cells))} is neither names of columns nor a row like the others",
                    where=self.where(title.line),
                    remedy=remedy,
                )


def read_table(
    path: Path, is_row: IsRow, remedy: str, sheet: str | None = None, comments: bool = False
) -> Table:
    """Read a table as a whole.

    Parameters
    ----------
    path : of text, or of a workbook
    is_row : whether the fields of a line are a row of this table
    remedy : what the table should have, for errors
    sheet : of a workbook; None: the only one that is not empty
    comments : what follows # in a row is a comment, too

    Raises
    ------
    SurveyError
        if the file cannot be read or has no row
    UsageError
        if a sheet must be named
    """
    source = open_rows(path, sheet)
    if isinstance(source, TextRows) and source.delimiter is None:
        head = islice(source, LONGEST_HEAD + _SAMPLE)
        lines: list[tuple[int, Row]] = [(number, _bare(row, comments)) for number, row in head]
        source.delimiter = _separator(source, lines, is_row)
    commas = source.delimiter != ","
    rows = [TableRow(number, _trimmed(source, _bare(row, comments), number)) for number, row in source]
    first = next((k for k, row in enumerate(rows[: LONGEST_HEAD + 1]) if is_row(row.cells, commas)), None)
    if first is None:
        line = rows[0].line if rows else source.end
        text = shown(" ".join(rows[0].cells)) if rows else "the file"
        what = f"{text} is not a row of this table" if rows else "the file has no rows"
        raise SurveyError(what, where=f"{source.path}:{line}", remedy=remedy)
    remarks = tuple(
        TableRow(number, tuple(word.strip() for word in text.split(source.delimiter or None)))
        for number, text in source.comments
    )
    decimals = Decimals(source.path, commas, source.any_mark)
    return Table(source.path, tuple(rows[first:]), tuple(rows[:first]), remarks, commas, decimals, source)


def _bare(row: Row, comments: bool) -> Row:
    """Return a line of text without the comment at its end, if it may have one."""
    return row.partition("#")[0] if comments and isinstance(row, str) else row


def _trimmed(source: TextRows | ListRows, row: Row, line: int) -> tuple[str, ...]:
    """Return the fields of a row without empty ones at its end."""
    cells = source.cells(row, line)  # type: ignore[arg-type]  # rows of this source
    while len(cells) > 1 and not cells[-1]:
        del cells[-1]
    return tuple(cells)


def _separator(source: TextRows, lines: Sequence[tuple[int, Row]], is_row: IsRow) -> str:
    """Return the separator with which most lines are rows; empty: blanks.

    Between commas and blanks, the one with which more fields are numbers: ``0,01 0,05`` has two.
    """
    text = "".join(str(line) for _, line in lines)
    scores: dict[str, tuple[int, float]] = {}
    for delimiter in (*(separator for separator in _SEPARATORS if separator in text), _BLANKS):
        source.delimiter, rows, numbers = delimiter, 0, 0.0
        for number, line in lines:
            with suppress(SurveyError):  # wrong quotes, with this separator
                cells = _trimmed(source, line, number)
                if is_row(cells, delimiter != ","):
                    rows += 1
                    numbers += sum(is_number(cell, delimiter != ",") for cell in cells) / len(cells)
        scores[delimiter] = rows, numbers
    most = max(rows for rows, _ in scores.values())
    clear = (
        separator for separator in _SEPARATORS[:-1] if separator in scores and scores[separator][0] == most
    )
    best: str = next(clear, None) or max(scores, key=lambda separator: scores[separator])
    pairs = [str(line).strip().strip('"') for _, line in lines if _TWO_PARTS.fullmatch(str(line).strip())]
    if best == "," and len(pairs) >= scores[","][0] and _repeats([pair.partition(",")[0] for pair in pairs]):
        return _BLANKS
    return best


def _repeats(wholes: Sequence[str]) -> bool:
    """Return whether ``0,05`` is one number in all lines: what stands before the comma repeats, unlike times."""
    return len(set(wholes)) <= len(wholes) // 2
