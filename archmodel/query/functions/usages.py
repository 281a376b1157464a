"""Usage of query functions: syntax, meaning, and checks of their arguments."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from sqlalchemy import ColumnElement

from archmodel.query.grammar import Call, Node
from archmodel.query.tokens import Token, complaint
from archmodel.tables.knowledge import OBSERVATIONS
from ground.errors import QueryError

MAX_METRES = 1e9
"""Largest coordinate or distance in an expression [m]: its square is a number in every database."""

Condition = ColumnElement[bool]

Ask = Callable[[Any, Node], Condition]
"""What makes a condition of a nested expression, in a `Scope` or a `StructureScope`."""

Usages = tuple[tuple[str, str], ...]

USAGES: Mapping[str, Usages] = {
    "within": (
        ("within(CODE, r)", "its centroid is within r metres of that stone's, itself left out"),
        ("within(x, y, z, r)", "its centroid is within r metres of that place"),
    ),
    "within_box": (
        ("within_box(x0, y0, z0, x1, y1, z1)", "its centroid is in that box, in metres, lowest corner first"),
    ),
    "rests_on": (
        ("rests_on(CODE)", "it rests on that stone"),
        ("rests_on(expression)", "it rests on a stone of which the expression is true"),
        ("rests_on()", "it rests on any stone"),
    ),
    "supports": (("supports(CODE, expression or nothing)", "such a stone rests on it"),),
    "beside": (("beside(CODE, expression or nothing)", "it is beside such a stone"),),
    "bonded_with": (("bonded_with(CODE, expression or nothing)", "it is bonded with such a stone"),),
    "across_the_wall": (
        ("across_the_wall(CODE, expression or nothing)", "such a stone is opposite, in the other facing"),
    ),
    "above": (("above(CODE or expression)", "it rests on such a stone, directly or through others"),),
    "below": (("below(CODE or expression)", "such a stone rests on it, directly or through others"),),
    "after": (
        (
            "after(CODE)",
            "it is, or belongs to, a unit that came later than this one by any chain of relations",
        ),
        ("after(expression)", "the same of units of which the expression is true"),
    ),
    "before": (
        ("before(CODE or expression)", "it is, or belongs to, a unit that came earlier than such a unit"),
    ),
    "contradicted": (
        (
            "contradicted()",
            "it is, or belongs to, a unit whose stratigraphic relations and dates cannot both be right",
        ),
    ),
    "member_of": (
        ("member_of(CODE)", "it is a member of the structure of that code, or of a part of it"),
        ("member_of(expression)", "the same of a structure of which the expression is true"),
        ("member_of()", "it is a member of any structure"),
    ),
    "has_mark": (
        ("has_mark()", "it bears a mason mark"),
        ("has_mark(SIGN)", "it bears that mason mark"),
    ),
    "observed": (
        ("observed()", "there is an observation of it"),
        (
            "observed(TYPE)",
            f"there is one of that type, or of a narrower term: {', '.join(OBSERVATIONS)}, or your own",
        ),
        ("observed(TYPE, n)", "there is one of that type whose severity is at least n (0 to 4)"),
    ),
    "documented": (
        ("documented()", "a document, drawing or photograph treats it, or is named as evidence"),
        ("documented(CODE)", "the document of that code does"),
    ),
    "by": (
        ("by(AUTHOR)", "that author states something of it, or of its structures"),
        (
            "by(AUTHOR, phase)",
            "that author states its phase; or material, mark, observation, depth, document, note",
        ),
    ),
    "disputed": (
        ("disputed()", "opinions on its phase or its material differ"),
        ("disputed(phase)", "opinions on its phase differ; or material"),
    ),
    "text": (
        (
            "text('WORDS')",
            "these words are in what is stated of it or of its structures, in the title of a document that treats "
            "it, in its notes, or in the title of a structure; upper and lower case (A–Z) are the same",
        ),
    ),
    "corrected": (
        ("corrected()", "a person corrected an attribute of it"),
        ("corrected(attribute)", "a person corrected that attribute"),
    ),
    "in_mechanism": (
        ("in_mechanism()", "it moves in a mechanism of the latest assessment"),
        ("in_mechanism(LOAD)", 'it moves in that of the load of that name, as "horizontal x"'),
    ),
    "is_a": (("is_a(KIND)", "it is of that kind or of a subkind"),),
    "canonical": (
        (
            "canonical()",
            "it has the canonical proportions of its kind; null if there are none, or a number is not known",
        ),
    ),
    "moved_since": (
        (
            "moved_since(CAMPAIGN)",
            "its place differs from that in the survey of this name by more than both can err, at 1 %, what all places "
            "along the faces scatter beyond their sigma being allowed for; null if it was "
            "not measured in both; `moved` and `moved_sigma` are then since that survey",
        ),
    ),
}
"""The functions of entities: ways to write them, and what each says."""

STRUCTURE_USAGES: Mapping[str, Usages] = {
    "part_of": (
        ("part_of(CODE or expression)", "it is such a structure, or a part of one"),
        ("part_of()", "it is a part of any structure"),
    ),
    "has": (("has(CODE or expression)", "such a stone is a member of it, or of a part of it"),),
    "is_a": (("is_a(KIND)", "it is of that kind of structure or of a subkind"),),
    "above": (("above(CODE or expression)", "it lies above such a unit, directly or through others"),),
    "below": (("below(CODE or expression)", "it lies below such a unit, directly or through others"),),
    "after": (("after(CODE or expression)", "it came later than such a unit by any chain of relations"),),
    "before": (("before(CODE or expression)", "it came earlier than such a unit"),),
    "contradicted": (("contradicted()", "its stratigraphic relations and dates cannot both be right"),),
    "disputed": (
        ("disputed()", "opinions on its phase or its material differ"),
        ("disputed(phase)", "opinions on its phase differ; or material"),
    ),
    "canonical": (("canonical()", "it has the canonical proportions of its kind; null as for stones"),),
    "changes": (
        (
            "changes(attribute)",
            "the attribute differs from that of the one below: of its kind and parent, with the number before",
        ),
    ),
}
"""The functions of structures, in lists of structures and within ``member_of(…)``."""


def _refusal(call: Call) -> QueryError:
    """Make the error for arguments that a function does not take."""
    name = call.function.text.lower()
    ways = " or ".join(usage for usage, _ in (USAGES.get(name) or STRUCTURE_USAGES[name]))
    return complaint(call.function, f"{name} cannot take these arguments", f"write {ways}")


def tokens(call: Call, *lengths: int) -> tuple[Token, ...]:
    """Return the arguments, which must be values, as many as one of the lengths allows."""
    values = tuple(argument for argument in call.arguments if isinstance(argument, Token))
    if len(values) != len(call.arguments) or len(values) not in lengths:
        raise _refusal(call)
    return values


def only(call: Call, *, needed: bool = False) -> Token | Node | None:
    """Return the one argument; None if there is none, and none is needed."""
    if len(call.arguments) > 1 or (needed and not call.arguments):
        raise _refusal(call)
    return call.arguments[0] if call.arguments else None


def metres(token: Token) -> float:
    """Parse a coordinate or a distance [m]."""
    number = float(token.text) if token.role == "number" else math.nan
    if not abs(number) <= MAX_METRES:
        remedy = f"write metres without quotes, e.g. 1.5, up to {MAX_METRES:g}"
        raise complaint(token, f"{token.text[:40]!r} is not a length", remedy)
    return number
