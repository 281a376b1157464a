"""Attributes of entities that follow from their relations: a header's tail, a voussoir's place in its arch."""

from collections.abc import Collection, Iterator, Mapping, Sequence

from sqlalchemy import ColumnElement, bindparam, func, select, update
from sqlalchemy.orm import Session, aliased

from archmodel.relations.arch_rings import ArchRings
from archmodel.relations.store import Act
from archmodel.store.bulk import batches, insert_rows
from archmodel.store.revisions import table_of
from archmodel.store.stone_arrays import id_conditions
from archmodel.tables.entities import Entity, Header, Stretcher
from archmodel.tables.entries import Entry
from archmodel.tables.hierarchy import kinds_below
from archmodel.tables.knowledge import Correction
from archmodel.tables.relations import Relation

_VALUE_ROUNDING = 1e-9  # values that differ by less, in m or rad, are one value computed twice


def arch_values(arches: Sequence[ArchRings]) -> dict[int, dict[str, float | None]]:
    """Return ring, rank and angle of the stones of arches, by entity; a springer of two belongs to the first."""
    values: dict[int, dict[str, float | None]] = {}
    for arch in arches:
        for stone in arch.stones:
            ring_values = {"ring": stone.ring, "rank": stone.rank, "intrados_angle": stone.angle}
            values.setdefault(stone.entity, dict(ring_values))
    return values


def tail_lengths(session: Session, headers: Collection[int] | None = None) -> dict[int, float]:
    """Return the reach of headers behind the deepest stretcher beside them, by entity [m]; 0 at least.

    Parameters
    ----------
    headers : numbers of the entities that are looked at; None: all
    """
    conditions: Iterator[ColumnElement[bool]] | list[ColumnElement[bool]]
    conditions = [Entity.id.is_not(None)] if headers is None else id_conditions(Entity.id, headers)
    tails: dict[int, float] = {}
    for condition in conditions:
        for mine, others in (
            (Relation.subject_id, Relation.object_id),
            (Relation.object_id, Relation.subject_id),
        ):
            stretcher = aliased(Entity)
            rows = session.execute(
                select(Entity.id, Entity.depth, func.max(stretcher.depth))
                .join(Relation, mine == Entity.id)
                .join(stretcher, stretcher.id == others)
                .where(
                    condition,
                    Entity.kind.in_(kinds_below(Header)),
                    Entity.depth.is_not(None),
                    stretcher.kind.in_(kinds_below(Stretcher)),
                    stretcher.depth.is_not(None),
                    Relation.kind == "beside",
                    Relation.superseded_id.is_(None),
                )
                .group_by(Entity.id, Entity.depth)
            )
            for number, depth, deepest in rows:
                assert depth is not None
                assert deepest is not None
                tail = max(depth - deepest, 0.0)
                tails[number] = min(tail, tails.get(number, tail))
    return tails


def give_values(session: Session, values: Mapping[int, Mapping[str, float | None]], act: Act) -> int:
    """Write computed values of attributes to entities; return how many values changed.

    What was not known is filled in. What was computed otherwise before is corrected, so that the former value is
    kept. What somebody declared, be it that it is not known, stays as it is.

    Parameters
    ----------
    session : a writing session
    values : by entity and attribute, the same attributes for all; None: nothing to say
    act : that they come with
    """
    names = sorted({name for changes in values.values() for name in changes})
    if not names:
        return 0
    declared = _declared(session, names)
    columns = [table_of(Entity).c[name] for name in names]
    changed = 0
    for some in batches(values):
        stored = {
            row[0]: dict(zip(names, row[1:], strict=True))
            for row in session.execute(
                select(table_of(Entity).c.id, *columns).where(table_of(Entity).c.id.in_(some))
            )
        }
        changes = [
            (number, name, before, after)
            for number in some
            for name, after in values[number].items()
            if (number, name) not in declared and _differs(before := stored[number][name], after)
        ]
        changed += len(changes)
        if changes:
            _update(session, names, stored, changes)
            _keep_former(session, [change for change in changes if change[2] is not None], act)
    return changed


def _differs(before: float | None, after: float | None) -> bool:
    return after is not None and (before is None or abs(before - after) > _VALUE_ROUNDING)


def _declared(session: Session, names: Sequence[str]) -> set[tuple[int, str]]:
    """Return the attributes of entities that somebody stated."""
    rows = session.execute(
        select(Correction.entity_id, Correction.attribute)
        .join(Entry, Entry.id == Correction.entry_id)
        .where(Correction.attribute.in_(names), Entry.action != "geometry")
    )
    return {(entity, attribute) for entity, attribute in rows}


_Change = tuple[int, str, float | None, float | None]


def _update(
    session: Session,
    names: Sequence[str],
    stored: Mapping[int, Mapping[str, float | None]],
    changes: Sequence[_Change],
) -> None:
    after = {number: dict(stored[number]) for number, *_ in changes}
    for number, name, _, value in changes:
        after[number][name] = value
    table = table_of(Entity)
    statement = (
        update(table)
        .where(table.c.id == bindparam("number"))
        .values({name: bindparam(f"new_{name}") for name in names})
    )
    rows = [
        {"number": number, **{f"new_{name}": value for name, value in given.items()}}
        for number, given in after.items()
    ]
    session.execute(statement, rows)


def _keep_former(session: Session, changes: Sequence[_Change], act: Act) -> None:
    insert_rows(
        session,
        Correction,
        (
            {
                "entity_id": number,
                "entry_id": act.id,
                "attribute": name,
                "before": before,
                "after": after,
            }
            for number, name, before, after in changes
        ),
    )
