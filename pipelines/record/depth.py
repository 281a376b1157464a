"""Depths of stones: the statement, and the solids extruded to them."""

from collections.abc import Sequence
from dataclasses import replace

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.correct import replace_measurement
from archmodel.assertions.statements import PLAIN, Remark, say_depth
from archmodel.store.bulk import batches
from archmodel.store.find_by_code import subjects
from archmodel.store.revisions import NOTHING, RowCounts
from archmodel.store.stones import load_stones
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry
from ground.errors import UsageError
from pipelines.ingest.records import stone_record, surveyed_block


def record_depth(
    session: Session,
    entry: Entry,
    codes: Sequence[str],
    value: float,
    sigma: float | None = None,
    remark: Remark = PLAIN,
) -> RowCounts:
    """Record the depth of stones, and extrude their measured faces to it.

    Parameters
    ----------
    codes : of the stones
    value, sigma : depth and its standard deviation [m]
    remark : its text is the evidence; without one, the source of the entry

    Raises
    ------
    UsageError
        if there is no such stone, or its face was not measured, so that there is nothing to extrude
    GeometryError
        if the face cannot be extruded to this depth
    """
    outcome = say_depth(session, entry, subjects(session, codes), value, sigma, remark)
    evidence = remark.text or entry.source
    for batch in batches(codes):
        outcome += _extrude(session, entry, batch, value, sigma, evidence)
    return outcome


def _extrude(
    session: Session, entry: Entry, codes: Sequence[str], value: float, sigma: float | None, evidence: str
) -> RowCounts:
    """Extrude solids to a depth; those of this depth, on whatever evidence, stay as they are."""
    outcome = NOTHING
    entities = session.scalars(select(Entity).where(Entity.code.in_(codes)).order_by(Entity.id)).all()
    for entity in entities:
        if entity.measurement is None:
            raise UsageError(f"{entity.code} was not measured", remedy="ingest a survey of its face first")
    changed = [entity for entity in entities if (entity.depth, entity.depth_sigma) != (value, sigma)]
    for stone in load_stones(session, changed):
        if stone.provenance == "solid":
            what = f"the depth of {stone.code} is that of its solid, which was surveyed"
            raise UsageError(what, remedy="ingest a better solid")
        deeper = replace(stone, depth=value, depth_sigma=sigma, depth_source=evidence, depth_origin="stone")
        outcome += replace_measurement(session, entry, stone_record(surveyed_block(deeper)), stone.code)
    return outcome
