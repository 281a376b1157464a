"""Attributes of structures that expressions and lists can ask for."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from sqlalchemy import ColumnElement, and_, case, func, select

from archmodel.quantities import quantities_of
from archmodel.query.attributes import CANON, Attribute
from archmodel.query.inherited import held
from archmodel.query.scope import StructureScope
from archmodel.tables.entities import Entity, Header, Stretcher
from archmodel.tables.hierarchy import kinds_below
from archmodel.tables.knowledge import Material, OfPhase, Phase, Statement
from archmodel.tables.opinions import preference, rule_of
from archmodel.tables.relations import Membership
from archmodel.tables.runs import StructureResult
from archmodel.tables.structures import Structure, structure_kinds

Source = Callable[[StructureScope, int | None], ColumnElement[Any]]


def _own(name: str) -> Source:
    """Return a source in a column of the structure."""
    return lambda scope, run: scope.structure.c[name]


def _parent(scope: StructureScope, run: int | None) -> ColumnElement[str]:
    """Return the code of the structure that it is a part of."""
    whole = scope.context.alias(Structure)
    parent = select(whole.c.code).where(whole.c.id == scope.structure.c.parent_id)
    return parent.correlate(scope.structure).scalar_subquery()


def _members(scope: StructureScope, run: int | None) -> ColumnElement[int]:
    """Count the entities that are its members, without those of its parts."""
    rows = scope.context.alias(Membership)
    count = select(func.count(rows.c.id)).where(rows.c.structure_id == scope.structure.c.id, held(rows))
    return count.correlate(scope.structure).scalar_subquery()


def _bond(scope: StructureScope, run: int | None) -> ColumnElement[str]:
    """Return whether its members are headers, stretchers or both; null if they are neither."""
    rows, stones = scope.context.alias(Membership), scope.context.alias(Entity)
    headers, stretchers = (
        func.sum(case((stones.c.kind.in_(kinds_below(cls)), 1), else_=0)) for cls in (Header, Stretcher)
    )
    bond = case(
        (and_(headers > 0, stretchers > 0), "mixed"), (headers > 0, "header"), (stretchers > 0, "stretcher")
    )
    agreed = (
        select(bond)
        .select_from(rows)
        .join(stones, stones.c.id == rows.c.entity_id)
        .where(rows.c.structure_id == scope.structure.c.id, held(rows))
    )
    return agreed.correlate(scope.structure).scalar_subquery()


def _parts(scope: StructureScope, run: int | None) -> ColumnElement[int]:
    """Count the structures that are parts of it."""
    rows = scope.context.alias(Structure)
    count = select(func.count(rows.c.id)).where(rows.c.parent_id == scope.structure.c.id, held(rows))
    return count.correlate(scope.structure).scalar_subquery()


def _shape(name: str) -> Source:
    """Return a source in the shape of an arch, as its voussoirs were measured."""

    def value(scope: StructureScope, run: int | None) -> ColumnElement[float]:
        """Return the number of the structure; null where it has no shape."""
        context = scope.context

        def shapes() -> Mapping[int, Sequence[float]]:
            """Measure all arches [m]."""
            # numpy is loaded only by those who ask
            from archmodel.store.arch_shapes import arch_shapes

            return {
                number: (shape.span, shape.rise) for number, shape in arch_shapes(context.session).items()
            }

        rows = context.computed("arches", ("span", "rise"), shapes)
        return select(rows.c[name]).where(rows.c.id == scope.structure.c.id).scalar_subquery()

    return value


def _opinion(about: str, column: str, named: type[Phase] | type[Material]) -> Source:
    """Return the name that the opinion which holds gives: its own, else that of the nearest structure around it."""

    def value(scope: StructureScope, run: int | None) -> ColumnElement[str]:
        """Return the statement of the author who is followed."""
        context = scope.context
        rule = context.once(("rule", about), lambda: rule_of(context.session, about))
        reach, statement, row = (
            context.statements_of_structures(about),
            context.alias(Statement),
            context.alias(named),
        )
        name = (
            select(row.c.name)
            .select_from(reach)
            .join(statement, statement.c.id == reach.c.statement_id)
            .join(row, row.c.id == statement.c[column])
            .where(reach.c.structure_id == scope.structure.c.id)
            .order_by(reach.c.distance, *preference(rule, statement, context.alias(Statement)))
            .limit(1)
        )
        return name.correlate(scope.structure).scalar_subquery()

    return value


def _result(name: str) -> Source:
    """Return a source in a named number of the structure's result: in a run, or in the latest that has it."""

    def value(scope: StructureScope, run: int | None) -> ColumnElement[float]:
        """Return the result of a run, or of the latest."""
        rows, newest = scope.context.alias(StructureResult), scope.context.alias(StructureResult)
        number = scope.context.run if run is None else run
        latest = select(func.max(newest.c.run_id)).where(newest.c.structure_id == scope.structure.c.id)
        wanted = latest.correlate(scope.structure).scalar_subquery() if number is None else number
        of_run = (rows.c.structure_id == scope.structure.c.id, rows.c.run_id == wanted)
        result = select(rows.c["values"][name].as_float()).where(*of_run)
        return result.correlate(scope.structure).scalar_subquery()

    return value


def _attribute(
    name: str,
    unit: str | None,
    meaning: str,
    source: Any,
    words: tuple[str, ...] | None = None,
    of_run: bool = False,
) -> Attribute:
    return Attribute(name, unit, meaning, source, words=words, of_run=of_run)


STRUCTURE_ATTRIBUTES: Mapping[str, Attribute] = {
    attribute.name: attribute
    for attribute in (
        _attribute("code", None, "its name", _own("code")),
        _attribute("kind", None, "its own kind, e.g. arch", _own("kind")),
        _attribute("title", None, "its name in words", _own("title")),
        _attribute("number", "-", "its place among its like, from the ground", _own("number")),
        _attribute("side", None, "outer or inner, of a wall facing", _own("side"), ("outer", "inner")),
        _attribute("parent", None, "code of the structure that it is a part of", _parent),
        _attribute("parts", "-", "structures that are parts of it", _parts),
        _attribute(
            "bond",
            None,
            "of its stones: header, stretcher, or mixed",
            _bond,
            ("header", "stretcher", "mixed"),
        ),
        _attribute("members", "-", "stones that are its members, without those of its parts", _members),
        _attribute(
            "phase",
            None,
            "name of the phase that it is of",
            _opinion(OfPhase.__kind__, "phase_id", Phase),
        ),
        Attribute(
            "material",
            None,
            "name of its material",
            _opinion("made_of", "material_id", Material),  # type: ignore[arg-type]
            vocabulary="material",
        ),
        _attribute("span", "m", "of an arch: between the springings of its intrados", _shape("span")),
        _attribute(
            "rise", "m", "of an arch: from its springings up to the crown of its intrados", _shape("rise")
        ),
        CANON,
        *(
            _attribute(quantity.name, quantity.unit, quantity.meaning, _result(quantity.name), of_run=True)
            for quantity in quantities_of(*structure_kinds()).values()
        ),
    )
}
"""Attributes of a structure, in lists of structures and within ``member_of(…)``."""
