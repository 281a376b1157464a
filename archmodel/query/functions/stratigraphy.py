"""Query functions on stratigraphy: earlier and later units, units above and below, contradictions with dates.

The order of units is computed once in a query; of a loop between several authors there is none, and the error names it.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from sqlalchemy import or_, select

from archmodel.query.dated import load_dates
from archmodel.query.functions.relations import with_parts
from archmodel.query.functions.usages import Ask, Condition, only, tokens
from archmodel.query.grammar import Call
from archmodel.query.inherited import held
from archmodel.query.names import meant
from archmodel.query.scope import Context, Scope, StructureScope, among
from archmodel.query.tokens import Token, complaint
from archmodel.store.bulk import batches
from archmodel.stratigraphy.dates import contradictions
from archmodel.stratigraphy.order import Link, Order, order_of
from archmodel.stratigraphy.stored import load_drawn, load_links, load_units, with_years
from archmodel.tables.entities import Entity
from archmodel.tables.relations import Membership
from archmodel.tables.structures import Structure
from ground.errors import UsageError

Where = Scope | StructureScope


@dataclass(frozen=True)
class _Matrix:
    """Units of a database in their order.

    Attributes
    ----------
    links : relations that are stated
    order : of all units
    groups : first of the equal units of each code
    """

    links: tuple[Link, ...]
    order: Order
    groups: Mapping[str, str]


def in_time(later: bool) -> Callable[[Where, Call, Ask], Condition]:
    """Test for units that came later, or earlier, than some others, by any chain of relations."""

    def sql(scope: Where, call: Call, ask: Ask) -> Condition:
        """Return the condition of such a unit."""
        matrix = _matrix(scope.context, call)
        order, wanted = matrix.order, _groups(scope.context, matrix, call, ask)
        places = {unit: 1 << k for k, unit in enumerate(order.units)}
        if later:
            bits = sum(places[unit] for unit in wanted)
            units = [unit for unit in order.units if order.earlier[unit] & bits]
        else:
            reach = 0
            for unit in wanted:
                reach |= order.earlier[unit]
            units = [unit for unit in order.units if reach & places[unit]]
        return _is_one_of(scope, _codes(order, units))

    return sql


def on_one_another(upwards: bool) -> Callable[[StructureScope, Call, Ask], Condition]:
    """Test for units that lie above, or below, some others, directly or through units between them."""

    def sql(scope: StructureScope, call: Call, ask: Ask) -> Condition:
        """Return the condition of such a unit."""
        matrix = _matrix(scope.context, call)
        steps: dict[str, set[str]] = {}
        for link in matrix.links:
            if link.relation == "above":
                ends = matrix.groups[link.target], matrix.groups[link.subject]
                steps.setdefault(ends[0 if upwards else 1], set()).add(ends[1 if upwards else 0])
        wanted = _groups(scope.context, matrix, call, ask)
        units, front = set[str](), set(wanted)
        while front:
            front = {unit for lower in front for unit in steps.get(lower, ())} - units
            units |= front
        return _is_one_of(scope, _codes(matrix.order, units))

    return sql


def contradicted(scope: Where, call: Call, ask: Ask) -> Condition:
    """Test for units whose relations and dates cannot both be right."""
    tokens(call, 0)
    matrix = _matrix(scope.context, call)
    session = scope.context.session
    dates = with_years(load_dates(session, list(matrix.groups)), load_drawn(session))
    wrong = contradictions(matrix.order, matrix.links, dates)
    return _is_one_of(scope, {code for pair in wrong for code in (pair.unit, pair.target)})


def _matrix(context: Context, call: Call) -> _Matrix:
    """Return the order of all units, which is put together once in a query."""

    def make() -> _Matrix:
        """Load relations and units, and order them."""
        links = tuple(load_links(context.session))
        try:
            order = order_of(load_units(context.session), links)
        except UsageError as error:
            remedy = f"{error.remedy}; see: moma matrix"
            raise complaint(call.function, f"units have no order: {error.what}", remedy) from None
        return _Matrix(links, order, {code: unit for unit, codes in order.equal.items() for code in codes})

    matrix: _Matrix = context.once("matrix", make)
    return matrix


def _groups(context: Context, matrix: _Matrix, call: Call, ask: Ask) -> set[str]:
    """Return the units that the argument names, each by the first of its equals.

    Raises
    ------
    QueryError
        if a code is that of no unit
    """
    argument = only(call, needed=True)
    if isinstance(argument, Token):
        if argument.text not in matrix.groups:
            what = f"{argument.text[:40]!r} is in no stratigraphic relation"
            raise complaint(argument, what, meant(argument.text, matrix.groups, "the units"))
        return {matrix.groups[argument.text]}
    assert argument is not None
    rows = context.alias(Structure)
    asked = ask(StructureScope(context, rows), argument)
    codes = context.session.scalars(select(rows.c.code).where(held(rows), asked))
    return {matrix.groups[code] for code in codes if code in matrix.groups}


def _codes(order: Order, units: Iterable[str]) -> set[str]:
    return {code for unit in units for code in order.equal[unit]}


def _is_one_of(scope: Where, codes: Iterable[str]) -> Condition:
    """Test for these units: a structure itself; a stone itself, or as a member of one or of a part of one."""
    session, wanted = scope.context.session, list(codes)
    structures = {
        number
        for batch in batches(wanted)
        for number in session.scalars(
            select(Structure.id).where(Structure.code.in_(batch), Structure.superseded_id.is_(None))
        )
    }
    if isinstance(scope, StructureScope):
        return among(scope.structure.c.id, structures)
    stones = {
        number
        for batch in batches(wanted)
        for number in session.scalars(select(Entity.id).where(Entity.code.in_(batch)))
    }
    parts = with_parts(scope.context, lambda whole: among(whole.c.id, structures))
    rows = scope.context.alias(Membership)
    members = select(rows.c.entity_id).where(held(rows), rows.c.structure_id.in_(select(parts.c.id)))
    return or_(among(scope.entity.c.id, stones), scope.entity.c.id.in_(members))
