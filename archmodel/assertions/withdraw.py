"""Withdrawal of statements about entities and structures, found by their content."""

from collections.abc import Mapping, Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.plain_values import statement_values
from archmodel.assertions.validation import checked_choice
from archmodel.store.bulk import batches
from archmodel.store.find_by_code import Subjects
from archmodel.store.revisions import NOTHING, RowCounts, end_rows
from archmodel.tables.entries import Entry
from archmodel.tables.knowledge import DepthEvidence, Statement
from archmodel.tables.relations import INVERSE, RELATIONS, SYMMETRIC, Membership, Relation
from moma.errors import UsageError

__all__ = ["withdraw_members", "withdraw_relations", "withdraw_statements"]


def withdraw_statements(
    session: Session,
    entry: Entry,
    cls: type[Statement],
    about: Subjects,
    match: Mapping[str, object] | None = None,
) -> RowCounts:
    """Withdraw the statements of a kind about some subjects.

    Parameters
    ----------
    match : only those that say this, by the names of ``wording.statement_values``; all of the kind if empty

    Raises
    ------
    UsageError
        if no such thing was ever said, or it is a depth
    """
    if cls is DepthEvidence:
        raise UsageError("a depth cannot be withdrawn", remedy="record the depth that holds instead")
    outcome, held = NOTHING, []
    for owner, numbers in ((cls.entity_id, about.entities), (cls.structure_id, about.structures)):
        for batch in batches(numbers):
            for one in session.scalars(select(cls).where(owner.in_(batch))):
                if not _says(one, match or {}):
                    continue
                if one.superseded_id is None:
                    held.append(one.id)
                else:
                    outcome += RowCounts(unchanged=1)
    return _ended(session, entry, Statement, held, outcome, cls.__kind__)


def withdraw_members(session: Session, entry: Entry, about: Subjects) -> RowCounts:
    """Withdraw declared memberships of entities in structures; computed ones stay."""
    outcome, held = NOTHING, []
    for batch in batches(about.entities):
        statement = select(Membership).where(
            Membership.entity_id.in_(batch),
            Membership.structure_id.in_(about.structures),
            Membership.declared,
        )
        for one in session.scalars(statement):
            if one.superseded_id is None:
                held.append(one.id)
            else:
                outcome += RowCounts(unchanged=1)
    return _ended(session, entry, Membership, held, outcome, "declared membership")


def withdraw_relations(
    session: Session, entry: Entry, kind: str, of: Sequence[int], to: Sequence[int]
) -> RowCounts:
    """Withdraw declared relations of a kind between entities, by their numbers; computed ones stay."""
    checked_choice("relation", kind, (*RELATIONS, "supports"))
    if kind not in RELATIONS:
        kind, of, to = INVERSE[kind], to, of
    ends = {(one, other) for one in of for other in to}
    if kind in SYMMETRIC:
        ends |= {(other, one) for one, other in ends}
    outcome, held = NOTHING, []
    for batch in batches(sorted({one for one, _ in ends})):
        statement = select(Relation).where(
            Relation.kind == kind, Relation.declared, Relation.subject_id.in_(batch)
        )
        for relation in session.scalars(statement):
            if (relation.subject_id, relation.object_id) not in ends:
                continue
            if relation.superseded_id is None:
                held.append(relation.id)
            else:
                outcome += RowCounts(unchanged=1)
    return _ended(session, entry, Relation, held, outcome, f"declared relation {kind}")


def _says(statement: Statement, match: Mapping[str, object]) -> bool:
    said = statement_values(statement)
    return all(said.get(name) == value for name, value in match.items())


def _ended(
    session: Session,
    entry: Entry,
    cls: type[Statement] | type[Membership] | type[Relation],
    held: Sequence[int],
    before: RowCounts,
    thing: str,
) -> RowCounts:
    """End rows that are held; rows withdrawn already stay, and rows that never were are an error."""
    if not held and not before.unchanged:
        raise UsageError(f"there is no such {thing} to withdraw", remedy="look at it by: moma show CODE")
    for batch in batches(held):
        end_rows(session, entry, cls, batch)
    return RowCounts(withdrawn=len(held)) if held else before
