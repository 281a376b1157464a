"""Attributes that queries can ask for, and their places in the tables."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, func
from sqlalchemy.orm import Session

from archmodel.query.columns import (
    Value,
    count,
    documents,
    of_entity,
    of_marks,
    of_material,
    of_measurement,
    of_observations,
    of_relations,
    of_result,
    of_simplification,
    of_values,
    rows,
    structures,
)
from archmodel.query.scope import Scope
from archmodel.store.run_record import STONE_VALUES
from archmodel.tables.entities import Entity, OwnAttribute, kinds, own_attributes
from archmodel.tables.knowledge import Correction
from archmodel.tables.runs import FIDELITIES, EntityResult
from archmodel.tables.surveys import Measurement

__all__ = ["ATTRIBUTES", "Attribute", "attributes_of", "kinds_of", "own_attributes_of"]


@dataclass(frozen=True)
class Attribute:
    """One attribute of an entity.

    Attributes
    ----------
    name : as users write it
    unit : "m", "Pa", …; "-" for counts and numbers without a unit; None for texts
    definition : what it is, in a few words
    value : where it is found: of a scope and, if it is one of a run, of the number of that run
    of_run : a run computed it, so that ``name@12`` asks for that of run 12
    words : all texts that it can be; None if it can be any
    is_truth : it is true or false
    """

    name: str
    unit: str | None
    definition: str
    value: Value
    of_run: bool = False
    words: tuple[str, ...] | None = None
    is_truth: bool = False

    @property
    def is_number(self) -> bool:
        """True for a number, False for a text."""
        return self.unit is not None

    @property
    def type_name(self) -> str:
        """The unit; without one, whether the attribute is a text or true or false."""
        return self.unit or ("true/false" if self.is_truth else "text")


def _result(
    name: str, unit: str | None, definition: str, value: Value, words: tuple[str, ...] | None = None
) -> Attribute:
    return Attribute(name, unit, definition, value, of_run=True, words=words)


_BUILT = (
    Attribute("code", None, "name of the stone in the survey", of_entity("code")),
    Attribute("kind", None, "its own kind, e.g. keystone", of_entity("kind")),
    Attribute("course", "-", "number of its course, from the ground", of_entity("course")),
    Attribute("zone", None, "part of the building", of_entity("zone")),
    Attribute("depth", "m", "how far it reaches into the wall", of_entity("depth")),
    Attribute("depth_sigma", "m", "standard deviation of the depth", of_entity("depth_sigma")),
    Attribute(
        "depth_origin", None, "evidence: stone, rule, kind, structure or solid", of_entity("depth_origin")
    ),
    Attribute("depth_source", None, "that evidence in words", of_entity("depth_source")),
    Attribute("length", "m", "horizontal extent of its face", of_entity("length")),
    Attribute("height", "m", "extent of its face upwards", of_entity("height")),
    Attribute("area", "m²", "area of its face", of_entity("area")),
    Attribute("volume", "m³", "volume of its solid", of_entity("volume")),
    Attribute("x", "m", "centroid of its solid", of_entity("x")),
    Attribute("y", "m", "centroid of its solid", of_entity("y")),
    Attribute("z", "m", "centroid of its solid", of_entity("z")),
    Attribute(
        "hypothesis",
        None,
        "nobody has seen it: missing, or hidden in the wall",
        of_entity("hypothesis"),
        is_truth=True,
    ),
)

_MEASURED = (
    Attribute(
        "rms", "m", "root mean square distance of its points from the fitted plane", of_measurement("rms")
    ),
    Attribute("redundancy", "-", "accepted points minus 3", of_measurement("redundancy")),
    Attribute("points", "-", "measured points on its face", of_measurement("point_count")),
    Attribute("rejected", "-", "points left out as blunders", of_measurement("rejected_count")),
    Attribute(
        "shape", None, "of its face: plane, bevelled, curved, rough, untested", of_measurement("shape")
    ),
    Attribute(
        "provenance",
        None,
        "of its face: points, photograph, solid or hypothesis",
        of_measurement("provenance"),
    ),
    Attribute("station", None, "where the instrument stood", of_measurement("station")),
    Attribute("photograph", None, "on which its face was drawn", of_measurement("photograph")),
    Attribute(
        "survey", None, "name of the survey that measured it", lambda scope, run: scope.survey().c.name
    ),
    Attribute(
        "measurements",
        "-",
        "how often it was measured, or its solid made anew",
        rows(Measurement, "entity_id", now=False),
    ),
)

_KNOWN = (
    Attribute("phase", None, "name of the phase that it is of", lambda scope, run: scope.phase().c.name),
    Attribute(
        "phase_begins",
        "year",
        "of that phase, at the earliest",
        lambda scope, run: scope.phase().c.begins,
    ),
    Attribute("phase_ends", "year", "of that phase, at the latest", lambda scope, run: scope.phase().c.ends),
    Attribute("material", None, "name of its material", lambda scope, run: scope.material().c.name),
    Attribute("density", "kg/m³", "of its material", of_material("density")),
    Attribute("tensile_strength", "Pa", "of its material", of_material("tensile_strength")),
    Attribute("compressive_strength", "Pa", "of its material", of_material("compressive_strength")),
    Attribute("marks", "-", "mason marks on it", of_marks(count)),
    Attribute(
        "mark",
        None,
        "name of its mason mark; of several, the first by the alphabet",
        of_marks(lambda said: func.min(said.c.sign)),
    ),
    Attribute("observations", "-", "observations of damage and change", of_observations(count)),
    Attribute(
        "severity",
        "-",
        "largest severity observed, from 0 (traces) to 4 (lost, or about to be)",
        of_observations(lambda said: func.max(said.c.severity)),
    ),
    Attribute("documents", "-", "documents, drawings and photographs that treat it", documents),
    Attribute(
        "corrections", "-", "attributes of it that were corrected", rows(Correction, "entity_id", now=False)
    ),
    Attribute("structures", "-", "structures that it is a member of", structures),
)

_RELATED = (
    Attribute("bearers", "-", "stones that it rests on", of_relations(count, "subject_id", kind="rests_on")),
    Attribute("borne", "-", "stones that rest on it", of_relations(count, "object_id", kind="rests_on")),
    Attribute(
        "neighbours", "-", "stones beside it", of_relations(count, "subject_id", "object_id", kind="beside")
    ),
    Attribute(
        "bearing_area",
        "m²",
        "area on which it rests",
        of_relations(lambda rows: func.sum(rows.c.area), "subject_id", kind="rests_on"),
    ),
)

_COMPUTED = (
    _result("von_mises_max", "Pa", "largest Von Mises stress", of_result("von_mises_max")),
    _result("von_mises_mean", "Pa", "mean Von Mises stress", of_result("von_mises_mean")),
    _result("displacement_max", "m", "largest displacement", of_result("displacement_max")),
    _result("contact_force_max", "N", "largest contact force", of_result("contact_force_max")),
    *(_result(name, unit, meaning, of_values(name)) for name, (unit, meaning) in STONE_VALUES.items()),
    _result("fidelity", None, "fixed, rigid or deformable", of_result("fidelity"), FIDELITIES),
    _result(
        "simplified_by",
        "m",
        "farthest that a corner of its solid was moved for the run",
        of_simplification("displacement_max"),
    ),
    _result("solid_shape", None, "of its simplified solid, e.g. hexahedron", of_simplification("shape")),
    _result(
        "blockiness",
        "-",
        "what it and a hexahedron have in common, over what they fill together",
        of_simplification("blockiness"),
    ),
    _result(
        "worst_angle",
        "rad",
        "largest departure from a right angle between two faces of that solid",
        of_simplification("worst_angle"),
    ),
    Attribute(
        "within_tolerance",
        None,
        "simplifying kept within what the survey can tell",
        of_simplification("within_tolerance"),
        of_run=True,
        is_truth=True,
    ),
    _result("outcome", None, "equilibrium, moving or collapsed", lambda scope, run: scope.run(run).c.outcome),
    _result("scene", None, "name of the scene", lambda scope, run: scope.run(run).c.scene),
    Attribute("run", "-", "number of the run that these are of", of_result("run_id")),
    Attribute("runs", "-", "runs that hold it", rows(EntityResult, "entity_id", now=False)),
)

ATTRIBUTES: Mapping[str, Attribute] = {
    one.name: one for one in (*_BUILT, *_MEASURED, *_KNOWN, *_RELATED, *_COMPUTED)
}
"""The attributes of every entity by name."""


def attributes_of(session: Session | None = None, kind: type[Entity] | None = None) -> dict[str, Attribute]:
    """Return the attributes of every entity, and those that some kinds have of their own.

    Parameters
    ----------
    session : of a database whose registered kinds count too
    kind : only own attributes that an entity of this kind can have; None: those of all kinds
    """
    known = dict(ATTRIBUTES)
    for name, attribute in own_attributes_of(session, kind).items():
        known.setdefault(name, attribute)
    return known


def kinds_of(session: Session | None = None) -> dict[str, type[Entity]]:
    """Return the kinds that a database can hold: those built in, and those that it registers itself."""
    user = None if session is None else session.get_bind().dialect
    return {
        name: cls
        for name, cls in kinds().items()
        if cls.__users__ is None or (user is not None and user in cls.__users__)
    }


def own_attributes_of(
    session: Session | None = None, kind: type[Entity] | None = None
) -> dict[str, Attribute]:
    """Return the attributes that some kinds have of their own, by name; null for entities of other kinds."""
    known = kinds_of(session).values()
    found: dict[str, Attribute] = {}
    for cls in known:
        if kind is None or issubclass(cls, kind):
            for own in own_attributes(cls).values():
                found.setdefault(own.name, _own(own))
    return found


def _own(own: OwnAttribute) -> Attribute:
    """Make the attribute of a kind: in a column or, for a registered kind, in the entity's JSON."""

    def value(scope: Scope, run: int | None) -> ColumnElement[Any]:
        if own.name in Entity.__table__.c:
            typed: ColumnElement[Any] = scope.entity.c[own.name]
            return typed
        told = scope.entity.c.own[own.name]
        said: ColumnElement[Any] = told.as_string() if own.unit is None else told.as_float()
        return said

    return Attribute(own.name, own.unit, own.definition, value)
