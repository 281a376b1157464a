"""Attributes that queries can ask for, and their places in the tables."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Boolean, ColumnElement, func, null
from sqlalchemy.orm import Session

from archmodel.quantities import quantities_of
from archmodel.query.columns import (
    Compiler,
    Test,
    Value,
    any_mark,
    count,
    departure,
    different_marks,
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
from archmodel.tables.base import Base, StoneAttribute, declared_attributes
from archmodel.tables.entities import Entity, own_attributes
from archmodel.tables.hierarchy import kinds_in
from archmodel.tables.knowledge import Correction
from archmodel.tables.runs import EntityResult
from archmodel.tables.surveys import Measurement, Simplification


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
    order : years by which texts are compared with < and >; None where they have no order
    several : test of any of several values that it can have; None where it has one
    measure : what makes it of expressions; None where it is found at `value`
    vocabulary : whose terms its values are; None: texts that mean themselves
    """

    name: str
    unit: str | None
    definition: str
    value: Value
    of_run: bool = False
    words: tuple[str, ...] | None = None
    is_truth: bool = False
    order: Value | None = None
    several: Callable[[Scope, Test], ColumnElement[bool]] | None = None
    measure: Callable[[Any, Compiler], ColumnElement[Any]] | None = None
    vocabulary: str | None = None

    @property
    def is_number(self) -> bool:
        """True for a number, False for a text."""
        return self.unit is not None

    @property
    def type_name(self) -> str:
        """The unit; without one, whether the attribute is a text or true or false."""
        return self.unit or ("true/false" if self.is_truth else "text")


def _declared(cls: type[Base], place: Callable[[str], Value], of_run: bool = False) -> Iterator[Attribute]:
    """Yield the attributes that the columns of a class declare, and the named numbers among their values."""
    declared = {column.name: attribute for column, attribute in declared_attributes(cls.__mapper__)}
    for column in cls.__mapper__.local_table.columns:
        if (attribute := declared.get(column.name)) is not None:
            is_truth = isinstance(column.type, Boolean)
            value = place(column.name)
            yield Attribute(
                attribute.name, attribute.unit, attribute.definition, value, of_run, attribute.words, is_truth
            )
        elif cls is EntityResult and column.name == "values":
            for name, quantity in quantities_of("stone").items():
                if name not in declared:
                    yield Attribute(name, quantity.unit, quantity.meaning, of_values(name), of_run)


_MEASURED = (
    *_declared(Measurement, of_measurement),
    Attribute(
        "survey", None, "name of the survey that measured it", lambda scope, run: scope.survey().c.name
    ),
    Attribute(
        "measurements",
        "-",
        "how often it was measured, or its solid made anew",
        rows(Measurement, "entity_id", now=False),
    ),
    Attribute(
        "moved",
        "m",
        "distance from its place in an earlier campaign: that of moved_since, else the first that measured it",
        lambda scope, run: scope.displacement().c.moved,
    ),
    Attribute(
        "moved_sigma",
        "m",
        "standard deviation of that; moved/moved_sigma is its significance",
        lambda scope, run: scope.displacement().c.moved_sigma,
    ),
)

_KNOWN = (
    Attribute(
        "phase",
        None,
        "name of the phase that it is of; < and > compare the years in which phases begin",
        lambda scope, run: scope.phase().c.name,
        order=lambda scope, run: func.coalesce(scope.phase().c.begins, scope.phase().c.ends),
    ),
    Attribute(
        "phase_author",
        None,
        "author of the opinion on its phase that holds",
        lambda scope, run: scope.opinions("of_phase").holding("author"),
    ),
    Attribute(
        "phase_begins",
        "year",
        "of that phase, at the earliest",
        lambda scope, run: scope.phase().c.begins,
    ),
    Attribute("phase_ends", "year", "of that phase, at the latest", lambda scope, run: scope.phase().c.ends),
    Attribute(
        "material",
        None,
        "name of its material",
        lambda scope, run: scope.material().c.name,
        vocabulary="material",
    ),
    Attribute(
        "material_author",
        None,
        "author of the opinion on its material that holds",
        lambda scope, run: scope.opinions("made_of").holding("author"),
    ),
    Attribute("density", "kg/m³", "of its material", of_material("density")),
    Attribute("tensile_strength", "Pa", "of its material", of_material("tensile_strength")),
    Attribute("compressive_strength", "Pa", "of its material", of_material("compressive_strength")),
    Attribute("marks", "-", "mason marks on it", of_marks(different_marks)),
    Attribute(
        "mark",
        None,
        "name of its mason mark, the first by the alphabet; a comparison is true of any of several",
        of_marks(lambda statement: func.min(statement.c.sign)),
        several=any_mark,
        vocabulary="mark",
    ),
    Attribute("observations", "-", "observations of damage and change", of_observations(count)),
    Attribute(
        "severity",
        "-",
        "largest severity observed, from 0 (traces) to 4 (lost, or about to be)",
        of_observations(lambda statement: func.max(statement.c.severity)),
    ),
    Attribute("documents", "-", "documents, drawings and photographs that treat it", documents),
    Attribute(
        "corrections", "-", "attributes of it that were corrected", rows(Correction, "entity_id", now=False)
    ),
    Attribute("structures", "-", "structures that it is a member of", structures),
)

CANON = Attribute(
    "departs_from_canon",
    "-",
    "how far it misses the canonical proportions of its kind, in tolerances; 0 if it has them",
    lambda scope, run: null(),
    measure=departure,
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
    *_declared(EntityResult, of_result, of_run=True),
    *_declared(Simplification, of_simplification, of_run=True),
    Attribute(
        "outcome",
        None,
        "equilibrium, settled, moving, collapsed, undecided or interrupted",
        lambda scope, run: scope.run(run).c.outcome,
        of_run=True,
    ),
    Attribute("scene", None, "name of the scene", lambda scope, run: scope.run(run).c.scene, of_run=True),
    Attribute("run", "-", "number of the run that these are of", of_result("run_id")),
    Attribute("runs", "-", "runs that hold it", rows(EntityResult, "entity_id", now=False)),
)

ATTRIBUTES: Mapping[str, Attribute] = {
    attribute.name: attribute
    for attribute in (*_declared(Entity, of_entity), *_MEASURED, CANON, *_KNOWN, *_RELATED, *_COMPUTED)
}
"""The attributes of every entity by name."""


def attributes_of(session: Session | None = None, kind: type[Entity] | None = None) -> dict[str, Attribute]:
    """Return the attributes of every entity, and those that some kinds have of their own.

    Parameters
    ----------
    session : of a database whose registered kinds count too
    kind : only own attributes that an entity of this kind can have; None: those of all kinds
    """
    attributes = dict(ATTRIBUTES)
    for name, attribute in own_attributes_of(session, kind).items():
        attributes.setdefault(name, attribute)
    return attributes


def own_attributes_of(
    session: Session | None = None, kind: type[Entity] | None = None
) -> dict[str, Attribute]:
    """Return the attributes that some kinds have of their own, by name; null for entities of other kinds."""
    classes = kinds_in(session, Entity).values()
    attributes: dict[str, Attribute] = {}
    for cls in classes:
        if kind is None or issubclass(cls, kind):
            for attribute in own_attributes(cls).values():
                attributes.setdefault(attribute.name, _own(attribute))
    return attributes


def _own(attribute: StoneAttribute) -> Attribute:
    """Make the attribute of a kind: in a column or, for a registered kind, in the entity's JSON."""

    def value(scope: Scope, run: int | None) -> ColumnElement[Any]:
        """Return the expression of the attribute in SQL."""
        if attribute.name in Entity.__table__.c:
            typed: ColumnElement[Any] = scope.entity.c[attribute.name]
            return typed
        stored = scope.entity.c.own[attribute.name]
        converted: ColumnElement[Any] = stored.as_string() if attribute.unit is None else stored.as_float()
        return converted

    return Attribute(attribute.name, attribute.unit, attribute.definition, value)
