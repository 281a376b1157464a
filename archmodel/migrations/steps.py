"""Steps of a migration: set the old tables aside, make the new ones, carry the rows over, drop the old tables.

A migrated layout therefore equals a newly made one, down to the names of its indexes.
"""

from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from typing import Any

from sqlalchemy import Connection, MetaData, Row, Select, Table, func, insert, inspect, select, text, update

_ASIDE = "old_"
_BATCH = 500  # rows: memory does not grow with the database


def begin_layout(connection: Connection, before: MetaData, after: MetaData) -> Mapping[str, Table]:
    """Set the tables of one layout aside and make those of the next; return the old ones by their old names."""
    aside = {}
    for table in before.sorted_tables:
        if table.name != "moma_schema":
            _set_aside(connection, table)
            aside[table.name] = table.to_metadata(MetaData(), name=_ASIDE + table.name)
    after.create_all(
        connection,
        tables=[table for table in after.sorted_tables if table.name != "moma_schema"],
        checkfirst=False,
    )
    return aside


def end_layout(connection: Connection, before: MetaData, after: MetaData, version: int) -> None:
    """Drop the tables set aside, continue the numbering of rows, and record the version."""
    for table in reversed(before.sorted_tables):
        if table.name != "moma_schema":
            connection.execute(text(f'DROP TABLE "{_ASIDE}{table.name}"'))
    if connection.dialect.name == "postgresql":
        for table in after.sorted_tables:
            if "id" in table.columns:
                _continue_numbers(connection, table)
    connection.execute(update(after.tables["moma_schema"]).values(version=version))


def carry(connection: Connection, table: Table, rows: Select[Any]) -> None:
    """Insert the rows of a query whose columns are named as those of the table."""
    names = [column.name for column in rows.selected_columns]
    connection.execute(insert(table).from_select(names, rows))


def carry_rows(connection: Connection, table: Table, rows: Iterable[Mapping[str, Any]]) -> None:
    """Insert rows that Python has changed, a batch at a time."""
    source = iter(rows)
    while batch := list(islice(source, _BATCH)):
        connection.execute(insert(table), batch)


def read(connection: Connection, query: Select[Any]) -> Iterator[Row[Any]]:
    """Yield the rows of a query, fetched a batch at a time."""
    yield from connection.execute(query.execution_options(yield_per=_BATCH))


def _set_aside(connection: Connection, table: Table) -> None:
    """Rename a table, with its keys, sequences and indexes, whose names its successor needs."""
    inspector = inspect(connection)
    for index in inspector.get_indexes(table.name):
        if "duplicates_constraint" not in index:
            connection.execute(text(f'DROP INDEX "{index["name"]}"'))
    if connection.dialect.name == "postgresql":
        constraints = [inspector.get_pk_constraint(table.name)["name"]]
        constraints += [constraint["name"] for constraint in inspector.get_unique_constraints(table.name)]
        for name in constraints:
            connection.execute(text(f'ALTER INDEX "{name}" RENAME TO "{_ASIDE}{name}"'))
        if (sequence := _sequence(connection, table)) is not None:
            name = sequence.rpartition(".")[2].strip('"')
            connection.execute(text(f'ALTER SEQUENCE {sequence} RENAME TO "{_ASIDE}{name}"'))
    connection.execute(text(f'ALTER TABLE "{table.name}" RENAME TO "{_ASIDE}{table.name}"'))


def _sequence(connection: Connection, table: Table) -> str | None:
    """Return the PostgreSQL sequence that numbers a table's rows, if there is one."""
    if "id" not in table.columns:
        return None
    return connection.scalar(select(func.pg_get_serial_sequence(table.name, "id")))


def _continue_numbers(connection: Connection, table: Table) -> None:
    """Number further rows after the largest number there is."""
    last = connection.scalar(select(func.max(table.columns.id)))
    if last is not None:
        connection.execute(select(func.setval(_sequence(connection, table), last)))
