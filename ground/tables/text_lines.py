"""Lines of a text file, one by one, after a check that it is text.

A file is read twice, each time in blocks of whole lines, so that memory does not grow with it: first to find its
encoding and to refuse control characters, then for its lines. UTF-8 is tried first, with or without a byte order
mark: hardly any text in another encoding is valid UTF-8 by chance. Everything else is taken as Latin-1, with the
quotation marks and dashes that Windows adds to it (code page 1252), in which nearly every byte is a character; other
encodings and binary files show by their control characters. UTF-16 with its mark, which Excel writes as "Unicode
text", and lines that end in carriage returns alone, as on old Macintoshes, are converted in memory.
"""

import io
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from ground.errors import SurveyError
from ground.tables.numbers import unreadable

_BLOCK = 1 << 18  # bytes read at a time
LONGEST_LINE = 1 << 16  # bytes of one line: far beyond any table that people write
_MARK = b"\xef\xbb\xbf"
_CONTROLS = bytes(code for code in range(128) if not chr(code).isprintable() and chr(code) not in "\t\n\r")
_SAVE_AS = "save the file as UTF-8 text"
_WIDE = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
_WIDEST = (b"\xff\xfe\x00\x00", b"\x00\x00\xfe\xff")  # UTF-32
_LARGEST = 1 << 28  # bytes of a file that is converted in memory
_BINARY = (
    (b"PK\x03\x04", "a workbook (XLSX, ODS) or another compressed file", "read it with --format csv"),
    (b"\xd0\xcf\x11\xe0", "an old workbook (XLS)", "read it with --format csv"),
    (b"%PDF", "a PDF", "export the table itself"),
    (b"LASF", "a point cloud (LAS)", "it has no stones: see moma ingest --help for clouds"),
    (b"ASTM-E57", "a point cloud (E57)", "it has no stones: see moma ingest --help for clouds"),
    (b"SQLite format 3", "a database (GeoPackage or another)", "export it as GeoJSON with z, or as a table with WKT"),
)  # fmt: skip


class TextLines:
    """The lines of a text file, an iterable of (number counted from 1, text without its end).

    Only line feeds, or carriage returns with line feeds, end a line, so that numbers agree with those of an editor.

    Attributes
    ----------
    path : as text, for messages
    encoding : "utf-8" or "cp1252", of which Latin-1 is a part
    end : number of the last line
    """

    def __init__(self, path: Path, longest: int = LONGEST_LINE) -> None:
        """Check the whole file, of which a line has at most so many bytes.

        Raises
        ------
        SurveyError
            if it cannot be read or is not text, with the line
        """
        self.path = str(path)
        self._longest = longest
        self._skip = 0
        self._converted: bytes | None = None
        self.encoding = self._find_encoding()
        self.end = self._check_characters()

    @property
    def is_converted(self) -> bool:
        """True if the file has another encoding or other line ends than its lines here."""
        return self._converted is not None

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

    def fail(self, line: int, what: str, remedy: str, kind: type[SurveyError] = SurveyError) -> SurveyError:
        """Make an error that names a line of this file."""
        return kind(what, where=f"{self.path}:{line}", remedy=remedy)

    def _convert(self) -> None:
        """Convert UTF-16, or lines that end in carriage returns alone, to UTF-8 with line feeds."""
        try:
            with Path(self.path).open("rb") as handle:
                start = handle.read(_BLOCK)
                wide = next((code for mark, code in _WIDE.items() if start.startswith(mark)), None)
                if start.startswith(_WIDEST):
                    raise self.fail(1, "the text is UTF-32", _SAVE_AS)
                if wide is None and (b"\r" not in start or b"\n" in start):
                    return
                data = start + handle.read(_LARGEST)
                if handle.read(1):
                    raise self.fail(1, f"UTF-16, or old line ends, in more than {_LARGEST} bytes", _SAVE_AS)
        except (OSError, ValueError) as error:
            raise unreadable(self.path, error, "give an existing file") from error
        if wide is not None:
            try:
                data = data.decode(wide).encode("utf-8")
            except UnicodeError as error:
                raise self.fail(1, "the file begins with the mark of UTF-16, but is not", _SAVE_AS) from error
            if b"\r" in data and b"\n" not in data:
                data = data.replace(b"\r", b"\n")
        elif b"\n" not in data:
            data = data.replace(b"\r", b"\n")
        else:
            return
        self._converted = data

    def _find_encoding(self) -> str:
        self._convert()
        marked, line = False, 1
        for number, block in enumerate(self._blocks()):
            if number == 0:
                for start, what, remedy in _BINARY:
                    if block.startswith(start):
                        raise self.fail(1, f"this is {what}, not text", remedy)
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
            _is_control(character) for character in set(self._decoded(block)) - {"\n", "\r"}
        )

    def _check_line(self, line: bytes, number: int) -> None:
        for character in self._decoded(line):
            if _is_control(character):
                code = ord(character) & 0xFF
                raise self.fail(number, f"control character 0x{code:02x}: this is not plain text", _SAVE_AS)

    def _decoded(self, data: bytes) -> str:
        """Decode bytes; invalid ones become lone surrogates."""
        return data.decode(self.encoding, "surrogateescape")

    def _blocks(self) -> Iterator[bytes]:
        """Read blocks of whole lines."""
        line, rest = 1, b""
        try:
            with self._open() as handle:
                handle.seek(self._skip)
                while block := handle.read(_BLOCK):
                    block = rest + block
                    cut = block.rfind(b"\n") + 1
                    rest = block[cut:]
                    if cut:
                        yield self._checked(block[:cut], line)
                        line += block.count(b"\n", 0, cut)
                    if len(rest) > self._longest:
                        break
        except (OSError, ValueError) as error:
            raise unreadable(self.path, error, "give an existing file") from error
        if rest:
            yield self._checked(rest, line)

    def _open(self) -> BinaryIO:
        return Path(self.path).open("rb") if self._converted is None else io.BytesIO(self._converted)

    def _checked(self, block: bytes, line: int) -> bytes:
        """Return the block unless one of its lines is too long."""
        start = 0
        while (stop := start + self._longest) < len(block):
            begin = block.rfind(b"\n", start, stop + 1) + 1
            if not begin:
                line += block.count(b"\n", 0, start)
                raise self.fail(
                    line, f"a line of more than {self._longest} bytes", "this is not a survey file"
                )
            start = begin
        return block


def _is_control(character: str) -> bool:
    code = ord(character)
    return (code < 32 and character != "\t") or 127 <= code < 160 or 0xDC80 <= code < 0xDD00
