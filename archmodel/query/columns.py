"""Sources of attributes: columns of joined tables, a search for each entity, or a measure of expressions."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from sqlalchemy import (
    ColumnElement,
    Double,
    FromClause,
    and_,
    case,
    distinct,
    func,
    literal,
    null,
    or_,
    select,
)

from archmodel.query.grammar import (
    All,
    Amount,
    AmountComparison,
    AnyOf,
    Comparison,
    Node,
    Not,
    Term,
    parse,
)
from archmodel.query.inherited import held, observations_of, statements_of
from archmodel.query.scope import Scope, StructureScope
from archmodel.tables.knowledge import Statement
from archmodel.tables.registered import TOLERANCE, Proportions, canons
from archmodel.tables.relations import Membership, Relation
from archmodel.tables.structures import Structure
from ground.errors import QueryError

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
        """Return the number of rows of a stone."""
        rows = scope.context.alias(table)
        count = select(func.count()).select_from(rows).where(rows.c[column] == scope.entity.c.id)
        return (count.where(held(rows)) if now else count).correlate(scope.entity).scalar_subquery()

    return value


def of_relations(what: Callable[[FromClause], ColumnElement[Any]], *sides: str, kind: str) -> Value:
    """Aggregate over all relations of a kind in which the entity stands on one of the sides."""

    def value(scope: Scope, run: int | None) -> ColumnElement[Any]:
        """Return what the relations of a stone say on either side."""
        parts: list[ColumnElement[Any]] = []
        for side in sides:
            rows = scope.context.alias(Relation)
            chosen = select(what(rows)).where(
                rows.c[side] == scope.entity.c.id, rows.c.kind == kind, held(rows)
            )
            parts.append(chosen.correlate(scope.entity).scalar_subquery())
        total = parts[0]
        for counted in parts[1:]:
            total = total + counted
        return total

    return value


def count(rows: FromClause) -> ColumnElement[int]:
    """Return the SQL count of rows."""
    return func.count(rows.c.id)


def different_marks(mark: FromClause) -> ColumnElement[Any]:
    """Count marks by sign and place: what two authors see is one mark."""
    return func.count(distinct(mark.c.sign + literal("\n") + func.coalesce(mark.c.place, "")))


def any_mark(scope: Scope, test: Test) -> ColumnElement[bool]:
    """Test for a mason mark of the entity whose sign passes."""
    mark = scope.context.alias(Statement)
    marks = select(mark.c.id).where(
        mark.c.entity_id == scope.entity.c.id, mark.c.kind == "mason_mark", held(mark), test(mark.c.sign)
    )
    return marks.correlate(scope.entity).exists()


def of_marks(what: Callable[[FromClause], ColumnElement[Any]]) -> Value:
    """Aggregate over the mason marks that the entity itself bears."""

    def value(scope: Scope, run: int | None) -> ColumnElement[Any]:
        """Return what the mason's marks of a stone say."""
        mark = scope.context.alias(Statement)
        marks = select(what(mark)).where(
            mark.c.entity_id == scope.entity.c.id, mark.c.kind == "mason_mark", held(mark)
        )
        return marks.correlate(scope.entity).scalar_subquery()

    return value


def of_observations(what: Callable[[FromClause], ColumnElement[Any]]) -> Value:
    """Aggregate over all observations that hold for the entity."""

    def value(scope: Scope, run: int | None) -> ColumnElement[Any]:
        """Return what the observations of a stone say."""
        statement, seen = observations_of(
            scope.context.alias, scope.entity, scope.context.statements_of_structures("observation")
        )
        return select(what(statement)).where(seen).correlate(scope.entity).scalar_subquery()

    return value


def documents(scope: Scope, run: int | None) -> ColumnElement[int]:
    """Count the documents that the statements about the entity name."""
    statement = scope.context.alias(Statement)
    named = statements_of(
        scope.context.alias,
        scope.entity,
        statement,
        scope.context.statements_of_structures(*DOCUMENTING),
        *DOCUMENTING,
    )
    count = select(func.count(distinct(statement.c.document_id))).where(named)
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


@dataclass(frozen=True)
class Compiler:
    """Makers of SQL for the parts of an expression.

    Attributes
    ----------
    test : condition of a node
    amount : number of a sum of terms
    """

    test: Callable[[Any, Node], ColumnElement[bool]]
    amount: Callable[[Any, Amount], ColumnElement[Any]]


def departure(scope: Scope | StructureScope, compiler: Compiler) -> ColumnElement[Any]:
    """Return how far it departs from the canonical proportions of its kind, in tolerances; null if it has none."""
    context = scope.context
    kind = scope.entity.c.kind if isinstance(scope, Scope) else scope.structure.c.kind
    kinds: dict[Proportions, list[str]] = {}
    for name, canon in context.once("canons", lambda: canons(context.session)).items():
        kinds.setdefault(canon, []).append(name)
    cases = []
    for canon, names in kinds.items():
        measure = _Departure(scope, compiler, TOLERANCE if canon.tolerance is None else canon.tolerance)
        try:
            cases.append((kind.in_(names), measure.of(parse(canon.expression))))
        except QueryError:
            continue  # of a kind of the other hierarchy
    return case(*cases, else_=null()) if cases else null()


@dataclass(frozen=True)
class _Departure:
    """Measure of how far an expression is from being true: 0 if it is, null if that is not known.

    A comparison of numbers departs by the missing share of its right side, over the tolerance. Of tests joined by
    and the largest counts, of tests joined by or the smallest. What is no number has no measure.
    """

    scope: Scope | StructureScope
    compiler: Compiler
    tolerance: float

    def of(self, node: Node, opposite: bool = False) -> ColumnElement[Any]:
        """Return the departure from a node, or from its opposite."""
        match node:
            case Not(operand):
                return self.of(operand, not opposite)
            case All(operands) | AnyOf(operands):
                parts = [self.of(operand, opposite) for operand in operands]
                return self._all(parts) if isinstance(node, All) is not opposite else self._any(parts)
            case AmountComparison(left, sign, right):
                return self._missing(left, sign, right, opposite)
            case Comparison(attribute, sign, value) if value.role in ("number", "word"):
                number = value.role == "number"
                term = Term(float(value.text)) if number else Term(1.0, value)
                try:
                    left = Amount((Term(1.0, attribute),), False)
                    return self._missing(left, sign, Amount((term,), False), opposite)
                except QueryError:
                    return self._truth(node, opposite)
            case _:
                return self._truth(node, opposite)

    def _truth(self, node: Node, opposite: bool) -> ColumnElement[Any]:
        test = self.compiler.test(self.scope, Not(node) if opposite else node)
        return case((test, literal(0.0, Double)), else_=null())

    def _missing(self, left: Amount, sign: str, right: Amount, opposite: bool) -> ColumnElement[Any]:
        amounts = [self.compiler.amount(self.scope, measure) for measure in (left, right)]
        larger = amounts[0] - amounts[1]
        missing = {"<": larger, "<=": larger, ">": -larger, ">=": -larger}.get(sign)
        if missing is None:
            equal = (sign == "=") is not opposite
            missing = func.abs(larger) if equal else case((larger != 0.0, 0.0), else_=null())
        elif opposite:
            missing = -missing
        unit = func.nullif(func.abs(amounts[1]) * self.tolerance, 0.0)
        return case((missing > 0.0, missing / unit), (missing <= 0.0, literal(0.0, Double)), else_=null())

    def _all(self, parts: list[ColumnElement[Any]]) -> ColumnElement[Any]:
        largest = self._extreme("max", "greatest", [func.coalesce(measure, -1.0) for measure in parts])
        unknown = or_(*(measure.is_(None) for measure in parts))
        return case((largest > 0.0, largest), (unknown, null()), else_=literal(0.0, Double))

    def _any(self, parts: list[ColumnElement[Any]]) -> ColumnElement[Any]:
        complete = and_(*(measure.is_not(None) for measure in parts))
        smallest = self._extreme("min", "least", parts)
        met = or_(*(measure == 0.0 for measure in parts))
        return case((met, literal(0.0, Double)), (complete, smallest), else_=null())

    def _extreme(self, sqlite: str, postgresql: str, parts: list[ColumnElement[Any]]) -> ColumnElement[Any]:
        dialect = self.scope.context.session.get_bind().dialect.name
        extreme: ColumnElement[Any] = getattr(func, sqlite if dialect == "sqlite" else postgresql)(*parts)
        return extreme
