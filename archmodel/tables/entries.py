"""Acts of recording: author, date and grounds of every change of the database.

Every row that says something of the building names the entry that it came with, and, once it is no longer
held to be true, the entry that superseded it. Nothing is overwritten and nothing is deleted, so what was known
at any entry can be read back (`held_at`); what is held now has ``superseded_id`` null.
"""

from collections.abc import Mapping
from datetime import UTC, datetime
from importlib.metadata import version

from sqlalchemy import ColumnElement, ForeignKey, Index, func, or_, select, text
from sqlalchemy.orm import Mapped, Session, declared_attr, mapped_column, relationship

from archmodel.tables.base import Base

ACTIONS = ("ingest", "geometry", "declaration", "correction", "run", "migration")
"""Kinds of entries: a survey taken in, relations computed, knowledge declared, attributes corrected, a simulation,
rows moved from an older layout of the database."""


class Entry(Base):
    """One act of recording; numbers of entries grow with time.

    Attributes
    ----------
    action : one of ACTIONS
    author : person who recorded it; None for a program
    source : on what grounds: the file, the document, the reasoning
    settings : of the program that computed it, e.g. tolerances
    version : of MOMA
    recorded_at : when (UTC)
    """

    __tablename__ = "entry"

    id: Mapped[int] = mapped_column(primary_key=True)
    action: Mapped[str]
    author: Mapped[str | None]
    source: Mapped[str]
    settings: Mapped[dict[str, object]]
    version: Mapped[str]
    recorded_at: Mapped[datetime]


class Recorded:
    """Columns of every row that describes the building: its entry, and the entry that superseded it."""

    entry_id: Mapped[int] = mapped_column(ForeignKey("entry.id"))
    superseded_id: Mapped[int | None] = mapped_column(ForeignKey("entry.id"))

    @declared_attr
    @classmethod
    def entry(cls) -> Mapped[Entry]:
        """The act of recording that this row came with."""
        return relationship(Entry, foreign_keys=[cls.entry_id])

    @declared_attr
    @classmethod
    def superseded_by(cls) -> Mapped[Entry | None]:
        """The act of recording that ended it; None if it is held now."""
        return relationship(Entry, foreign_keys=[cls.superseded_id])


def new_entry(
    session: Session,
    action: str,
    source: str,
    *,
    author: str | None = None,
    settings: Mapping[str, object] | None = None,
) -> Entry:
    """Begin an act of recording; its number is known when this returns.

    Parameters
    ----------
    session : a writing session
    action : one of ACTIONS
    source : on what grounds
    author : person who recorded it; None for a program
    settings : of the program that computed it, in values that JSON can hold
    """
    if action not in ACTIONS:
        raise ValueError(f"action {action!r} is none of {', '.join(ACTIONS)}")
    entry = Entry(
        action=action,
        author=author,
        source=source,
        settings=dict(settings or {}),
        version=version("moma-masonry"),
        recorded_at=datetime.now(UTC),
    )
    session.add(entry)
    session.flush()
    return entry


def latest_entry(session: Session) -> int | None:
    """Number of the last act of recording; None if nothing was recorded yet."""
    return session.scalar(select(func.max(Entry.id)))


def held_at(table: type[Recorded], entry: int | None = None) -> ColumnElement[bool]:
    """Return the condition that a row is held to be true: now, or just after the given entry."""
    if entry is None:
        return table.superseded_id.is_(None)
    return (table.entry_id <= entry) & or_(table.superseded_id.is_(None), table.superseded_id > entry)


def held_index(name: str, *columns: str) -> Index:
    """Return a unique index over the rows that are held now."""
    return Index(name, *columns, unique=True, sqlite_where=text("superseded_id IS NULL"))
