"""A made-up version 3, which adds a column and a table and moves a value; see `next_version`."""

from collections.abc import Iterator
from typing import Any

from alembic import op
from sqlalchemy import Connection, MetaData, Row, func, null, select

from archmodel.migrations import steps
from archmodel.tables import layout
from tests.archmodel.migrations import next_version

revision = "0003"
down_revision = "0002"
depends_on = None


def upgrade() -> None:
    _migrate(layout.metadata, next_version.metadata, 3)


def downgrade() -> None:
    _migrate(next_version.metadata, layout.metadata, 2)


def losses(connection: Connection) -> Iterator[str]:
    tables = next_version.metadata.tables
    for text, query in {
        "photographs": select(func.count()).select_from(tables["photograph"]),
        "the weathering of stones": select(func.count(tables["entity"].c.weathering)),
    }.items():
        if count := connection.scalar(query):
            yield f"{text} ({count})"


def _migrate(before: MetaData, after: MetaData, version: int) -> None:
    connection = op.get_bind()
    old = steps.begin_layout(connection, before, after)
    for table in after.sorted_tables:
        if table.name == "survey":
            rows = steps.read(connection, select(old["survey"]))
            steps.carry_rows(connection, table, map(_survey, rows))
        elif table.name in old:
            columns = [old[table.name].c.get(one.name, null().label(one.name)) for one in table.c]
            steps.carry(connection, table, select(*columns).select_from(old[table.name]))
    steps.end_layout(connection, before, after, version)


def _survey(row: Row[Any]) -> dict[str, Any]:
    """Version 3 keeps names of surveys the other way round."""
    return row._asdict() | {"name": row.name[::-1]}
