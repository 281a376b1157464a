"""Import: a JSON document read row by row into an empty database, all of it or nothing."""

import gzip
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.database.session import Database
from archmodel.exchange.head import ADDED, HEAD, SINCE, TABLES, check_head
from archmodel.exchange.json_stream import JsonText
from archmodel.exchange.rows import Row, RowReader, nearest
from archmodel.exchange.sections import Section, sections
from archmodel.exchange.store import SectionStore
from archmodel.migrations.versions.v2_quality_and_evidence import credit_statements, state_percentile
from archmodel.tables.registered import RegisteredKind, declare_registered, release_registered
from ground.errors import DatabaseError, ExchangeError


def import_building(path: str | Path, database: Database) -> dict[str, int]:
    """Read a document into an empty database, all of it or nothing.

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
                return _read_building(session, stream, str(path))  # type: ignore[arg-type]
        return _read_building(session, file, str(path))


def _read_building(session: Session, stream: BinaryIO, name: str) -> dict[str, int]:
    """Read a document; after an error the session must be rolled back."""
    _refuse_filled(session)
    text = JsonText(stream, name)
    try:
        version = _read_head(text, name)
        added = ADDED.get(version, frozenset())
        counts = _read_tables(session, text, name, SINCE.get(version, {}), added)
        if added:
            session.flush()
            credit_statements(session.connection())
            state_percentile(session.connection())
        text.take("}")
        text.take("")
    except BaseException:
        release_registered(session.get_bind().engine)
        raise
    return counts


def _refuse_filled(session: Session) -> None:
    for section in sections():
        if session.execute(select(section.fields[0].column).limit(1)).first() is not None:
            what = f"it is not empty, its table {section.name} has rows"
            remedy = "a document makes a database of its own; name a new one with --db"
            url = session.get_bind().engine.url.render_as_string()  # without a password
            raise ExchangeError(what, where=url, remedy=remedy)


def _read_head(text: JsonText, name: str) -> int:
    """Read up to the value of `TABLES`; return the version of the layout."""
    head: dict[str, Any] = {}
    text.take("{")
    if text.peek() != "}":
        while (key := _key(text, head, (*HEAD, TABLES))) != TABLES:
            head[key] = text.value()
            if text.take(",", "}") == "}":
                break
        else:
            check_head(head, name)
            return int(head["schema_version"])
    check_head(head, name)
    raise ExchangeError("is missing", where=f"{name} $.{TABLES}", remedy="export the building again")


def _key(text: JsonText, before: dict[str, Any], keys: Sequence[str]) -> str:
    """Return the next key of an object, past its colon."""
    if text.peek() != '"':
        text.take('"')
    key = str(text.value())
    if key in before:
        text.refuse(f"the key {key} comes twice")
    if key not in keys:
        text.refuse(f"unknown key {key[:40]!a}", nearest(key, keys))
    text.take(":")
    return key


def _read_tables(
    session: Session,
    text: JsonText,
    name: str,
    absent: Mapping[str, Mapping[str, Any]],
    added: Collection[str],
) -> dict[str, int]:
    """Read the sections, whose order is fixed so that references can be checked at once.

    Parameters
    ----------
    absent : values that rows of an older document lack, by section
    added : sections that an older document lacks
    """
    expected = [section for section in sections() if section.name not in added]
    names = [section.name for section in expected]
    counts: dict[str, int] = {}
    kinds: set[str] = set()
    text.take("{")
    for section in expected:
        if text.peek() == "}":
            raise ExchangeError(
                "is missing", where=f"{name} $.{TABLES}.{section.name}", remedy="write [] if it is empty"
            )
        key = _key(text, counts, names)
        if key != section.name:
            text.refuse(f"found section {key}, expected {section.name}", f"the order is {', '.join(names)}")
        reader = RowReader(section, name, kinds, absent.get(section.name))
        counts[key] = _read_section(session, section, text, reader, name)
        if section is not expected[-1] and text.peek() != "}":
            text.take(",")
    if text.take(",", "}") == ",":
        _key(text, counts, names)  # which is unknown, or comes twice
    return counts


def _read_section(session: Session, section: Section, text: JsonText, reader: RowReader, name: str) -> int:
    store = SectionStore(session, section, name)
    text.take("[")
    count = 0
    if text.peek() != "]":
        while True:
            text.peek()
            line, before = text.line, text.consumed
            row: Row = reader.read(text.value(), count, line)
            store.add(row, text.consumed - before)
            count += 1
            if text.take(",", "]") == "]":
                break
    else:
        text.take("]")
    store.finish()
    if section.table is RegisteredKind.__table__:
        _declare(session, name)
    return count


def _declare(session: Session, name: str) -> None:
    """Declare the registered kinds, so that entities and structures can be of them."""
    try:
        declare_registered(session)
    except DatabaseError as error:
        raise ExchangeError(error.what, where=f"{name} $.{TABLES}.kind", remedy=error.remedy) from error
