"""Replacement of measurements, with corrections of the attributes that follow from them."""

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from archmodel.store.bulk import first_free_id, insert_rows
from archmodel.store.stone_record import StoneRecord
from archmodel.store.stone_rows import ENTITY_COLUMNS, entity_rows, measurement_row
from archmodel.tables.entities import CORRECTABLE, Entity
from archmodel.tables.knowledge import Correction
from archmodel.tables.surveys import Measurement

MEASURED = tuple(name for name in ENTITY_COLUMNS if name not in CORRECTABLE)
"""Columns of an entity that follow from its measurement. Kind, code, course and zone do not: whoever corrected them
knew more than the survey."""


def supersede_measurements(
    session: Session,
    entry_id: int,
    survey_id: int,
    numbers: Sequence[int],
    stones: Sequence[StoneRecord],
    places: Sequence[str],
) -> None:
    """Replace the measurements of entities by those of these records.

    Parameters
    ----------
    entry_id, survey_id : the act of recording, and the survey that the records are of
    numbers : primary key of the entity that each record is of, fewer than SQLite's limit of parameters
    stones, places : the records, and ``file:line stone CODE`` of each for errors

    Raises
    ------
    SurveyError, GeometryError
        if a record cannot be stored, at its place
    """
    made = entity_rows(stones, places)
    measured = first_free_id(session, Measurement)
    shared = {"survey_id": survey_id, "entry_id": entry_id, "superseded_id": None}
    rows = [
        {"id": measured + place, "entity_id": number, **shared, **measurement_row(stone, where)}
        for place, (number, stone, where) in enumerate(zip(numbers, stones, places, strict=True))
    ]
    session.execute(
        update(Measurement)
        .where(Measurement.entity_id.in_(numbers), Measurement.superseded_id.is_(None))
        .values(superseded_id=entry_id)
    )
    insert_rows(session, Measurement, rows)
    _correct(session, entry_id, dict(zip(numbers, made, strict=True)))


def _correct(session: Session, entry_id: int, made: Mapping[int, Mapping[str, object]]) -> None:
    """Write the new values into the entities, and a correction for each that differs."""
    columns = [getattr(Entity, name) for name in MEASURED]
    rows = session.execute(select(Entity.id, *columns).where(Entity.id.in_(made))).mappings()
    corrections: list[dict[str, Any]] = []
    changed = []
    for row in rows:
        new = made[row["id"]]
        differing = [name for name in MEASURED if row[name] != new[name]]
        if differing:
            changed.append({"id": row["id"], **{name: new[name] for name in MEASURED}})
        corrections += [
            {
                "entity_id": row["id"],
                "entry_id": entry_id,
                "attribute": name,
                "before": row[name],
                "after": new[name],
            }
            for name in differing
        ]
    if changed:
        session.execute(update(Entity), changed)
    first = first_free_id(session, Correction)
    insert_rows(
        session,
        Correction,
        ({"id": number, **correction} for number, correction in enumerate(corrections, start=first)),
    )
