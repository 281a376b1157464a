"""A building document, written row by row: one line for each row, whatever the size of the database."""

import json
from collections.abc import Iterator
from typing import Any, BinaryIO

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from archmodel.exchange.head import TABLES, head_of
from archmodel.exchange.json_types import Mismatch
from archmodel.exchange.sections import Section, sections
from archmodel.tables.base import ArrayType
from moma.errors import ExchangeError

__all__ = ["write_building"]

ROWS, ROWS_WITH_ARRAYS = 1000, 100
"""Rows that are fetched at once."""

_READABLE = json.JSONEncoder(ensure_ascii=False, allow_nan=False)
_ESCAPED = json.JSONEncoder(ensure_ascii=True, allow_nan=False)


def write_building(session: Session, stream: BinaryIO) -> dict[str, int]:
    """Write all that a database holds.

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
        if a row holds what JSON cannot say
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
    """The rows in the order of their keys."""
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
    """Every column, with the label of each reference behind it."""
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
    """Key and encoder for each column of the statement."""
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
        # Half of a surrogate pair, in a JSON column: JSON can say it, UTF-8 cannot.
        return _ESCAPED.encode(row).encode()


def _unsayable(section: Section, row: Any, columns: list[tuple[str, Any]], error: Exception) -> ExchangeError:
    """Which value of the row it is."""
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
