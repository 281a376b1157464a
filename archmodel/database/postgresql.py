"""Databases on a PostgreSQL server, by the driver psycopg 3."""

from dataclasses import dataclass
from typing import Any, Self

from sqlalchemy import URL, Connection, Engine, create_engine, event
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import DBAPIError
from sqlalchemy.pool import ConnectionPoolEntry

from archmodel.tables.base import json_text
from archmodel.tables.layout import metadata
from ground.errors import DatabaseError, MissingLibraryError

HOW_TO_WRITE = "postgresql://USER@HOST/NAME"
"""The URL of a database on a server."""

WRITE_LOCK = 0x4D4F4D41
"""Key of the advisory lock that a writing transaction holds ("MOMA"); locks are of one database of the server."""


@dataclass(frozen=True)
class PostgresqlServer:
    """A database on a server.

    Attributes
    ----------
    url : as SQLAlchemy knows it, with the driver
    lock_timeout : how long to wait for another program's lock [s]
    """

    url: URL
    lock_timeout: float

    @classmethod
    def of(cls, url: URL, lock_timeout: float) -> Self:
        """Return the database that a URL names.

        Raises
        ------
        DatabaseError
            if it names none
        """
        asked = cls(url.set(drivername="postgresql+psycopg"), lock_timeout)
        if not url.database or "\0" in f"{url.username}{url.password}{url.host}{url.database}":
            what = f"{asked.shown[:80]!r} does not name a database"
            raise DatabaseError(what, remedy=f"write {HOW_TO_WRITE}")
        return asked

    @property
    def place(self) -> str:
        """Its name in messages."""
        return self.shown

    @property
    def shown(self) -> str:
        """The URL, to be printed, with its password hidden."""
        return self.url.set(drivername="postgresql").render_as_string(hide_password=True)

    def engine(self, create: bool) -> Engine:
        """Return an engine on the database, which must exist: MOMA makes tables, not databases."""
        _restrict_indexes()
        ours = {"connect_timeout": "10", "application_name": "moma"}
        arguments = {name: value for name, value in ours.items() if name not in self.url.query}
        try:
            engine = create_engine(
                self.url,
                connect_args={**arguments, "client_encoding": "utf8"},
                pool_pre_ping=True,
                json_serializer=json_text,
            )
        except ImportError as error:
            raise MissingLibraryError(
                "PostgreSQL needs the package psycopg, which is not installed",
                where=self.place,
                remedy="python -m pip install 'moma-masonry[postgresql]'",
            ) from error
        event.listen(engine, "connect", self._on_connect)
        event.listen(engine, "begin", _on_begin)
        return engine

    def _on_connect(self, connection: DBAPIConnection, entry: ConnectionPoolEntry) -> None:
        """Set how long to wait for locks: writers wait for one another, readers for migrations alone."""
        patience = max(1, round(1000 * self.lock_timeout))  # [ms]; zero would wait for ever
        cursor = connection.cursor()
        cursor.execute(f"SET lock_timeout = {patience}")
        # Compiling a statement of many small parts takes seconds, answering it milliseconds.
        cursor.execute("SET jit = off")
        cursor.close()
        connection.commit()

    def settle(self, engine: Engine) -> None:
        """Do nothing: the server lets readers and a writer work at once."""

    def refusal(self, error: Exception) -> DatabaseError:
        """Translate a complaint of the server for users."""
        cause: Any = error.orig if isinstance(error, DBAPIError) else error
        message = _first_line(str(cause))
        state = str(getattr(cause, "sqlstate", None) or "")
        for states, words, what, remedy in _COMPLAINTS:
            if (state and state.startswith(states)) or (not state and any(word in message for word in words)):
                remedy = remedy.format(name=self.url.database)
                return DatabaseError(what.format(message=message), where=self.place, remedy=remedy)
        return DatabaseError(
            f"the database refused: {message}", where=self.place, remedy="nothing was changed"
        )


def _restrict_indexes() -> None:
    """Give indexes over some rows the condition that they have on SQLite.

    Stated where the tables are declared, it would make every command load the drivers of PostgreSQL.
    """
    for table in metadata.tables.values():
        for index in table.indexes:
            where = index.dialect_options["sqlite"]["where"]
            if where is not None:
                index.dialect_kwargs["postgresql_where"] = where


def _on_begin(connection: Connection) -> None:
    """Give readers one state of the database, and let writers go one after another.

    A writer reads committed rows, not a snapshot: its first statement is the wait for the lock, and what was written
    until then must be seen.
    """
    if connection.get_execution_options().get("moma_read_only", False):
        connection.exec_driver_sql("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ, READ ONLY")
    else:
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({WRITE_LOCK})")


def _first_line(message: str) -> str:
    """Return the complaint without the statement and the hints that follow it."""
    lines = [line for line in message.splitlines() if line.strip()]
    return lines[0] if lines else "it does not say why"


_Complaint = tuple[tuple[str, ...], tuple[str, ...], str, str]

_COMPLAINTS: tuple[_Complaint, ...] = (
    (
        ("55P03", "40P01"),
        ("lock timeout",),
        "the database is locked by another program",
        "wait until the other program is done, then try again",
    ),
    (
        ("3D000",),
        ("does not exist", "no such database"),
        "there is no such database or user ({message})",
        "make it on the server: createdb {name}",
    ),
    (
        ("28P01", "28000"),
        ("authentication failed", "no password supplied", "pg_hba.conf"),
        "the server does not let you in: wrong user or password ({message})",
        "write the password in ~/.pgpass or in the variable PGPASSWORD",
    ),
    (
        ("25006",),
        (),
        "the database cannot be written ({message})",
        "only a writing session can change it; is the server a replica?",
    ),
    (
        ("42501",),
        (),
        "you may not do this in the database ({message})",
        "ask its owner for the permission, or use a database of your own: createdb NAME",
    ),
    (("53100",), (), "the disk of the server is full", "make room on it and try again; nothing was changed"),
    (
        ("53300",),
        ("too many clients", "connection slots"),
        "the server has too many users",
        "try again later",
    ),
    (
        ("08", "57P"),
        (),
        "the connection to the server was lost ({message})",
        "nothing was changed; start the server and try again",
    ),
    (
        (),
        ("connect", "translate host name", "resolve host", "starting up", "shutting down"),
        "no PostgreSQL server answers ({message})",
        "start it, or correct host and port of the URL",
    ),
)
"""SQL states or their beginnings, words where there is no state, their meaning, and the remedy."""
