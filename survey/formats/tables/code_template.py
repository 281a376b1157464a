"""Templates of the codes that surveyors key into an instrument.

A template is text with fields in braces, e.g. ``{block}:{role}`` or ``{block} {kind} {course?} {role}``; the text
between them stands for itself, a blank for one or more. A field with a question mark may be missing, together with the
text before it; ``{*}`` is read and ignored. A description has one reading or none: an ambiguous template is refused.
Where the name of a stone is made of its zone, course and number, ``{number}`` takes the place of ``{block}``. A role
may follow a name at once, as in ``12-4E``: then the name ends in a digit.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from ground.errors import UsageError
from survey.formats.fields import code_of

__all__ = ["CONTROL_WORDS", "ROLES", "STATION", "CodeFields", "CodeTemplate", "is_bare", "role_of"]

STATION = "station"
"""The role of a position of the instrument."""

ROLES: Mapping[str, str] = {
    **dict.fromkeys(("v", "vertex", "corner", "edge", "outline"), "vertex"),
    **dict.fromkeys(("e", "ecke", "eckpunkt", "rand", "sommet", "coin", "vertice", "spigolo", "esquina"), "vertex"),
    **dict.fromkeys(("vértice",), "vertex"),
    # line codes of field software: a line begins, goes on, ends, is closed
    **dict.fromkeys(("b", "beg", "begin", "start", "l", "line", "end", "c", "cls", "close"), "vertex"),
    **dict.fromkeys(("p", "point", "pt", "face", "surface", "f", "punkt", "fläche", "flaeche"), "point"),
    **dict.fromkeys(("flächenpunkt", "face point", "punto", "superficie", "faccia", "cara"), "point"),
    **dict.fromkeys(("s", "st", "stn", "stp", "station", "standpunkt", "stazione", "estación"), STATION),
}  # fmt: skip
"""Roles of points by the words for them."""

CONTROL_WORDS = frozenset(
    ("fp", "festpunkt", "pp", "passpunkt", "gcp", "control", "tie", "appui", "punto fisso", "punto fijo")
)
"""Descriptions of control points, which belong to no stone."""

_ROLE_WORDS = "|".join(sorted((re.escape(role) for role in ROLES if " " not in role), key=len, reverse=True))
_ROLE_LETTERS = re.escape("".join(sorted(set("".join(ROLES)) - {" "})))
_CODE, _CODE_LETTERS = r"[^\W_][\w.+/:-]{0,63}", r"\w.+/:-"
_FREE, _FREE_LETTERS = r"[^\W_][^\t%s]{0,63}", r"^\t%s"  # all but what separates fields
_FIELDS = {  # pattern of each field, and its characters
    "block": (_CODE, _CODE_LETTERS),
    "zone": (_CODE, _CODE_LETTERS),
    "kind": (r"[^\W\d_][\w-]{0,31}", r"\w-"),
    "course": (r"[0-9]{1,6}", r"0-9"),
    "number": (r"[0-9]{1,6}[^\W\d_]?", r"^\W_"),
    "role": (rf"(?i:{_ROLE_WORDS})", _ROLE_LETTERS + _ROLE_LETTERS.upper()),
}
_JOINED = ("block", "course", "number")  # fields that end in a digit where a role follows at once
_NAMED = ("zone", "course", "number")  # fields that name a stone together
_WORD = r"[0-9]{1,6}|[^\W\d_]{1,8}", r"^\W_"  # a course of these, or a word where there is none, as in arches
_IGNORED = "*"
_FIELD = re.compile(r"\{([^{}]*)\}")
_REMEDY = "write e.g. {block}:{role} or {block} {kind} {course} {role}"
_MARKS = " /;,|:"  # which separate fields, and are in few names
_LONG = (("{block}", "{kind}", "{course}", "{role}"), ("{block}", "{course}", "{kind}", "{role}"))
_SHORT = (("{block}", "{kind}", "{role}"), ("{block}", "{role}"), ("{block}", "{course}", "{role}"))
_USUAL = (
    *(
        f"{zone}{{course}}{mark}{{number}}{mark}{{kind}}{mark}{{role}}"
        for mark in "._/-"
        for zone in (f"{{zone}}{mark}", "")
    ),
    *(mark.join(fields) for mark in _MARKS for fields in _LONG),
    *(mark.join(fields) for mark in _MARKS for fields in _SHORT),
    *("{block} {kind} {course?} {role}", "{block}.{kind}.{role}"),
    *("{block}_{role}", "{block}-{role}", "{block}.{role}", "{role} {block}", "{role}:{block}"),
    *(
        "{block} {kind}",
        "{kind} {block} {role}",
        "{kind} {block}",
        "{block}:{role} {*}",
        "{block} {role} {*}",
    ),
    *("{block} {kind} {role} {*}", "{block}{role}", "{block}{role} {*}", "{block}", "{block} {*}"),
)
_CORNERS = 3  # of the smallest stone


@dataclass(frozen=True)
class CodeFields:
    """The fields of one description.

    Attributes
    ----------
    block : name of the stone; of the station, if that is its role
    kind, course, zone : of the stone; None if the template has no such field
    role : "vertex", "point" or "station"
    """

    block: str
    kind: str | None
    course: int | None
    zone: str | None
    role: str


class CodeTemplate:
    """A parsed template.

    Parameters
    ----------
    text : the template
    sommet : whether the role S is a corner, "sommet", instead of a station

    Raises
    ------
    UsageError
        if it has no block, has an unknown field, or is ambiguous
    """

    def __init__(self, text: str, sommet: bool = False) -> None:
        self.text, self._sommet = text, sommet
        parts = _FIELD.split(text.strip())
        self.fields = tuple(name.removesuffix("?") for name in parts[1::2])
        self._literals = parts[::2]
        self._optional = [name.endswith("?") for name in parts[1::2]]
        if any("{" in literal or "}" in literal for literal in self._literals):
            raise UsageError(f"code template {text!r} has a brace without its other", remedy=_REMEDY)
        self._check_fields()
        self._numbered = "block" not in self.fields
        self._matches = [self._compiled(variant) for variant in self._variants()]

    def parse(self, description: str) -> CodeFields | None:
        """Split a description into its fields; None if it does not fit the template."""
        found = next((parsed for match in self._matches if (parsed := match(description))), None)
        if found is None:
            return None
        fields = found.groupdict()
        kind, course = fields.get("kind"), fields.get("course")
        return CodeFields(
            block=_named(found) if self._numbered else fields["block"].rstrip(),
            kind=None if kind is None else kind.lower(),
            course=int(course) if course is not None and course.isdigit() else None,
            zone=fields.get("zone"),
            role=role_of(fields.get("role") or "v", self._sommet),
        )

    def expected(self, description: str, others: Sequence[str]) -> str:
        """Return the remedy for a description that does not fit: the usual template that fits it and others."""
        rows = [row for row in (description, *others) if not is_bare(row)]
        for text in _USUAL:
            template = CodeTemplate(text)
            fields = [template.parse(row) for row in rows]
            if rows and text != self.text and _is_sensible(text, fields):
                return f'it would be read by --codes "{text}"'
        return (
            f"correct it, or say by --codes how the codes are built; fields are {', '.join(_FIELDS)}, and {{*}} for "
            "what is ignored"
        )

    def _check_fields(self) -> None:
        named = [field for field in self.fields if field != _IGNORED]
        for name in named:
            if name not in _FIELDS:
                allowed = ", ".join((*_FIELDS, _IGNORED))
                raise UsageError(
                    f"code template {self.text!r} has a field {name!r}", remedy=f"fields: {allowed}"
                )
            if named.count(name) > 1:
                raise UsageError(f"code template {self.text!r} has {{{name}}} twice", remedy="keep one")
        names = [name for name in ("block", "number") if name in named]
        if len(names) != 1 or self._optional[self.fields.index(names[0])]:
            what = "{block} beside {number}" if len(names) == 2 else "no {block}"
            raise UsageError(f"code template {self.text!r} has {what}", remedy=_REMEDY)

    def _variants(self) -> Iterable[tuple[bool, ...]]:
        """Iterate over which fields are there: all first, and those with a closed list of words before others."""
        choices = [(True, False) if optional else (True,) for optional in self._optional]
        closed = [name in ("role", "course") for name in self.fields]
        return sorted(
            product(*choices),
            key=lambda choice: (-sum(choice), -sum(a and b for a, b in zip(choice, closed, strict=True))),
        )

    def _compiled(self, present: tuple[bool, ...]) -> Callable[[str], "re.Match[str] | None"]:
        """Return the match of a description that has these fields."""
        first = self._literals[0]
        names: list[str] = []
        between: list[str] = []
        last = ""
        for k, (name, there) in enumerate(zip(self.fields, present, strict=True)):
            before, after = self._literals[k], self._literals[k + 1]
            if not there:
                if names:  # with the text before it
                    last = after
                elif k == 0:  # with the text after it
                    first = before
                continue
            if names:
                between.append(before)
            names.append(name)
            last = after
        literals = set("".join(between) + last + first)
        free = "".join(
            re.escape(literal) for literal in sorted(literals) if not re.match(f"[{_CODE_LETTERS}]", literal)
        )
        if self._numbered:
            marks = re.escape("".join(sorted(literals)))
            apart = rf"[^\W_][^\s{marks}]{{0,63}}", rf"^\s{marks}"
            wide = {
                **_FIELDS,
                "zone": apart,
                "kind": (rf"[^\W\d_][^\s{marks}]{{0,31}}", apart[1]),
                "course": _WORD,
            }
        else:
            wide = {**_FIELDS, "block": (_FREE % free, _FREE_LETTERS % free)}
        fields = wide if _is_clear(wide, names, between) else _FIELDS
        if not _is_clear(fields, names, between):
            one, two, literal = _unclear(fields, names, between)
            raise UsageError(
                f"code template {self.text!r} can be read in two ways: {literal!r} does not separate "
                f"{{{one}}} from {{{two}}}",
                remedy="separate them by a character that neither of them has, such as a blank",
            )
        pattern = _literal(first)
        for name, literal, after in zip(names, [*between, last], [*names[1:], ""], strict=True):
            if _is_joined(name, literal, after):
                pattern += f"(?P<{name}>{fields[name][0]}(?<=[0-9]))"
            elif name == _IGNORED:
                pattern += (rf"[^{re.escape(literal[0])}]*" if literal else ".*") + _literal(literal)
            else:
                pattern += f"(?P<{name}>{fields[name][0]}){_literal(literal)}"
        return re.compile(pattern).fullmatch


def role_of(word: str, sommet: bool) -> str:
    """Return the role that a word stands for; with `sommet`, S is a corner."""
    word = word.casefold()
    return "vertex" if sommet and word == "s" else ROLES[word]


def is_bare(description: str) -> bool:
    """Return whether a description only says that its point is a station or a control point."""
    word = description.strip().casefold()
    return word in CONTROL_WORDS or ROLES.get(word) == STATION


def _named(found: "re.Match[str]") -> str:
    """Return the name of a stone from its zone, course and number, with the text between them."""
    groups = [name for name in _NAMED if found.groupdict().get(name) is not None]
    return found.string[min(found.start(name) for name in groups) : max(found.end(name) for name in groups)]


def _is_sensible(text: str, rows: Sequence[CodeFields | None]) -> bool:
    """Return whether a template fits all descriptions, and does not make a stone of every point."""
    fields = [row for row in rows if row is not None and code_of(row.block)]
    if len(fields) < len(rows):
        return False
    corners = Counter(row.block for row in fields if row.role == "vertex")
    if "{block}{role}" in text:  # the letter tells points from corners, and is no letter of the name
        return any(row.role == "point" and corners[row.block] for row in fields)
    return "{role}" in text or max(corners.values(), default=0) >= _CORNERS


Fields = Mapping[str, tuple[str, str]]


def _unclear(fields: Fields, names: Sequence[str], between: Sequence[str]) -> tuple[str, str, str]:
    """Return two fields whose separation is not clear, and the text between them; empty if all are separated.

    A field ends where the text after it has a character that the field cannot have; from the right likewise. If the
    fields can be peeled off from both ends in this way until one is left, there is one reading.
    """
    names, between = list(names), list(between)
    while between:
        if _ends(fields, names[0], between[0]) or _is_joined(names[0], between[0], names[1]):
            del names[0], between[0]
        elif _ends(fields, names[-1], between[-1]):
            del names[-1], between[-1]
        else:
            return names[0], names[1], between[0]
    return "", "", ""


def _is_clear(fields: Fields, names: Sequence[str], between: Sequence[str]) -> bool:
    return not _unclear(fields, names, between)[0]


def _ends(fields: Fields, field: str, literal: str) -> bool:
    if field == _IGNORED:
        return bool(literal)
    character = re.compile(f"[{fields[field][1]}]")
    return any(character.fullmatch(character_text) is None for character_text in literal)


def _is_joined(field: str, literal: str, after: str) -> bool:
    """Return whether a role follows a name at once; the digits end where its letters begin."""
    return not literal and after == "role" and field in _JOINED


def _literal(text: str) -> str:
    return r"[ \t]+".join(re.escape(word) for word in re.split(r"[ \t]+", text))
