"""Superseding, revising and withdrawing rows; nothing is overwritten.

Rows that nothing refers to (statements, properties, relations, memberships) are replaced by new rows. Materials,
phases, documents and structures are what other rows refer to by number, so the number stays with the row that is
held now: `revise` keeps the old contents in a row of their own, superseded, which the row that is held now names
in ``supersedes_id``.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Table, func, insert, select, update
from sqlalchemy.orm import Session

from archmodel.tables.base import Base
from archmodel.tables.entries import Entry, Recorded
from archmodel.tables.knowledge import (
    DepthEvidence,
    Document,
    MadeOf,
    Material,
    MaterialProperty,
    OfPhase,
    Phase,
    Statement,
)
from archmodel.tables.relations import Membership
from archmodel.tables.structures import Structure
from ground.errors import DatabaseError, UsageError


@dataclass(frozen=True)
class RowCounts:
    """Numbers of rows that were new, replaced others, were there already, or were withdrawn."""

    new: int = 0
    replaced: int = 0
    unchanged: int = 0
    withdrawn: int = 0

    def __add__(self, other: "RowCounts") -> "RowCounts":
        return RowCounts(
            self.new + other.new,
            self.replaced + other.replaced,
            self.unchanged + other.unchanged,
            self.withdrawn + other.withdrawn,
        )

    @property
    def changes(self) -> int:
        """Number of rows that record something new."""
        return self.new + self.replaced + self.withdrawn


NOTHING = RowCounts()


def table_of(cls: type[Base]) -> Table:
    """Return the table of a class, for statements on many rows."""
    table = cls.__table__
    assert isinstance(table, Table)
    return table


def supersede(session: Session, entry: Entry, old: Any, new: Any) -> None:
    """Replace a statement or property by a new one of its class.

    Raises
    ------
    UsageError
        if they are of two classes, or the old one is not held now
    """
    if type(old) is not type(new):
        what = f"a {type(new).__name__} cannot replace a {type(old).__name__}"
        raise UsageError(what, remedy="withdraw the old one and declare the new one")
    _refuse_ended(old)
    old.superseded_id = entry.id
    # first, since only one row of a name can be held
    session.flush()
    new.entry_id, new.supersedes_id = entry.id, old.id
    session.add(new)
    session.flush()


def withdraw(session: Session, entry: Entry, row: Any) -> RowCounts:
    """Withdraw a row without replacing it, with the properties of a material or the memberships of a structure.

    Raises
    ------
    UsageError
        if it is not held now, other rows that are held need it, or it is a depth, which only another depth
        can replace, since the solid follows from it
    """
    _refuse_ended(row)
    if isinstance(row, DepthEvidence):
        raise UsageError("a depth cannot be withdrawn", remedy="record the depth that holds instead")
    _refuse_needed(session, row)
    parts = 0
    if isinstance(row, Material):
        parts = _end_where(session, entry, MaterialProperty, material_id=row.id)
    elif isinstance(row, Structure):
        parts = _end_where(session, entry, Membership, structure_id=row.id)
    row.superseded_id = entry.id
    session.flush()
    return RowCounts(withdrawn=1 + parts)


def revise(session: Session, entry: Entry, row: Any, values: Mapping[str, object]) -> RowCounts:
    """Give a row new contents, and keep the old ones in a row of their own.

    Parameters
    ----------
    row : of Material, Phase, Document or Structure, held now; keeps its number
    values : by name of the column; those that are not named stay
    """
    _refuse_ended(row)
    table, number = table_of(type(row)), row.id
    old = dict(session.execute(select(table).where(table.c.id == number)).mappings().one())
    if all(old[name] == value for name, value in values.items()):
        return RowCounts(unchanged=1)
    kept = {name: value for name, value in old.items() if name != "id"} | {"superseded_id": entry.id}
    key = session.execute(insert(table).values(kept).returning(table.c.id)).scalar_one()
    session.execute(
        update(table)
        .where(table.c.id == number)
        .values({**values, "entry_id": entry.id, "supersedes_id": key})
    )
    # its class may have changed with its kind
    session.expunge(row)
    return RowCounts(replaced=1)


def end_rows(session: Session, entry: Entry, cls: type[Base], numbers: list[int]) -> None:
    """Mark rows as no longer held; at most as many as fit into one statement."""
    table = table_of(cls)
    session.execute(update(table).where(table.c.id.in_(numbers)).values(superseded_id=entry.id))
    _read_again(session, cls)


def _end_where(session: Session, entry: Entry, cls: type[Base], **owner: int) -> int:
    """End the held rows that belong to a row; return their number."""
    table = table_of(cls)
    conditions = [table.c[name] == value for name, value in owner.items()]
    query = select(func.count()).select_from(table).where(table.c.superseded_id.is_(None), *conditions)
    count = int(session.scalar(query) or 0)
    session.execute(
        update(table).where(table.c.superseded_id.is_(None), *conditions).values(superseded_id=entry.id)
    )
    _read_again(session, cls)
    return count


def _read_again(session: Session, cls: type[Base]) -> None:
    """Expire loaded rows of a class, which may have ended without the session's knowledge."""
    for row in [entity for entity in session.identity_map.values() if isinstance(entity, cls)]:
        session.expire(row, ["superseded_id"])


def _refuse_ended(row: Recorded) -> None:
    if row.superseded_id is not None:
        what = f"{type(row).__name__} {getattr(row, 'id', '')} is held no longer"
        raise DatabaseError(what, remedy="take the row that is held now (superseded_id is null)")


def _refuse_needed(session: Session, row: Any) -> None:
    """Refuse to withdraw a row that others refer to."""
    users: dict[str, Any] = {}
    if isinstance(row, Material):
        of_it = select(MadeOf.id).where(MadeOf.material_id == row.id, MadeOf.superseded_id.is_(None))
        users = {"statements that stones are made of it": of_it}
    elif isinstance(row, Phase):
        of_it = select(OfPhase.id).where(OfPhase.phase_id == row.id, OfPhase.superseded_id.is_(None))
        users = {"statements that stones are of it": of_it}
    elif isinstance(row, Document):
        citing = select(Statement.id).where(
            Statement.document_id == row.id, Statement.superseded_id.is_(None)
        )
        users = {"statements that name it": citing}
    elif isinstance(row, Structure):
        users = {
            "parts": select(Structure.id).where(
                Structure.parent_id == row.id, Structure.superseded_id.is_(None)
            ),
            "statements about it": select(Statement.id).where(
                Statement.structure_id == row.id, Statement.superseded_id.is_(None)
            ),
        }
    name = getattr(row, "name", None) or getattr(row, "code", "")
    for label, statement in users.items():
        if count := len(session.scalars(statement).all()):
            what = f"{type(row).__name__.lower()} {name} cannot be withdrawn: there are {count} {label}"
            raise UsageError(what, remedy="withdraw them first")
