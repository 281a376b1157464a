"""The native survey format: one text file, one record per stone, line by line.

Grammar (EBNF; every production but `file` and `stone` is one line, words separated by blanks; ``#`` at the start
of a line or after a blank begins a comment, except in TEXT; blank lines are free)::

    file    = "moma-survey" "1" , { header } , stone , { stone } ;
    header  = "name" TEXT
            | "observer" X Y Z                              (* where the surveyor stood *)
            | "station" NAME X Y Z
            | "sigma" S                                     (* of one coordinate without its own *)
            | "control" NAME X Y Z [ "sigma" S ] "site" X Y Z [ "sigma" S ]
            | "photo" NAME [ "sigma" PIXELS ] [ "station" NAME ]
            | "mark" PHOTO U V "at" X Y Z [ "sigma" S ]     (* four or more per photo *)
            | "depth" ( KIND | "*" ) [ "course" N [ "-" N ] ] [ "zone" NAME ] D [ "sigma" S ] "source" TEXT
            | "canon" KIND LENGTH HEIGHT "sigma" S "source" TEXT
            | "extrude" [ "along" DX DY DZ ] [ "tail" T ]
            | "roughness" ( S | "0" )                       (* of faces about their planes *)
            | "orientation" TEXT                            (* result of moma orient *)
            | "surface" NAME ( "plane" | "cylinder" ) [ "sigma" S ] ;
    stone   = "stone" CODE KIND [ "course" N ] [ "zone" NAME ] , { item } , "end" ;
    item    = "vertex" X Y Z [ "sigma" S ]                  (* 3 or more, in order around the face *)
            | "point" X Y Z [ "sigma" S ]
            | "photo" NAME
            | "pixel" U V                                   (* 3 or more, instead of vertices *)
            | "mark" NAME ( "vertex" | "point" ) PHOTO X Y [ "sigma" PIXELS ]   (* on an oriented photograph *)
            | "on" SURFACE
            | "station" NAME
            | "extrude" [ "along" DX DY DZ ] [ "tail" T ]
            | "sigma" S
            | "depth" D [ "sigma" S ] "source" TEXT
            | "note" KEY TEXT ;
    NAME    = CODE | '"' TEXT '"' ;

All lengths are metres. TEXT runs to the end of its line. A wrong head refuses the file, a wrong stone that stone:
reading goes on behind its ``end``, or at the next line that begins with ``stone``.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from ground.errors import SurveyError, UsageError
from ground.tables.text_lines import TextLines
from survey.formats.native.cursor import Cursor
from survey.formats.native.header import HeadReader
from survey.formats.native.stone import STONE_WORDS, StoneReader
from survey.formats.options import ReadingOptions, whole
from survey.records.survey import BlockRecord, Reject, Survey, SurveyHead, SurveyStream

MAGIC = "moma-survey 1"
"""First line of the format."""


def open_moma(path: Path, options: ReadingOptions | None = None) -> SurveyStream:
    """Open a native survey file, whose stones are then read one by one.

    Parameters
    ----------
    path : the file
    options : a head of another file is refused, because a native survey has its own; the rest is not used

    Raises
    ------
    SurveyError
        naming file and line, if the file as a whole or its head is wrong
    """
    if options is not None and options.head is not None:
        raise UsageError(
            "a native survey has a head of its own", where=str(path), remedy="leave out the header file"
        )
    lines = TextLines(Path(path))
    numbered = iter(lines)
    reader, first = _read_head(lines, numbered)
    if first is None:
        raise lines.fail(lines.end, "the survey has no stones", "add 'stone CODE KIND' … 'end'")
    head = reader.finish(Path(path).stem, str(path))
    return SurveyStream(head, _Stones(lines, numbered, head, reader.sigma).records(first))


def read_moma(path: Path) -> Survey:
    """Read a native survey file as a whole.

    Raises
    ------
    SurveyError
        naming file and line, when any line is wrong
    """
    return whole(open_moma(path), Path(path))


def read_head(path: Path) -> SurveyHead:
    """Read a header file: a native survey without stones, for formats that have no head of their own.

    Its name is empty if the file states none. The sigma of the file is that of its control points and marks;
    `with_header` also takes it for the stones.

    Raises
    ------
    SurveyError
        naming file and line, when any line is wrong
    """
    return _header_file(path)[0]


def with_header(options: ReadingOptions, path: Path) -> ReadingOptions:
    """Return the options with the head of a header file, and with its sigma if it states one."""
    head, sigma = _header_file(path)
    return replace(options, head=head, sigma=options.sigma if sigma is None else sigma)


def _header_file(path: Path) -> tuple[SurveyHead, float | None]:
    lines = TextLines(Path(path))
    reader, first = _read_head(lines, iter(lines))
    if first is not None:
        raise lines.fail(first[0], "a stone in a header file", "keep stones in the survey")
    return reader.finish("", str(path)), reader.sigma


def _read_head(
    lines: TextLines, numbered: Iterator[tuple[int, str]]
) -> tuple[HeadReader, tuple[int, str] | None]:
    """Read up to the first stone; return the head and that line, None if there is no stone."""
    reader, begun = HeadReader(), False
    for number, line in numbered:
        cursor = Cursor(line, f"{lines.path}:{number}")
        word = cursor.word()
        if not word:
            continue
        if not begun:
            if line.split("#", 1)[0].split() != MAGIC.split():
                raise cursor.fail(
                    "this is not a MOMA survey",
                    f"the first line must be '{MAGIC}'; name any other format (--format csv, pnezd, …)",
                )
            begun = True
        elif word == "stone":
            return reader, (number, line)
        elif word in reader.takers:
            reader.takers[word](cursor, number)
        else:
            raise _unknown(word, cursor, (*reader.takers, "stone"))
    if not begun:
        raise lines.fail(lines.end, "the file is empty", f"the first line must be '{MAGIC}'")
    return reader, None


class _Stones:
    """Reader of the stones of a file."""

    def __init__(
        self, lines: TextLines, numbered: Iterator[tuple[int, str]], head: SurveyHead, sigma: float | None
    ) -> None:
        self._path, self._end, self._numbered = lines.path, lines.end, numbered
        self._head, self._sigma = head, sigma
        self._lines_of: dict[str, int] = {}
        self._begin = 0  # first line of the stone, or of lines outside any stone
        self._error: SurveyError | None = None  # reason to skip lines up to the next stone
        self._code: str | None = None

    def records(self, first: tuple[int, str]) -> Iterator[BlockRecord | Reject]:
        """Iterate over the stones; `first` is the line that begins the first one."""
        stone = self._open(*first)
        for number, line in self._numbered:
            if stone is not None and stone.take_place(line):
                continue
            cursor = Cursor(line, f"{self._path}:{number}")
            word = cursor.word()
            if word == "stone":
                if stone is not None:
                    self._error = self._unfinished(number)
                if self._error is not None:
                    yield self._reject(self._error, number)
                stone = self._open(number, line)
                continue
            if word and self._error is None:
                done = self._take(stone, word, cursor, number)
                if done is not None:
                    yield done
                if done is not None or self._error is not None:
                    stone = None
            if word == "end" and self._error is not None:
                yield self._reject(self._error, number + 1)
        if stone is not None:
            self._error = self._unfinished(self._end)
        if self._error is not None:
            yield self._reject(self._error, self._end + 1)

    def _open(self, number: int, line: str) -> StoneReader | None:
        """Begin a stone."""
        self._begin, self._code = number, None
        cursor = Cursor(line, f"{self._path}:{number}")
        cursor.word()
        try:
            self._code = cursor.copy().code()
            if (before := self._lines_of.setdefault(self._code, number)) != number:
                raise cursor.fail(f"stone {self._code} a second time", f"the first is on line {before}")
            return StoneReader(cursor, number, self._head, self._sigma)
        except SurveyError as error:
            self._error = error
            return None

    def _take(self, stone: StoneReader | None, word: str, cursor: Cursor, number: int) -> BlockRecord | None:
        """Read a line of a stone; return the stone once it is complete."""
        try:
            if stone is None:
                self._begin, self._code = number, None
                raise _unknown(word, cursor, ("stone",))
            if word == "end":
                return stone.finish(cursor, number)
            if word not in STONE_WORDS:
                raise _unknown(word, cursor, STONE_WORDS)
            stone.take(word, cursor, number)
        except SurveyError as error:
            self._error = error
        return None

    def _unfinished(self, number: int) -> SurveyError:
        return SurveyError(
            f"stone {self._code} (line {self._begin}) has no 'end'",
            where=f"{self._path}:{number}",
            remedy="the file may be cut short",
        )

    def _reject(self, error: SurveyError, stop: int) -> Reject:
        self._error = None
        return Reject(self._code, error, (range(self._begin, stop),))


def _unknown(word: str, cursor: Cursor, allowed: tuple[str, ...]) -> SurveyError:
    return cursor.fail(f"unknown word {word[:40]!r}", f"a line begins with one of: {', '.join(allowed)}")
