"""Export: a whole database as one JSON document, written row by row.

``docs/exchange.md`` describes the document, and how to read it without MOMA.
"""

import gzip
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from archmodel.exchange.head import TABLES, head_of
from archmodel.exchange.sections import Section, sections
from archmodel.exchange.values import Mismatch
from archmodel.tables.base import ArrayType
from ground.errors import ExchangeError

COMPRESSION = 4
"""Of gzip: higher levels take twice the time for a few percent."""

ROWS, ROWS_WITH_ARRAYS = 1000, 100
"""Numbers of rows that are fetched at once."""

_READABLE = json.JSONEncoder(ensure_ascii=False, allow_nan=False)
_ESCAPED = json.JSONEncoder(ensure_ascii=True, allow_nan=False)


def export_building(session: Session, path: str | Path) -> dict[str, int]:
    """Write a whole database into one document.

    The document replaces an older one only when it is complete.

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
        if the file cannot be written, or a row holds a value without a JSON form
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
        what = f"it cannot be written: {error.strerror}"
        raise ExchangeError(what, where=str(path), remedy="name a file in another folder") from error
    finally:
        with suppress(OSError):  # a folder that is read-only refuses this too
            part.unlink(missing_ok=True)
    return counts


@contextmanager
def _compressed(file: BinaryIO, path: Path) -> Iterator[BinaryIO]:
    """Open the stream that goes into the file."""
    if path.suffix != ".gz":
        yield file
        return
    # Without a name and a time, the same database gives the same bytes.
    with gzip.GzipFile("", "wb", COMPRESSION, file, mtime=0) as stream:
        yield stream  # type: ignore[misc]


def write_building(session: Session, stream: BinaryIO) -> dict[str, int]:
    """Write a whole database to a stream.

    Parameters
    ----------
    session : a reading session, which sees one state of the database
    stream : for the bytes; the same database gives the same bytes

    Returns
    -------
    dict
        number of rows by section

    Raises
    ------
    ExchangeError
        if a row holds a value without a JSON form
    """
    stream.write(b"{\n")
    for key, value in head_of(session).items():
        stream.write(f'"{key}": {_READABLE.encode(value)},\n'.encode())
    stream.write(f'"{TABLES}": {{'.encode())
    counts: dict[str, int] = {}
    for section in sections():
        stream.write(b",\n" if counts else b"\n")
        counts[section.name] = _write_section(session, section, stream)
    stream.write(b"\n}\n}\n")
    return counts


def _write_section(session: Session, section: Section, stream: BinaryIO) -> int:
    stream.write(f'"{section.name}": ['.encode())
    count = 0
    for line in _lines(session, section):
        stream.write(b",\n" if count else b"\n")
        stream.write(line)
        count += 1
    stream.write(b"\n]" if count else b"]")
    return count


def _lines(session: Session, section: Section) -> Iterator[bytes]:
    """Yield the rows in the order of their keys, as lines."""
    columns = _columns(section)
    heavy = any(isinstance(field.column.type, ArrayType) for field in section.fields)
    options = {"yield_per": ROWS_WITH_ARRAYS if heavy else ROWS}
    with session.execute(_statement(section), execution_options=options) as rows:
        for row in rows:
            try:
                yield _encoded(
                    {
                        name: encode(value)
                        for (name, encode), value in zip(columns, row, strict=True)
                        if value is not None
                    }
                )
            except (ValueError, RecursionError) as error:
                raise _unsayable(section, row, columns, error) from error


def _statement(section: Section) -> Select[Any]:
    """Select every column, each reference followed by its label."""
    chosen: list[Any] = []
    joined: Any = section.table
    for field in section.fields:
        chosen.append(field.column)
        if (label := field.label) is not None:
            target = label.target.table.alias()
            joined = joined.outerjoin(target, target.c[label.number.name] == label.column)
            chosen.append(target.c[label.target.name].label(f"label of {label.name}"))
    return select(*chosen).select_from(joined).order_by(*section.table.primary_key)


def _columns(section: Section) -> list[tuple[str, Any]]:
    """Return key and encoder of each column of the statement."""
    columns: list[tuple[str, Any]] = []
    for field in section.fields:
        columns.append((field.name, field.value.encode))
        if field.label is not None:
            columns.append((field.label.name, str))
    return columns


def _encoded(row: dict[str, Any]) -> bytes:
    try:
        return _READABLE.encode(row).encode()
    except UnicodeEncodeError:
        # Half of a surrogate pair, in a JSON column: JSON can escape it, UTF-8 cannot encode it.
        return _ESCAPED.encode(row).encode()


def _unsayable(section: Section, row: Any, columns: list[tuple[str, Any]], error: Exception) -> ExchangeError:
    """Return the error that names the value without a JSON form."""
    key = ", ".join(f"{name} {value}" for name, value in zip(section.key, row, strict=False))
    place, what = f"{section.name} {key}", "is nested too deeply"
    for (name, encode), value in zip(columns, row, strict=True):
        try:
            if value is not None:
                _ESCAPED.encode(encode(value))
        except Mismatch as wrong:
            place, what = f"{place} {name}{wrong.path}", wrong.what
            break
        except (ValueError, RecursionError) as wrong:
            place, what = f"{place} {name}", what if isinstance(wrong, RecursionError) else str(wrong)
            break
    return ExchangeError(what, where=place, remedy="correct it in the database, then export again")
