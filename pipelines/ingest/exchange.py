"""Exchange of a whole building between a database and one document."""

import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from sqlalchemy import URL

from archmodel.database.session import home_of, open_database
from archmodel.database.sqlite import SqliteFile
from archmodel.exchange.reader import import_building
from archmodel.exchange.writer import export_building, write_building
from ground.errors import DatabaseError, ExchangeError


@dataclass(frozen=True)
class ExchangeReport:
    """Rows transferred between a database and a document.

    Attributes
    ----------
    path : of the document
    database : its URL, without a password
    bytes : of the document
    rows : number of rows, by section
    """

    path: str
    database: str
    bytes: int
    rows: dict[str, int]


def export_database(url: str, path: Path) -> ExchangeReport:
    """Write the contents of a database into one document; see `export_building`."""
    with open_database(url, create=False) as database:
        with database.session(read_only=True) as session:
            rows = export_building(session, path)
        return ExchangeReport(str(path), database.url, path.stat().st_size, rows)


def export_to_stream(url: str, stream: BinaryIO) -> None:
    """Write the contents of a database into a stream of bytes; an error may leave a part of it there."""
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        write_building(session, stream)


def import_database(path: Path, url: str) -> ExchangeReport:
    """Create a database from a document, all of it or nothing.

    A new file is written under another name and appears when it is complete.

    Raises
    ------
    ExchangeError
        if the database is not empty, or anything in the document is wrong
    DatabaseError
        if the database cannot be opened or written
    """
    home = home_of(url)
    file = home.file if isinstance(home, SqliteFile) else None
    if file is None or file.exists():
        with open_database(url) as database:
            rows = import_building(path, database)
    else:
        rows = _import_new(path, file)
    return ExchangeReport(str(path), home.shown, path.stat().st_size, rows)


def _import_new(path: Path, file: Path) -> dict[str, int]:
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    try:
        with open_database(URL.create("sqlite", database=str(part)).render_as_string()) as database:
            rows = import_building(path, database)
        _publish(part, file)
    except DatabaseError as error:
        if error.where == str(part):
            raise error.at(str(file)) from error
        raise
    finally:
        for end in ("", "-wal", "-shm"):
            with suppress(OSError):  # a folder that is read-only refuses this too
                part.with_name(part.name + end).unlink(missing_ok=True)
    return rows


def _publish(part: Path, file: Path) -> None:
    """Give the complete database its name, unless another process was faster."""
    try:
        os.link(part, file)
    except FileExistsError:
        what = "another process has created this database in the meantime"
        raise ExchangeError(what, where=str(file), remedy="name a new database with --db") from None
    except OSError:
        part.rename(file)  # a file system without links
