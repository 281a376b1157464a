"""Declaration of structures with their members, and of relations between entities.

As in ``archmodel.assertions.declare``, what is declared again as it is changes nothing.
"""

from collections.abc import Mapping, Sequence

from sqlalchemy import insert, select
from sqlalchemy.orm import Session

from archmodel.assertions.declare import declare_named
from archmodel.assertions.validation import checked_choice, checked_label, checked_text, checked_whole
from archmodel.store.bulk import batches
from archmodel.store.find_by_code import held_named
from archmodel.store.revisions import NOTHING, RowCounts, end_rows, table_of
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry
from archmodel.tables.hierarchy import kind_of
from archmodel.tables.relations import INVERSE, RELATIONS, SYMMETRIC, Membership, Relation
from archmodel.tables.structures import Structure, structure_kind_named
from ground.errors import UsageError


def declare_structure(
    session: Session,
    entry: Entry,
    kind: str,
    code: str,
    *,
    title: str | None = None,
    parent: str | None = None,
    number: int | None = None,
    side: str | None = None,
) -> RowCounts:
    """Declare a part of the building, within another one perhaps; its members are declared by `declare_members`."""
    cls = structure_kind_named(kind)
    if side is not None:
        checked_choice("side", side, ("outer", "inner"))
    above = None if parent is None else held_named(session, Structure, parent)
    _refuse_circle(code, above)
    label = checked_label("code", code)
    if session.scalar(select(Entity.id).where(Entity.code == label)) is not None:
        raise UsageError(f"{code} is a stone", remedy="give the structure a code of its own")
    values = {
        "kind": kind_of(cls),
        "title": checked_text("title", title),
        "parent_id": None if above is None else above.id,
        "number": checked_whole("number", number, 0),
        "side": side,
    }
    return declare_named(session, entry, Structure, {"code": label}, values, cls)


def declare_members(
    session: Session, entry: Entry, code: str, entities: Sequence[int], *, ordered: bool = False
) -> RowCounts:
    """Declare entities, by their numbers, members of a structure; earlier declarations stay.

    Parameters
    ----------
    ordered : their ranks are their places in `entities`, from 1
    """
    structure = held_named(session, Structure, code)
    outcome = NOTHING
    for batch in batches(enumerate(entities, start=1)):
        ranks = {number: rank if ordered else None for rank, number in batch}
        outcome += _declare_members(session, entry, structure.id, ranks)
    return outcome


def declare_relation(
    session: Session, entry: Entry, kind: str, of: Sequence[int], to: Sequence[int]
) -> RowCounts:
    """Declare a relation of each of some entities, by their numbers, to each of others.

    A relation that was computed from the geometry stays beside the declared one.

    Raises
    ------
    UsageError
        for an unknown relation, or an entity in relation to itself
    """
    checked_choice("relation", kind, (*RELATIONS, "supports"))
    both = set(of) & set(to)
    if both:
        raise UsageError(
            f"{len(both)} stones would be in relation to themselves", remedy="leave them out of one"
        )
    pairs = [(subject, target) for subject in of for target in to]
    if kind not in RELATIONS:
        kind, pairs = INVERSE[kind], [(second, first) for first, second in pairs]
    if kind in SYMMETRIC:
        pairs = [(min(pair), max(pair)) for pair in pairs]
    outcome = NOTHING
    for batch in batches(dict.fromkeys(pairs)):
        outcome += _declare_relations(session, entry, kind, batch)
    return outcome


def _refuse_circle(code: str, above: Structure | None) -> None:
    """Refuse a structure that would be a part of itself, at any level."""
    while above is not None:
        if above.code == code:
            raise UsageError(f"{code} would be a part of itself", remedy="give it another parent")
        above = above.parent


def _declare_members(
    session: Session, entry: Entry, structure: int, ranks: Mapping[int, int | None]
) -> RowCounts:
    table = table_of(Membership)
    query = select(table).where(
        table.c.structure_id == structure, table.c.entity_id.in_(ranks), table.c.superseded_id.is_(None)
    )
    same: set[int] = set()
    replaced: dict[int, int] = {}
    rank_of = dict(ranks)
    for row in session.execute(query).mappings():
        number = row["entity_id"]
        if ranks[number] is None:
            rank_of[number] = row["rank"]
        if row["declared"] and row["rank"] == rank_of[number]:
            same.add(number)
        else:
            # what was computed, too, is declared from now on
            replaced[number] = row["id"]
    if replaced:
        end_rows(session, entry, Membership, list(replaced.values()))
    rows = [
        {"entry_id": entry.id, "entity_id": number, "structure_id": structure, "rank": rank, "declared": True}
        for number, rank in rank_of.items()
        if number not in same
    ]
    if rows:
        session.execute(insert(table), rows)
    return RowCounts(new=len(rows) - len(replaced), replaced=len(replaced), unchanged=len(same))


def _declare_relations(
    session: Session, entry: Entry, kind: str, pairs: Sequence[tuple[int, int]]
) -> RowCounts:
    table = table_of(Relation)
    query = select(table.c.subject_id, table.c.object_id).where(
        table.c.kind == kind,
        table.c.declared,
        table.c.superseded_id.is_(None),
        table.c.subject_id.in_({subject for subject, _ in pairs}),
    )
    same = {(subject, target) for subject, target in session.execute(query)} & set(pairs)
    rows = [
        {"entry_id": entry.id, "kind": kind, "subject_id": subject, "object_id": target, "declared": True}
        for subject, target in pairs
        if (subject, target) not in same
    ]
    if rows:
        session.execute(insert(table), rows)
    return RowCounts(new=len(rows), unchanged=len(same))
