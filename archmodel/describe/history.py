"""History of an entity or a structure: all statements in the order of recording.

What is held now, what was held once and what replaced it: nothing is overwritten, so all of it can be read back,
and so can the whole description as it was when any entry had just been made (`known_at`).
"""

from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from sqlalchemy import or_, select
from sqlalchemy.orm import Session, joinedload

from archmodel.assertions.plain_values import entry_values, statement_values
from archmodel.describe.canons import canons_of
from archmodel.describe.entity import describe
from archmodel.describe.knowledge import ancestors
from archmodel.describe.rows import first_values, structures_named
from archmodel.store.find_by_code import no_such_code
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry, Recorded
from archmodel.tables.hierarchy import Kind
from archmodel.tables.knowledge import Correction, Statement
from archmodel.tables.registered import Canon, refuse_unknown_kinds
from archmodel.tables.relations import INVERSE, Membership, Relation
from archmodel.tables.runs import EntityResult, Run
from archmodel.tables.structures import Structure
from archmodel.tables.surveys import Measurement

Values = dict[str, object]


@dataclass(frozen=True)
class Event:
    """One statement, or the end of one.

    Attributes
    ----------
    entry, action, author, source, recorded_at : the act of recording that it came with
    event : recorded, measured, corrected, said, replaced, withdrawn or simulated
    what : entity, structure, measurement, the name of the corrected attribute, the kind of statement or
        relation, membership or run
    says : what was said, by name; what was withdrawn
    before : what was held until then, if it was replaced or corrected
    """

    entry: int
    action: str
    author: str | None
    source: str
    recorded_at: str
    event: str
    what: str
    says: Values
    before: Values | None = None


def history(session: Session, code: str) -> tuple[Event, ...]:
    """Return all events of the stone or structure of a code, oldest first.

    Raises
    ------
    UsageError
        if there is no such stone or structure; names the nearest codes
    DatabaseError
        if the database holds a kind that is not declared
    """
    refuse_unknown_kinds(session, Entity, Structure)
    number = session.scalar(select(Entity.id).where(Entity.code == code)) if code.isprintable() else None
    if number is not None:
        own = [*_of_entity(session, number), *_statements(session, "entity_id", number)]
        return _ordered([*own, *_inherited(session, number)])
    structures = structures_named(session, code) if code.isprintable() else []
    if not structures:
        raise no_such_code(session, code, Entity.code, Structure.code)
    return _ordered([event for structure in structures for event in _of_structure(session, structure)])


def known_at(session: Session, code: str, entry: int) -> dict[str, object]:
    """Describe a stone or structure as it was when an entry had just been made.

    Parameters
    ----------
    code : that it has now
    entry : number of an entry

    Raises
    ------
    UsageError
        if there is no such entry, or the stone or structure was not known then
    """
    return describe(session, code, entry)


def _ordered(events: Sequence[Event]) -> tuple[Event, ...]:
    # stable: within an entry as they were gathered
    return tuple(sorted(events, key=lambda event: event.entry))


def _event(entry: Entry, event: str, what: str, says: Values, before: Values | None = None) -> Event:
    provenance: dict[str, Any] = entry_values(entry)
    known = {name: value for name, value in says.items() if value is not None}
    return Event(event=event, what=what, says=known, before=before, **provenance)


def _of_entity(session: Session, number: int) -> Iterator[Event]:
    """Collect its record, measurements, corrections, structures, relations and runs."""
    entity = session.get_one(Entity, number)
    told = first_values(session, number, "code", "kind", "course", "zone", "depth")
    yield _event(entity.entry, "recorded", "entity", told)
    measured = select(Measurement).where(Measurement.entity_id == number).order_by(Measurement.id)
    yield from _chain(session.scalars(measured).all(), "measurement", _measurement, lambda row: row.entity_id)
    corrections = select(Correction).where(Correction.entity_id == number).order_by(Correction.id)
    for row in session.scalars(corrections):
        yield _event(row.entry, "corrected", row.attribute, {"value": row.after}, {"value": row.before})
    member = (
        select(Membership)
        .where(Membership.entity_id == number)
        .options(joinedload(Membership.structure))
        .order_by(Membership.id)
    )
    yield from _chain(
        session.scalars(member).all(), "membership", _structure_of, lambda row: row.structure_id
    )
    yield from _relations(session, number)
    yield from _canons(session, type(entity))
    runs = (
        select(EntityResult)
        .where(EntityResult.entity_id == number)
        .options(joinedload(EntityResult.run).joinedload(Run.entry))
        .order_by(EntityResult.run_id)
    )
    for result in session.scalars(runs):
        told = {"run": result.run_id, "scene": result.run.scene, "fidelity": result.fidelity}
        yield _event(result.run.entry, "simulated", "run", told | {"von_mises_p99": result.von_mises_p99})


def _relations(session: Session, number: int) -> Iterator[Event]:
    """Collect its relations, as seen from it."""
    statement = (
        select(Relation)
        .where(or_(Relation.subject_id == number, Relation.object_id == number))
        .options(joinedload(Relation.subject), joinedload(Relation.object))
        .order_by(Relation.id)
    )
    rows = session.scalars(statement).all()
    for kind in dict.fromkeys(INVERSE.values()):
        seen = [row for row in rows if (row.kind if row.subject_id == number else INVERSE[row.kind]) == kind]

        def told(relation: Relation) -> Values:
            """Return a relation as values."""
            other = relation.object if relation.subject_id == number else relation.subject
            return {
                "code": other.code,
                "declared": relation.declared,
                "area": relation.area,
                "gap": relation.gap,
            }

        yield from _chain(
            seen, kind, told, lambda relation: (relation.subject_id, relation.object_id, relation.declared)
        )


def _of_structure(session: Session, held: Structure) -> Iterator[Event]:
    """Collect the versions of a structure, its members, the statements about it, and its end."""
    versions = [held]
    while versions[0].supersedes_id is not None:
        versions.insert(0, session.get_one(Structure, versions[0].supersedes_id))
    before: Values | None = None
    for version in versions:
        told = _structure(session, version)
        yield _event(version.entry, "recorded" if before is None else "replaced", "structure", told, before)
        before = told
    members = (
        select(Membership)
        .where(Membership.structure_id == held.id)
        .options(joinedload(Membership.entity))
        .order_by(Membership.id)
    )
    yield from _chain(
        session.scalars(members).all(),
        "member",
        lambda row: {"code": row.entity.code, "rank": row.rank},
        lambda row: row.entity_id,
    )
    yield from _canons(session, type(held))
    yield from _statements(session, "structure_id", held.id)
    if held.superseded_by is not None:
        yield _event(held.superseded_by, "withdrawn", "structure", before or {})


def _canons(session: Session, cls: type[Kind]) -> Iterator[Event]:
    """Collect the canonical proportions that were stated of its kind and of those above it."""
    rows = canons_of(session, cls)
    by_number = {canon.id: canon for canon in rows}
    replaced = {canon.supersedes_id for canon in rows}
    for canon in rows:
        values = _canon(canon)
        if canon.proportions is None:
            yield _event(canon.entry, "withdrawn", "canon", values)
            continue
        earlier = None if canon.supersedes_id is None else by_number.get(canon.supersedes_id)
        yield _event(
            canon.entry,
            "said" if earlier is None else "replaced",
            "canon",
            values,
            None if earlier is None else _canon(earlier),
        )
        if canon.superseded_by is not None and canon.id not in replaced:
            yield _event(canon.superseded_by, "withdrawn", "canon", values)


def _canon(canon: Canon) -> Values:
    return {"kind": canon.kind, "proportions": canon.proportions, "tolerance": canon.tolerance}


def _inherited(session: Session, number: int) -> Iterator[Event]:
    """Collect what was stated of the structures of which it is or was a member, and of those that contain them."""
    members = select(Membership.structure_id).where(Membership.entity_id == number).distinct()
    structures: dict[int, str] = {}
    for first in session.scalars(members):
        structures |= ancestors(session, first)
    for structure, code in structures.items():
        for event in _statements(session, "structure_id", structure):
            yield replace(event, says={**event.says, "said_of": code})


def _statements(session: Session, column: str, number: int) -> Iterator[Event]:
    rows = session.scalars(
        select(Statement)
        .where(getattr(Statement, column) == number)
        .options(joinedload(Statement.document))
        .order_by(Statement.id)
    ).all()
    by_number = {row.id: row for row in rows}
    replaced = {row.supersedes_id for row in rows}
    for row in rows:
        old = by_number.get(row.supersedes_id) if row.supersedes_id is not None else None
        before = None if old is None else statement_values(old)
        yield _event(
            row.entry, "said" if old is None else "replaced", row.kind, statement_values(row), before
        )
        if row.superseded_by is not None and row.id not in replaced:
            yield _event(row.superseded_by, "withdrawn", row.kind, statement_values(row))


def _chain(
    rows: Sequence[Any],
    what: str,
    told: Callable[[Any], Values],
    about: Callable[[Any], Hashable],
) -> Iterator[Event]:
    """Chain rows without ``supersedes_id``: one that began with the entry that ended another replaces it."""
    ended: dict[tuple[Hashable, int], Recorded] = {
        (about(row), row.superseded_id): row for row in rows if row.superseded_id is not None
    }
    for row in rows:
        old = ended.pop((about(row), row.entry_id), None)
        first = "measured" if what == "measurement" else "said"
        before = None if old is None else told(old)
        yield _event(row.entry, first if old is None else "replaced", what, told(row), before)
    for old in ended.values():
        if old.superseded_by is not None:
            yield _event(old.superseded_by, "withdrawn", what, told(old))


def _measurement(measurement: Measurement) -> Values:
    return {
        "survey": measurement.survey.name,
        "line": measurement.line,
        "points": measurement.point_count,
        "rejected": measurement.rejected_count,
        "rms": measurement.rms,
    }


def _structure_of(membership: Membership) -> Values:
    return {"structure": membership.structure.code, "rank": membership.rank}


def _structure(session: Session, structure: Structure) -> Values:
    parent = None if structure.parent_id is None else session.get_one(Structure, structure.parent_id)
    values = {
        "kind": structure.kind,
        "title": structure.title,
        "part_of": None if parent is None else parent.code,
        "number": structure.number,
        "side": structure.side,
    }
    return {name: value for name, value in values.items() if value is not None}


def list_entries(session: Session) -> list[dict[str, object]]:
    """Return number, action, author, source and time of every act of recording, oldest first."""
    return [entry_values(entry) for entry in session.scalars(select(Entry).order_by(Entry.id))]
