"""Hypothetical stones: stored with their grounds, and withdrawn again.

A hypothesis is an entity like others, whose `hypothesis` is true and whose measurement has the provenance
"hypothesis". One that is withdrawn loses its geometry, its course and its zone: it is in no relation and no scene any
more, and queries do not find it; its statements stay in its history.
"""

import hashlib
from collections.abc import Iterable, Mapping, Sequence

from sqlalchemy import insert, select, update
from sqlalchemy.orm import Session

from archmodel.store.bulk import batches
from archmodel.store.lookalikes import Lookalikes, explained
from archmodel.store.remeasuring import MEASURED
from archmodel.store.revisions import NOTHING, RowCounts, end_rows
from archmodel.store.stone_record import StoneRecord
from archmodel.store.stones import insert_stones
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.knowledge import Correction
from archmodel.tables.surveys import Measurement, Survey
from ground.errors import DatabaseError, UsageError

_GIVEN_UP = ("course", "zone", *(name for name in MEASURED if name != "hypothesis"))
"""Columns that become unknown when a hypothesis is withdrawn."""


def store_hypotheses(
    session: Session,
    name: str,
    stones: Sequence[StoneRecord],
    source: str,
    *,
    author: str | None = None,
    settings: Mapping[str, object] | None = None,
) -> tuple[Entry, tuple[int, ...]]:
    """Store hypothetical stones: all of them or, if anything is wrong, none.

    Parameters
    ----------
    session : a writing session; it stays usable after an error
    name : what proposed them
    stones : with `hypothesis` true, at least one
    source : on what grounds
    author : person who recorded it; None for a program
    settings : of the program that computed them

    Returns
    -------
    The act of recording, and the primary keys of the entities in the order of the stones

    Raises
    ------
    DatabaseError
        if a code is there already, or given twice
    UsageError
        if a stone is no hypothesis
    """
    with session.begin_nested():
        _check(session, stones)
        entry = new_entry(session, "declaration", source, author=author, settings=settings)
        digest = hashlib.sha256(f"{entry.id}: {name}".encode()).hexdigest()
        survey = Survey(name=name, path=name, sha256=digest, entry_id=entry.id, stations={}, frame=None)
        session.add(survey)
        session.flush()
        numbers: list[int] = []
        for batch in batches(stones):
            numbers += insert_stones(session, batch, survey)
        return entry, tuple(numbers)


def withdraw_hypotheses(session: Session, entry: Entry, entities: Iterable[int]) -> RowCounts:
    """Withdraw hypothetical stones.

    Parameters
    ----------
    entities : their primary keys

    Raises
    ------
    UsageError
        if one of them was seen
    """
    outcome = NOTHING
    for batch in batches(entities):
        found = list(session.scalars(select(Entity).where(Entity.id.in_(batch)).order_by(Entity.id)))
        seen = next((entity for entity in found if not entity.hypothesis), None)
        if seen is not None:
            raise UsageError(f"{seen.code} is no hypothesis: it was surveyed", remedy="leave it out")
        in_space = [entity for entity in found if entity.x is not None]
        outcome += RowCounts(withdrawn=len(in_space), unchanged=len(found) - len(in_space))
        _end_geometry(session, entry, in_space)
    return outcome


def _check(session: Session, stones: Sequence[StoneRecord]) -> None:
    if not stones:
        raise UsageError("there are no stones", remedy="give one at least")
    stored_codes: set[str] = set()
    lookalikes = Lookalikes(session, Entity.code)
    for batch in batches(stones):
        codes = [stone.code for stone in batch]
        there = session.scalars(select(Entity.code).where(Entity.code.in_(codes))).all()
        twice = [*there, *(code for code in codes if code in stored_codes or codes.count(code) > 1)]
        if twice:
            raise DatabaseError(f"the code {twice[0]} is taken", remedy="give each stone a code of its own")
        if (like := lookalikes.like(codes)) is not None:
            remedy = "write both with the same characters"
            raise DatabaseError(f"the code {explained(*like)}", remedy=remedy)
        stored_codes |= set(codes)
        if any(not stone.hypothesis for stone in batch):
            code = next(stone.code for stone in batch if not stone.hypothesis)
            raise UsageError(f"{code} is no hypothesis", remedy="store what was surveyed by ingest")


def _end_geometry(session: Session, entry: Entry, entities: Sequence[Entity]) -> None:
    """End the measurements of entities and the attributes that follow from them; corrections keep the values."""
    if not entities:
        return
    numbers = [entity.id for entity in entities]
    measured = select(Measurement.id).where(
        Measurement.entity_id.in_(numbers), Measurement.superseded_id.is_(None)
    )
    end_rows(session, entry, Measurement, list(session.scalars(measured)))
    rows = [
        {
            "entity_id": entity.id,
            "entry_id": entry.id,
            "attribute": name,
            "before": getattr(entity, name),
            "after": None,
        }
        for entity in entities
        for name in _GIVEN_UP
        if getattr(entity, name) is not None
    ]
    session.execute(insert(Correction), rows)
    session.execute(update(Entity).where(Entity.id.in_(numbers)).values(dict.fromkeys(_GIVEN_UP)))
    for entity in entities:
        session.expire(entity)
