"""Databases of older layouts, as the programs of then made them.

``data/version1.sql`` and ``version2.sql`` are dumps of SQLite files: eight stones of the window bay with every other of
their points, one point and one corner moved aside, notes; a stone with corners alone; a small run of five of them. The
second has a ninth stone too, with a value in every column. ``version3.sql`` has rows in every table, and registers a
kind and an attribute whose names version 4 took.
"""

import json
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from datetime import date, datetime
from pathlib import Path
from typing import Any

from alembic import command
from alembic.config import Config
from sqlalchemy import Boolean, Connection, DateTime, create_engine, insert, select, text
from sqlalchemy.types import JSON, Date

from archmodel.migrations.layouts import version1, version2, version3, version4

LAYOUTS = {
    1: version1.metadata,
    2: version2.metadata,
    3: version3.metadata,
    4: version4.metadata,
}

Rows = dict[str, list[dict[str, Any]]]


def dump(version: int) -> str:
    """The dump of a version."""
    return (Path(__file__).parent / "data" / f"version{version}.sql").read_text()


def dumped(version: int) -> Rows:
    """The rows of a dump by table, read without SQLAlchemy: JSON and times in Python's values, arrays as bytes."""
    found: Rows = {}
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(dump(version))
        connection.row_factory = sqlite3.Row
        for table in LAYOUTS[version].sorted_tables:
            rows = [dict(row) for row in connection.execute(f'SELECT * FROM "{table.name}"')]
            for row in rows:
                for column in table.columns:
                    if isinstance(row[column.name], str) and isinstance(column.type, JSON):
                        row[column.name] = json.loads(row[column.name])  # numbers are kept as numbers
                    if row[column.name] is not None and isinstance(column.type, Boolean):
                        row[column.name] = bool(row[column.name])
                    if row[column.name] is not None and isinstance(column.type, Date):
                        row[column.name] = date.fromisoformat(row[column.name])
                    if isinstance(column.type, DateTime):
                        row[column.name] = datetime.fromisoformat(row[column.name])
            found[table.name] = _sorted(rows)
    return found


def make_old(url: str, version: int) -> None:
    """A database of an old version at a URL that nobody has laid out; on SQLite with the tables of then."""
    if url.startswith("sqlite"):
        with closing(sqlite3.connect(url.removeprefix("sqlite:///"))) as connection:
            connection.executescript(dump(version))
        return
    rows = dumped(version)
    with connected(url) as connection:
        run_alembic(connection, f"{version:04d}")
        for table in LAYOUTS[version].sorted_tables:
            if table.name != "moma_schema" and rows[table.name]:
                connection.execute(insert(table), rows[table.name])
        connection.execute(text("DROP TABLE alembic_version"))  # which these versions did not have


def rows_of(url: str, version: int) -> Rows:
    """The rows of a database by table, as `dumped` gives them."""
    with connected(url) as connection:
        return {
            table.name: _sorted([row._asdict() for row in connection.execute(select(table))])
            for table in LAYOUTS[version].sorted_tables
        }


@contextmanager
def connected(url: str) -> Iterator[Connection]:
    """A connection with a transaction for the time of a block, without MOMA's locks and checks."""
    engine = create_engine(url.replace("postgresql:", "postgresql+psycopg:"))
    try:
        with engine.begin() as connection:
            yield connection
    finally:
        engine.dispose()


def run_alembic(connection: Connection, revision: str) -> None:
    """Alembic's own way from nothing up to a revision."""
    config = Config()
    config.set_main_option("script_location", "archmodel:migrations")
    config.attributes["connection"] = connection
    command.upgrade(config, revision)


def _sorted(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return sorted(rows, key=repr)
