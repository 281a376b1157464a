"""Rows of entities and structures."""

from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.store.revisions import table_of
from archmodel.tables.entities import Entity
from archmodel.tables.knowledge import Correction
from archmodel.tables.structures import Structure


def entity_row(session: Session, number: int) -> dict[str, Any]:
    """Return the columns of an entity."""
    table = table_of(Entity)
    return dict(session.execute(select(table).where(table.c.id == number)).mappings().one())


def first_values(session: Session, number: int, *names: str) -> dict[str, Any]:
    """Return attributes of an entity as they were first recorded, before all corrections."""
    row = entity_row(session, number)
    values = {name: row[name] for name in names}
    corrections = (
        select(Correction)
        .where(Correction.entity_id == number, Correction.attribute.in_(names))
        .order_by(Correction.id.desc())
    )
    for scalar in session.scalars(corrections):
        values[scalar.attribute] = scalar.before
    return values


def structures_named(session: Session, code: str) -> list[Structure]:
    """List structures that have or had a code, latest first, without rows that only keep an earlier revision."""
    rows = session.scalars(select(Structure).where(Structure.code == code)).all()
    replaced = {row.supersedes_id for row in rows}
    named_rows = [row for row in rows if row.id not in replaced]
    return sorted(
        named_rows, key=lambda row: (row.superseded_id is None, row.superseded_id or 0), reverse=True
    )
