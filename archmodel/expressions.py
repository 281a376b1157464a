"""From query expressions to SQL conditions; see ``docs/query.md`` for the language.

What the user wrote reaches the database as bound parameters only; the names that become SQL are those of
``attributes.ATTRIBUTES``.
"""

import difflib
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

from sqlalchemy import ColumnElement, and_, not_, or_

from archmodel.attributes import ATTRIBUTES, Attribute
from archmodel.entities import kind_named, kind_of
from archmodel.grammar import (
    All,
    AnyOf,
    Comparison,
    IsNull,
    Like,
    Membership,
    Node,
    Not,
    parse,
)
from archmodel.runs import FIDELITIES
from archmodel.tokens import Token, complaint
from moma.errors import UsageError

__all__ = ["condition"]

# so many attributes are named where none is like what was written
_SHOWN = 20

_OPERATORS: Mapping[str, Callable[[Any, Any], Any]] = {
    "=": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


def condition(expression: str) -> ColumnElement[bool]:
    """The SQL condition of one expression, for a select that has gone through ``with_attributes``.

    Raises
    ------
    QueryError
        with the place in the expression and the nearest names
    """
    return _sql(parse(expression))


def _sql(node: Node) -> ColumnElement[bool]:
    """The condition of a node; as deep as the grammar allows, no deeper."""
    match node:
        case All(operands):
            return and_(*map(_sql, operands))
        case AnyOf(operands):
            return or_(*map(_sql, operands))
        case Not(operand):
            return not_(_sql(operand))
        case IsNull(name):
            return _attribute(name).column.is_(None)
        case Like(name, pattern):
            attribute = _attribute(name)
            if attribute.is_number:
                raise complaint(name, f"{attribute.name} is a number, like is for texts", "use < and >")
            return attribute.column.ilike(pattern.text)
        case Membership(name, values):
            attribute = _attribute(name)
            return attribute.column.in_([_constant(attribute, value) for value in values])
        case Comparison(name, sign, value):
            attribute = _attribute(name)
            compared: ColumnElement[bool] = _OPERATORS[sign](attribute.column, _operand(attribute, value))
            return compared


def _attribute(name: Token) -> Attribute:
    """The attribute that a token names."""
    if (attribute := ATTRIBUTES.get(name.text.lower())) is not None:
        return attribute
    raise complaint(name, f"unknown attribute {name.text[:40]!r}", _nearest(name.text))


def _nearest(name: str) -> str:
    """What the user may have meant."""
    near = difflib.get_close_matches(name[:40].lower(), ATTRIBUTES, n=3, cutoff=0.5)
    shown = [*list(ATTRIBUTES)[:_SHOWN], "…"] if len(ATTRIBUTES) > _SHOWN else list(ATTRIBUTES)
    return f"did you mean {' or '.join(near)}?" if near else f"the attributes are {', '.join(shown)}"


def _operand(attribute: Attribute, value: Token) -> Any:
    """The right side of a comparison: a constant, or another number of the same stone (depth > length)."""
    if attribute.is_number and value.role == "word":
        other = ATTRIBUTES.get(value.text.lower())
        if other is None:
            what = (
                f"{value.text[:40]!r} is neither a number nor an attribute, and {attribute.name} is a number"
            )
            raise complaint(value, what, _nearest(value.text))
        if other.is_number:
            return other.column
        raise complaint(value, f"{attribute.name} is a number, {other.name} is a text")
    return _constant(attribute, value)


def _constant(attribute: Attribute, value: Token) -> float | str:
    """The value as the attribute's type has it."""
    if attribute.is_number:
        number = float(value.text) if value.role == "number" else math.nan
        if not math.isfinite(number):
            remedy = "write a number without quotes, e.g. 0.4 or 2e5"
            raise complaint(value, f"{attribute.name} is a number, {value.text[:40]!r} is not", remedy)
        return number
    if attribute.name == "kind":
        try:
            return kind_of(kind_named(value.text))
        except UsageError as error:
            raise complaint(value, error.what, error.remedy) from None
    if attribute.name == "fidelity" and value.text not in FIDELITIES:
        raise complaint(value, f"unknown fidelity {value.text[:40]!r}", f"they are {', '.join(FIDELITIES)}")
    return value.text
