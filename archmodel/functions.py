"""The functions of query expressions: places, relations, membership, knowledge, proportions."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import (
    ColumnElement,
    Double,
    FromClause,
    Select,
    and_,
    case,
    exists,
    literal,
    not_,
    null,
    or_,
    select,
    union_all,
)

from archmodel.attributes import DOCUMENTING, attributes_of
from archmodel.entities import canon_of, kind_named, kinds
from archmodel.grammar import Call, Node, parse
from archmodel.knowledge import OBSERVATIONS, Correction, Statement
from archmodel.lookups import document_named, mark_named, meant, stone_named, structure_named
from archmodel.relations import SYMMETRIC, Membership, Relation
from archmodel.said import alias_of, held, statements_of
from archmodel.scope import Context, Scope, StructureScope
from archmodel.structures import Structure
from archmodel.tokens import Token, complaint
from moma.errors import QueryError, UsageError

__all__ = ["FUNCTIONS", "STRUCTURE_FUNCTIONS", "Function"]

MAX_METRES = 1e9
"""Largest coordinate or distance in an expression [m]: its square is a number in every database."""

MAX_SEVERITY = 4

Condition = ColumnElement[bool]
Ask = Callable[[Any, Node], Condition]
"""The condition of a node, in a `Scope` or a `StructureScope`."""


@dataclass(frozen=True)
class Function:
    """A function of expressions that is true or false of an entity.

    Attributes
    ----------
    name : as users write it
    usages : ways to write it, and what each says of an entity
    sql : the condition, of the scope, the call, and what turns nested expressions into conditions
    """

    name: str
    usages: tuple[tuple[str, str], ...]
    sql: Callable[[Any, Call, Ask], Condition]


def _refuse(call: Call, name: str) -> QueryError:
    """The error for arguments that do not fit."""
    known = FUNCTIONS.get(name) or STRUCTURE_FUNCTIONS[name]
    remedy = f"write {' or '.join(usage for usage, _ in known.usages)}"
    return complaint(call.function, f"{name} cannot take these arguments", remedy)


def _tokens(call: Call, *lengths: int) -> tuple[Token, ...]:
    """The arguments, which must be values, as many as one of the lengths says."""
    values = tuple(one for one in call.arguments if isinstance(one, Token))
    if len(values) != len(call.arguments) or len(values) not in lengths:
        raise _refuse(call, call.function.text.lower())
    return values


def _only(call: Call) -> "Token | Node | None":
    """The one argument; None if there is none."""
    if len(call.arguments) > 1:
        raise _refuse(call, call.function.text.lower())
    return call.arguments[0] if call.arguments else None


def _metres(token: Token) -> float:
    """A coordinate or a distance."""
    number = float(token.text) if token.role == "number" else math.nan
    if not abs(number) <= MAX_METRES:
        remedy = f"write metres without quotes, e.g. 1.5, up to {MAX_METRES:g}"
        raise complaint(token, f"{token.text[:40]!r} is not a length", remedy)
    return number


# places


def _within(scope: Scope, call: Call, ask: Ask) -> Condition:
    values = _tokens(call, 2, 4)
    radius = _metres(values[-1])
    if radius < 0.0:
        raise complaint(values[-1], f"the radius {values[-1].text[:40]} is negative")
    if len(values) == 4:
        x, y, z = map(_metres, values[:3])
        return _ball(scope, (x, y, z), radius)
    stone = stone_named(scope.context, values[0])
    if stone.x is None or stone.y is None or stone.z is None:
        raise complaint(values[0], f"the place of {values[0].text[:40]} is not known")
    return and_(_ball(scope, (stone.x, stone.y, stone.z), radius), scope.entity.c.id != stone.id)


def _ball(scope: Scope, centre: tuple[float, ...], radius: float) -> Condition:
    """Centroids at most `radius` from the centre; the box around it comes first, for the index."""
    columns = [scope.entity.c[axis] for axis in "xyz"]
    offsets = [column - literal(value, Double) for column, value in zip(columns, centre, strict=True)]
    square = sum((offset * offset for offset in offsets[1:]), offsets[0] * offsets[0])
    low = [value - radius for value in centre]
    high = [value + radius for value in centre]
    return and_(_box(scope, low, high), square <= literal(radius * radius, Double))


def _within_box(scope: Scope, call: Call, ask: Ask) -> Condition:
    numbers = list(map(_metres, _tokens(call, 6)))
    low, high = numbers[:3], numbers[3:]
    if any(a > b for a, b in zip(low, high, strict=True)):
        remedy = "write the lowest corner first: within_box(x0, y0, z0, x1, y1, z1)"
        raise complaint(call.function, "the box has a corner above the other", remedy)
    return _box(scope, low, high)


def _box(scope: Scope, low: list[float], high: list[float]) -> Condition:
    return and_(
        *(
            scope.entity.c[axis].between(literal(a, Double), literal(b, Double))
            for axis, a, b in zip("xyz", low, high, strict=True)
        )
    )


# relations


def _related(name: str, subject: str, other: str) -> Callable[[Scope, Call, Ask], Condition]:
    """A stored relation, asked of the entity on the side `subject` about the one on the side `other`."""
    sides = ((subject, other), (other, subject)) if name in SYMMETRIC else ((subject, other),)

    def sql(scope: Scope, call: Call, ask: Ask) -> Condition:
        wanted = _others(scope.context, _only(call), ask)
        parts: list[Select[Any]] = []
        for mine, theirs in sides:
            rows = alias_of(Relation)
            chosen = select(rows.c[mine]).where(rows.c.kind == name, held(rows))
            parts.append(chosen if wanted is None else chosen.where(wanted(rows.c[theirs])))
        if wanted is not None:
            return scope.entity.c.id.in_(union_all(*parts) if len(parts) > 1 else parts[0])
        mine_first = (part.where(part.selected_columns[0] == scope.entity.c.id) for part in parts)
        return or_(*(part.correlate(scope.entity).exists() for part in mine_first))

    return sql


Wanted = Callable[[ColumnElement[int]], Condition]


def _others(context: Context, argument: "Token | Node | None", ask: Ask) -> Wanted | None:
    """The condition on the number of the other entity; None: any will do.

    A nested expression is a select of its own, which is done once and not for every entity.
    """
    if argument is None:
        return None
    if isinstance(argument, Token):
        number = stone_named(context, argument).id
        return lambda column: column == number
    there = Scope.elsewhere(context)
    condition = ask(there, argument)
    numbers = there.joined(select(there.entity.c.id)).where(condition)
    return lambda column: column.in_(numbers)


def _load_path(step_from: str, step_to: str) -> Callable[[Scope, Call, Ask], Condition]:
    """Along rests_on from the entities that are meant, over `step_from` to `step_to`, as often as it goes."""

    def sql(scope: Scope, call: Call, ask: Ask) -> Condition:
        argument = _only(call)
        if argument is None:
            raise _refuse(call, call.function.text.lower())
        wanted = _others(scope.context, argument, ask)
        assert wanted is not None
        first, further = alias_of(Relation), alias_of(Relation)
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


# membership


def _member_of(scope: Scope, call: Call, ask: Ask) -> Condition:
    rows = alias_of(Membership)
    argument = _only(call)
    if argument is None:
        return _any_row(scope, held(rows), rows.c.entity_id == scope.entity.c.id)
    parts = _with_parts(scope.context, argument, ask)
    members = select(rows.c.entity_id).where(held(rows), rows.c.structure_id.in_(select(parts.c.id)))
    return scope.entity.c.id.in_(members)


def _with_parts(context: Context, argument: "Token | Node", ask: Ask) -> FromClause:
    """Numbers of the structures that are meant, and of their parts."""
    whole, part = alias_of(Structure), alias_of(Structure)
    if isinstance(argument, Token):
        meant_here: Condition = whole.c.id == structure_named(context, argument)
    else:
        meant_here = ask(StructureScope(context, whole), argument)
    parts = select(whole.c.id).where(held(whole), meant_here).cte(recursive=True)
    return parts.union(
        select(part.c.id).join_from(parts, part, part.c.parent_id == parts.c.id).where(held(part))
    )


def _part_of(scope: StructureScope, call: Call, ask: Ask) -> Condition:
    argument = _only(call)
    if argument is None:
        return scope.structure.c.parent_id.is_not(None)
    parts = _with_parts(scope.context, argument, ask)
    return scope.structure.c.id.in_(select(parts.c.id))


# knowledge


def _has_mark(scope: Scope, call: Call, ask: Ask) -> Condition:
    said = alias_of(Statement)
    conditions: list[Condition] = [
        held(said),
        said.c.entity_id == scope.entity.c.id,
        said.c.kind == "mason_mark",
    ]
    conditions += [said.c.sign == mark_named(scope.context, sign) for sign in _tokens(call, 0, 1)]
    return _any_row(scope, *conditions)


def _observed(scope: Scope, call: Call, ask: Ask) -> Condition:
    values = _tokens(call, 0, 1, 2)
    of_type, severe = [], []
    said, own = alias_of(Statement), alias_of(Statement)
    if values:
        type_ = values[0].text.lower()
        if type_ not in OBSERVATIONS:
            remedy = meant(type_, OBSERVATIONS, "the types")
            raise complaint(values[0], f"unknown type of observation {values[0].text[:40]!r}", remedy)
        of_type = [said.c.type == type_]
    if len(values) == 2:
        severe = [said.c.severity >= _severity(values[1])]
    same = _any_row(
        scope,
        own.c.entity_id == scope.entity.c.id,
        own.c.kind == "observation",
        own.c.type == said.c.type,
        held(own),
        also=said,
    )
    told = statements_of(scope.entity, said, scope.context.said_of_structures("observation"))
    by_itself_or_no_own = or_(said.c.entity_id.is_not(None), not_(same))
    return _any_row(scope, said.c.kind == "observation", told, by_itself_or_no_own, *of_type, *severe)


def _severity(token: Token) -> int:
    if token.text not in map(str, range(MAX_SEVERITY + 1)):
        remedy = "write a number from 0 (traces) to 4 (lost, or about to be)"
        raise complaint(token, f"{token.text[:40]!r} is not a severity", remedy)
    return int(token.text)


def _documented(scope: Scope, call: Call, ask: Ask) -> Condition:
    said = alias_of(Statement)
    conditions: list[Condition] = [said.c.document_id.is_not(None)]
    conditions += [said.c.document_id == document_named(scope.context, code) for code in _tokens(call, 0, 1)]
    told = statements_of(scope.entity, said, scope.context.said_of_structures(*DOCUMENTING))
    return _any_row(scope, told, *conditions)


def _corrected(scope: Scope, call: Call, ask: Ask) -> Condition:
    rows = alias_of(Correction)
    conditions: list[Condition] = [rows.c.entity_id == scope.entity.c.id]
    for token in _tokens(call, 0, 1):
        known = attributes_of(scope.context.session)
        if (name := token.text.lower()) not in known:
            raise complaint(
                token, f"unknown attribute {token.text[:40]!r}", meant(name, known, "the attributes")
            )
        conditions.append(rows.c.attribute == name)
    return _any_row(scope, *conditions)


def _any_row(scope: Scope, *conditions: Condition, also: FromClause | None = None) -> Condition:
    """Whether there is a row that satisfies the conditions, for each entity."""
    around = (scope.entity,) if also is None else (scope.entity, also)
    return exists().where(*conditions).correlate(*around)


# kinds and their proportions


def _is_a(scope: Scope, call: Call, ask: Ask) -> Condition:
    (name,) = _tokens(call, 1)
    try:
        cls = kind_named(name.text)
    except UsageError as error:
        raise complaint(name, error.what, error.remedy) from None
    return scope.entity.c.kind.in_([kind for kind, sub in kinds().items() if issubclass(sub, cls)])


def _canonical(scope: Scope, call: Call, ask: Ask) -> Condition:
    _tokens(call, 0)
    kinds_of: dict[str, list[str]] = {}
    for kind, cls in kinds().items():
        if (canon := canon_of(cls)) is not None:
            kinds_of.setdefault(canon, []).append(kind)
    if scope.context.once("within canon", list):
        raise complaint(call.function, "canonical proportions cannot refer to canonical()")
    cases = []
    for canon, names in kinds_of.items():
        scope.context.once("within canon", list).append(canon)
        try:
            cases.append((scope.entity.c.kind.in_(names), ask(scope, parse(canon))))
        except QueryError as error:
            what = f"the canonical proportions of {' and '.join(names)} cannot be understood: {error}"
            raise complaint(call.function, what) from None
        finally:
            scope.context.once("within canon", list).clear()
    # Neither true nor false for kinds that have none.
    return case(*cases, else_=null())


_ALL = (
    Function(
        "within",
        (
            ("within(CODE, r)", "its centroid is within r metres of that stone's, itself left out"),
            ("within(x, y, z, r)", "its centroid is within r metres of that place"),
        ),
        _within,
    ),
    Function(
        "within_box",
        (("within_box(x0, y0, z0, x1, y1, z1)", "its centroid is in that box (lowest corner first) [m]"),),
        _within_box,
    ),
    Function(
        "rests_on",
        (
            ("rests_on(CODE)", "it rests on that stone"),
            ("rests_on(expression)", "it rests on a stone of which the expression is true"),
            ("rests_on()", "it rests on any stone"),
        ),
        _related("rests_on", "subject_id", "object_id"),
    ),
    Function(
        "supports",
        (("supports(CODE | expression | nothing)", "such a stone rests on it"),),
        _related("rests_on", "object_id", "subject_id"),
    ),
    Function(
        "beside",
        (("beside(CODE | expression | nothing)", "it is beside such a stone"),),
        _related("beside", "subject_id", "object_id"),
    ),
    Function(
        "bonded_with",
        (("bonded_with(CODE | expression | nothing)", "it is bonded with such a stone"),),
        _related("bonded_with", "subject_id", "object_id"),
    ),
    Function(
        "across_the_wall",
        (("across_the_wall(CODE | expression | nothing)", "such a stone is opposite, in the other facing"),),
        _related("across_the_wall", "subject_id", "object_id"),
    ),
    Function(
        "above",
        (("above(CODE | expression)", "it rests on such a stone, directly or through others"),),
        _load_path("object_id", "subject_id"),
    ),
    Function(
        "below",
        (("below(CODE | expression)", "such a stone rests on it, directly or through others"),),
        _load_path("subject_id", "object_id"),
    ),
    Function(
        "member_of",
        (
            ("member_of(CODE)", "it is a member of the structure of that code, or of a part of it"),
            ("member_of(expression)", "the same of a structure of which the expression is true"),
            ("member_of()", "it is a member of any structure"),
        ),
        _member_of,
    ),
    Function(
        "has_mark",
        (
            ("has_mark()", "it bears a mason mark"),
            ("has_mark(SIGN)", "it bears that mason mark"),
        ),
        _has_mark,
    ),
    Function(
        "observed",
        (
            ("observed()", "there is an observation of it"),
            ("observed(TYPE)", f"there is one of that type: {', '.join(OBSERVATIONS)}"),
            ("observed(TYPE, n)", "there is one of that type whose severity is at least n (0 to 4)"),
        ),
        _observed,
    ),
    Function(
        "documented",
        (
            ("documented()", "a document, drawing or photograph treats it or is named as evidence"),
            ("documented(CODE)", "the document of that code does"),
        ),
        _documented,
    ),
    Function(
        "corrected",
        (
            ("corrected()", "an attribute of it was corrected"),
            ("corrected(attribute)", "that attribute was"),
        ),
        _corrected,
    ),
    Function(
        "is_a",
        (("is_a(KIND)", "it is of that kind or of a subkind"),),
        _is_a,
    ),
    Function(
        "canonical",
        (
            (
                "canonical()",
                "it has the canonical proportions of its kind; null where the kind has none, or a number is not known",
            ),
        ),
        _canonical,
    ),
)

FUNCTIONS: Mapping[str, Function] = {function.name: function for function in _ALL}
"""What can be asked of an entity."""

STRUCTURE_FUNCTIONS: Mapping[str, Function] = {
    "part_of": Function(
        "part_of",
        (
            ("part_of(CODE | expression)", "it is such a structure, or a part of one"),
            ("part_of()", "it is a part of any structure"),
        ),
        _part_of,
    )
}
"""What can be asked of a structure, within ``member_of(…)``."""
