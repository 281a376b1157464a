"""Opening the entity database, and transactions in it."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, Self

from sqlalchemy import Connection, Engine, MetaData, insert, inspect, make_url, select
from sqlalchemy.exc import ArgumentError, DBAPIError
from sqlalchemy.orm import Session, configure_mappers

from archmodel.database import postgresql, sqlite
from archmodel.database.postgresql import PostgresqlServer
from archmodel.database.sqlite import SqliteFile
from archmodel.tables.layout import SCHEMA_VERSION, SchemaVersion, metadata
from archmodel.tables.registered import declare_registered, release_registered
from ground.errors import DatabaseError, NoDatabaseError

_COLUMNS = {
    "sqlite": "SELECT m.name, c.name FROM sqlite_master AS m, pragma_table_info(m.name) AS c WHERE m.type = 'table'",
    "postgresql": "SELECT table_name, column_name FROM information_schema.columns "
    "WHERE table_schema = ANY(current_schemas(false))",
}
"""Query of all columns with their tables, by dialect: one for all, as databases are opened by every command."""


class Home(Protocol):
    """Place of a database: a file or a server."""

    @property
    def place(self) -> str:
        """Its name in messages."""

    @property
    def shown(self) -> str:
        """Its URL without a password."""

    def engine(self, create: bool) -> Engine:
        """Return an engine whose transactions are those of `Database.session`."""

    def settle(self, engine: Engine) -> None:
        """Finish the database once its tables are there."""

    def refusal(self, error: Exception) -> DatabaseError:
        """Translate a complaint of the driver for users."""


@dataclass(frozen=True)
class Database:
    """An open entity database.

    Attributes
    ----------
    url : as SQLAlchemy writes it; a password is shown as ***
    engine : for plain SQLAlchemy work
    home : its file or server
    """

    url: str
    engine: Engine
    home: Home

    @contextmanager
    def session(self, *, read_only: bool = False) -> Iterator[Session]:
        """Open one transaction: committed at the end of the block, rolled back if an error leaves it.

        A writing session holds the database's write lock from its first statement on, so that what it
        has read is still true when it writes; keep it short. A reading session sees the database as it was at
        its first statement, waits for nobody and can change nothing.

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
            raise self.home.refusal(error) from error

    def close(self) -> None:
        """Return the connections and release the registered kinds; the database can be opened again."""
        release_registered(self.engine)
        self.engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def open_database(url: str, create: bool = True, *, lock_timeout: float = 10.0) -> Database:
    """Open the database at `url`; lay it out first where it is empty or missing and `create` allows it.

    Parameters
    ----------
    url : ``sqlite:///FILE``; ``sqlite://`` is a database in memory, gone when it is closed;
        ``postgresql://USER@HOST/NAME``, a database on a server, which must exist, if only empty
    create : lay out a missing or an empty database; False for commands that only read
    lock_timeout : how long to wait for another program's lock [s]

    Raises
    ------
    DatabaseError
        for a wrong URL, a missing file, a server that does not answer or refuses, a database that is not MOMA's
        or of another version, a locked one
    MissingLibraryError
        if psycopg is not installed

    Examples
    --------
    >>> from sqlalchemy import func, select
    >>> from archmodel.tables.entities import Entity
    >>> with open_database("sqlite://") as database, database.session(read_only=True) as session:
    ...     session.scalar(select(func.count(Entity.id)))
    0
    """
    configure_mappers()  # takes a new process longest, so not while others wait for the lock
    home = home_of(url, lock_timeout)
    engine = home.engine(create)
    try:
        with engine.connect() as connection:
            _prepare(connection, home, create)
        home.settle(engine)
        with Session(engine.execution_options(moma_read_only=True)) as session:
            declare_registered(session)
    except DatabaseError:
        engine.dispose()
        raise
    except Exception as error:
        engine.dispose()
        if isinstance(error, DBAPIError | engine.dialect.loaded_dbapi.Error):
            raise home.refusal(error) from error
        raise
    return Database(home.shown, engine, home)


def home_of(url: str, lock_timeout: float = 10.0) -> Home:
    """Return the file or server of a URL.

    Raises
    ------
    DatabaseError
        if the URL is not one that can be opened
    """
    remedy = f"write {sqlite.HOW_TO_WRITE}, or {postgresql.HOW_TO_WRITE}"
    try:
        parsed = make_url(url)
    except (ArgumentError, ValueError) as error:
        shown = re.sub(r"//[^/]*@", "//…@", url)[:80]  # no password
        raise DatabaseError(f"{shown!r} is not a database URL", remedy=remedy) from error
    if parsed.drivername in ("sqlite", "sqlite+pysqlite"):
        return SqliteFile.of(parsed, lock_timeout)
    if parsed.drivername in ("postgresql", "postgresql+psycopg"):
        return PostgresqlServer.of(parsed, lock_timeout)
    raise DatabaseError(f"databases of type {parsed.drivername!r} cannot be opened", remedy=remedy)


def version_of(connection: Connection, place: str) -> int | None:
    """Return the version of the layout of a database; None if it has no tables.

    Raises
    ------
    DatabaseError
        if there are tables, but not MOMA's
    """
    tables = inspect(connection).get_table_names()
    if not tables:
        return None
    if SchemaVersion.__tablename__ not in tables:
        raise DatabaseError("is not a MOMA database", where=place, remedy="name another database with --db")
    return connection.scalar(select(SchemaVersion.__table__.c.version)) or 0


def missing_columns(connection: Connection, layout: MetaData) -> list[str]:
    """Return the columns of a layout, as table.column, that a database does not have."""
    there = set(map(tuple, connection.exec_driver_sql(_COLUMNS[connection.dialect.name])))
    return [
        f"{table.name}.{column.name}"
        for table in layout.sorted_tables
        for column in table.columns
        if (table.name, column.name) not in there
    ]


def _prepare(connection: Connection, home: Home, create: bool) -> None:
    """Check that this is a MOMA database of this program's version; lay out an empty one."""
    read_only = connection.execution_options(moma_read_only=True)
    with read_only.begin():
        if _is_ours(read_only, home):
            return
    if not create:
        remedy = "take in a survey first: moma ingest FILE"
        raise NoDatabaseError("the database is empty", where=home.place, remedy=remedy)
    writing = connection.execution_options(moma_read_only=False)
    with writing.begin():
        # Another program may have laid it out in the meantime; under the lock no other can.
        if not _is_ours(writing, home):
            metadata.create_all(writing, checkfirst=False)
            writing.execute(insert(SchemaVersion).values(version=SCHEMA_VERSION))


def _is_ours(connection: Connection, home: Home) -> bool:
    """Return whether the database is laid out, False if it is empty; refuse other layouts."""
    version = version_of(connection, home.place)
    if version is None:
        return False
    if version != SCHEMA_VERSION:
        older = version < SCHEMA_VERSION
        raise DatabaseError(
            f"has schema version {version}, this program reads version {SCHEMA_VERSION}",
            where=home.place,
            remedy=f"moma migrate --db {home.shown}" if older else "install the version of MOMA that made it",
        )
    if missing := missing_columns(connection, metadata):
        raise DatabaseError(
            f"says that its layout is version {version}, but has no {', '.join(missing[:3])}",
            where=home.place,
            remedy="it was changed by hand or by another program: export it with the MOMA that made it, "
            "and import the document here",
        )
    return True
