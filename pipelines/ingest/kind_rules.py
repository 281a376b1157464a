"""Rules for the kinds of solids, such as ``support: z < 0.01``.

The expressions are those of ``moma query --where``, without functions, over attributes of a solid. `x`, `y` and
`z` are the lower corner of its box, `x_max`, `y_max` and `z_max` the upper one: ``z < 0.01`` holds for solids that
stand on the ground, however high they are.
"""

import difflib
import fnmatch
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from archmodel.query.grammar import (
    All,
    AmountComparison,
    AnyOf,
    Call,
    Comparison,
    IsIn,
    IsNull,
    Like,
    Node,
    Not,
    attributes_in,
    parse,
)
from archmodel.query.tokens import Token, complaint
from archmodel.tables.entities import kind_named
from archmodel.tables.hierarchy import names_below
from ground.errors import UsageError
from survey.extrusion.extrusion import SurveyedBlock
from survey.geometry.solids import area_vector

Value = float | str | None

RULE_ATTRIBUTES: Mapping[str, str] = {
    "code": "name of the stone",
    "kind": "as its name says it, or --kind",
    "course": "as its name says it",
    "x": "lower corner of its box [m]",
    "y": "lower corner of its box [m]",
    "z": "lowest corner: where it stands [m]",
    "x_max": "upper corner of its box [m]",
    "y_max": "upper corner of its box [m]",
    "z_max": "highest corner [m]",
    "volume": "[m³]",
    "length": "horizontal extent of its face [m]",
    "height": "extent of its face upwards [m]",
    "depth": "how far it reaches behind its face [m]",
}
"""Attributes in a rule."""

_TEXTS = frozenset({"code", "kind"})
_SUPPORT = "support"
_OPERATORS: Mapping[str, Callable[[float | str, float | str], bool]] = {
    "=": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}


@dataclass(frozen=True)
class KindRule:
    """Kind of all stones for which an expression holds.

    Attributes
    ----------
    kind : e.g. voussoir
    node : the expression
    option : by which it was given, for messages
    """

    kind: str
    node: Node
    option: str


def kind_rules(texts: Sequence[str] = (), supports: Sequence[str] = ()) -> tuple[KindRule, ...]:
    """Read rules; the last one that holds for a stone counts, and those of supports come after all others.

    Parameters
    ----------
    texts : "KIND: EXPRESSION"
    supports : expressions, for stones that are supports

    Raises
    ------
    UsageError
        naming the option, and the place in the expression
    """
    rules = []
    for text in texts:
        kind, colon, expression = text.partition(":")
        if not colon or not kind.strip():
            remedy = 'write it as "KIND: EXPRESSION", e.g. "voussoir: z > 0.5"'
            raise UsageError(f"{text!r} names no kind", where="--kind-where", remedy=remedy)
        rules.append(KindRule(kind.strip().lower(), _checked(expression), "--kind-where"))
    return (*rules, *(KindRule(_SUPPORT, _checked(text), "--support") for text in supports))


def check_kinds(rules: Sequence[KindRule]) -> None:
    """Check that the hierarchy has all kinds of the rules.

    Raises
    ------
    UsageError
        naming the nearest known kinds
    """
    for rule in rules:
        try:
            kind_named(rule.kind)
        except UsageError as error:
            raise error.at(rule.option) from error
        for token in _kinds_named(rule.node):
            try:
                kind_named(token.text)
            except UsageError as error:
                raise complaint(token, error.what, error.remedy) from None


def _kinds_named(node: Node) -> Iterator[Token]:
    """Yield the names of kinds with which an expression compares that of a stone."""
    match node:
        case All(operands) | AnyOf(operands):
            for operand in operands:
                yield from _kinds_named(operand)
        case Not(operand):
            yield from _kinds_named(operand)
        case Comparison(Token(text="kind"), _, value):
            yield value
        case IsIn(Token(text="kind"), values):
            yield from values


def apply_rules(block: SurveyedBlock, rules: Sequence[KindRule]) -> SurveyedBlock:
    """Give a stone its kind by the rules."""
    if not rules:
        return block
    values = _values(block)
    kind = next((rule.kind for rule in reversed(rules) if _holds(rule.node, values)), block.kind)
    if kind == block.kind:
        return block
    face = replace(block.face, kind=kind, record=replace(block.face.record, kind=kind))
    return replace(block, kind=kind, face=face)


def _values(block: SurveyedBlock) -> dict[str, Value]:
    vertices, measures = block.solid.vertices, block.face.measures
    low, high, middle = vertices.min(axis=0), vertices.max(axis=0), vertices.mean(axis=0)
    sides = [vertices[list(face)] for face in block.solid.faces]
    volume = sum(float((side[0] - middle) @ area_vector(side)) for side in sides) / 3.0
    return {
        "code": block.code,
        "kind": block.kind,
        "course": block.course,
        **dict(zip(("x", "y", "z"), map(float, low), strict=True)),
        **dict(zip(("x_max", "y_max", "z_max"), map(float, high), strict=True)),
        "volume": volume,
        "length": measures.length,
        "height": measures.height,
        "depth": block.depth.value,
    }


def _checked(expression: str) -> Node:
    node = parse(expression)
    _check(node)
    return node


def _check(node: Node) -> None:
    """Refuse attributes that a solid does not have, and comparisons of numbers with texts."""
    match node:
        case All(operands) | AnyOf(operands):
            for operand in operands:
                _check(operand)
        case Not(operand):
            _check(operand)
        case Call(function) | IsNull(Call(function)):
            raise complaint(function, f"{function.text} is a function", "a rule may ask for attributes only")
        case AmountComparison():
            for token in attributes_in(node):
                raise complaint(token, "a rule computes nothing", "compare one attribute with a number")
        case IsNull(Token() as attribute):
            _check_attribute(attribute)
        case Like(attribute, _):
            _check_attribute(attribute)
            if attribute.text not in _TEXTS:
                raise complaint(attribute, f"{attribute.text} is a number, like is for texts", "use < and >")
        case Comparison(attribute, sign, value):
            _check_attribute(attribute)
            _check_value(attribute, value)
            if attribute.text == "kind" and sign not in ("=", "!="):
                raise complaint(value, f"kinds have no order, {sign} does not compare them", "write = or !=")
        case IsIn(attribute, values):
            _check_attribute(attribute)
            for value in values:
                _check_value(attribute, value)


def _check_attribute(token: Token) -> None:
    if token.text not in RULE_ATTRIBUTES:
        close_matches = difflib.get_close_matches(token.text, RULE_ATTRIBUTES, n=3) or list(RULE_ATTRIBUTES)
        raise complaint(token, f"unknown attribute {token.text!r}", f"known: {', '.join(close_matches)}")


def _check_value(attribute: Token, value: Token) -> None:
    """Refuse to compare a number with anything other than a number or a numeric attribute."""
    if attribute.text in _TEXTS or value.role == "number":
        return
    if value.role != "word" or value.text not in RULE_ATTRIBUTES or value.text in _TEXTS:
        what = f"{attribute.text} is a number, {value.text!r} is not"
        raise complaint(value, what, "compare it with a number, or with another attribute")


def _holds(node: Node, values: Mapping[str, Value]) -> bool | None:
    """Evaluate an expression for a stone; None where a value is missing."""
    match node:
        case All(operands):
            found = [_holds(operand, values) for operand in operands]
            return False if False in found else None if None in found else True
        case AnyOf(operands):
            found = [_holds(operand, values) for operand in operands]
            return True if True in found else None if None in found else False
        case Not(operand):
            operand_holds = _holds(operand, values)
            return None if operand_holds is None else not operand_holds
        case IsNull(Token() as attribute):
            return values[attribute.text] is None
        case Like(attribute, pattern):
            return bool(_matches(str(values[attribute.text]), pattern.text))
        case Comparison(Token(text="kind"), sign, value):
            return _is_a(values["kind"], value) is (sign == "=")
        case IsIn(Token(text="kind"), members):
            return any(_is_a(values["kind"], member) for member in members)
        case Comparison(attribute, sign, value):
            return _compared(sign, values[attribute.text], _value(attribute, value, values))
        case IsIn(attribute, members):
            found = [
                _compared("=", values[attribute.text], _value(attribute, member, values))
                for member in members
            ]
            return True if True in found else None if None in found else False
    return None


def _is_a(kind: Value, named: Token) -> bool:
    """Return whether a kind is a named one or a subkind of it."""
    return kind in names_below(kind_named(named.text))


def _compared(sign: str, first: Value, second: Value) -> bool | None:
    if first is None or second is None:
        return None
    return _OPERATORS[sign](first, second)


def _value(attribute: Token, token: Token, values: Mapping[str, Value]) -> Value:
    if attribute.text in _TEXTS:
        return token.text
    return float(token.text) if token.role == "number" else values[token.text]


def _matches(text: str, pattern: str) -> bool:
    """Match a pattern as in queries: % stands for any text, _ for one character; case is ignored."""
    escaped = "".join(_wild(pattern))
    return fnmatch.fnmatchcase(text.lower(), escaped.lower())


def _wild(pattern: str) -> Iterator[str]:
    for character in pattern:
        yield {"%": "*", "_": "?", "*": "[*]", "?": "[?]", "[": "[[]"}.get(character, character)
