"""Templates of the codes that surveyors key into an instrument.

A template is text with fields in braces, e.g. ``{block}:{role}`` or ``{block} {kind} {course} {role}``; the text
between them stands for itself, a blank for one or more. A description has one reading or none: an ambiguous template
is refused.
"""

import re
from dataclasses import dataclass

from moma.errors import UsageError

__all__ = ["STATION", "CodeFields", "CodeTemplate"]

STATION = "station"
"""The role of a position of the instrument."""

_FIELDS = {  # pattern of each field, and of its characters
    "block": (r"[^\W_][\w.+/:-]{0,63}", r"[\w.+/:-]"),
    "zone": (r"[^\W_][\w.+/:-]{0,63}", r"[\w.+/:-]"),
    "kind": (r"[A-Za-z][A-Za-z0-9_-]{0,31}", r"[A-Za-z0-9_-]"),
    "course": (r"[0-9]{1,6}", r"[0-9]"),
    "role": (r"(?i:vertex|v|point|p|station|s)", r"(?i:[vertxpoinsa])"),
}
_ROLES = {"v": "vertex", "p": "point", "s": STATION}
_PART = re.compile(r"\{([^{}]*)\}")
_REMEDY = "write e.g. {block}:{role} or {block} {kind} {course} {role}"


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

    Raises
    ------
    UsageError
        if it has no block, has an unknown field, or is ambiguous
    """

    def __init__(self, text: str) -> None:
        self.text = text
        parts = _PART.split(text.strip())
        self.fields, literals = tuple(parts[1::2]), parts[::2]
        if any("{" in one or "}" in one for one in literals):
            raise UsageError(f"code template {text!r} has a brace without its other", remedy=_REMEDY)
        self._check_fields()
        self._check_separation(literals[1:-1])
        pattern = _literal(literals[0])
        for name, literal in zip(self.fields, literals[1:], strict=True):
            pattern += f"(?P<{name}>{_FIELDS[name][0]}){_literal(literal)}"
        self._match = re.compile(pattern).fullmatch

    def parse(self, description: str) -> CodeFields | None:
        """Split a description into its fields; None if it does not fit the template."""
        found = self._match(description)
        if found is None:
            return None
        fields = found.groupdict()
        kind, course = fields.get("kind"), fields.get("course")
        return CodeFields(
            block=fields["block"],
            kind=None if kind is None else kind.lower(),
            course=None if course is None else int(course),
            zone=fields.get("zone"),
            role=_ROLES[fields.get("role", "v")[0].lower()],
        )

    def _check_fields(self) -> None:
        for name in self.fields:
            if name not in _FIELDS:
                known = ", ".join(_FIELDS)
                raise UsageError(
                    f"code template {self.text!r} has a field {name!r}", remedy=f"fields: {known}"
                )
            if self.fields.count(name) > 1:
                raise UsageError(f"code template {self.text!r} has {{{name}}} twice", remedy="keep one")
        if "block" not in self.fields:
            raise UsageError(f"code template {self.text!r} has no {{block}}", remedy=_REMEDY)

    def _check_separation(self, literals: list[str]) -> None:
        """Check that every field has a known end.

        A field ends where the text after it has a character that the field cannot have; from the right likewise.
        If the fields can be peeled off from both ends in this way until one is left, there is one reading.
        """
        names, between = list(self.fields), list(literals)
        while between:
            if _ends(names[0], between[0]):
                del names[0], between[0]
            elif _ends(names[-1], between[-1]):
                del names[-1], between[-1]
            else:
                first, second = names[0], names[1]
                raise UsageError(
                    f"code template {self.text!r} can be read in two ways: {between[0]!r} does not separate "
                    f"{{{first}}} from {{{second}}}",
                    remedy="separate them by a character that neither of them has, such as a blank",
                )


def _ends(field: str, literal: str) -> bool:
    character = re.compile(_FIELDS[field][1])
    return any(character.fullmatch(one) is None for one in literal)


def _literal(text: str) -> str:
    return r"[ \t]+".join(re.escape(one) for one in re.split(r"[ \t]+", text))
