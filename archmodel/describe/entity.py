"""Description of one entity or structure, now or at an earlier entry."""

import math
import unicodedata
from typing import Any

from sqlalchemy import or_, select
from sqlalchemy.orm import Session, joinedload

from archmodel.assertions.plain_values import entry_values
from archmodel.database.as_known import as_known
from archmodel.describe.canons import canon_values
from archmodel.describe.knowledge import knowledge, memberships, owners_of, owners_of_structure
from archmodel.describe.rows import entity_row, structures_named
from archmodel.describe.runs import JOINT_VALUES
from archmodel.store.find_by_code import no_such_code
from archmodel.tables.entities import Entity, kind_named, own_attributes
from archmodel.tables.entries import held_at
from archmodel.tables.hierarchy import definition_of, kind_chain, kind_of
from archmodel.tables.knowledge import Correction
from archmodel.tables.registered import refuse_unknown_kinds
from archmodel.tables.relations import INVERSE, Membership, Relation
from archmodel.tables.runs import EntityResult, JointResult, Run, StructureResult
from archmodel.tables.structures import Structure
from archmodel.tables.surveys import Measurement, Survey
from ground.errors import UsageError

Values = dict[str, Any]


def describe(session: Session, code: str, at: int | None = None) -> dict[str, object]:
    """Describe the stone or structure of a code in plain values that JSON can hold.

    Parameters
    ----------
    code : that it has now
    at : number of an entry: as it was known when that had just been made; None: now

    Returns
    -------
    dict
        of a stone: code, kind, definition, kinds (general to particular, each with its definition), canon,
        course, zone, hypothesis, own (attributes of its kind: value, unit, definition), face, solid, depth, structures,
        relations, knowledge, survey, measured, notes, runs (latest first), joints (of the latest run),
        corrections; of a structure: code, kind, definition, canon, title, number, side, part_of, parts, members,
        knowledge, recorded, withdrawn; SI units

    Raises
    ------
    UsageError
        if there is no such stone or structure, or was not; names the nearest codes
    """
    refuse_unknown_kinds(session, Entity, Structure)
    code = unicodedata.normalize("NFC", code)
    if not code.isprintable():
        raise no_such_code(session, code, Entity.code, Structure.code)
    if at is not None:
        return _described_at(session, code, at)
    number = session.scalar(select(Entity.id).where(Entity.code == code))
    if number is not None:
        return _entity(session, number)
    structures = structures_named(session, code)
    if not structures:
        raise no_such_code(session, code, Entity.code, Structure.code)
    return _structure(session, structures[0])


def _described_at(session: Session, code: str, at: int) -> Values:
    """Describe a stone or structure as it was known when an entry had just been made."""
    number = session.scalar(select(Entity.id).where(Entity.code == code))
    structures = structures_named(session, code)
    if number is None and not structures:
        raise no_such_code(session, code, Entity.code, Structure.code)
    with as_known(session, at) as then:
        if number is not None and then.get(Entity, number) is not None:
            return _entity(then, number)
        # a code that was given up can have been given to another structure since
        for structure in structures:
            if number is None and (held := then.get(Structure, structure.id)) is not None:
                return _structure(then, held)
    raise UsageError(f"{code} was not known at entry {at}", remedy="ask for a later one")


def _entity(session: Session, number: int) -> Values:
    row = entity_row(session, number)
    cls = kind_named(row["kind"])
    measured = _measurement(session, number)
    members = memberships(session, number)
    results = _results(session, number)
    return {
        "code": row["code"],
        "kind": row["kind"],
        "definition": definition_of(cls),
        "kinds": [{"kind": kind_of(one), "definition": definition_of(one)} for one in kind_chain(cls)],
        "canon": canon_values(session, "entity", row["code"], row["kind"]),
        "course": row["course"],
        "zone": row["zone"],
        "hypothesis": row["hypothesis"],
        "own": _own(cls, row),
        "face": {"length": row["length"], "height": row["height"], "area": row["area"]},
        "solid": {"volume": row["volume"], "centroid": [row["x"], row["y"], row["z"]]},
        "depth": {
            "value": row["depth"],
            "sigma": row["depth_sigma"],
            "source": row["depth_source"],
            "origin": row["depth_origin"],
        },
        "structures": [_membership(session, member) for member in members],
        "relations": _relations(session, number),
        "knowledge": knowledge(session, "entity_id", number, owners_of(session, members)),
        "survey": None if measured is None else _survey(measured),
        "measured": None if measured is None else _measured(measured),
        "notes": {} if measured is None else dict(measured.notes),
        "runs": [_result(result) for result in results],
        "joints": _joints(session, number, results[0].run_id) if results else [],
        "corrections": _corrections(session, number),
    }


def _structure(session: Session, row: Structure) -> Values:
    number = row.id
    owners = owners_of_structure(session, row.parent_id)
    parts = select(Structure.code).where(Structure.parent_id == number, held_at(Structure))
    members = (
        select(Entity.code)
        .join(Membership, Membership.entity_id == Entity.id)
        .where(Membership.structure_id == number, held_at(Membership))
        .order_by(Membership.rank.is_(None), Membership.rank, Membership.id)
    )
    ended = row.superseded_by
    return {
        "code": row.code,
        "kind": row.kind,
        "definition": definition_of(type(row)),
        "canon": canon_values(session, "structure", row.code, row.kind),
        "title": row.title,
        "number": row.number,
        "side": row.side,
        "part_of": [owner.structure.code for owner in owners],
        "parts": sorted(session.scalars(parts)),
        "members": list(session.scalars(members)),
        "runs": _results_of_structure(session, number),
        "knowledge": knowledge(session, "structure_id", number, owners),
        "recorded": entry_values(row.entry),
        "withdrawn": None if ended is None else entry_values(ended),
    }


def _results_of_structure(session: Session, number: int) -> list[Values]:
    """List the results of runs for a structure, latest first."""
    statement = (
        select(StructureResult)
        .where(StructureResult.structure_id == number)
        .options(joinedload(StructureResult.run))
        .order_by(StructureResult.run_id.desc())
    )
    return [
        {"run": row.run_id, "scene": row.run.scene, "outcome": row.run.outcome, **row.values}
        for row in session.scalars(statement)
    ]


def _own(cls: type[Entity], row: Values) -> Values:
    """Return the known attributes of its kind, each with its unit (None for a text) and definition."""
    kept = row["own"] or {}
    values = {name: row[name] if name in row else kept.get(name) for name in own_attributes(cls)}
    return {
        name: {"value": values[name], "unit": attribute.unit, "definition": attribute.definition}
        for name, attribute in own_attributes(cls).items()
        if values[name] is not None
    }


def _measurement(session: Session, number: int) -> Measurement | None:
    return session.scalar(
        select(Measurement)
        .where(Measurement.entity_id == number, held_at(Measurement))
        .options(joinedload(Measurement.survey).joinedload(Survey.entry))
    )


def _results(session: Session, number: int) -> list[EntityResult]:
    """List the results of runs, latest first."""
    statement = (
        select(EntityResult)
        .join(EntityResult.run)
        .where(EntityResult.entity_id == number)
        .options(joinedload(EntityResult.run).joinedload(Run.entry))
        .order_by(EntityResult.run_id.desc())
    )
    return list(session.scalars(statement))


def _membership(session: Session, one: Membership) -> Values:
    """Describe membership in a structure, and the structures that contain it."""
    structure = one.structure
    return {
        "code": structure.code,
        "kind": structure.kind,
        "title": structure.title,
        "rank": one.rank,
        "part_of": [owner.structure.code for owner in owners_of_structure(session, structure.parent_id)],
        "declared": one.declared,
        "entry": one.entry_id,
    }


def _corrections(session: Session, number: int) -> list[Values]:
    statement = (
        select(Correction)
        .where(Correction.entity_id == number)
        .options(joinedload(Correction.entry))
        .order_by(Correction.id)
    )
    return [
        {"attribute": row.attribute, "before": row.before, "after": row.after} | entry_values(row.entry)
        for row in session.scalars(statement)
    ]


def _survey(measured: Measurement) -> dict[str, object]:
    """Describe the survey of a measurement."""
    survey = measured.survey
    return {
        "name": survey.name,
        "file": survey.path,
        "line": measured.line,
        "sha256": survey.sha256,
        "stored_at": survey.entry.recorded_at.isoformat(timespec="seconds"),
    }


def _measured(measurement: Measurement) -> dict[str, object]:
    """Describe the measurement and its plane, with standard deviations from the covariance."""
    deviations = [math.sqrt(max(variance, 0.0)) for variance in measurement.covariance.diagonal().tolist()]
    return {
        "vertices": len(measurement.vertices),
        "points": measurement.point_count,
        "rejected": _names(measurement),
        "rejected_corners": [index + 1 for index in measurement.rejected_vertices],
        "sigma": measurement.sigma,
        "plane": {
            "normal": measurement.normal.tolist(),
            "offset": measurement.offset,
            "centroid": measurement.centroid.tolist(),
            "tilt_sigma": deviations[:2],
            "height_sigma": deviations[2],
        },
        "shape": measurement.shape_text,
        "provenance": measurement.provenance_text,
        "station": measurement.station,
        "remarks": list(measurement.remarks),
        "evidence": list(measurement.evidence),
        "rms": measurement.rms,
        "redundancy": measurement.redundancy,
    }


def _names(measurement: Measurement) -> list[str | int]:
    """Name the outliers: as the instrument named the points, otherwise by their numbers from 1."""
    return [measurement.names[i] if measurement.names else i + 1 for i in measurement.rejected]


def _result(result: EntityResult) -> dict[str, object]:
    """Describe the result of one run for the stone."""
    return {
        "run": result.run.id,
        "scene": result.run.scene,
        "outcome": result.run.outcome,
        "version": result.run.versions["moma"],
        "stored_at": result.run.entry.recorded_at.isoformat(timespec="seconds"),
        "fidelity": result.fidelity,
        "von_mises_p99": result.von_mises_p99,
        "von_mises_max": result.von_mises_max,
        "von_mises_mean": result.von_mises_mean,
        "displacement_max": result.displacement_max,
        "contact_force_max": result.contact_force_max,
        "values": dict(result.values),
    }


def _relations(session: Session, entity: int) -> dict[str, list[Values]]:
    """List the relations of an entity by kind as seen from it: rests on, supports, beside, …

    Returns
    -------
    dict
        of lists of code, declared, area [m²], gap [m], entry
    """
    statement = (
        select(Relation)
        .where(or_(Relation.subject_id == entity, Relation.object_id == entity), held_at(Relation))
        .options(joinedload(Relation.subject), joinedload(Relation.object))
        .order_by(Relation.id)
    )
    told: dict[str, dict[str, Values]] = {name: {} for name in INVERSE}
    for row in session.scalars(statement):
        name = row.kind if row.subject_id == entity else INVERSE[row.kind]
        other = row.object if row.subject_id == entity else row.subject
        values = {
            "code": other.code,
            "declared": row.declared,
            "area": row.area,
            "gap": row.gap,
            "entry": row.entry_id,
        }
        # computed and declared: one relation, of which the geometry gives the numbers
        before = told[name].get(other.code)
        if before is not None:
            numbers = before if before["area"] is not None else values
            values = {**numbers, "declared": True}
        told[name][other.code] = values
    return {name: [ones[code] for code in sorted(ones)] for name, ones in told.items() if ones}


def _joints(session: Session, entity: int, run: int) -> list[Values]:
    """List the results of a run for the joints of an entity; forces in N, pressures in Pa, lengths in m."""
    statement = (
        select(JointResult)
        .where(
            or_(JointResult.first_id == entity, JointResult.second_id == entity), JointResult.run_id == run
        )
        .options(joinedload(JointResult.first), joinedload(JointResult.second))
        .order_by(JointResult.number)
    )
    return [
        {
            "neighbour": (row.second if row.first_id == entity else row.first).code,
            **{name: getattr(row, name) for name in ("area", *JOINT_VALUES)},
        }
        for row in session.scalars(statement)
    ]
