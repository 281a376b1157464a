"""Knowledge of many stones at once, from a database: attributes, relations, history and measured points."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload

from archmodel.assertions.plain_values import statement_values
from archmodel.query.api import find_rows
from archmodel.query.attributes import Attribute, attributes_of
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry
from archmodel.tables.knowledge import Correction, Statement
from archmodel.tables.relations import INVERSE, RELATIONS, Membership, Relation
from archmodel.tables.structures import Structure
from archmodel.tables.surveys import Measurement
from mechanics.arrays import Array
from pipelines.reports.page.model import Column, Event, Points, Relations

_GROUPS = {
    "Stone": "code kind course zone hypothesis length height area volume",
    "Depth": "depth depth_sigma depth_origin depth_source",
    "Survey": "rms redundancy points rejected shape provenance station photograph survey measurements",
}
_OMITTED = ("code", "x", "y", "z")


@dataclass(frozen=True)
class Known:
    """Knowledge of stones in a database, in the order of their codes."""

    columns: tuple[Column, ...]
    relations: Relations
    events: tuple[Event, ...]
    points: Points


def known_stones(
    session: Session, codes: Sequence[str], results: bool = False, run: int | None = None
) -> Known:
    """Collect what is held of stones.

    Parameters
    ----------
    codes : of the stones; those that are not in the database have no values
    results : include the results of runs
    run : whose results; None: each stone's latest
    """
    number = {code: index for index, code in enumerate(codes)}
    asked = {
        name: attribute
        for name, attribute in attributes_of(session).items()
        if name not in _OMITTED and (results or not (attribute.of_run or name in ("run", "runs")))
    }
    rows: list[dict[str, object]] = [{} for _ in codes]
    for row in find_rows(session, "entity", run=run, columns=["code", *asked]):
        if (index := number.get(str(row["code"]))) is not None:
            rows[index] = row
    columns = [column_of(one, [row.get(name) for row in rows]) for name, one in asked.items()]
    ids = {
        id_: number[code] for code, id_ in session.execute(select(Entity.code, Entity.id)) if code in number
    }
    return Known(
        tuple(column for column in columns if column is not None),
        _relations(session, ids),
        tuple(_events(session, ids)),
        _points(session, ids),
    )


def column_of(attribute: Attribute, values: Sequence[Any]) -> Column | None:
    """Return the column of an attribute; None where no stone has a value."""
    if all(value is None for value in values):
        return None
    name = attribute.name
    label = name.replace("_", " ")
    group = next((title for title, names in _GROUPS.items() if name in names.split()), "Knowledge")
    group = "Results" if attribute.of_run or name in ("run", "runs") else group
    if attribute.is_number:
        numbers = np.array([np.nan if value is None else float(value) for value in values])
        return Column(name, label, attribute.unit, numbers, group)
    texts = [
        None if value is None else "yes" if value is True else "no" if value is False else str(value)
        for value in values
    ]
    return Column(name, label, None, texts, group)


def _relations(session: Session, ids: dict[int, int]) -> Relations:
    found = session.execute(
        select(Relation.subject_id, Relation.object_id, Relation.kind).where(Relation.superseded_id.is_(None))
    )
    rows = sorted(
        {
            (ids[subject], ids[object_], RELATIONS.index(kind))
            for subject, object_, kind in found
            if subject in ids and object_ in ids
        }
    )
    table = np.array(rows, dtype=np.int64).reshape(-1, 3)
    names = [name.replace("_", " ") for name in RELATIONS]
    return Relations(
        table[:, :2], table[:, 2], names, [INVERSE[name].replace("_", " ") for name in RELATIONS]
    )


def _events(session: Session, ids: dict[int, int]) -> Iterator[Event]:
    """Yield what was recorded of each stone itself, in the order of recording."""
    entries = {row.id: row for row in session.scalars(select(Entry))}
    events: list[tuple[int, int, str]] = [
        (entry, ids[entity], "measured")
        for entry, entity in session.execute(select(Measurement.entry_id, Measurement.entity_id))
        if entity in ids
    ]
    events += [
        (row.entry_id, ids[row.entity_id], f"{row.attribute} corrected: {row.before} → {row.after}")
        for row in session.scalars(select(Correction))
        if row.entity_id in ids
    ]
    members = select(Membership.entry_id, Membership.entity_id, Structure.code).join(Membership.structure)
    events += [
        (entry, ids[entity], f"member of {code}")
        for entry, entity, code in session.execute(members)
        if entity in ids
    ]
    query = select(Statement).where(Statement.entity_id.is_not(None)).options(joinedload(Statement.document))
    for statement in session.scalars(query).unique():
        if statement.entity_id in ids:
            values = ", ".join(f"{name} {value}" for name, value in statement_values(statement).items())
            events.append(
                (
                    statement.entry_id,
                    ids[statement.entity_id],
                    f"{statement.kind.replace('_', ' ')}: {values}",
                )
            )
    for number, stone, what in sorted(events):
        entry = entries[number]
        who = entry.author or "MOMA"
        yield Event(stone, entry.recorded_at.date().isoformat(), who, f"{what} ({entry.source})")


def _points(session: Session, ids: dict[int, int]) -> Points:
    """Return the points on the faces, as measured."""
    statement = (
        select(Measurement.entity_id, Measurement.points, Measurement.rejected)
        .where(Measurement.superseded_id.is_(None))
        .order_by(Measurement.entity_id)
    )
    places: list[Array] = [np.zeros((0, 3))]
    owner, rejected = [np.zeros(0, np.int64)], [np.zeros(0, bool)]
    for entity, points, left_out in session.execute(statement):
        if entity in ids and len(points):
            places.append(points)
            owner.append(np.full(len(points), ids[entity]))
            rejected.append(np.isin(np.arange(len(points)), left_out))
    return Points(np.concatenate(places), np.concatenate(owner), np.concatenate(rejected))
