"""Collection of the stones of a table of points, whose lines may come in any order."""

import math
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import shown
from survey.arrays import Array
from survey.conventions import CORNERS
from survey.records.survey import BlockRecord, Reject, SurveyHead

_HOPELESS = 1000  # wrong lines without any stone after which the file is refused


@dataclass(slots=True)
class TableStone:
    """One stone while its lines are read.

    Attributes
    ----------
    code, course, zone, station : as in BlockRecord
    kind : as in BlockRecord; None until a line states it
    name : as people write it
    agreed : what the last of its rows states of it, checked against the others
    notes : the different texts of each column that is kept as a note, in order
    line : the first of its lines
    error : the first error in its lines; None if there is none
    depth, depth_sigma, depth_source, depth_origin : as in BlockRecord
    """

    code: str
    kind: str | None
    course: int | None
    line: int
    name: str = ""
    zone: str | None = None
    station: str | None = None
    error: SurveyError | None = None
    depth: float | None = None
    depth_sigma: float | None = None
    depth_source: str | None = None
    depth_origin: str | None = None
    vertices: "array[float]" = field(default_factory=lambda: array("d"))
    points: "array[float]" = field(default_factory=lambda: array("d"))
    vertex_sigmas: "array[float]" = field(default_factory=lambda: array("d"))
    point_sigmas: "array[float]" = field(default_factory=lambda: array("d"))
    vertex_names: list[str] = field(default_factory=list)
    point_names: list[str] = field(default_factory=list)
    runs: list[int] = field(default_factory=list)
    agreed: object = None
    notes: dict[str, dict[str, None]] | None = None

    def add_line(self, line: int, count: int = 1) -> None:
        """Record `count` lines of the stone; the first and the next line of every run are kept."""
        if self.runs and self.runs[-1] == line:
            self.runs[-1] = line + count
        else:
            self.runs += (line, line + count)

    def add_note(self, key: str, text: str) -> None:
        """Add a text to a note."""
        if self.notes is None:
            self.notes = {}
        self.notes.setdefault(key, {})[text] = None

    def add_place(
        self, is_vertex: bool, place: tuple[float, float, float], sigma: float, name: str | None
    ) -> None:
        """Add a corner, or a point on the face; sigma is NaN, and the name None, if the table has none."""
        if is_vertex:
            self.vertices.extend(place)
            self.vertex_sigmas.append(sigma)
            if name is not None:
                self.vertex_names.append(name)
        else:
            self.points.extend(place)
            self.point_sigmas.append(sigma)
            if name is not None:
                self.point_names.append(name)

    def spans(self) -> tuple[range, ...]:
        """Return the lines of the file that it was read from."""
        return tuple(range(*self.runs[i : i + 2]) for i in range(0, len(self.runs), 2))


class PointTable:
    """The stones of a table, and the wrong lines that belong to none.

    Parameters
    ----------
    path : of the table, for errors
    sigma : standard deviation of a coordinate whose line states none [m]
    kind : of stones whose lines state none

    Attributes
    ----------
    stones : by code, in the order of the file
    """

    def __init__(self, path: str, sigma: float, kind: str) -> None:
        self._path, self._sigma, self._kind = path, sigma, kind
        self.stones: dict[str, TableStone] = {}
        self._astray: list[tuple[range, SurveyError]] = []

    @property
    def is_empty(self) -> bool:
        """True if no line has been read."""
        return not (self.stones or self._astray)

    def refuse(self, code: str | None, error: SurveyError, line: int, count: int = 1) -> None:
        """Record a wrong line, which spoils its stone if that is known.

        Raises
        ------
        SurveyError
            the first of these errors, if a thousand lines have been read and none names its stone
        """
        if code is not None:
            stone = self.stones.setdefault(code, TableStone(code, None, None, line))
            stone.error = stone.error or error
            stone.add_line(line, count)
            return
        self._astray.append((range(line, line + count), error))
        if not self.stones and len(self._astray) >= _HOPELESS:
            raise self._astray[0][1]

    def records(self) -> Iterator[BlockRecord | Reject]:
        """Iterate, once, over stones and stray lines in the order of their first lines."""
        astray, at = self._astray, 0
        for code in list(self.stones):
            stone = self.stones.pop(code)  # popped, so that memory holds each stone only once
            while at < len(astray) and astray[at][0].start < stone.line:
                yield _reject(*astray[at])
                at += 1
            yield self._record(stone)
        for reject_parts in astray[at:]:
            yield _reject(*reject_parts)

    def _record(self, stone: TableStone) -> BlockRecord | Reject:
        count = len(stone.vertices) // 3
        if stone.error is None and count < CORNERS:
            stone.error = SurveyError(
                f"block {stone.code} has {count} vertices",
                where=f"{self._path}:{stone.line}",
                remedy="a face needs 3 lines of role vertex or more",
            )
        if stone.error is None and stone.depth is None and (stone.depth_sigma or stone.depth_source):
            stone.error = SurveyError(
                f"block {stone.code} has precision or source of a depth, but no depth",
                where=f"{self._path}:{stone.line}",
                remedy="fill the column depth",
            )
        if stone.error is not None:
            return Reject(stone.code, stone.error, stone.spans())
        sigma, sigmas = self._precision(stone)
        source = stone.depth_source or (None if stone.depth is None else "column depth of the table")
        names = (*stone.point_names, *stone.vertex_names)
        notes = {} if stone.name in ("", stone.code) else {"name": stone.name}
        for key, texts in (stone.notes or {}).items():
            notes[key] = "; ".join(texts)
        return BlockRecord(
            code=stone.code,
            kind=stone.kind or self._kind,
            course=stone.course,
            vertices=_rows(stone.vertices),
            points=_rows(stone.points),
            sigma=sigma,
            depth=stone.depth,
            depth_sigma=stone.depth_sigma,
            depth_source=source,
            depth_origin=None if stone.depth is None else stone.depth_origin,
            line=stone.line,
            zone=stone.zone,
            station=stone.station,
            sigmas=sigmas,
            names=names if all(names) else (),
            notes=notes,
            spans=stone.spans(),
        )

    def _precision(self, stone: TableStone) -> tuple[float, Array | None]:
        """Return the precision of the stone, and of its points if they differ."""
        sigmas = np.array([*stone.point_sigmas, *stone.vertex_sigmas])
        sigmas[np.isnan(sigmas)] = self._sigma
        if (sigmas == sigmas[0]).all():
            return float(sigmas[0]), None
        return math.sqrt(float(sigmas @ sigmas) / len(sigmas)), sigmas


def _rows(flat: "array[float]") -> Array:
    return np.array(flat, dtype=np.float64).reshape(-1, 3)


def _reject(lines: range, error: SurveyError) -> Reject:
    return Reject(None, error, (lines,))


def check_station(name: str, head: SurveyHead, where: str) -> None:
    """Check that the head has a station of this name.

    Raises
    ------
    SurveyError
        if it has none
    """
    names = [station.name for station in head.stations]
    if name not in names:
        raise SurveyError(
            f"no station {shown(name)}",
            where=where,
            remedy=f"stations of the header file: {', '.join(names) or 'none'}",
        )
