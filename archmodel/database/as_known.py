"""The database as it was when an entry had just been made: a copy in memory, from which all later ones are taken back.

Whatever reads a database reads this one, so that a query, a description and a page of an earlier day need no words of
their own. Entries are never changed, so that a copy stays true, and a server keeps the last ones (`EarlierStates`).
"""

import re
import sqlite3
import threading
from calendar import monthrange
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, date, datetime, time, timedelta

from sqlalchemy import Connection, ForeignKey, Table, delete, func, insert, select, update
from sqlalchemy.orm import Session

from archmodel.database.session import Database, open_database
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry, latest_entry
from archmodel.tables.knowledge import Correction, Document, Material, Phase
from archmodel.tables.layout import SchemaVersion, metadata
from archmodel.tables.registered import declare_registered
from archmodel.tables.structures import Structure
from ground.errors import UsageError

_REVISED = (Material, Phase, Document, Structure)
"""Tables whose rows keep their number when they are revised, the earlier contents in a row of their own."""

_BATCH = 500  # rows


def entry_named(session: Session, text: str) -> int:
    """Return the number of an entry, or of the last one made until the end of a day, month or year (UTC).

    Parameters
    ----------
    text : "12", "2024-03-15", "2024-03" or "2024"; a number of an entry comes before a year

    Raises
    ------
    UsageError
        if there is no such entry, or nothing was recorded by then
    """
    if text.isascii() and text.isdigit() and len(text) < 10 and session.get(Entry, int(text)) is not None:
        return int(text)
    match = re.fullmatch(r"(\d{4})(?:-(\d{2})(?:-(\d{2}))?)?", text)
    try:
        day = None if match is None else _last_day(*match.groups())
    except ValueError:
        day = None
    if day is None or (text.isdigit() and int(text) < 1000):
        remedy = f"give an entry up to {latest_entry(session)} (moma entries), or a date as 2024-03-15"
        raise UsageError(f"there is no entry {text[:40]}", where="--at", remedy=remedy)
    until = datetime.combine(day + timedelta(days=1), time(), UTC)
    number = session.scalar(select(func.max(Entry.id)).where(Entry.recorded_at < until))
    if number is None:
        first = session.scalar(select(func.min(Entry.recorded_at)))
        remedy = "it is empty" if first is None else f"the first entry is of {first.date().isoformat()}"
        raise UsageError(f"nothing was recorded by {text}", where="--at", remedy=remedy)
    return number


def _last_day(year: str, month: str | None, day: str | None) -> date:
    if month is None:
        return date(int(year), 12, 31)
    last = monthrange(int(year), int(month))[1]
    return date(int(year), int(month), last if day is None else int(day))


@contextmanager
def as_known(session: Session, entry: int | None) -> Iterator[Session]:
    """Open a session on the database as it was when an entry had just been made; None: as it is now.

    Raises
    ------
    UsageError
        if there is no such entry
    """
    if entry is None:
        yield session
        return
    with _copy_at(session, entry) as database, database.session(read_only=True) as then:
        yield then


@dataclass
class _State:
    """Copy in memory, and how many wait for it or read it; one connection has the copy, so one reads at a time."""

    database: Database | None = None
    users: int = 0
    turn: threading.Lock = field(default_factory=threading.Lock)


class EarlierStates:
    """Copies of one database as it was at several entries; those asked for last stay in memory.

    Parameters
    ----------
    most : number of copies that stay
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._states: OrderedDict[int, _State] = OrderedDict()
        self._lock = threading.Lock()

    @contextmanager
    def as_known(self, session: Session, entry: int | None) -> Iterator[Session]:
        """Open a session on the database as it was at an entry, as the function `as_known` does; from any thread."""
        if entry is None:
            yield session
            return
        with self._lock:
            state = self._states.setdefault(entry, _State())
            self._states.move_to_end(entry)
            state.users += 1
        try:
            with state.turn:
                if state.database is None:
                    state.database = _copy_at(session, entry)
                with state.database.session(read_only=True) as then:
                    yield then
        finally:
            self._leave(state)

    def close(self) -> None:
        """Release the copies."""
        with self._lock:
            for state in self._states.values():
                if state.database is not None:
                    state.database.close()
            self._states.clear()

    def _leave(self, state: _State) -> None:
        """Release copies that nobody reads beyond those that stay; and those that could not be made."""
        with self._lock:
            state.users -= 1
            for entry in list(self._states):
                found = self._states[entry]
                if not found.users and (found.database is None or len(self._states) > self._most):
                    if found.database is not None:
                        found.database.close()
                    del self._states[entry]


def _copy_at(session: Session, entry: int) -> Database:
    """Copy the database into memory, and take back what came after an entry; the caller closes the copy."""
    if session.get(Entry, entry) is None:
        remedy = f"the last one is {latest_entry(session)}; list them by: moma entries"
        raise UsageError(f"there is no entry {entry}", remedy=remedy)
    database = open_database("sqlite://")
    try:
        _copy(session.connection(), database)
        with database.session() as then:
            connection = then.connection()
            _undo_revisions(connection, entry)
            _undo_corrections(connection, entry)
            _take_back(connection, entry)
            declare_registered(then)
    except BaseException:
        database.close()
        raise
    return database


def _copy(source: Connection, database: Database) -> None:
    """Copy all pages of an SQLite database, all rows of another one."""
    pages = source.connection.driver_connection
    reading = source.get_execution_options().get("moma_read_only", False)
    with database.engine.connect() as target:
        # what is taken back leaves references for a while; has no effect within a transaction
        target.connection.cursor().execute("PRAGMA foreign_keys = OFF")
        copied = target.connection.driver_connection
        if reading and isinstance(pages, sqlite3.Connection) and isinstance(copied, sqlite3.Connection):
            pages.backup(copied)  # waits for ever for the end of a transaction that writes
            return
        with target.begin():
            for table in metadata.sorted_tables:
                if table is SchemaVersion.__table__:
                    continue
                rows = source.execute(select(table).execution_options(yield_per=_BATCH)).mappings()
                for batch in rows.partitions(_BATCH):
                    target.execute(insert(table), [dict(row) for row in batch])


def _undo_revisions(connection: Connection, entry: int) -> None:
    """Give rows that were revised later their earlier contents."""
    for cls in _REVISED:
        table = cls.__table__
        assert isinstance(table, Table)
        later = select(table.c.id, table.c.supersedes_id).where(
            table.c.entry_id > entry, table.c.supersedes_id.is_not(None), table.c.id < table.c.supersedes_id
        )
        while rows := connection.execute(later).all():
            for number, earlier in rows:
                old = dict(connection.execute(select(table).where(table.c.id == earlier)).mappings().one())
                connection.execute(delete(table).where(table.c.id == earlier))
                del old["id"]
                connection.execute(update(table).where(table.c.id == number).values(old))


def _undo_corrections(connection: Connection, entry: int) -> None:
    """Give entities that were corrected later their earlier attributes."""
    entity, correction = Entity.__table__, Correction.__table__
    assert isinstance(entity, Table)
    later = select(correction).where(correction.c.entry_id > entry).order_by(correction.c.id.desc())
    undone: dict[int, dict[str, object]] = {}
    for row in connection.execute(later).mappings():
        undone.setdefault(row["entity_id"], {})[row["attribute"]] = row["before"]
    for number, values in undone.items():
        columns = {name: value for name, value in values.items() if name in entity.c}
        values_now = {name: value for name, value in values.items() if name not in entity.c}
        if values_now:
            before = connection.scalar(select(entity.c.own).where(entity.c.id == number)) or {}
            after = {name: value for name, value in {**before, **values_now}.items() if value is not None}
            columns["own"] = after or None
        connection.execute(update(entity).where(entity.c.id == number).values(columns))


def _take_back(connection: Connection, entry: int) -> None:
    """Delete what came later, with what refers to it, and hold again what was superseded later."""
    tables = [table for table in metadata.sorted_tables if table is not SchemaVersion.__table__]
    for table in tables:
        number = table.c.id if table is Entry.__table__ else table.c.get("entry_id")
        if number is not None:
            connection.execute(delete(table).where(number > entry))
        for key in sorted(table.foreign_keys, key=lambda foreign_key: foreign_key.parent.name):
            _drop_lost(connection, table, key)
    for table in tables:
        if "superseded_id" in table.c:
            connection.execute(update(table).where(table.c.superseded_id > entry).values(superseded_id=None))


def _drop_lost(connection: Connection, table: Table, key: ForeignKey) -> None:
    """Delete rows that refer to one that is not there; what they only supersede may be gone."""
    column, target = key.parent, key.column
    if column.name == "superseded_id":
        return
    target_rows = target.table.alias() if target.table is table else target.table
    lost = column.is_not(None) & column.not_in(select(target_rows.c[target.name]))
    if column.name == "supersedes_id":
        connection.execute(update(table).where(lost).values({column.name: None}))
    else:
        connection.execute(delete(table).where(lost))
