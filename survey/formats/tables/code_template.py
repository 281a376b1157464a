"""Templates of the codes that surveyors key into an instrument.

A template is text with fields in braces, e.g. ``{block}:{role}`` or ``{block} {kind} {course?} {role}``; the text
between them stands for itself, a blank for one or more. A field with a question mark may be missing, together with the
text before it; ``{*}`` is read and ignored. A description has one reading or none: an ambiguous template is refused.
Where the name of a stone is made of its zone, course and number, ``{number}`` takes the place of ``{block}``. A role
or kind may follow a name at once, as in ``12-4E``: then the name ends in a digit. A field with a width, ``{course:2}``,
has so many characters, whatever follows.
"""

import re
from collections import Counter
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from ground.errors import UsageError
from survey.conventions import CORNERS
from survey.formats.fields import code_of
from survey.formats.tables.roles import CONTROL, ROLES, is_bare, role_of, roles_with

_CODE, _CODE_LETTERS = r"[^\W_][\w.+/:-]{0,63}", r"\w.+/:-"
_FREE, _FREE_LETTERS = r"[^\W_][^\t%s]{0,63}", r"^\t%s"  # all but what separates fields
_FIELDS = {  # pattern of each field, and its characters
    "block": (_CODE, _CODE_LETTERS),
    "zone": (_CODE, _CODE_LETTERS),
    "kind": (r"[^\W\d_][\w-]{0,31}", r"\w-"),
    "course": (r"[0-9]{1,6}", r"0-9"),
    "number": (r"[0-9]{1,6}[^\W\d_]?", r"^\W_"),
}
_JOINED = ("block", "course", "number")  # fields that end in a digit where a role or kind follows at once
_LETTERS = r"[^\W\d_]{1,32}"  # kind that follows at once
_NAMED = ("zone", "course", "number")  # fields that name a stone together
_WORD = r"[0-9]{1,6}|[^\W\d_]{1,8}", r"^\W_"  # a course of these, or a word where there is none, as in arches
_IGNORED = "*"
_FIELD = re.compile(r"\{([^{}]*)\}")
_WIDTH = re.compile(r"([^:?]*)(?::([1-9][0-9]?))?(\?)?")
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
    *(f"{name}{{kind}}{role}" for name in ("{course:2}{number:2}", "{block}") for role in (" {role?}", "")),
    "{block} {role?}",
    *(
        *("{block} {kind}", "{kind} {block} {role}", "{kind} {block}", "{block}:{role} {*}"),
        "{block} {role} {*}",
    ),
    *("{block} {kind} {role} {*}", "{block}{role}", "{block}{role} {*}", "{block}", "{block} {*}"),
)
_STONES_OF_KIND = 2  # stones for each kind, on average, from which letters that end names are kinds


@dataclass(frozen=True)
class CodeFields:
    """The fields of one description.

    Attributes
    ----------
    block : name of the stone; of the station, if that is its role
    kind, course, zone : of the stone; None if the template has no such field
    role : "vertex", "point" or "station"
    counted : whether the role has a number
    """

    block: str
    kind: str | None
    course: int | None
    zone: str | None
    role: str
    counted: bool = False


class CodeTemplate:
    """A parsed template.

    Parameters
    ----------
    text : the template
    roles : of points by words that are the user's own
    numbered : whether roles may have numbers: v1, v2, p1

    Raises
    ------
    UsageError
        if it has no block, has an unknown field, or is ambiguous
    """

    def __init__(self, text: str, roles: Mapping[str, str] | None = None, numbered: bool = True) -> None:
        self.text, self._words, self._counted = text, roles or {}, numbered
        self._roles = roles_with(self._words)
        parts = _FIELD.split(text.strip())
        self._literals = parts[::2]
        if any("{" in literal or "}" in literal for literal in self._literals):
            raise UsageError(f"code template {text!r} has a brace without its other", remedy=_REMEDY)
        matches = [_WIDTH.fullmatch(field) for field in parts[1::2]]
        self.fields = tuple(
            text if match is None else match[1] for text, match in zip(parts[1::2], matches, strict=True)
        )
        self._optional = [match is not None and bool(match[3]) for match in matches]
        self._widths = {match[1]: int(match[2]) for match in matches if match is not None and match[2]}
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
            role=role_of(fields.get("role") or "v", self._roles) or "vertex",
            counted=(fields.get("role") or "v")[-1].isdigit(),
        )

    def expected(self, description: str, others: Sequence[str]) -> str:
        """Return the remedy for a description that does not fit: the usual template that fits it and others."""
        rows = [row for row in (description, *others) if not is_bare(row, self._roles)]
        words = {row: None for row in rows if not any(map(str.isdigit, row))}
        if len(words) < len(rows) / 2:  # stones are numbered, so that these are none
            rows = [row for row in rows if row not in words]
        else:
            words = {}
        starts = {row.split()[0] for row in rows if row.strip()}
        word = starts.pop() if len(starts) == 1 else ""  # the same before all is of no stone
        before = f"{word} " if word and not any(map(str.isdigit, word)) else ""
        for text in (*(before + text for text in _USUAL if before), *_USUAL):
            template = CodeTemplate(text, self._words)
            fields = [template.parse(row) for row in rows]
            if rows and text != self.text and _is_sensible(text, fields):
                meant = ",".join(f"{word}={CONTROL}" for word in words)
                return f'it would be read by --codes "{text}"' + (
                    f'; if points {", ".join(words)} belong to no stone, also give --roles "{meant}"'
                    if words
                    else ""
                )
        return (
            f"correct it, or say by --codes how the codes are built; fields are {', '.join((*_FIELDS, 'role'))}, and "
            "{*} for what is ignored"
        )

    def _check_fields(self) -> None:
        named = [field for field in self.fields if field != _IGNORED]
        for name in named:
            if name not in (*_FIELDS, "role"):
                allowed = ", ".join((*_FIELDS, "role", _IGNORED))
                raise UsageError(
                    f"code template {self.text!r} has a field {name!r}", remedy=f"fields: {allowed}"
                )
            if name in self._widths and name == "role":
                raise UsageError(f"code template {self.text!r} gives a role a width", remedy="leave it out")
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
        usual = {**_FIELDS, "role": _pattern_of_roles(self._words, self._counted)}
        if self._numbered:
            marks = re.escape("".join(sorted(literals)))
            apart = rf"[^\W_][^\s{marks}]{{0,63}}", rf"^\s{marks}"
            wide = {
                **usual,
                "zone": apart,
                "kind": (rf"[^\W\d_][^\s{marks}]{{0,31}}", apart[1]),
                "course": _WORD,
            }
        else:
            wide = {**usual, "block": (_FREE % free, _FREE_LETTERS % free)}
        fixed = {name: _fixed(name, width, self._numbered) for name, width in self._widths.items()}
        fields = (
            {**wide, **fixed} if _is_clear({**wide, **fixed}, names, between, fixed) else {**usual, **fixed}
        )
        if not _is_clear(fields, names, between, fixed):
            one, two, literal = _unclear(fields, names, between, fixed)
            raise UsageError(
                f"code template {self.text!r} can be read in two ways: {literal!r} does not separate "
                f"{{{one}}} from {{{two}}}",
                remedy="separate them by a character that neither of them has, such as a blank; or give their width, "
                f"{{{one}:2}}",
            )
        pattern, before = _literal(first), ""
        for name, literal, after in zip(names, [*between, last], [*names[1:], ""], strict=True):
            joined = name not in fixed and _is_joined(name, literal, after)
            if name == _IGNORED:
                pattern += (rf"[^{re.escape(literal[0])}]*" if literal else ".*") + _literal(literal)
            else:
                pattern_of_field = _LETTERS if name == "kind" and before else fields[name][0]
                pattern += (
                    f"(?P<{name}>{pattern_of_field}{'(?<=[0-9])' if joined else ''}){_literal(literal)}"
                )
            before = name if joined else ""
        return re.compile(pattern).fullmatch


def _pattern_of_roles(own_words: Mapping[str, str], numbered: bool) -> tuple[str, str]:
    """Return the pattern of the words for roles, and their characters."""
    words = [word for word in {**ROLES, **own_words} if " " not in word]
    pattern = "|".join(sorted(map(re.escape, words), key=len, reverse=True))
    letters = re.escape("".join(sorted(set("".join(words)))))
    number = "[0-9]{0,3}" if numbered else ""
    return rf"(?i:{pattern}){number}", letters + letters.upper() + ("0-9" if numbered else "")


def _fixed(name: str, width: int, numbered: bool) -> tuple[str, str]:
    """Return the pattern of a field of so many characters, and its characters; a course may be a shorter word."""
    if name == "number" or (name == "course" and not numbered):
        return rf"[0-9]{{{width}}}", "0-9"
    if name == "course":
        return rf"(?:[0-9]{{{width}}}|[^\W\d_]{{1,{width}}}(?![^\W\d_]))", r"^\W_"
    letters = _FIELDS[name][1]
    return rf"[^\W_][{letters}]{{{width - 1}}}", letters


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
    if "}{kind}" in text and not _end_in_kinds(fields):
        return False
    if "{course:2}" in text and not _are_counted(fields):
        return False
    counted = any(row.counted for row in fields)  # or a name that ends so
    # the letter tells points from corners, and is none of the name
    if counted or "{role?}" in text or "{block}{role}" in text:
        return any(row.role == "point" and corners[row.block] for row in fields)
    return "{role}" in text or max(corners.values(), default=0) >= CORNERS


def _end_in_kinds(fields: Sequence[CodeFields]) -> bool:
    """Return whether the letters with which names end are kinds: one for each name, and few for many."""
    kinds: dict[str, set[str | None]] = {}
    for row in fields:
        kinds.setdefault(row.block, set()).add(row.kind)
    different = set[str | None]().union(*kinds.values())
    return (
        all(len(words) == 1 for words in kinds.values())
        and 1 < len(different) <= len(kinds) / _STONES_OF_KIND
    )


def _are_counted(fields: Sequence[CodeFields]) -> bool:
    """Return whether names are courses from the first or second, without a gap, and in each stones from the first."""
    numbers: dict[int, set[int]] = {}
    for row in fields:
        if row.course is not None:
            numbers.setdefault(row.course, set()).add(int(row.block[-2:]))
    courses = sorted(numbers)
    return (
        bool(courses)
        and courses == list(range(courses[0], courses[0] + len(courses)))
        and courses[0] < 2
        and all(min(stones) < 2 for stones in numbers.values())
    )


Fields = Mapping[str, tuple[str, str]]


def _unclear(
    fields: Fields, names: Sequence[str], between: Sequence[str], fixed: Container[str]
) -> tuple[str, str, str]:
    """Return two fields whose separation is not clear, and the text between them; empty if all are separated.

    A field ends where the text after it has a character that the field cannot have, or after its width; from the right
    likewise. If the fields can be peeled off from both ends in this way until one is left, there is one reading.
    """
    names, between = list(names), list(between)
    while between:
        if (
            names[0] in fixed
            or _ends(fields, names[0], between[0])
            or _is_joined(names[0], between[0], names[1])
        ):
            del names[0], between[0]
        elif _ends(fields, names[-1], between[-1]):
            del names[-1], between[-1]
        else:
            return names[0], names[1], between[0]
    return "", "", ""


def _is_clear(fields: Fields, names: Sequence[str], between: Sequence[str], fixed: Container[str]) -> bool:
    return not _unclear(fields, names, between, fixed)[0]


def _ends(fields: Fields, field: str, literal: str) -> bool:
    if field == _IGNORED:
        return bool(literal)
    character = re.compile(f"[{fields[field][1]}]")
    return any(character.fullmatch(character_text) is None for character_text in literal)


def _is_joined(field: str, literal: str, after: str) -> bool:
    """Return whether a role or kind follows a name at once; the digits end where its letters begin."""
    return not literal and after in ("role", "kind") and field in _JOINED


def _literal(text: str) -> str:
    return r"[ \t]+".join(re.escape(word) for word in re.split(r"[ \t]+", text))
