"""A made-up version 3 of the layout, to migrate to and from.

It adds a column `entity.weathering` and a table `photograph`, and keeps the names of surveys backwards. The classes of
version 2 work on it, so that databases of both can be opened. `declare` makes it the program's version.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from alembic import command
from alembic.config import Config
from sqlalchemy import Column, Connection, ForeignKey, Integer, MetaData, Table, create_engine, select

from archmodel.migrations import migrate
from archmodel.tables import layout
from archmodel.tables.base import TEXT

FOLDERS = [*migrate.VERSION_FOLDERS, str(Path(__file__).parent / "made_up")]

metadata = MetaData()
for _table in layout.metadata.sorted_tables:
    _table.to_metadata(metadata)
metadata.tables["entity"].append_column(Column("weathering", TEXT))
Table(
    "photograph",
    metadata,
    Column("id", Integer, primary_key=True),
    Column("entity_id", Integer, ForeignKey("entity.id"), nullable=False, index=True),
    Column("path", TEXT, nullable=False, unique=True),
)

LAYOUTS = {**migrate.LAYOUTS, 3: metadata}

Rows = dict[str, list[str]]


def declare(patch: pytest.MonkeyPatch) -> None:
    """Make version 3 the newest of the program."""
    patch.setattr("archmodel.migrations.migrate.VERSION_FOLDERS", FOLDERS)
    patch.setattr("archmodel.migrations.migrate.LAYOUTS", LAYOUTS)
    for module in ("archmodel.tables.layout", "archmodel.migrations.migrate", "archmodel.database.session"):
        patch.setattr(f"{module}.SCHEMA_VERSION", 3)


def rows_of(url: str, version: int) -> Rows:
    """Return the rows of a database by table, as text, in the order of their keys."""
    with connected(url) as connection:
        return {
            table.name: [
                repr(tuple(value.tobytes() if hasattr(value, "tobytes") else value for value in row))
                for row in connection.execute(select(table).order_by(*table.primary_key))
            ]
            for table in LAYOUTS[version].sorted_tables
        }


@contextmanager
def connected(url: str) -> Iterator[Connection]:
    """Open a connection with a transaction, without MOMA's locks and checks."""
    engine = create_engine(url.replace("postgresql:", "postgresql+psycopg:"))
    try:
        with engine.begin() as connection:
            yield connection
    finally:
        engine.dispose()


def run_alembic(connection: Connection, revision: str) -> None:
    """Let Alembic itself lay out a revision from nothing."""
    config = Config()
    config.set_main_option("script_location", "archmodel:migrations")
    config.set_main_option("path_separator", "newline")
    config.set_main_option("version_locations", "\n".join(FOLDERS))
    config.attributes["connection"] = connection
    command.upgrade(config, revision)
