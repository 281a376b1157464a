"""Databases carried to another version of the layout: all rows, or nothing changes."""

import os
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Engine, inspect
from sqlalchemy.exc import DBAPIError

from archmodel.database.session import Home, home_of, missing_columns, version_of
from archmodel.database.sqlite import SqliteFile
from archmodel.migrations.layouts import version1
from archmodel.tables.layout import SCHEMA_VERSION, metadata
from ground.errors import DatabaseError, UsageError

LAYOUTS = {1: version1.metadata, 2: metadata}
"""Tables of each version."""

VERSION_FOLDERS = ["archmodel:migrations/versions"]
"""Folders of the scripts, as Alembic names them."""


@dataclass(frozen=True)
class Migration:
    """Outcome of a migration.

    Attributes
    ----------
    url : without a password
    before, after : versions of the layout; equal if there was nothing to do
    backup : copy of the SQLite file made before; None on a server and where nothing was done
    lost : descriptions of what the older layout could not hold
    """

    url: str
    before: int
    after: int
    backup: str | None = None
    lost: tuple[str, ...] = ()


def migrate(url: str, to: int | None = None, *, lossy: bool = False, lock_timeout: float = 10.0) -> Migration:
    """Migrate a database to a version of the layout.

    The migration holds the write lock. A copy of an SQLite file is kept beside it.

    Parameters
    ----------
    url : of the database
    to : the version; None: the newest
    lossy : drop what an older version cannot hold
    lock_timeout : how long to wait for another program's lock [s]

    Raises
    ------
    UsageError
        for an unknown version; if something would be lost and `lossy` is not given
    DatabaseError
        if there is no MOMA database, or it is newer than this program, or refuses; nothing is changed then
    """
    to = SCHEMA_VERSION if to is None else to
    if not 1 <= to <= SCHEMA_VERSION:
        raise UsageError(
            f"version {to} of the layout is not known", remedy=f"name one up to {SCHEMA_VERSION}"
        )
    home = home_of(url, lock_timeout)
    engine = home.engine(create=False)
    try:
        with _rebuilding(engine) as connection:
            return _migrate(connection, home, to, lossy)
    except (DBAPIError, engine.dialect.loaded_dbapi.Error) as error:
        raise home.refusal(error) from error
    finally:
        engine.dispose()


def _migrate(connection: Connection, home: Home, to: int, lossy: bool) -> Migration:
    """Migrate on a connection that holds the write lock."""
    before = version_of(connection, home.place)
    if before is None:
        raise DatabaseError("the database is empty", where=home.place, remedy="there is nothing to migrate")
    if before > SCHEMA_VERSION:
        what = f"has schema version {before}, this program knows versions up to {SCHEMA_VERSION}"
        raise DatabaseError(what, where=home.place, remedy="install the MOMA that made it")
    if missing := missing_columns(connection, LAYOUTS[before]):
        raise DatabaseError(
            f"says that its layout is version {before}, but has no {', '.join(missing[:3])}",
            where=home.place,
            remedy="it was changed by hand or by another program: export it with the MOMA that made it",
        )
    if before == to:
        return Migration(home.shown, before, to)
    backup = _copy_beside(home.file, before) if isinstance(home, SqliteFile) and home.file else None
    try:
        lost = _run(connection, before, to)
        if lost and not lossy:
            what = f"version {to} of the layout cannot hold: {'; '.join(lost)}"
            raise UsageError(what, where=home.place, remedy="give --yes to go there without")
        _check_references(connection, home.place)
    except BaseException:
        if backup is not None:
            backup.unlink()  # nothing is changed
        raise
    return Migration(home.shown, before, to, None if backup is None else str(backup), lost)


def _run(connection: Connection, before: int, to: int) -> tuple[str, ...]:
    """Run the scripts, each of which records its version; return what those on the way down lost."""
    config = Config()
    config.set_main_option("script_location", "archmodel:migrations")
    config.set_main_option("path_separator", "newline")
    config.set_main_option("version_locations", "\n".join(VERSION_FOLDERS))
    config.attributes["connection"] = connection
    if not inspect(connection).has_table("alembic_version"):
        command.stamp(config, f"{before:04d}")
    if to > before:
        command.upgrade(config, f"{to:04d}")
        return ()
    scripts = ScriptDirectory.from_config(config)
    lost: list[str] = []
    for version in range(before, to, -1):
        losses = getattr(scripts.get_revision(f"{version:04d}").module, "losses", None)
        lost += losses(connection) if losses else ()
        command.downgrade(config, f"{version - 1:04d}")
    return tuple(lost)


@contextmanager
def _rebuilding(engine: Engine) -> Iterator[Connection]:
    """Open a writing transaction in which SQLite lets tables be rebuilt, without checks of references."""
    with engine.connect() as plain:
        if engine.dialect.name == "sqlite":
            cursor = plain.connection.cursor()
            cursor.execute("PRAGMA foreign_keys = OFF")  # has no effect within a transaction
            cursor.close()
        connection = plain.execution_options(moma_read_only=False)
        with connection.begin():
            yield connection


def _check_references(connection: Connection, place: str) -> None:
    """Refuse rows that refer to missing ones; PostgreSQL checks this itself."""
    if connection.dialect.name != "sqlite":
        return
    if (broken := connection.exec_driver_sql("PRAGMA foreign_key_check").first()) is not None:
        what = f"row {broken[1]} of the table {broken[0]} refers to a row of {broken[2]} that is not there"
        raise DatabaseError(what, where=place, remedy="the database was damaged before; nothing was changed")


def _copy_beside(file: Path, version: int) -> Path:
    """Copy an SQLite file to the first free name of FILE.v1.bak, FILE.v1.2.bak, …"""
    number = 1
    while True:
        middle = f"v{version}" if number == 1 else f"v{version}.{number}"
        copy = file.with_name(f"{file.name}.{middle}.bak")
        try:
            os.close(os.open(copy, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        except FileExistsError:
            number += 1
            continue
        except OSError as error:
            what = f"no copy can be kept before migrating: {error.strerror}"
            raise DatabaseError(
                what, where=str(copy), remedy="make room, or correct the permissions"
            ) from error
        break
    source, target = sqlite3.connect(file), sqlite3.connect(copy)
    try:
        source.backup(target)
        shutil.copymode(file, copy)
    except BaseException:
        target.close()
        copy.unlink()
        raise
    finally:
        target.close()
        source.close()
    return copy
