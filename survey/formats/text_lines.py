"""Lines of a text file, one by one, after a check that it is text.

A file is read twice, each time in blocks of whole lines, so that memory does not grow with it: first to find its
encoding and to refuse control characters, then for its lines. UTF-8 is tried first, with or without a byte order
mark: hardly any text in another encoding is valid UTF-8 by chance. Everything else is taken as Latin-1, with the
quotation marks and dashes that Windows adds to it (code page 1252), in which nearly every byte is a character; other
encodings and binary files show by their control characters.
"""

from collections.abc import Iterator
from pathlib import Path

from moma.errors import SurveyError
from survey.formats.fields import unreadable

__all__ = ["TextLines"]

_BLOCK = 1 << 18  # bytes read at a time
_LONGEST = 1 << 16  # bytes of one line: far beyond any table that people write
_MARK = b"\xef\xbb\xbf"
_CONTROLS = bytes([*range(9), 11, 12, *range(14, 32), 127])  # all but tab, line feed and carriage return
_SAVE_AS = "save the file as UTF-8 text"


class TextLines:
    """The lines of a text file, an iterable of (number counted from 1, text without its end).

    Only line feeds, or carriage returns with line feeds, end a line, so that numbers agree with those of an editor.

    Attributes
    ----------
    path : as text, for messages
    encoding : "utf-8" or "cp1252", of which Latin-1 is a part
    end : number of the last line
    """

    def __init__(self, path: Path) -> None:
        """Check the whole file.

        Raises
        ------
        SurveyError
            if it cannot be read or is not text, with the line
        """
        self.path = str(path)
        self._skip = 0
        self.encoding = self._find_encoding()
        self.end = self._check_characters()

    def __iter__(self) -> Iterator[tuple[int, str]]:
        number = 0
        for block in self._blocks():
            lines = block.decode(self.encoding).replace("\r\n", "\n").split("\n")
            if not lines[-1]:
                del lines[-1]
            for line in lines:
                number += 1
                yield number, line
                # a last line may end in a carriage return alone; stripping blanks removes it

    def rows(self) -> Iterator[tuple[int, str]]:
        """Iterate over the lines of a table, without comments and rows of nothing but separators."""
        for number, line in self:
            text = line.strip(" \t,;")
            if text and not text.startswith("#"):
                yield number, line

    def fail(self, line: int, what: str, remedy: str) -> SurveyError:
        """Make an error that names a line of this file."""
        return SurveyError(what, where=f"{self.path}:{line}", remedy=remedy)

    def _find_encoding(self) -> str:
        marked, line = False, 1
        for number, block in enumerate(self._blocks()):
            if number == 0:
                if block.startswith((b"\xff\xfe", b"\xfe\xff")):
                    raise self.fail(1, "the text is UTF-16 or UTF-32", _SAVE_AS)
                marked = block.startswith(_MARK)
            try:
                block.decode("utf-8")
            except UnicodeDecodeError as error:
                if not marked:
                    return "cp1252"
                line += block.count(b"\n", 0, error.start)
                what = f"the file begins with the mark of UTF-8, but byte 0x{block[error.start]:02x} is not UTF-8"
                raise self.fail(line, what, _SAVE_AS) from error
            line += block.count(b"\n")
        self._skip = len(_MARK) if marked else 0
        return "utf-8"

    def _check_characters(self) -> int:
        """Refuse control characters; return the number of the last line."""
        line = 1
        for block in self._blocks():
            if self._has_controls(block):
                for offset, text in enumerate(block.split(b"\n")):
                    self._check_line(text.removesuffix(b"\r"), line + offset)
            line += block.count(b"\n")
        return line

    def _has_controls(self, block: bytes) -> bool:
        if block.count(b"\r") != block.count(b"\r\n") or len(block.translate(None, _CONTROLS)) < len(block):
            return True
        return not block.isascii() and any(
            _is_control(one) for one in set(self._decoded(block)) - {"\n", "\r"}
        )

    def _check_line(self, line: bytes, number: int) -> None:
        for one in self._decoded(line):
            if _is_control(one):
                code = ord(one) & 0xFF
                raise self.fail(number, f"control character 0x{code:02x}: this is not plain text", _SAVE_AS)

    def _decoded(self, data: bytes) -> str:
        """Decode bytes; invalid ones become lone surrogates."""
        return data.decode(self.encoding, "surrogateescape")

    def _blocks(self) -> Iterator[bytes]:
        """Read blocks of whole lines."""
        line, rest = 1, b""
        try:
            with Path(self.path).open("rb") as handle:
                handle.seek(self._skip)
                while block := handle.read(_BLOCK):
                    block = rest + block
                    cut = block.rfind(b"\n") + 1
                    rest = block[cut:]
                    if cut:
                        yield self._checked(block[:cut], line)
                        line += block.count(b"\n", 0, cut)
                    if len(rest) > _LONGEST:
                        break
        except (OSError, ValueError) as error:
            raise unreadable(self.path, error, "give an existing survey file") from error
        if rest:
            yield self._checked(rest, line)

    def _checked(self, block: bytes, line: int) -> bytes:
        """Return the block unless one of its lines is too long."""
        start = 0
        while (stop := start + _LONGEST) < len(block):
            found = block.rfind(b"\n", start, stop + 1) + 1
            if not found:
                line += block.count(b"\n", 0, start)
                raise self.fail(line, f"a line of more than {_LONGEST} bytes", "this is not a survey file")
            start = found
        return block


def _is_control(one: str) -> bool:
    code = ord(one)
    return (code < 32 and one != "\t") or 127 <= code < 160 or 0xDC80 <= code < 0xDD00
