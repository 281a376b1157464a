"""Rows as they were at an earlier entry: revised rows, and entities that were corrected."""

from typing import Any, TypeVar

from sqlalchemy import select
from sqlalchemy.orm import Session, object_mapper

from archmodel.store.revisions import table_of
from archmodel.tables.entities import Entity
from archmodel.tables.knowledge import Correction, Document, Material, Phase
from archmodel.tables.structures import Structure

__all__ = ["entity_at", "structures_named", "version_at"]

T = TypeVar("T", Material, Phase, Document, Structure)


def version_at(session: Session, row: T, at: int | None) -> T:
    """Return the row as it was when the entry `at` had just been made; as it is now if that is None.

    Parameters
    ----------
    row : as other rows refer to it, by the number that stays with what is held now
    """
    while at is not None and row.entry_id > at and row.supersedes_id is not None:
        # of the most general class: a structure can have been of another kind
        cls: type[T] = object_mapper(row).base_mapper.class_
        row = session.get_one(cls, row.supersedes_id)
    return row


def entity_at(session: Session, number: int, at: int | None) -> dict[str, Any] | None:
    """Return the columns of an entity before later corrections; None if it was not there yet."""
    table = table_of(Entity)
    row = dict(session.execute(select(table).where(table.c.id == number)).mappings().one())
    if at is None:
        return row
    if row["entry_id"] > at:
        return None
    later = (
        select(Correction)
        .where(Correction.entity_id == number, Correction.entry_id > at)
        .order_by(Correction.id.desc())
    )
    own = dict(row["own"] or {})
    for one in session.scalars(later):
        if one.attribute in row:
            row[one.attribute] = one.before
        elif one.before is None:
            own.pop(one.attribute, None)
        else:
            own[one.attribute] = one.before
    row["own"] = own or None
    return row


def structures_named(session: Session, code: str) -> list[Structure]:
    """List structures that have or had a code, latest first, without rows that only keep an earlier revision."""
    rows = session.scalars(select(Structure).where(Structure.code == code)).all()
    kept = {one.supersedes_id for one in rows}
    found = [one for one in rows if one.id not in kept]
    return sorted(found, key=lambda one: (one.superseded_id is None, one.superseded_id or 0), reverse=True)
