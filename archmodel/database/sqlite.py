"""Databases in one SQLite file, or in memory."""

import os
import sqlite3
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Self
from urllib.parse import quote

from sqlalchemy import URL, Connection, Engine, create_engine, event
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import DBAPIError
from sqlalchemy.pool import ConnectionPoolEntry, StaticPool

from archmodel.tables.base import json_text
from ground.errors import DatabaseError, NoDatabaseError

HOW_TO_WRITE = "sqlite:///FILE with three slashes, e.g. sqlite:///moma.db"
"""The URL of a file."""


@dataclass(frozen=True)
class SqliteFile:
    """A database in one file.

    Attributes
    ----------
    url : as SQLAlchemy knows it
    file : None in memory
    lock_timeout : how long to wait for another program's lock [s]
    """

    url: URL
    file: Path | None
    lock_timeout: float

    @classmethod
    def of(cls, url: URL, lock_timeout: float) -> Self:
        """Return the file that a URL names.

        Raises
        ------
        DatabaseError
            if it names none
        """
        if url.host or url.username or url.query or "\0" in (url.database or ""):
            shown = url.render_as_string()[:80]
            raise DatabaseError(f"{shown!r} does not name a file", remedy=f"write {HOW_TO_WRITE}")
        file = None if url.database in (None, "", ":memory:") else Path(str(url.database))
        return cls(url, file, lock_timeout)

    @property
    def place(self) -> str:
        """Its name in messages."""
        return "memory" if self.file is None else str(self.file)

    @property
    def shown(self) -> str:
        """The URL, to be printed."""
        return self.url.render_as_string()

    @property
    def _reading(self) -> URL | None:
        """URL for a file that can only be read, in a folder where SQLite cannot put its log; None if it can.

        Without a log beside it, nobody is writing: the file is taken as it is, without locks. With one, the log holds
        the latest rows and is read too.
        """
        if self.file is None or not self.file.exists() or os.access(self.file.parent, os.W_OK):
            return None
        logs = (self.file.with_name(f"{self.file.name}{end}") for end in ("-wal", "-shm"))
        state = {} if any(log.exists() for log in logs) else {"immutable": "1"}
        place = f"file:{quote(str(self.file.absolute()))}"
        return URL.create("sqlite", database=place, query={"mode": "ro", "uri": "true", **state})

    def engine(self, create: bool) -> Engine:
        """Return an engine on the file, which may be missing if `create` allows it."""
        if self.file is not None:
            _check_file(self.file, create)
        shared = {"check_same_thread": False} if self.file is None else {}
        engine = create_engine(
            self._reading or self.url,
            connect_args={"timeout": self.lock_timeout, **shared},
            json_serializer=json_text,
            # a database in memory is that of its connection
            poolclass=StaticPool if self.file is None else None,
        )
        event.listen(engine, "connect", _on_connect)
        event.listen(engine, "begin", _on_begin)
        return engine

    def settle(self, engine: Engine) -> None:
        """Switch to the write-ahead log, with which readers and one writer work at once.

        The file remembers it, so that this has an effect only once. It cannot be done within a transaction, hence
        the bare connection; and SQLite does not wait here for another program's write lock, hence the loop.
        """
        if self.file is None or self._reading is not None:
            return
        connection = engine.raw_connection()
        deadline = time.monotonic() + self.lock_timeout
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

    def refusal(self, error: Exception) -> DatabaseError:
        """Translate a complaint of SQLite for users."""
        message = _first_message(error)
        if self.file is not None and not self.file.exists() and not os.access(self.file.parent, os.W_OK):
            what, remedy = "its folder cannot be written", "name a database in another folder with --db"
            return DatabaseError(what, where=self.place, remedy=remedy)
        for words, what, remedy in _COMPLAINTS:
            if any(word in message for word in words):
                return DatabaseError(what.format(message=message), where=self.place, remedy=remedy)
        return DatabaseError(
            f"the database refused: {message}", where=self.place, remedy="nothing was changed"
        )


_COMPLAINTS = (
    (
        ("locked",),
        "the database is locked by another program",
        "wait until the other program is done, then try again",
    ),
    (("not a database",), "is not a MOMA database", "name another file with --db"),
    (
        ("malformed",),
        "the file is damaged ({message})",
        "restore a copy of it, or try: sqlite3 FILE .recover",
    ),
    (("is full",), "the disk is full", "make room on it and try again; nothing was changed"),
    (
        ("unable to open database file",),
        "the database cannot be opened, or its log FILE-wal cannot be read ({message})",
        "check the permissions of the file and of its folder; copy it with its -wal file to a folder of your own",
    ),
    (
        ("readonly",),
        "the database cannot be written ({message})",
        "check the permissions of the file and of its folder",
    ),
)
"""Words of SQLite, their meaning, and the remedy."""


def _first_message(error: Exception) -> str:
    """Return the first message of SQLite: after some failures it has ended the transaction and lost its savepoints."""
    message: str = str(error.orig if isinstance(error, DBAPIError) else error)
    before = error.__context__
    while "no such savepoint" in message and before is not None:
        if isinstance(before, sqlite3.Error):
            message = str(before)
        before = before.__context__
    return message


def _check_file(file: Path, create: bool) -> None:
    """Refuse a wrong path before SQLite does so less clearly, or makes an empty file."""
    if file.is_dir():
        raise DatabaseError("is a folder, not a database", where=str(file), remedy="name a file in it")
    if not file.exists() and not create:
        remedy = "take in a survey first (moma ingest FILE), or name another database with --db"
        raise NoDatabaseError("there is no database", where=str(file), remedy=remedy)
    if not file.parent.is_dir():
        raise DatabaseError(f"there is no folder {file.parent}", where=str(file), remedy="make it first")


def _on_connect(connection: DBAPIConnection, entry: ConnectionPoolEntry) -> None:
    """Leave transactions to SQLAlchemy, since sqlite3 would begin them too late, and enforce foreign keys."""
    connection.isolation_level = None
    cursor = connection.cursor()
    cursor.execute("PRAGMA foreign_keys = ON")
    cursor.close()


def _on_begin(connection: Connection) -> None:
    """Lock at once for writing: a transaction that reads first and locks later can fail half-way."""
    read_only = connection.get_execution_options().get("moma_read_only", False)
    connection.exec_driver_sql(f"PRAGMA query_only = {'ON' if read_only else 'OFF'}")
    connection.exec_driver_sql("BEGIN" if read_only else "BEGIN IMMEDIATE")
