"""All that is known of one entity: what it is, what was measured, what was computed."""

import difflib
import math

from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload, selectinload

from archmodel.entities import Entity, definition_of, kind_chain, kind_of, refuse_unknown_kinds
from archmodel.runs import EntityResult, Run
from archmodel.surveys import Measurement, Survey
from moma.errors import UsageError

__all__ = ["describe"]

MAX_CANDIDATES = 1000
"""Codes that are looked through for one that is like a mistyped code."""


def describe(session: Session, code: str) -> dict[str, object]:
    """Everything about the stone of this code, in plain values that JSON can say.

    Returns
    -------
    dict
        code, kind, definition, kinds (general to particular, each with its definition), course, face, solid,
        depth, survey, measured, notes, runs (latest first); SI units

    Raises
    ------
    UsageError
        if there is no such stone; names the nearest codes
    """
    refuse_unknown_kinds(session)
    entity = session.scalar(
        select(Entity)
        .where(Entity.code == _plain(code))
        .options(
            joinedload(Entity.measurement).joinedload(Measurement.survey).joinedload(Survey.entry),
            selectinload(Entity.results).joinedload(EntityResult.run).joinedload(Run.entry),
        )
    )
    if entity is None:
        raise _no_such(session, code)
    chain, measured = kind_chain(type(entity)), entity.measurement
    return {
        "code": entity.code,
        "kind": entity.kind,
        "definition": definition_of(type(entity)),
        "kinds": [{"kind": kind_of(cls), "definition": definition_of(cls)} for cls in chain],
        "course": entity.course,
        "zone": entity.zone,
        "face": {"length": entity.length, "height": entity.height, "area": entity.area},
        "solid": {"volume": entity.volume, "centroid": [entity.x, entity.y, entity.z]},
        "depth": {
            "value": entity.depth,
            "sigma": entity.depth_sigma,
            "source": entity.depth_source,
            "origin": entity.depth_origin,
        },
        "survey": None if measured is None else _survey(measured),
        "measured": None if measured is None else _measured(measured),
        "notes": {} if measured is None else dict(measured.notes),
        "runs": [_result(result) for result in reversed(entity.results)],
    }


def _survey(measured: Measurement) -> dict[str, object]:
    """Where the measurement comes from."""
    survey = measured.survey
    return {
        "name": survey.name,
        "file": survey.path,
        "line": measured.line,
        "sha256": survey.sha256,
        "stored_at": survey.entry.recorded_at.isoformat(timespec="seconds"),
    }


def _measured(measurement: Measurement) -> dict[str, object]:
    """The measurement and the plane fitted to it, with standard deviations from the covariance."""
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
        "rms": measurement.rms,
        "redundancy": measurement.redundancy,
    }


def _names(measurement: Measurement) -> list[str | int]:
    """The points left out: by the names that the instrument gave them, else by their numbers from 1."""
    return [measurement.names[i] if measurement.names else i + 1 for i in measurement.rejected]


def _result(result: EntityResult) -> dict[str, object]:
    """What one run computed for the stone."""
    return {
        "run": result.run.id,
        "scene": result.run.scene,
        "outcome": result.run.outcome,
        "version": result.run.versions["moma"],
        "stored_at": result.run.entry.recorded_at.isoformat(timespec="seconds"),
        "fidelity": result.fidelity,
        "von_mises_max": result.von_mises_max,
        "von_mises_mean": result.von_mises_mean,
        "displacement_max": result.displacement_max,
        "contact_force_max": result.contact_force_max,
        "values": dict(result.values),
    }


def _plain(code: str) -> str:
    """The code, if it can be one: what cannot be printed can be in no database."""
    if not code.isprintable():
        raise UsageError(
            f"{code[:40]!a} is not a stone's code", remedy="list the codes by: moma query entity"
        )
    return code


def _no_such(session: Session, code: str) -> UsageError:
    """The error for a code that is not there, with the nearest that are."""
    alike = (
        select(Entity.code).where(Entity.code.istartswith(code[:1], autoescape=True)).limit(MAX_CANDIDATES)
    )
    near = difflib.get_close_matches(code[:40], session.scalars(alike).all(), n=3, cutoff=0.5)
    remedy = f"did you mean {' or '.join(near)}?" if near else "list the codes by: moma query entity"
    return UsageError(f"there is no stone {code[:40]!r} in the database", remedy=remedy)
