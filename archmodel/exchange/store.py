"""Storing the rows of a section, many at a time, with each refusal traced to its row."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from sqlalchemy import Column, UniqueConstraint, bindparam, select, update
from sqlalchemy.exc import DataError, DBAPIError, IntegrityError, StatementError
from sqlalchemy.orm import Session

from archmodel.exchange.rows import Row, quoted_key
from archmodel.exchange.sections import Label, Section
from archmodel.exchange.values import quoted
from archmodel.store.bulk import BATCH, insert_rows
from ground.errors import ExchangeError

Values = dict[str, Any]

WEIGHT = 1 << 22
"""Most characters of the document that are stored at once, whatever the number of rows."""


class SectionStore:
    """Store of the rows of one section, in their order.

    Parameters
    ----------
    session : a writing session
    section : the section
    document : its name, for errors
    """

    def __init__(self, session: Session, section: Section, document: str) -> None:
        self._session, self._section, self._document = session, section, document
        self._waiting: list[Row] = []
        self._weight = 0
        self._later: list[Row] = []

    def add(self, row: Row, weight: int) -> None:
        """Take a row, to be stored with others.

        Parameters
        ----------
        row : the row
        weight : characters that it has in the document
        """
        self._waiting.append(row)
        self._weight += weight
        if row.later:
            key = self._section.key[0]
            self._later.append(replace(row, values={key: row.values[key]}, labels={}))
        if len(self._waiting) >= BATCH or self._weight >= WEIGHT:
            self._store()

    def finish(self) -> None:
        """Store the remaining rows, then the references to rows that came later."""
        self._store()
        for start in range(0, len(self._later), BATCH):
            self._refer(self._later[start : start + BATCH])
        self._later = []
        for field in self._section.fields:
            if field.within:
                self._refuse_rings(field.column)

    def _refuse_rings(self, column: Column[Any]) -> None:
        """Refuse rows that are parts or successors of themselves, even by way of others."""
        key = self._section.table.c[self._section.key[0]]
        pairs = self._session.execute(select(key, column).where(column.is_not(None)))
        target: dict[Any, Any] = {number: parent for number, parent in pairs}  # noqa: C416
        while target:
            start, at = target.popitem()
            chain = [start]
            while at != start and at in target:
                chain.append(at)
                at = target.pop(at)
            if at in chain:
                ring = " → ".join(str(label) for label in [*chain[chain.index(at) :], at][:10])
                what = f"{self._section.name} {at} refers to itself by {column.name}: {ring}"
                raise ExchangeError(what, where=f"{self._document} $.tables.{self._section.name}")

    def _store(self) -> None:
        rows, self._waiting, self._weight = self._waiting, [], 0
        if not rows:
            return
        for label in self._section.labels:
            self._check_label(label, rows)
        self._run(self._insert, rows, [row.values for row in rows])

    def _insert(self, rows: Sequence[Row]) -> None:
        insert_rows(self._session, self._section.mapper.class_, [row.values for row in rows])

    def _check_label(self, label: Label, rows: Sequence[Row]) -> None:
        """Refuse a reference whose label is not that of the row it refers to."""
        name, key = label.column.name, label.name
        labelled = [row for row in rows if key in row.labels]
        wanted = {row.values[name] for row in labelled} - {None}
        if not labelled:
            return
        pairs = select(label.number, label.target).where(label.number.in_(wanted))
        code_of: dict[Any, str] = {number: code for number, code in self._session.execute(pairs)}  # noqa: C416
        for row in labelled:
            number, code = row.values[name], row.labels[key]
            if number is None:
                raise row.wrong(f"is {quoted(code)}, but {name} is null", f".{key}")
            if number not in code_of:
                raise row.wrong(f"there is no {label.target.table.name} {number}", f".{name}")
            if code_of[number] != code:
                what = f"is {quoted(code)}, but {name} {number} is {quoted(code_of[number])}"
                raise row.wrong(what, f".{key}", f"correct one of them, or leave {key} out")

    def _refer(self, rows: Sequence[Row]) -> None:
        """Set the references that were left out."""
        table, (key, *_) = self._section.table, self._section.key

        def execute(rows: Sequence[Row]) -> None:
            """Set the references of some rows, one statement for each column."""
            for name in dict.fromkeys(name for row in rows for name in row.later):
                statement = update(table).where(table.c[key] == bindparam("moma_key"))
                targets = [
                    {"moma_key": row.values[key], "moma_target": row.later[name]}
                    for row in rows
                    if name in row.later
                ]
                self._session.execute(statement.values({name: bindparam("moma_target")}), targets)

        self._run(execute, rows, [row.later for row in rows])

    def _run(
        self, execute: Callable[[Sequence[Row]], None], rows: Sequence[Row], values: list[Values]
    ) -> None:
        """Store all rows at once; if the database refuses, one by one to find the row."""
        if self._try(execute, rows) is None:
            return
        for row, columns in zip(rows, values, strict=True):
            if (error := self._try(execute, [row])) is not None:
                raise self._refusal(row, columns, error) from error
        raise rows[0].wrong("the database refuses this row together with those after it")

    def _try(self, execute: Callable[[Sequence[Row]], None], rows: Sequence[Row]) -> Exception | None:
        """Execute it; if the rows are refused, undo it and return the error."""
        try:
            with self._session.begin_nested():
                execute(rows)
        except (StatementError, ValueError, RecursionError) as error:
            if isinstance(error, DBAPIError) and not isinstance(error, IntegrityError | DataError):
                raise
            return error
        return None

    def _refusal(self, row: Row, values: Values, error: Exception) -> ExchangeError:
        """Return the reason why the database refuses a row, at its place."""
        for field in self._section.fields:
            target = values.get(field.name)
            for key in field.column.foreign_keys if target is not None else ():
                if self._session.scalar(select(key.column).where(key.column == target)) is None:
                    return row.wrong(
                        f"there is no {key.column.table.name} {quoted(target)}", f".{field.name}"
                    )
        for columns, where in self._unique():
            if (same := self._same(row, columns, where)) is not None:
                names = ", ".join(column.name for column in columns)
                mine = quoted_key(tuple(row.values[column.name] for column in columns))
                what = f"{names} {mine} is also that of {', '.join(self._section.key)} {quoted_key(same)}"
                return row.wrong(what, remedy="each may be there once")
        cause = error.orig if isinstance(error, StatementError) else error
        lines = str(cause).strip().splitlines() or [type(cause).__name__]
        return row.wrong(f"the database refuses this row: {lines[0]}")

    def _unique(self) -> Iterator[tuple[list[Column[Any]], Any]]:
        """Yield what must be unique: columns, and the condition on the rows concerned, or None."""
        for constraint in self._section.table.constraints:
            if isinstance(constraint, UniqueConstraint):
                yield [*constraint.columns], None
        for index in self._section.table.indexes:
            if index.unique:
                yield [*index.columns], index.dialect_options["sqlite"]["where"]

    def _same(self, row: Row, columns: list[Column[Any]], where: Any) -> tuple[Any, ...] | None:
        """Return the key of another row with the same unique values."""
        if not {column.name for column in columns} <= row.values.keys():
            return None  # only a reference was to be set
        if where is not None and row.values["superseded_id"] is not None:
            return None
        conditions = [column == row.values[column.name] for column in columns]
        query = select(*self._section.table.primary_key).where(
            *conditions, *(() if where is None else (where,))
        )
        other = self._session.execute(query).first()
        return None if other is None else tuple(other)
