"""Bulk inserts: primary keys and the fastest way into the tables."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain, islice
from operator import itemgetter
from typing import Any, TypeVar

from sqlalchemy import Connection, Dialect, Table, func, select, text
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import Session

from archmodel.tables.base import Base

BATCH = 500
"""Rows per statement: fewer than SQLite's limit of parameters, and memory does not grow with what is stored."""

T = TypeVar("T")
Row = tuple[Any, ...]


def first_free_id(session: Session, table: type[Base]) -> int:
    """Return a primary key from which on all are free; the session's write lock keeps them free."""
    return int(session.scalar(select(func.coalesce(func.max(_table(table).c.id), 0))) or 0) + 1


def insert_rows(session: Session, table: type[Base], rows: Iterable[Mapping[str, Any]]) -> int:
    """Insert rows that all have the same columns, primary keys included; return their number.

    Rows are not kept, so that the source may have any length. They bypass SQLAlchemy's statements, which take
    half of the time; its types still convert the values.
    """
    source = iter(rows)
    first = next(source, None)
    if first is None:
        return 0
    session.flush()  # what the rows refer to
    connection, target, names = session.connection(), _table(table), tuple(first)
    convert = _converter(target, names, connection.dialect)
    count = 0
    for batch in batches(chain((first,), source)):
        if any(len(row) != len(names) for row in batch):
            raise ValueError(f"rows of {target.name} with other columns than {', '.join(names)}")
        _SENDERS[connection.dialect.name](connection, target, names, [convert(row) for row in batch])
        count += len(batch)
    if connection.dialect.name == "postgresql" and "id" in names:
        _advance_sequence(connection, target)
    return count


def batches(items: Iterable[T]) -> Iterator[list[T]]:
    """Yield the items in lists of `BATCH`."""
    source = iter(items)
    while batch := list(islice(source, BATCH)):
        yield batch


def _table(table: type[Base]) -> Table:
    mapped = table.__table__
    assert isinstance(mapped, Table)
    return mapped


def _converter(table: Table, names: Sequence[str], dialect: Dialect) -> Callable[[Mapping[str, Any]], Row]:
    """Return the function from a row to the values that the driver takes, in the order of the names."""
    processors = [table.c[name].type.dialect_impl(dialect).bind_processor(dialect) for name in names]
    active = [(place, process) for place, process in enumerate(processors) if process is not None]
    taken = itemgetter(*names)

    def convert(row: Mapping[str, Any]) -> Row:
        """Return the values of a row as the database takes them."""
        values = list(taken(row)) if len(names) > 1 else [taken(row)]
        for place, process in active:
            values[place] = process(values[place])
        return tuple(values)

    return convert


def _send_to_sqlite(connection: Connection, table: Table, names: Sequence[str], values: list[Row]) -> None:
    marks = ", ".join("?" * len(names))
    statement = f'INSERT INTO "{table.name}" ({_quoted(names)}) VALUES ({marks})'
    connection.exec_driver_sql(statement, values)


def _send_to_postgresql(
    connection: Connection, table: Table, names: Sequence[str], values: list[Row]
) -> None:
    statement = f'COPY "{table.name}" ({_quoted(names)}) FROM STDIN'
    driver = connection.dialect.loaded_dbapi
    try:
        with connection.connection.cursor() as cursor, cursor.copy(statement) as copy:  # type: ignore[attr-defined]
            for row in values:
                copy.write_row(row)
    except driver.Error as error:
        raise DBAPIError.instance(statement, None, error, driver.Error, dialect=connection.dialect) from error


def _quoted(names: Sequence[str]) -> str:
    """Quote columns of MOMA's own tables for SQL."""
    return ", ".join(f'"{name}"' for name in names)


_SENDERS: Mapping[str, Callable[[Connection, Table, Sequence[str], list[Row]], None]] = {
    "sqlite": _send_to_sqlite,
    "postgresql": _send_to_postgresql,
}


def _advance_sequence(connection: Connection, table: Table) -> None:
    """Let PostgreSQL number further rows from the largest number on."""
    connection.execute(
        text(
            f"SELECT setval(pg_get_serial_sequence('{table.name}', 'id'), (SELECT max(id) FROM {table.name}))"
        )
    )
