"""Withdrawal of statements about entities and structures, found by their content.

An author withdraws statements of their own where there are any, else those of others. What a withdrawn statement
superseded holds again, as its author said it.
"""

from collections.abc import Mapping, Sequence

from sqlalchemy import insert, select
from sqlalchemy.orm import Session

from archmodel.assertions.opinions import says
from archmodel.assertions.statements import SINGLE
from archmodel.assertions.validation import checked_choice
from archmodel.store.bulk import batches
from archmodel.store.find_by_code import Subjects
from archmodel.store.revisions import NOTHING, RowCounts, end_rows, table_of
from archmodel.tables.entries import Entry
from archmodel.tables.knowledge import DepthEvidence, Statement
from archmodel.tables.relations import INVERSE, RELATIONS, SYMMETRIC, Membership, Relation
from ground.errors import UsageError


def withdraw_statements(
    session: Session,
    entry: Entry,
    cls: type[Statement],
    about: Subjects,
    match: Mapping[str, object] | None = None,
    since: int = 0,
) -> RowCounts:
    """Withdraw the statements of a kind about some subjects.

    Parameters
    ----------
    match : only those that say this, by the names of ``plain_values.statement_values`` or ``author``; all of the kind
        if empty
    since : only those that came with a later entry than this one

    Raises
    ------
    UsageError
        if no such thing was ever said, it is a depth, or several other authors said it of one subject that can
        have but one
    """
    if cls is DepthEvidence:
        raise UsageError("a depth cannot be withdrawn", remedy="record the depth that holds instead")
    outcome = NOTHING
    statements: list[Statement] = []
    for owner, batch in about.batches():
        for row in session.scalars(select(cls).where(getattr(cls, owner).in_(batch))):
            if not says(row, match or {}):
                continue
            if row.superseded_id is None and row.entry_id > since:
                statements.append(row)
            else:
                outcome += RowCounts(unchanged=1)
    mine = [statement for statement in statements if statement.author == entry.author]
    ended = mine or statements
    voices = {statement.author for statement in ended}
    if cls in SINGLE and len(voices) > 1:
        names = ", ".join(sorted(name or "an unnamed author" for name in voices))
        remedy = 'name the author: match = { author = "…" }'
        raise UsageError(f"{cls.__kind__} was said by several other authors: {names}", remedy=remedy)
    counts = _ended(session, entry, Statement, [statement.id for statement in ended], outcome, cls.__kind__)
    _say_again(
        session,
        entry,
        [statement.supersedes_id for statement in ended if statement.supersedes_id is not None],
    )
    return counts


def _say_again(session: Session, entry: Entry, numbers: Sequence[int]) -> None:
    """Copy superseded statements to rows that are held, with author and date of the opinion as they were."""
    table = table_of(Statement)
    for batch in batches(numbers):
        rows = session.execute(select(table).where(table.c.id.in_(batch))).mappings()
        again = [{**row, "entry_id": entry.id, "superseded_id": None} for row in rows]
        for one in again:
            del one["id"]
        if again:
            session.execute(insert(table), again)


def withdraw_members(session: Session, entry: Entry, about: Subjects) -> RowCounts:
    """Withdraw declared memberships of entities in structures; computed ones stay."""
    outcome, ids = NOTHING, []
    for batch in batches(about.entities):
        statement = select(Membership).where(
            Membership.entity_id.in_(batch),
            Membership.structure_id.in_(about.structures),
            Membership.declared,
        )
        for row in session.scalars(statement):
            if row.superseded_id is None:
                ids.append(row.id)
            else:
                outcome += RowCounts(unchanged=1)
    return _ended(session, entry, Membership, ids, outcome, "declared membership")


def withdraw_relations(
    session: Session, entry: Entry, kind: str, of: Sequence[int], to: Sequence[int]
) -> RowCounts:
    """Withdraw declared relations of a kind between entities, by their numbers; computed ones stay."""
    checked_choice("relation", kind, (*RELATIONS, "supports"))
    if kind not in RELATIONS:
        kind, of, to = INVERSE[kind], to, of
    ends = {(subject, target) for subject in of for target in to}
    if kind in SYMMETRIC:
        ends |= {(second, first) for first, second in ends}
    outcome, ids = NOTHING, []
    for batch in batches(sorted({subject for subject, _ in ends})):
        statement = select(Relation).where(
            Relation.kind == kind, Relation.declared, Relation.subject_id.in_(batch)
        )
        for relation in session.scalars(statement):
            if (relation.subject_id, relation.object_id) not in ends:
                continue
            if relation.superseded_id is None:
                ids.append(relation.id)
            else:
                outcome += RowCounts(unchanged=1)
    return _ended(session, entry, Relation, ids, outcome, f"declared relation {kind}")


def _ended(
    session: Session,
    entry: Entry,
    cls: type[Statement] | type[Membership] | type[Relation],
    ids: Sequence[int],
    before: RowCounts,
    thing: str,
) -> RowCounts:
    """End rows that are held; rows withdrawn already stay, and rows that never were are an error."""
    if not ids and not before.unchanged:
        raise UsageError(f"there is no such {thing} to withdraw", remedy="look at it by: moma show CODE")
    for batch in batches(ids):
        end_rows(session, entry, cls, batch)
    return RowCounts(withdrawn=len(ids)) if ids else before
