"""Parser of one line of the native format, word by word."""

import re
from re import Pattern

from ground.errors import SurveyError
from ground.tables.numbers import parse_length, parse_number, shown
from survey.formats.fields import CODE, KIND, parse_course
from survey.formats.tables.kinds import kind_of

NAME_REMEDY = "use letters, digits and . + / : - _, at most 64"

_WORD = re.compile(r'\s*("[^"]*"(?=\s|$)|\S+)')
_QUOTED = re.compile(r"\S(?:.{0,62}\S)?")
_COURSES = re.compile(r"\s*(\d{1,6})(?:\s*-\s*(\d{1,6}))?(?=\s|$)", re.ASCII)


class Cursor:
    """A position in a line. A word that begins with ``#`` begins a comment, except in text.

    Attributes
    ----------
    where : "file:line", for errors
    """

    def __init__(self, line: str, where: str) -> None:
        self._line, self._at, self.where = line, 0, where

    def fail(self, what: str, remedy: str) -> SurveyError:
        """Make an error that names this line."""
        return SurveyError(what, where=self.where, remedy=remedy)

    def peek(self) -> str:
        """Return the next word without consuming it; empty at the end of the line."""
        match = _WORD.match(self._line, self._at)
        return "" if match is None or match[1].startswith("#") else match[1]

    def word(self) -> str:
        """Consume the next word; empty at the end of the line."""
        match = _WORD.match(self._line, self._at)
        if match is None or match[1].startswith("#"):
            return ""
        self._at = match.end()
        return match[1]

    def keyword(self, word: str) -> bool:
        """Consume the next word if it is this one; return whether it was."""
        if self.peek() != word:
            return False
        self.word()
        return True

    def copy(self) -> "Cursor":
        """Return a cursor at the same position."""
        copied = Cursor(self._line, self.where)
        copied._at = self._at
        return copied

    def key(self) -> str:
        """Consume the next word, even if it begins with ``#`` or a quotation mark."""
        words = self._line[self._at :].split(maxsplit=1)
        if not words:
            return ""
        self._at = self._line.index(words[0], self._at) + len(words[0])
        return words[0]

    def matching(self, pattern: Pattern[str], what: str, remedy: str) -> str:
        """Consume the next word, which must match a pattern."""
        word = self.word()
        if pattern.fullmatch(word) is None:
            raise self.fail(f"{what} {shown(word)} is not a {what}", remedy)
        return word

    def code(self, what: str = "code") -> str:
        """Consume the name of a stone."""
        return self.matching(CODE, what, NAME_REMEDY)

    def kind(self) -> str:
        """Consume the name of a kind of stone, in upper or lower case and in any language of tables."""
        word = kind_of(self.word(), {})
        if KIND.fullmatch(word) is None:
            raise self.fail(f"kind {shown(word)} is not a kind", "use letters, e.g. header")
        return word

    def name(self, what: str) -> str:
        """Consume a name: one word, or several in quotes."""
        word = self.peek()
        if word.startswith('"') and len(word) > 1:
            self.word()
            text = word[1:-1]
            if not (word.endswith('"') and _QUOTED.fullmatch(text) and text.isprintable()):
                raise self.fail(f"{what} {shown(word)} is not a name", 'write e.g. "north wall"')
            return text
        return self.code(what)

    def number(self, what: str) -> float:
        """Consume a number."""
        word = self.word()
        if not word:
            raise self.fail(f"{what} is missing", "write a number")
        return parse_number(word, what, self.where)

    def length(self, what: str) -> float:
        """Consume a number greater than 0."""
        word = self.word()
        if not word:
            raise self.fail(f"{what} is missing", "write a number greater than 0")
        return parse_length(word, what, self.where)

    def row(self, what: str, axes: str = "xyz") -> tuple[float, ...]:
        """Consume coordinates, one for each axis."""
        values: list[float] = []
        for axis in axes:
            if self.peek() in ("", "at", "sigma", "site"):
                need = " ".join(axes.upper())
                raise self.fail(f"{what} has {len(values)} coordinates", f"write: {what} {need}")
            values.append(parse_number(self.word(), f"{what} {axis}", self.where))
        return tuple(values)

    def course(self) -> int:
        """Consume the number of a course."""
        return parse_course(self.word(), self.where)

    def courses(self) -> tuple[int, int]:
        """Consume a course, or first - last."""
        match = _COURSES.match(self._line, self._at)
        if match is None:
            raise self.fail(f"courses {shown(self.peek())}", "write: course 3, or: course 3-5")
        self._at = match.end()
        first, last = int(match[1]), int(match[2] or match[1])
        if first > last:
            raise self.fail(f"courses {first}-{last}", "write the lower course first")
        return first, last

    def sigma(self, what: str) -> float | None:
        """Consume ``sigma S`` if it comes next."""
        return self.length(f"{what} sigma") if self.keyword("sigma") else None

    def source(self, what: str) -> str:
        """Consume ``source TEXT``, which must come next."""
        if not self.keyword("source"):
            raise self.fail(f"the {what} has no source", f"write: {what} … source TEXT")
        return self.text("source")

    def text(self, what: str) -> str:
        """Consume the rest of the line."""
        text = self._line[self._at :].strip().replace("\t", " ")
        self._at = len(self._line)
        if not text or not text.isprintable():
            raise self.fail(f"{what} has no readable text", "write printable words after it")
        return text

    def end(self, remedy: str) -> None:
        """Check that nothing but a comment is left of the line."""
        if word := self.peek():
            raise self.fail(f"unexpected {shown(word)}", remedy)

    def check_first(self, value: object, word: str) -> None:
        """Check that a value which may be stated once is not yet known."""
        if value is not None:
            raise self.fail(f"a second {word!r}", f"keep one {word!r} line")
