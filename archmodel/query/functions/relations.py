"""Query functions on relations between stones and membership in structures."""

from collections.abc import Callable
from typing import Any

from sqlalchemy import ColumnElement, FromClause, Select, exists, or_, select, union_all

from archmodel.query.functions.usages import Ask, Condition, only
from archmodel.query.grammar import Call, Node
from archmodel.query.inherited import held
from archmodel.query.names import stone_named, structure_named
from archmodel.query.scope import Context, Scope, StructureScope
from archmodel.query.tokens import Token
from archmodel.tables.relations import SYMMETRIC, Membership, Relation
from archmodel.tables.structures import Structure

Wanted = Callable[[ColumnElement[int]], Condition]


def related(name: str, subject: str, other: str) -> Callable[[Scope, Call, Ask], Condition]:
    """Test for a stored relation of the entity on the side `subject` to the one on the side `other`."""
    sides = ((subject, other), (other, subject)) if name in SYMMETRIC else ((subject, other),)

    def sql(scope: Scope, call: Call, ask: Ask) -> Condition:
        """Return the condition that a stone has such a relation to a stone that is asked for."""
        wanted = _others(scope.context, only(call), ask)
        parts: list[Select[Any]] = []
        for mine, theirs in sides:
            rows = scope.context.alias(Relation)
            chosen = select(rows.c[mine]).where(rows.c.kind == name, held(rows))
            parts.append(chosen if wanted is None else chosen.where(wanted(rows.c[theirs])))
        if wanted is not None:
            return scope.entity.c.id.in_(union_all(*parts) if len(parts) > 1 else parts[0])
        mine_first = (selected.where(selected.selected_columns[0] == scope.entity.c.id) for selected in parts)
        return or_(*(selected.correlate(scope.entity).exists() for selected in mine_first))

    return sql


def _others(context: Context, argument: Token | Node | None, ask: Ask) -> Wanted | None:
    """Return the condition on the number of the other entity; None: any will do.

    A nested expression is a table of its own before the statement, which is made once and not for every entity;
    selects within selects would be too deep for SQLite's parser.
    """
    if argument is None:
        return None
    if isinstance(argument, Token):
        number = stone_named(context, argument).id
        return lambda column: column == number
    there = Scope.elsewhere(context)
    condition = ask(there, argument)
    numbers = there.joined(select(there.entity.c.id)).where(condition).cte()
    return lambda column: column.in_(select(numbers.c.id))


def load_path(step_from: str, step_to: str) -> Callable[[Scope, Call, Ask], Condition]:
    """Test for a place on the load path from the given entities, along `step_from` → `step_to`, as often as it goes."""

    def sql(scope: Scope, call: Call, ask: Ask) -> Condition:
        """Return the condition that a path of relations leads to a stone that is asked for."""
        wanted = _others(scope.context, only(call, needed=True), ask)
        assert wanted is not None
        first, further = scope.context.alias(Relation), scope.context.alias(Relation)
        path = (
            select(first.c[step_to].label("entity_id"))
            .where(first.c.kind == "rests_on", held(first), wanted(first.c[step_from]))
            .cte(recursive=True)
        )
        # UNION, not UNION ALL: each entity once, so that it ends even if stones rest on one another.
        path = path.union(
            select(further.c[step_to])
            .join_from(path, further, further.c[step_from] == path.c.entity_id)
            .where(further.c.kind == "rests_on", held(further))
        )
        return scope.entity.c.id.in_(select(path.c.entity_id))

    return sql


def member_of(scope: Scope, call: Call, ask: Ask) -> Condition:
    """Test for membership in a structure, or in a part of it."""
    rows = scope.context.alias(Membership)
    argument = only(call)
    if argument is None:
        structure = scope.context.alias(Structure)
        source = rows.join(structure, structure.c.id == rows.c.structure_id)
        held_now = (held(rows), held(structure), rows.c.entity_id == scope.entity.c.id)
        return exists().select_from(source).where(*held_now).correlate(scope.entity)
    parts = _named_with_parts(scope.context, argument, ask)
    members = select(rows.c.entity_id).where(held(rows), rows.c.structure_id.in_(select(parts.c.id)))
    return scope.entity.c.id.in_(members)


def _named_with_parts(context: Context, argument: Token | Node, ask: Ask) -> FromClause:
    """Return the numbers of the given structures and of their parts."""

    def wanted(whole: FromClause) -> Condition:
        """Test for a structure that the argument names."""
        if isinstance(argument, Token):
            return whole.c.id == structure_named(context, argument)
        return ask(StructureScope(context, whole), argument)

    return with_parts(context, wanted)


def with_parts(context: Context, wanted: Callable[[FromClause], Condition]) -> FromClause:
    """Return the numbers of the structures that satisfy a condition, and of their parts."""
    whole, child = context.alias(Structure), context.alias(Structure)
    parts = select(whole.c.id).where(held(whole), wanted(whole)).cte(recursive=True)
    return parts.union(
        select(child.c.id).join_from(parts, child, child.c.parent_id == parts.c.id).where(held(child))
    )


def part_of(scope: StructureScope, call: Call, ask: Ask) -> Condition:
    """Test for being a structure, or a part of it."""
    argument = only(call)
    if argument is None:
        return scope.structure.c.parent_id.is_not(None)
    parts = _named_with_parts(scope.context, argument, ask)
    return scope.structure.c.id.in_(select(parts.c.id))
