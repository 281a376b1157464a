"""The native survey format: one ASCII (UTF-8) file, one record per stone, line by line.

Grammar (EBNF; one line each, words separated by blanks; ``#`` at the start of a line or after a blank
begins a comment, except in TEXT; blank lines are free)::

    file    = "moma-survey" "1" , { header } , { stone } ;
    header  = "name" TEXT
            | "observer" X Y Z                              (* where the surveyor stood *)
            | "sigma" S                                     (* of one coordinate, for all stones below *)
            | "depth" KIND D [ "sigma" S ] "source" TEXT ;  (* for stones without a depth of their own *)
    stone   = "stone" CODE KIND [ "course" N ] , { item } , "end" ;
    item    = "vertex" X Y Z                                (* 3 or more, in order around the face *)
            | "point" X Y Z
            | "sigma" S
            | "depth" D [ "sigma" S ] "source" TEXT
            | "note" KEY TEXT ;

All lengths are metres. TEXT runs to the end of its line. A file is accepted whole or refused whole, with the
line that is wrong.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from re import Pattern

import numpy as np
from numpy.typing import NDArray

from moma.errors import SurveyError
from survey.formats.fields import CODE, KIND, parse_length, parse_number, read_lines
from survey.formats.moma_writer import MAGIC, write_moma
from survey.records import OBSERVER, BlockRecord, DepthRule, Station, Survey, SurveyHead

__all__ = ["read_moma", "write_moma"]

_HEADER_WORDS = "name, observer, sigma, depth, stone"
_STONE_WORDS = "vertex, point, sigma, depth, note, end"


def read_moma(path: Path) -> Survey:
    """Read a native survey file.

    Parameters
    ----------
    path : the file

    Returns
    -------
    Survey with all its stones

    Raises
    ------
    SurveyError
        naming file and line, when any line is wrong
    """
    path = Path(path)
    reader = _Reader(str(path))
    lines = read_lines(path)
    for number, line in enumerate(lines, start=1):
        reader.line = number
        if line.strip() and not line.lstrip().startswith("#"):
            reader.take(line)
    reader.line = len(lines)
    return reader.finish(Path(path).stem)


@dataclass
class _Stone:
    """A stone record that is being read."""

    code: str
    kind: str
    course: int | None
    line: int
    sigma: float | None
    vertices: list[tuple[float, ...]] = field(default_factory=list)
    points: list[tuple[float, ...]] = field(default_factory=list)
    depth: tuple[float, float | None, str] | None = None
    notes: dict[str, str] = field(default_factory=dict)


class _Reader:
    """The state of reading: what has been read so far, and on which line we are."""

    def __init__(self, path: str) -> None:
        self.path, self.line = path, 0
        self.begun = False
        self.name: str | None = None
        self.observer: NDArray[np.float64] | None = None
        self.sigma: float | None = None
        self.rules: dict[str, DepthRule] = {}
        self.blocks: list[BlockRecord] = []
        self.lines_of: dict[str, int] = {}
        self.stone: _Stone | None = None

    def fail(self, what: str, remedy: str) -> SurveyError:
        return SurveyError(what, where=f"{self.path}:{self.line}", remedy=remedy)

    def take(self, line: str) -> None:
        """Read one line that is neither blank nor a comment."""
        if not self.begun:
            if line.split("#", 1)[0].split() != MAGIC.split():
                raise self.fail("this is not a MOMA survey", f"the first line must be '{MAGIC}'")
            self.begun = True
            return
        word, rest = _head(line)
        takers = self._header_takers() if self.stone is None else self._stone_takers(self.stone)
        if word not in takers:
            allowed = _HEADER_WORDS if self.stone is None else _STONE_WORDS
            raise self.fail(f"unknown word {word[:40]!r}", f"a line begins with one of: {allowed}")
        takers[word](rest)

    def finish(self, stem: str) -> Survey:
        if not self.begun:
            raise self.fail("the file is empty", f"the first line must be '{MAGIC}'")
        if self.stone is not None:
            raise self.fail(
                f"stone {self.stone.code} (line {self.stone.line}) has no 'end'", "the file may be cut short"
            )
        if not self.blocks:
            raise self.fail("the survey has no stones", "add 'stone CODE KIND' … 'end'")
        stations = () if self.observer is None else (Station(OBSERVER, self.observer),)
        head = SurveyHead(self.name or stem, self.path, stations, depth_rules=tuple(self.rules.values()))
        return Survey(head, tuple(self.blocks))

    # --- lines of the header ---

    def _header_takers(self) -> dict[str, Callable[[str], None]]:
        takers: dict[str, Callable[[str], None]] = {"stone": self._take_stone}
        if not self.blocks:
            takers |= {
                "name": self._take_name,
                "observer": self._take_observer,
                "sigma": self._take_sigma,
                "depth": self._take_rule,
            }
        return takers

    def _take_name(self, rest: str) -> None:
        self._once(self.name, "name")
        self.name = self._text(rest, "name")

    def _take_observer(self, rest: str) -> None:
        self._once(self.observer, "observer")
        self.observer = np.array(self._xyz(rest, "observer"))

    def _take_sigma(self, rest: str) -> None:
        self._once(self.sigma, "sigma")
        self.sigma = self._sigma(rest)

    def _take_rule(self, rest: str) -> None:
        kind, rest = _head(rest)
        self._match(KIND, kind, "kind", "use lower-case letters, e.g. header")
        if kind in self.rules:
            raise self.fail(f"a second depth for {kind!r}", f"the first is on line {self.rules[kind].line}")
        value, sigma, source = self._depth(rest)
        self.rules[kind] = DepthRule(kind, value, sigma, source, self.line)

    def _take_stone(self, rest: str) -> None:
        words = _uncommented(rest)
        if not (len(words) == 2 or (len(words) == 4 and words[2] == "course")):
            raise self.fail(f"cannot read 'stone {rest.strip()[:40]}'", "write: stone CODE KIND [course N]")
        code, kind = words[:2]
        self._match(CODE, code, "code", "use letters, digits and . + / : - _, at most 64")
        self._match(KIND, kind, "kind", "use lower-case letters, e.g. header")
        if code in self.lines_of:
            raise self.fail(f"stone {code} a second time", f"the first is on line {self.lines_of[code]}")
        course = self._course(words[3]) if len(words) == 4 else None
        self.stone = _Stone(code, kind, course, self.line, self.sigma)
        self.lines_of[code] = self.line

    # --- lines of a stone ---

    def _stone_takers(self, stone: _Stone) -> dict[str, Callable[[str], None]]:
        return {
            "vertex": lambda rest: stone.vertices.append(self._xyz(rest, "vertex")),
            "point": lambda rest: stone.points.append(self._xyz(rest, "point")),
            "sigma": lambda rest: setattr(stone, "sigma", self._sigma(rest)),
            "depth": lambda rest: self._take_own_depth(stone, rest),
            "note": lambda rest: self._take_note(stone, rest),
            "end": lambda rest: self._take_end(stone, rest),
        }

    def _take_own_depth(self, stone: _Stone, rest: str) -> None:
        self._once(stone.depth, "depth")
        stone.depth = self._depth(rest)

    def _take_note(self, stone: _Stone, rest: str) -> None:
        key, text = _head(rest)
        if not key or key in stone.notes:
            raise self.fail(f"note {key[:40]!r} is missing or repeated", "write: note KEY TEXT, one per key")
        stone.notes[key] = self._text(text, f"note {key}")

    def _take_end(self, stone: _Stone, rest: str) -> None:
        if _uncommented(rest):
            raise self.fail(f"'{rest.strip()[:40]}' after 'end'", "put 'end' on a line of its own")
        if len(stone.vertices) < 3:
            raise self.fail(
                f"stone {stone.code} has {len(stone.vertices)} vertices", "a face needs 3 vertices or more"
            )
        if stone.sigma is None:
            raise self.fail(
                f"stone {stone.code} has no sigma", "write 'sigma 0.003' (metres) before the stones"
            )
        depth, depth_sigma, source = stone.depth or (None, None, None)
        self.blocks.append(
            BlockRecord(
                code=stone.code,
                kind=stone.kind,
                course=stone.course,
                vertices=np.array(stone.vertices),
                points=np.array(stone.points).reshape(-1, 3),
                sigma=stone.sigma,
                depth=depth,
                depth_sigma=depth_sigma,
                depth_source=source,
                line=stone.line,
                notes=stone.notes,
            )
        )
        self.stone = None

    # --- fields ---

    @property
    def _where(self) -> str:
        return f"{self.path}:{self.line}"

    def _once(self, value: object, word: str) -> None:
        if value is not None:
            raise self.fail(f"a second {word!r}", f"keep one {word!r} line")

    def _text(self, rest: str, what: str) -> str:
        text = rest.strip().replace("\t", " ")
        if not text or not text.isprintable():
            raise self.fail(f"{what} has no readable text", "write printable words after it")
        return text

    def _match(self, pattern: Pattern[str], text: str, what: str, remedy: str) -> None:
        if pattern.fullmatch(text) is None:
            raise self.fail(f"{what} {text[:40]!r} is not a {what}", remedy)

    def _xyz(self, rest: str, what: str) -> tuple[float, ...]:
        words = _uncommented(rest)
        if len(words) != 3:
            raise self.fail(f"{what} has {len(words)} coordinates", f"write: {what} X Y Z")
        return tuple(
            parse_number(w, f"{what} {axis}", self._where) for w, axis in zip(words, "xyz", strict=True)
        )

    def _sigma(self, rest: str) -> float:
        words = _uncommented(rest)
        if len(words) != 1:
            raise self.fail(f"sigma has {len(words)} values", "write: sigma 0.003")
        return parse_length(words[0], "sigma", self._where)

    def _course(self, word: str) -> int:
        if not (word.isascii() and word.isdigit() and len(word) <= 6):
            raise self.fail(
                f"course {word[:40]!r} is not a whole number", "count courses from the ground: 1, 2, …"
            )
        return int(word)

    def _depth(self, rest: str) -> tuple[float, float | None, str]:
        """Read ``D [sigma S] source TEXT``."""
        depth = parse_length(_head(rest)[0], "depth", self._where)
        keyword, rest = _head(_head(rest)[1])
        sigma: float | None = None
        if keyword == "sigma":
            word, rest = _head(rest)
            sigma = parse_length(word, "depth sigma", self._where)
            keyword, rest = _head(rest)
        if keyword != "source":
            raise self.fail("the depth has no source", "write: depth … D [sigma S] source TEXT")
        return depth, sigma, self._text(rest, "source")


def _head(text: str) -> tuple[str, str]:
    """First word of a line, and what follows it."""
    words = text.split(maxsplit=1)
    return (words[0] if words else "", words[1] if len(words) > 1 else "")


def _uncommented(rest: str) -> list[str]:
    """Words of a line up to the first one that begins a comment."""
    words = rest.split()
    for index, word in enumerate(words):
        if word.startswith("#"):
            return words[:index]
    return words
