"""Opening the entity database, and working in it one transaction at a time."""

import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from sqlalchemy import URL, Connection, Engine, create_engine, event, insert, inspect, make_url, select
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import ArgumentError, DBAPIError
from sqlalchemy.orm import Session
from sqlalchemy.pool import ConnectionPoolEntry

from archmodel.layout import SCHEMA_VERSION, SchemaVersion, metadata
from moma.errors import DatabaseError

__all__ = ["Database", "open_database"]


@dataclass(frozen=True)
class Database:
    """An open entity database.

    Attributes
    ----------
    url : as SQLAlchemy writes it
    engine : for plain SQLAlchemy work
    """

    url: str
    engine: Engine

    @contextmanager
    def session(self, *, read_only: bool = False) -> Iterator[Session]:
        """One transaction: committed at the end of the block, undone if an error leaves it.

        A writing session holds the database's write lock from its first statement on, so that what it
        has read is still true when it writes; keep it short. A reading session waits for nobody and can
        change nothing.

        Raises
        ------
        DatabaseError
            if the database refuses: locked by another program, full disk, damaged file
        """
        engine = self.engine.execution_options(moma_read_only=read_only)
        try:
            with Session(engine, expire_on_commit=False) as session, session.begin():
                yield session
        except DBAPIError as error:
            raise _refusal(error, self.engine.url.database or "memory") from error

    def close(self) -> None:
        """Give the connections back; the database can be opened again."""
        self.engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def open_database(url: str, create: bool = True, *, lock_timeout: float = 10.0) -> Database:
    """Open the database at `url`, and make it first where there is none and `create` allows.

    Parameters
    ----------
    url : ``sqlite:///FILE``; ``sqlite://`` is a database in memory, gone when it is closed
    create : make a missing database; False for commands that only read
    lock_timeout : how long to wait for another program's lock [s]

    Raises
    ------
    DatabaseError
        for a wrong URL, a missing file, a file that is not a MOMA database, a locked one
    """
    parsed = _parse(url)
    file = _file_of(parsed)
    if file is not None:
        _check_file(file, create)
    engine = create_engine(parsed, connect_args={"timeout": lock_timeout})
    event.listen(engine, "connect", _on_connect)
    event.listen(engine, "begin", _on_begin)
    place = str(file) if file is not None else "memory"
    try:
        with engine.connect() as connection:
            _prepare(connection, place, create)
        if file is not None:
            _use_write_ahead_log(engine, lock_timeout)
    except (DBAPIError, sqlite3.Error) as error:
        engine.dispose()
        raise _refusal(error, place) from error
    except DatabaseError:
        engine.dispose()
        raise
    return Database(parsed.render_as_string(), engine)


def _parse(url: str) -> URL:
    """The URL, if it is one that this version can open."""
    remedy = "write sqlite:///FILE with three slashes, e.g. sqlite:///moma.db"
    try:
        parsed = make_url(url)
    except (ArgumentError, ValueError) as error:
        raise DatabaseError(f"{url[:80]!r} is not a database URL", remedy=remedy) from error
    if parsed.drivername not in ("sqlite", "sqlite+pysqlite"):
        raise DatabaseError(f"databases of type {parsed.drivername!r} cannot be opened", remedy=remedy)
    if parsed.host or parsed.username or parsed.query or "\0" in (parsed.database or ""):
        raise DatabaseError(f"{url[:80]!r} does not name a file", remedy=remedy)
    return parsed


def _file_of(url: URL) -> Path | None:
    """The file of an SQLite URL; None in memory."""
    return None if url.database in (None, "", ":memory:") else Path(str(url.database))


def _check_file(file: Path, create: bool) -> None:
    """Say what is wrong with the path before SQLite says it less clearly, or makes an empty file."""
    if file.is_dir():
        raise DatabaseError("is a folder, not a database", where=str(file), remedy="name a file in it")
    if not file.exists() and not create:
        remedy = "take in a survey first (moma ingest FILE), or name another database with --db"
        raise DatabaseError("there is no database", where=str(file), remedy=remedy)
    if not file.parent.is_dir():
        raise DatabaseError(f"there is no folder {file.parent}", where=str(file), remedy="make it first")


def _on_connect(connection: DBAPIConnection, entry: ConnectionPoolEntry) -> None:
    """Leave transactions to SQLAlchemy (sqlite3 would begin them too late) and enforce foreign keys."""
    connection.isolation_level = None
    cursor = connection.cursor()
    cursor.execute("PRAGMA foreign_keys = ON")
    cursor.close()


def _on_begin(connection: Connection) -> None:
    """Writers lock at once: a transaction that reads first and locks later can fail half-way."""
    read_only = connection.get_execution_options().get("moma_read_only", False)
    connection.exec_driver_sql(f"PRAGMA query_only = {'ON' if read_only else 'OFF'}")
    connection.exec_driver_sql("BEGIN" if read_only else "BEGIN IMMEDIATE")


def _prepare(connection: Connection, place: str, create: bool) -> None:
    """Check that this is a MOMA database of our version; lay out an empty one."""
    read_only = connection.execution_options(moma_read_only=True)
    with read_only.begin():
        tables = set(inspect(read_only).get_table_names())
        if _is_ours(read_only, tables, place):
            return
    if not create:
        remedy = "take in a survey first: moma ingest FILE"
        raise DatabaseError("the database is empty", where=place, remedy=remedy)
    writing = connection.execution_options(moma_read_only=False)
    with writing.begin():
        # Another program may have laid it out since we looked; now nobody else can.
        if not _is_ours(writing, set(inspect(writing).get_table_names()), place):
            metadata.create_all(writing)
            writing.execute(insert(SchemaVersion).values(version=SCHEMA_VERSION))


def _is_ours(connection: Connection, tables: set[str], place: str) -> bool:
    """Whether the tables are MOMA's; False if there are none; an error if they are another program's."""
    if not tables:
        return False
    remedy = "name another file with --db"
    if SchemaVersion.__tablename__ not in tables:
        raise DatabaseError("is not a MOMA database", where=place, remedy=remedy)
    version = connection.scalar(select(SchemaVersion.version))
    if version != SCHEMA_VERSION:
        what = f"has schema version {version}, this program reads version {SCHEMA_VERSION}"
        raise DatabaseError(
            what, where=place, remedy="use the version of MOMA that made it, or a new database"
        )
    return True


def _use_write_ahead_log(engine: Engine, lock_timeout: float) -> None:
    """Let readers and one writer work at once. The file remembers it, so mostly there is nothing to do.

    This cannot be done within a transaction, hence on the bare connection; and SQLite does not wait for
    another program's write lock here, hence the loop.
    """
    connection = engine.raw_connection()
    deadline = time.monotonic() + lock_timeout
    try:
        cursor = connection.cursor()
        while True:
            try:
                cursor.execute("PRAGMA journal_mode = WAL")
                break
            except sqlite3.OperationalError as error:
                if "locked" not in str(error) or time.monotonic() > deadline:
                    raise
            time.sleep(0.01)
        cursor.close()
    finally:
        connection.close()


def _refusal(error: DBAPIError | sqlite3.Error, place: str) -> DatabaseError:
    """SQLite's complaint in the user's words."""
    said = str(error.orig if isinstance(error, DBAPIError) else error)
    if "locked" in said:
        remedy = "wait until the other program is done, then try again"
        return DatabaseError("the database is locked by another program", where=place, remedy=remedy)
    if "not a database" in said:
        return DatabaseError("is not a MOMA database", where=place, remedy="name another file with --db")
    if "readonly" in said or "unable to open" in said:
        remedy = "check the permissions of the file and of its folder"
        return DatabaseError(f"the database cannot be written ({said})", where=place, remedy=remedy)
    return DatabaseError(f"the database refused: {said}", where=place, remedy="nothing was changed")
