"""A whole building as one JSON document, out of a database and into another, exactly.

What is written, and how to read it without MOMA, is said in ``docs/exchange.md``.
"""

import gzip
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from sqlalchemy.orm import Session

from archmodel.database.session import Database
from archmodel.exchange.reader import read_building
from archmodel.exchange.writer import write_building
from moma.errors import ExchangeError

__all__ = ["export_building", "import_building"]

COMPRESSION = 4
"""Of gzip: more takes twice the time for a few percent."""


def export_building(session: Session, path: str | Path) -> dict[str, int]:
    """Write all that a database holds into one document.

    The document takes the place of an older one only when it is complete.

    Parameters
    ----------
    session : a reading session, which sees one state of the database
    path : of the document; compressed if it ends in ``.gz``

    Returns
    -------
    dict
        number of rows by section

    Raises
    ------
    ExchangeError
        if the file cannot be written, or a row holds what JSON cannot say
    """
    path = Path(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as file:
            with _compressed(file, path) as stream:
                counts = write_building(session, stream)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        raise ExchangeError(f"it cannot be written: {error.strerror}", where=str(path)) from error
    finally:
        part.unlink(missing_ok=True)
    return counts


def import_building(path: str | Path, database: Database) -> dict[str, int]:
    """Take a document into an empty database: all of it or nothing.

    Parameters
    ----------
    path : of the document; compressed if it ends in ``.gz``
    database : open, laid out, without rows

    Returns
    -------
    dict
        number of rows by section

    Raises
    ------
    ExchangeError
        if the database is not empty, or anything in the document is wrong
    DatabaseError
        if the database cannot be written
    """
    path = Path(path)
    try:
        file = path.open("rb")
    except OSError as error:
        raise ExchangeError(f"it cannot be read: {error.strerror}", where=str(path)) from error
    with file, database.session() as session:
        if path.suffix == ".gz":
            with gzip.GzipFile(fileobj=file, mode="rb") as stream:
                return read_building(session, stream, str(path))  # type: ignore[arg-type]
        return read_building(session, file, str(path))


@contextmanager
def _compressed(file: BinaryIO, path: Path) -> Iterator[BinaryIO]:
    """The stream that goes into the file."""
    if path.suffix != ".gz":
        yield file
        return
    # Without a name and a time in it, the same database gives the same bytes.
    with gzip.GzipFile("", "wb", COMPRESSION, file, mtime=0) as stream:
        yield stream  # type: ignore[misc]
