"""Text of a JSON document, read forward one value at a time, each with its place.

The standard library's decoder reads the values. It is as fast as the event parsers that were tried, returns the same
float64 for every number whatever the locale, reads whole numbers of any size, detects repeated keys and reports the
place of an error.
"""

import codecs
import re
import zlib
from json import JSONDecodeError, JSONDecoder
from typing import Any, BinaryIO, NoReturn

from ground.errors import ExchangeError

CHUNK = 1 << 20
"""Bytes that are read at once."""

VALUE_LIMIT = 1 << 28
"""Characters of the longest value: a stone with some four million points."""

_LONGEST_WORD = 16
"""Errors this close to the end of what was read may come from a word, a number or an escape cut in two."""

_BLANKS = re.compile(r"[ \t\r\n]*")


class _Unreadable(ValueError):
    """A value that JSON's grammar allows and this program refuses."""


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content = dict(pairs)
    if len(content) != len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))  # type: ignore[func-returns-value]
        raise _Unreadable(f"the key {twice[:40]!a} comes twice in one object")
    return content


def _refuse_constant(word: str) -> NoReturn:
    raise _Unreadable(f"{word} is no JSON; what is not known is null")


def _ended(error: JSONDecodeError) -> bool:
    """Return whether the error is that the document ends."""
    rest = error.doc[error.pos :]
    if error.msg.startswith("Unterminated string") or (
        error.msg.startswith("Invalid \\") and '"' not in rest
    ):
        return True
    if re.fullmatch(r"\.|[eE][-+]?", rest.strip()):  # of a number
        return True
    return any(word.startswith(rest.strip()) for word in ("true", "false", "null", "-"))


class JsonText:
    """A document with a current place in it.

    Parameters
    ----------
    stream : of UTF-8 bytes
    name : of the document, for errors
    limit : characters of the longest value
    """

    def __init__(self, stream: BinaryIO, name: str, limit: int = VALUE_LIMIT) -> None:
        self._stream, self._name, self._limit = stream, name, limit
        self._decoder = codecs.getincrementaldecoder("utf-8-sig")("strict")
        self._decode = JSONDecoder(object_pairs_hook=_object, parse_constant=_refuse_constant).raw_decode
        self._text, self._at, self._before = "", 0, 0
        self._bytes, self._done = 0, False
        self._line, self._counted, self._column = 1, 0, 1

    @property
    def line(self) -> int:
        """Line of the place, from 1."""
        self._line += self._text.count("\n", self._counted, self._at)
        self._counted = self._at
        return self._line

    @property
    def consumed(self) -> int:
        """Number of characters before the place."""
        return self._before + self._at

    def peek(self) -> str:
        """Return the next character that is not blank; empty at the end."""
        while True:
            self._at = _BLANKS.match(self._text, self._at).end()  # type: ignore[union-attr]
            if self._at < len(self._text):
                return self._text[self._at]
            if not self._more():
                return ""

    def take(self, *wanted: str) -> str:
        """Return the next character that is not blank, which must be one of these; "" stands for the end."""
        found = self.peek()
        if found not in wanted:
            expected = " or ".join(character or "the end" for character in wanted)
            self.refuse(f"found {found!a}, expected {expected}" if found else f"it ends before {expected}")
        self._at += len(found)
        return found

    def value(self) -> Any:
        """Return the next value, whole."""
        self.peek()
        while True:
            try:
                value, end = self._decode(self._text, self._at)
            except JSONDecodeError as error:
                if self._cut(error) and self._more():
                    continue
                cut = _ended(error)
                self._at = len(self._text) if cut else error.pos
                self.refuse("it ends in the middle of a value" if cut else f"this is no JSON: {error.msg}")
            except RecursionError:
                self.refuse("lists or objects are nested too deeply")
            except ValueError as error:
                self.refuse(str(error) if isinstance(error, _Unreadable) else "a number has too many digits")
            # A number at the end of what was read may go on: 1e+ was read as 1 so far.
            if end + 2 >= len(self._text) and self._more():
                continue
            self._at = end
            return value

    @property
    def column(self) -> int:
        """Column of the place in its line, from 1."""
        newline = self._text.rfind("\n", 0, self._at)
        return self._at - newline if newline >= 0 else self._column + self._at

    def refuse(self, what: str, remedy: str | None = None) -> NoReturn:
        """Raise an error at this place."""
        raise ExchangeError(what, where=f"{self._name}:{self.line} character {self.column}", remedy=remedy)

    def _cut(self, error: JSONDecodeError) -> bool:
        """Return whether the error may vanish when more text is read."""
        return error.pos >= len(self._text) - _LONGEST_WORD or error.msg.startswith("Unterminated string")

    def _more(self) -> bool:
        """Read on; False at the end. What lies before the place is forgotten."""
        if self._done:
            return False
        waiting = len(self._text) - self._at
        if waiting > self._limit:
            self.refuse(f"a value is longer than {self._limit} characters")
        self._line, self._column = self.line, self.column
        self._before += self._at
        self._text, self._at, self._counted = self._text[self._at :], 0, 0
        # A long value is read again from its beginning, hence as much again as there is.
        self._text += self._read(max(CHUNK, waiting))
        return True

    def _read(self, size: int) -> str:
        pending = len(self._decoder.getstate()[0])
        try:
            raw = self._stream.read(size)
            self._done = not raw
            text = self._decoder.decode(raw, self._done)
        except UnicodeDecodeError as error:
            where = f"{self._name} byte {self._bytes - pending + error.start}"
            raise ExchangeError(f"this is not UTF-8 ({error.reason})", where=where) from None
        except (OSError, EOFError, zlib.error) as error:
            raise ExchangeError(f"it cannot be read: {error}", where=self._name) from error
        self._bytes += len(raw)
        return text
