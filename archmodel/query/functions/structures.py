"""Query functions on structures: stones that they have, and courses that differ from the one below."""

from sqlalchemy import ColumnElement, and_, distinct, func, or_, select

from archmodel.query.functions.usages import Ask, Condition, only, tokens
from archmodel.query.grammar import Call
from archmodel.query.inherited import held
from archmodel.query.names import meant, stone_named
from archmodel.query.scope import Scope, StructureScope
from archmodel.query.structures import STRUCTURE_ATTRIBUTES
from archmodel.query.tokens import Token, complaint
from archmodel.tables.knowledge import Statement
from archmodel.tables.opinions import DISPUTABLE
from archmodel.tables.relations import Membership
from archmodel.tables.structures import Structure


def has(scope: StructureScope, call: Call, ask: Ask) -> Condition:
    """Test for a stone among the members of a structure, or of its parts."""
    context, argument = scope.context, only(call)
    rows, child = context.alias(Membership), context.alias(Structure)
    members = select(rows.c.structure_id).where(held(rows))
    if isinstance(argument, Token):
        members = members.where(rows.c.entity_id == stone_named(context, argument).id)
    elif argument is not None:
        there = Scope.elsewhere(context)
        condition = ask(there, argument)
        numbers = there.joined(select(there.entity.c.id)).where(condition).cte()
        members = members.where(rows.c.entity_id.in_(select(numbers.c.id)))
    # from the structures of such members upwards, to all that contain them
    reach = members.cte(recursive=True)
    reach = reach.union(
        select(child.c.parent_id)
        .join_from(reach, child, child.c.id == reach.c.structure_id)
        .where(held(child), child.c.parent_id.is_not(None))
    )
    return scope.structure.c.id.in_(select(reach.c.structure_id))


def changes(scope: StructureScope, call: Call, ask: Ask) -> Condition:
    """Test for an attribute that differs from that of the structure of its kind below, with the number before."""
    (token,) = tokens(call, 1)
    if (attribute := STRUCTURE_ATTRIBUTES.get(token.text.lower())) is None:
        remedy = meant(token.text, STRUCTURE_ATTRIBUTES, "the attributes")
        raise complaint(token, f"unknown attribute {token.text[:40]!r}", remedy)
    here, below = scope.structure, scope.context.alias(Structure)
    lower = StructureScope(scope.context, below)
    same = and_(
        held(below),
        below.c.kind == here.c.kind,
        func.coalesce(below.c.parent_id, 0) == func.coalesce(here.c.parent_id, 0),
        func.coalesce(below.c.side, "") == func.coalesce(here.c.side, ""),
        below.c.number == here.c.number - 1,
    )
    differ = attribute.value(lower, None) != attribute.value(scope, None)  # type: ignore[arg-type]
    return select(below.c.id).where(same, differ).correlate(here).exists()


def disputed_structure(scope: StructureScope, call: Call, ask: Ask) -> Condition:
    """Test for opinions on a structure that differ: its own or, if it has none, of the nearest structure around it."""
    values = tokens(call, 0, 1)
    named = {"phase": "of_phase", "material": "made_of"}
    if values and values[0].text.lower() not in named:
        remedy = meant(values[0].text, named, "they")
        raise complaint(values[0], f"there are no opinions on {values[0].text[:40]!r}", remedy)
    kinds = [named[values[0].text.lower()]] if values else list(named.values())
    return or_(*(_differ(scope, kind) for kind in kinds))


def _differ(scope: StructureScope, about: str) -> ColumnElement[bool]:
    context, here = scope.context, scope.structure
    reach, statement = context.statements_of_structures(about), context.alias(Statement)
    nearest = select(func.min(reach.c.distance)).where(reach.c.structure_id == here.c.id).correlate(here)
    count = (
        select(func.count(distinct(statement.c[DISPUTABLE[about]])))
        .select_from(reach)
        .join(statement, statement.c.id == reach.c.statement_id)
        .where(reach.c.structure_id == here.c.id, reach.c.distance == nearest.scalar_subquery())
    )
    return count.correlate(here).scalar_subquery() > 1
