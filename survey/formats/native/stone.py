"""One stone of the native survey format, line by line."""

import math
import re

import numpy as np

from ground.tables.numbers import FARTHEST
from survey.arrays import Array
from survey.conventions import CORNERS
from survey.formats.native.cursor import Cursor
from survey.formats.native.header import missing, read_extrusion
from survey.records.survey import BlockRecord, Extrusion, PointMark, SurveyHead

STONE_WORDS = (
    "vertex", "point", "photo", "pixel", "mark", "on", "station", "extrude", "sigma", "depth", "note", "end",
)  # fmt: skip
"""Words that begin a line of a stone."""

_PLACE = re.compile(
    r"[ \t]*(vertex|point)[ \t]+([-+.0-9eE]+)[ \t]+([-+.0-9eE]+)[ \t]+([-+.0-9eE]+)[ \t]*"
).fullmatch  # a number to `float` made of these characters is one here too


class StoneReader:
    """Reader of a stone, line by line.

    Parameters
    ----------
    cursor : in its first line, after ``stone``
    line : number of that line
    head : of the survey
    sigma : of the survey, for coordinates without one of their own [m]; None if it has none

    Attributes
    ----------
    code : its name
    """

    def __init__(self, cursor: Cursor, line: int, head: SurveyHead, sigma: float | None) -> None:
        self.code = cursor.code()
        self._kind = cursor.kind()
        self._course = cursor.course() if cursor.keyword("course") else None
        self._zone = cursor.name("zone") if cursor.keyword("zone") else None
        cursor.end("write: stone CODE KIND [course N] [zone NAME]")
        self._line, self._head, self._head_sigma = line, head, sigma
        self._places: dict[str, list[tuple[float, ...]]] = {"vertex": [], "point": []}
        self._sigmas: dict[tuple[str, int], float] = {}  # of places with their own
        self._pixels: list[tuple[float, ...]] = []
        self._sigma: float | None = None
        self._depth: tuple[float, float | None, str] | None = None
        self._notes: dict[str, str] = {}
        self._photograph: str | None = None
        self._station: str | None = None
        self._extrusion: Extrusion | None = None
        self._marks: list[PointMark] = []
        self._surface: str | None = None

    def take_place(self, line: str) -> bool:
        """Read a line of a vertex or point if it is a plain one: the fast path for most of a file."""
        match = _PLACE(line)
        if match is None:
            return False
        word, a, b, c = match.groups()
        try:
            x, y, z = float(a), float(b), float(c)
        except ValueError:
            return False
        if not (-FARTHEST <= x <= FARTHEST and -FARTHEST <= y <= FARTHEST and -FARTHEST <= z <= FARTHEST):
            return False
        self._places[word].append((x, y, z))
        return True

    def take(self, word: str, cursor: Cursor, line: int) -> None:
        """Read one line after its first word, which is one of `STONE_WORDS` other than ``end``."""
        match word:
            case "vertex" | "point":
                self._take_place(word, cursor)
            case "sigma":
                cursor.check_first(self._sigma, word)
                self._sigma = cursor.length("sigma")
                cursor.end("write: sigma 0.003")
            case "depth":
                cursor.check_first(self._depth, word)
                self._depth = cursor.length("depth"), cursor.sigma("depth"), cursor.source("depth")
            case "note":
                self._take_note(cursor)
            case "photo":
                cursor.check_first(self._photograph, word)
                names = [photograph.name for photograph in self._head.photographs]
                if self._head.orientation is None:
                    self._photograph = self._known("photo", names, cursor)
                else:  # the result of the orientation, which is not read here, names more of them
                    self._photograph = cursor.name("photo")
                    cursor.end("write: photo NAME")
            case "pixel":
                self._pixels.append(cursor.row("pixel", "uv"))
                cursor.end("write: pixel U V")
            case "mark":
                self._take_mark(cursor, line)
            case "on":
                cursor.check_first(self._surface, word)
                self._surface = self._known(
                    "surface", [surface.name for surface in self._head.surfaces], cursor
                )
            case "station":
                cursor.check_first(self._station, word)
                self._station = self._known(
                    "station", [station.name for station in self._head.stations], cursor
                )
            case _:
                cursor.check_first(self._extrusion, word)
                self._extrusion = read_extrusion(cursor)

    def finish(self, cursor: Cursor, line: int) -> BlockRecord:
        """Put the stone together; the cursor is after its ``end``."""
        cursor.end("put 'end' on a line of its own")
        self._check_corners(cursor)
        sigma = self._sigma or self._head_sigma
        if sigma is None and not (self._places["vertex"] or self._places["point"]):
            sigma = 0.0  # located points bring their own precision
        if sigma is None:
            raise cursor.fail(
                f"stone {self.code} has no sigma", "write 'sigma 0.003' (metres) before the stones"
            )
        sigmas = self._all_sigmas(sigma)
        depth, depth_sigma, source = self._depth or (None, None, None)
        return BlockRecord(
            code=self.code,
            kind=self._kind,
            course=self._course,
            vertices=_array(self._places["vertex"], 3),
            points=_array(self._places["point"], 3),
            sigma=sigma if sigmas is None else math.sqrt(float(sigmas @ sigmas) / len(sigmas)),
            depth=depth,
            depth_sigma=depth_sigma,
            depth_source=source,
            line=self._line,
            notes=self._notes,
            zone=self._zone,
            station=self._station,
            photograph=self._photograph,
            image=_array(self._pixels, 2),
            sigmas=sigmas,
            extrusion=self._extrusion,
            spans=(range(self._line, line + 1),),
            marks=tuple(self._marks),
            surface=self._surface,
        )

    def _take_place(self, word: str, cursor: Cursor) -> None:
        place, sigma = cursor.row(word), cursor.sigma(word)
        cursor.end(f"write: {word} X Y Z [sigma S]")
        if sigma is not None:
            self._sigmas[word, len(self._places[word])] = sigma
        self._places[word].append(place)

    def _take_mark(self, cursor: Cursor, line: int) -> None:
        remedy = "write: mark POINT vertex PHOTO X Y [sigma PIXELS], or point instead of vertex"
        if self._head.orientation is None:
            raise cursor.fail(
                "a mark, but the head names no orientation", "write in the head: orientation FILE"
            )
        name = cursor.name("point")
        role = cursor.word()
        if role not in ("vertex", "point"):
            raise cursor.fail(f"point {name} is {role!r}", remedy)
        photograph = cursor.name("photo")
        image = np.array(cursor.row("mark", "xy"))
        sigma = cursor.sigma("mark")
        cursor.end(remedy)
        for mark in self._marks:
            if mark.name == name and mark.role != role:
                raise cursor.fail(
                    f"point {name} is a {role} here and a {mark.role} on line {mark.line}", "keep one role"
                )
            if mark.name == name and mark.photograph == photograph:
                raise cursor.fail(
                    f"point {name} is marked twice on {photograph}, first on line {mark.line}", "keep one"
                )
        self._marks.append(PointMark(name, role, photograph, image, sigma, line))

    def _take_note(self, cursor: Cursor) -> None:
        key = cursor.key()
        if not key or key in self._notes:
            raise cursor.fail(
                f"note {key[:40]!r} is missing or repeated", "write: note KEY TEXT, one per key"
            )
        self._notes[key] = cursor.text(f"note {key}")

    def _known(self, what: str, names: list[str], cursor: Cursor) -> str:
        name = cursor.name(what)
        if name not in names:
            raise missing(what, name, names, cursor.where)
        cursor.end(f"write: {what} NAME")
        return name

    def _check_corners(self, cursor: Cursor) -> None:
        corners = len(self._places["vertex"])
        marked = len({mark.name for mark in self._marks if mark.role == "vertex"})
        if marked and (corners or self._pixels):
            raise cursor.fail(
                f"stone {self.code} has marked vertices and {'pixels' if self._pixels else 'vertices in space'}",
                "keep one of the two outlines",
            )
        if marked:
            corners = marked
        if self._photograph is None and self._pixels:
            raise cursor.fail(f"stone {self.code} has pixels, but no photo", "write: photo NAME")
        if self._photograph is not None and corners:
            raise cursor.fail(
                f"stone {self.code} has both vertices and a photo", "keep one of the two outlines"
            )
        if self._photograph is not None and len(self._pixels) < CORNERS:
            raise cursor.fail(
                f"stone {self.code} has {len(self._pixels)} pixels", "a face needs 3 pixels or more"
            )
        if self._photograph is None and corners < CORNERS:
            raise cursor.fail(f"stone {self.code} has {corners} vertices", "a face needs 3 vertices or more")

    def _all_sigmas(self, common: float) -> Array | None:
        if not self._sigmas:
            return None
        order = [(word, k) for word in ("point", "vertex") for k in range(len(self._places[word]))]
        return np.array([self._sigmas.get(role, common) for role in order])


def _array(rows: list[tuple[float, ...]], columns: int) -> Array:
    return np.array(rows, dtype=np.float64).reshape(-1, columns)
