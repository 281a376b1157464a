"""Compilation of query expressions to SQL conditions; see ``docs/query.md`` for the language.

What the user wrote reaches the database as bound parameters only; the names that become SQL are those of
``attributes``, ``functions`` and the tables.
"""

import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

from sqlalchemy import Boolean, ColumnElement, Double, Integer, and_, func, literal, not_, or_, select
from sqlalchemy.orm import Session

from archmodel.query.attributes import ATTRIBUTES, Attribute, attributes_of
from archmodel.query.columns import Compiler, Test
from archmodel.query.functions.registry import FUNCTIONS, STRUCTURE_FUNCTIONS, Function
from archmodel.query.grammar import (
    All,
    Amount,
    AmountComparison,
    AnyOf,
    Call,
    Comparison,
    IsIn,
    IsNull,
    Like,
    Node,
    Not,
    parse,
)
from archmodel.query.names import meant, phase_begins, run_with_number, terms_named
from archmodel.query.scope import Context, Scope, StructureScope
from archmodel.query.structures import STRUCTURE_ATTRIBUTES
from archmodel.query.tokens import Token, complaint
from archmodel.tables.base import LARGEST_INTEGER
from archmodel.tables.entities import Entity, kind_named
from archmodel.tables.hierarchy import names_below
from archmodel.tables.structures import structure_kind_named
from ground.errors import UsageError

Where = Scope | StructureScope

_OPERATORS: Mapping[str, Callable[[Any, Any], Any]] = {
    "=": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


def condition(session: Session, expression: str, run: int | None = None) -> ColumnElement[bool]:
    """Return the condition of one expression, for a select of entities: ``select(Header).where(condition(…))``.

    Parameters
    ----------
    session : of the database that will be asked
    expression : see docs/query.md
    run : whose results are meant where the expression names no run; None: the latest that holds the entity

    Raises
    ------
    QueryError
        with the place in the expression and the nearest names
    """
    scope = Scope(Context(session, run))
    simple = condition_in(scope, parse(expression))
    if scope.is_bare:
        return simple
    there = Scope.elsewhere(Context(session, run))
    nested = condition_in(there, parse(expression))
    return Entity.id.in_(there.joined(select(there.entity.c.id)).where(nested))


def column_named(scope: Where, name: str) -> ColumnElement[Any]:
    """Return the column of an attribute: ``depth``, ``von_mises_max@12``.

    Raises
    ------
    QueryError
        with the nearest names, if there is no such attribute or run
    """
    return _column(scope, Token("word", name, 1, name))[1]


def condition_in(scope: Where, node: Node) -> ColumnElement[bool]:
    """Return the condition of a node, for a select with the joins of the scope; as deep as the grammar allows."""
    match node:
        case All(operands):
            return and_(*(condition_in(scope, operand) for operand in operands))
        case AnyOf(operands):
            return or_(*(condition_in(scope, operand) for operand in operands))
        case Not(operand):
            return not_(condition_in(scope, operand))
        case Call():
            return _call(scope, node)
        case IsNull(operand):
            tested = _call(scope, operand) if isinstance(operand, Call) else _column(scope, operand)[1]
            return tested.is_(None)
        case Like(name, pattern):
            attribute, column = _column(scope, name)
            if attribute.is_number:
                raise complaint(name, f"{attribute.name} is a number, like is for texts", "use < and >")
            if attribute.is_truth:
                what = f"{attribute.name} is true or false, like is for texts"
                raise complaint(name, what, f"write {attribute.name} = true")
            # With an escape character of our own: databases differ in the one that they assume.
            return _tested(
                scope, attribute, column, lambda text: text.ilike(pattern.text.replace("~", "~~"), escape="~")
            )
        case IsIn(name, values):
            attribute, column = _column(scope, name)
            if attribute.name == "kind":
                return column.in_(_kinds(scope, *values))
            if attribute.vocabulary is not None:
                named = [
                    name
                    for value in values
                    for name in terms_named(scope.context, attribute.vocabulary, value)
                ]
                return _tested(scope, attribute, column, lambda expression: expression.in_(named))
            constants = [_constant(scope, attribute, value) for value in values]
            return _tested(scope, attribute, column, lambda expression: expression.in_(constants))
        case Comparison(name, sign, value):
            attribute, column = _column(scope, name)
            if attribute.name == "kind":
                return _of_kind(scope, column, sign, value)
            if sign not in ("=", "!=") and not attribute.is_number and attribute.name != "code":
                return _ordered(scope, name, attribute, sign, value)
            if attribute.vocabulary is not None:
                terms = terms_named(scope.context, attribute.vocabulary, value)
                named_so = _tested(scope, attribute, column, lambda expression: expression.in_(terms))
                return named_so if sign == "=" else and_(column.is_not(None), not_(named_so))
            operand = _operand(scope, attribute, value)
            compared: ColumnElement[bool] = _OPERATORS[sign](column, operand)
            return compared
        case AmountComparison(left, sign, right):
            computed: ColumnElement[bool] = _OPERATORS[sign](_amount(scope, left), _amount(scope, right))
            return computed


def _tested(
    scope: Where, attribute: Attribute, column: ColumnElement[Any], test: Test
) -> ColumnElement[bool]:
    """Return a test of an attribute; of any of its values where it can have several."""
    if attribute.several is None or isinstance(scope, StructureScope):
        return test(column)
    return attribute.several(scope, test)


def _ordered(scope: Where, name: Token, attribute: Attribute, sign: str, value: Token) -> ColumnElement[bool]:
    """Return a comparison of what is no number by its order: phases have that of their years, codes that of letters."""
    if attribute.order is None or isinstance(scope, StructureScope):
        what = f"{attribute.name} is {_type_of(attribute)}, which has no order"
        raise complaint(name, what, "write =, != or like")
    compared: ColumnElement[bool] = _OPERATORS[sign](
        attribute.order(scope, None), phase_begins(scope.context, value)
    )
    return compared


def _amount(scope: Where, amount: Amount) -> ColumnElement[Any]:
    """Return a number computed of attributes that are numbers."""
    total: Any = literal(0.0, Double)
    for term in amount.terms:
        product: Any = literal(term.factor, Double)
        if term.attribute is not None:
            product = product * _computable(scope, term.attribute)
        if term.divisor is not None:
            # what is divided by zero is not known
            product = product / func.nullif(_computable(scope, term.divisor), 0)
        total = total + product
    return func.abs(total) if amount.absolute else total


def _computable(scope: Where, token: Token) -> ColumnElement[Any]:
    """Return the column of an attribute that is a number."""
    attribute, column = _column(scope, token)
    if not attribute.is_number:
        what = f"{attribute.name} is {_type_of(attribute)}, and cannot be computed with"
        raise complaint(token, what, "compute with numbers such as depth")
    return column


def _call(scope: Where, call: Call) -> ColumnElement[bool]:
    """Return the condition of a function."""
    name = call.function.text.lower()
    functions: Mapping[str, Function] = FUNCTIONS if isinstance(scope, Scope) else STRUCTURE_FUNCTIONS
    if (function := functions.get(name)) is None:
        if name in _attributes(scope):
            what, remedy = f"{name} is an attribute, not a function", "compare it, e.g. depth > 0.4"
        else:
            what = f"unknown function {call.function.text[:40]!r}"
            remedy = meant(name, functions, "the functions")
        raise complaint(call.function, what, remedy)
    scope.context.count_function(call.function)
    return function.sql(scope, call, condition_in)


def _attributes(scope: Where) -> Mapping[str, Attribute]:
    """Return the attributes that can be asked for here."""
    if isinstance(scope, StructureScope):
        return STRUCTURE_ATTRIBUTES
    session = scope.context.session
    attributes: Mapping[str, Attribute] = scope.context.once("attributes", lambda: attributes_of(session))
    return attributes


def _found(scope: Where, name: str) -> Attribute | None:
    """Return the attribute of a name; the database is asked only for what is not built in."""
    if isinstance(scope, Scope) and name in ATTRIBUTES:
        return ATTRIBUTES[name]
    return _attributes(scope).get(name)


def _column(scope: Where, token: Token) -> tuple[Attribute, ColumnElement[Any]]:
    """Return the attribute that a token names, and its column: ``depth``, ``von_mises_max@12``."""
    name, at, number = token.text.partition("@")
    if (attribute := _found(scope, name.lower())) is None:
        attributes = _attributes(scope)
        functions = FUNCTIONS if isinstance(scope, Scope) else STRUCTURE_FUNCTIONS
        if name.lower() in functions:
            raise complaint(token, f"{name} is a function", f"write {functions[name.lower()].usages[0][0]}")
        raise complaint(token, f"unknown attribute {name[:40]!r}", meant(name, attributes, "the attributes"))
    if at and not attribute.of_run:
        what = f"{attribute.name} does not depend on a run"
        raise complaint(token, what, f"write {attribute.name} without @{number[:20]}")
    run = run_with_number(scope.context, token, number) if at else None
    if attribute.measure is not None:
        if scope.context.within_canon:
            raise complaint(token, "canonical proportions cannot ask for the departure from themselves")
        return attribute, attribute.measure(scope, Compiler(condition_in, _amount))
    return attribute, attribute.value(scope, run)  # type: ignore[arg-type]


def _operand(scope: Where, attribute: Attribute, value: Token) -> Any:
    """Return the right side of a comparison: a constant, or another attribute of the same kind (depth > length)."""
    if value.role == "word" and (attribute.is_number or (attribute.of_run and "@" in value.text)):
        name = value.text.partition("@")[0].lower()
        operand = _found(scope, name)
        if operand is None:
            kind = _type_of(attribute)
            what = f"{value.text[:40]!r} is neither {kind} nor an attribute, and {attribute.name} is {kind}"
            raise complaint(value, what, meant(name, _attributes(scope), "the attributes"))
        if (operand.is_number, operand.is_truth) != (attribute.is_number, attribute.is_truth):
            raise complaint(
                value, f"{attribute.name} is {_type_of(attribute)}, {operand.name} is {_type_of(operand)}"
            )
        return _column(scope, value)[1]
    return _constant(scope, attribute, value)


def _constant(scope: Where, attribute: Attribute, value: Token) -> Any:
    """Convert a value to the attribute's type."""
    if attribute.is_number:
        return _number(attribute, value)
    if attribute.is_truth:
        return _truth(attribute, value)
    if attribute.words is not None and value.text not in attribute.words:
        what = f"unknown {attribute.name} {value.text[:40]!r}"
        raise complaint(value, what, f"they are {', '.join(attribute.words)}")
    return value.text


def _of_kind(scope: Where, column: ColumnElement[Any], sign: str, value: Token) -> ColumnElement[bool]:
    """Return the condition that a kind is, or is not, a named one or a subkind of it."""
    if sign not in ("=", "!="):
        raise complaint(value, f"kinds have no order, {sign} does not compare them", "write = or !=")
    names = _kinds(scope, value)
    return column.in_(names) if sign == "=" else column.not_in(names)


def _kinds(scope: Where, *values: Token) -> list[str]:
    """Return the names of kinds and of all their subkinds."""
    names: set[str] = set()
    for value in values:
        try:
            if isinstance(scope, StructureScope):
                names |= names_below(structure_kind_named(value.text))
            else:
                names |= names_below(kind_named(value.text))
        except UsageError as error:
            raise complaint(value, error.what, error.remedy) from None
    return sorted(names)


def _type_of(attribute: Attribute) -> str:
    return "a number" if attribute.is_number else "true or false" if attribute.is_truth else "a text"


def _truth(attribute: Attribute, value: Token) -> ColumnElement[Any]:
    """Parse true or false, in upper or lower case."""
    if value.text.lower() not in _TRUTHS:
        what = f"{attribute.name} is true or false, {value.text[:40]!r} is not"
        raise complaint(value, what, f"write {attribute.name} = true or {attribute.name} = false")
    return literal(_TRUTHS[value.text.lower()], Boolean)


_TRUTHS = {"true": True, "false": False}


def _number(attribute: Attribute, value: Token) -> ColumnElement[Any]:
    """Return a number with its type: PostgreSQL would round it to that of the column, or not use the index.

    Whole numbers that no integer column holds are compared as floating-point numbers.
    """
    number = float(value.text) if value.role == "number" else math.nan
    if not math.isfinite(number):
        remedy = "write a number without quotes, e.g. 0.4 or 2e5"
        raise complaint(value, f"{attribute.name} is a number, {value.text[:40]!r} is not", remedy)
    if number.is_integer() and abs(number) <= LARGEST_INTEGER:
        return literal(int(number), Integer)
    return literal(number, Double)
