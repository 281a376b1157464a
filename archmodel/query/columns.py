"""Sources of attributes: columns of joined tables, or a search for each entity."""

from collections.abc import Callable
from typing import Any

from sqlalchemy import ColumnElement, FromClause, distinct, func, literal, select

from archmodel.query.inherited import held, observations_of, statements_of
from archmodel.query.scope import Scope
from archmodel.tables.knowledge import Statement
from archmodel.tables.relations import Membership, Relation
from archmodel.tables.structures import Structure

__all__ = [
    "DOCUMENTING",
    "Test",
    "Value",
    "any_mark",
    "count",
    "different_marks",
    "documents",
    "of_entity",
    "of_marks",
    "of_material",
    "of_measurement",
    "of_observations",
    "of_relations",
    "of_result",
    "of_simplification",
    "of_values",
    "rows",
    "structures",
]

Value = Callable[[Scope, int | None], ColumnElement[Any]]

Test = Callable[[ColumnElement[Any]], ColumnElement[bool]]

DOCUMENTING = ("made_of", "of_phase", "mason_mark", "observation", "depth", "reference", "note", "decision")
"""Kinds of statements that can name a document: all."""


def of_entity(name: str) -> Value:
    """Return a source in a column of the entity."""
    return lambda scope, run: scope.entity.c[name]


def of_measurement(name: str) -> Value:
    """Return a source in a column of the entity's measurement."""
    return lambda scope, run: scope.measurement().c[name]


def of_result(name: str) -> Value:
    """Return a source in a column of the entity's result in a run."""
    return lambda scope, run: scope.result(run).c[name]


def of_simplification(name: str) -> Value:
    """Return a source in a column of the solid that stood for the entity in a run."""
    return lambda scope, run: scope.simplification(run).c[name]


def of_values(name: str) -> Value:
    """Return a source in a named number of the entity's result in a run."""
    return lambda scope, run: scope.result(run).c["values"][name].as_float()


def of_material(name: str) -> Value:
    """Return a source in a property of the entity's material."""
    return lambda scope, run: scope.material_property(name).c.value


def rows(table: type[Any], column: str, *, now: bool = True) -> Value:
    """Count the rows of a table that name the entity in a column."""

    def value(scope: Scope, run: int | None) -> ColumnElement[int]:
        rows = scope.context.alias(table)
        count = select(func.count()).select_from(rows).where(rows.c[column] == scope.entity.c.id)
        return (count.where(held(rows)) if now else count).correlate(scope.entity).scalar_subquery()

    return value


def of_relations(what: Callable[[FromClause], ColumnElement[Any]], *sides: str, kind: str) -> Value:
    """Aggregate over all relations of a kind in which the entity stands on one of the sides."""

    def value(scope: Scope, run: int | None) -> ColumnElement[Any]:
        parts: list[ColumnElement[Any]] = []
        for side in sides:
            rows = scope.context.alias(Relation)
            chosen = select(what(rows)).where(
                rows.c[side] == scope.entity.c.id, rows.c.kind == kind, held(rows)
            )
            parts.append(chosen.correlate(scope.entity).scalar_subquery())
        total = parts[0]
        for part in parts[1:]:
            total = total + part
        return total

    return value


def count(rows: FromClause) -> ColumnElement[int]:
    """Return the SQL count of rows."""
    return func.count(rows.c.id)


def different_marks(said: FromClause) -> ColumnElement[Any]:
    """Count marks by sign and place: what two authors see is one mark."""
    return func.count(distinct(said.c.sign + literal("\n") + func.coalesce(said.c.place, "")))


def any_mark(scope: Scope, test: Test) -> ColumnElement[bool]:
    """Test for a mason mark of the entity whose sign passes."""
    said = scope.context.alias(Statement)
    marks = select(said.c.id).where(
        said.c.entity_id == scope.entity.c.id, said.c.kind == "mason_mark", held(said), test(said.c.sign)
    )
    return marks.correlate(scope.entity).exists()


def of_marks(what: Callable[[FromClause], ColumnElement[Any]]) -> Value:
    """Aggregate over the mason marks that the entity itself bears."""

    def value(scope: Scope, run: int | None) -> ColumnElement[Any]:
        said = scope.context.alias(Statement)
        marks = select(what(said)).where(
            said.c.entity_id == scope.entity.c.id, said.c.kind == "mason_mark", held(said)
        )
        return marks.correlate(scope.entity).scalar_subquery()

    return value


def of_observations(what: Callable[[FromClause], ColumnElement[Any]]) -> Value:
    """Aggregate over all observations that hold for the entity."""

    def value(scope: Scope, run: int | None) -> ColumnElement[Any]:
        said, seen = observations_of(
            scope.context.alias, scope.entity, scope.context.statements_of_structures("observation")
        )
        return select(what(said)).where(seen).correlate(scope.entity).scalar_subquery()

    return value


def documents(scope: Scope, run: int | None) -> ColumnElement[int]:
    """Count the documents that the statements about the entity name."""
    said = scope.context.alias(Statement)
    told = statements_of(
        scope.context.alias,
        scope.entity,
        said,
        scope.context.statements_of_structures(*DOCUMENTING),
        *DOCUMENTING,
    )
    count = select(func.count(distinct(said.c.document_id))).where(told)
    return count.correlate(scope.entity).scalar_subquery()


def structures(scope: Scope, run: int | None) -> ColumnElement[int]:
    """Count the structures of which the entity is a member."""
    rows, structure = scope.context.alias(Membership), scope.context.alias(Structure)
    count = (
        select(func.count())
        .select_from(rows.join(structure, structure.c.id == rows.c.structure_id))
        .where(rows.c.entity_id == scope.entity.c.id, held(rows), held(structure))
    )
    return count.correlate(scope.entity).scalar_subquery()
