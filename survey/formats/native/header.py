"""The head of the native survey format: data shared by all stones of a survey."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ground.errors import SurveyError
from survey.conventions import CHECKED
from survey.formats.native.cursor import Cursor
from survey.records.survey import (
    OBSERVER,
    Canon,
    ControlPoint,
    DepthRule,
    Extrusion,
    Photograph,
    PhotoMark,
    Station,
    SurfaceRule,
    SurveyHead,
)


class _Numbered(Protocol):
    """An entry with the line that it was read from."""

    @property
    def line(self) -> int:
        """Number of the line."""


@dataclass(frozen=True)
class _Mark:
    photograph: str
    mark: PhotoMark
    where: str


class HeadReader:
    """Reader of a head, line by line.

    Attributes
    ----------
    sigma : standard deviation of a coordinate without one of its own [m]; None if not stated
    takers : methods that read a line, by its first word
    """

    def __init__(self) -> None:
        self.sigma: float | None = None
        self._name: str | None = None
        self._stations: dict[str, Station] = {}
        self._control: dict[str, ControlPoint] = {}
        self._photographs: dict[str, Photograph] = {}
        self._marks: list[_Mark] = []
        self._rules: list[DepthRule] = []
        self._canons: dict[str, Canon] = {}
        self._extrusion: Extrusion | None = None
        self._orientation: str | None = None
        self._roughness: float | None = None
        self._surfaces: dict[str, SurfaceRule] = {}
        self._places: dict[str, str] = {}  # of entries that are checked once all lines are read
        self.takers: dict[str, Callable[[Cursor, int], None]] = {
            "name": self._take_name,
            "observer": self._take_observer,
            "station": self._take_station,
            "sigma": self._take_sigma,
            "control": self._take_control,
            "photo": self._take_photograph,
            "mark": self._take_mark,
            "depth": self._take_rule,
            "canon": self._take_canon,
            "extrude": self._take_extrusion,
            "orientation": self._take_orientation,
            "surface": self._take_surface,
            "roughness": self._take_roughness,
        }

    def finish(self, name: str, path: str) -> SurveyHead:
        """Put the head together.

        Parameters
        ----------
        name : of the survey, if the head states none
        path : of the survey

        Raises
        ------
        SurveyError
            at the line that refers to a missing entry, or that is incomplete
        """
        return SurveyHead(
            name=self._name or name,
            path=path,
            stations=tuple(self._stations.values()),
            control=tuple(self._control_point(control_line) for control_line in self._control.values()),
            photographs=self._finished_photographs(),
            depth_rules=tuple(self._rules),
            canons=tuple(self._canons.values()),
            extrusion=self._extrusion or Extrusion(),
            orientation=self._orientation,
            surfaces=tuple(self._surfaces.values()),
            roughness=self._roughness,
        )

    # --- lines ---

    def _take_name(self, cursor: Cursor, line: int) -> None:
        cursor.check_first(self._name, "name")
        self._name = cursor.text("name")

    def _take_observer(self, cursor: Cursor, line: int) -> None:
        self._add_station(Station(OBSERVER, np.array(cursor.row("observer")), line), cursor)
        cursor.end("write: observer X Y Z")

    def _take_station(self, cursor: Cursor, line: int) -> None:
        self._add_station(Station(cursor.name("station"), np.array(cursor.row("station")), line), cursor)
        cursor.end("write: station NAME X Y Z")

    def _add_station(self, station: Station, cursor: Cursor) -> None:
        _new(station.name, self._stations, "station", cursor)
        self._stations[station.name] = station

    def _take_sigma(self, cursor: Cursor, line: int) -> None:
        cursor.check_first(self.sigma, "sigma")
        self.sigma = cursor.length("sigma")
        cursor.end("write: sigma 0.003")

    def _take_roughness(self, cursor: Cursor, line: int) -> None:
        cursor.check_first(self._roughness, "roughness")
        self._roughness = 0.0 if cursor.peek() == "0" and cursor.word() else cursor.length("roughness")
        cursor.end("write: roughness 0.001")

    def _take_control(self, cursor: Cursor, line: int) -> None:
        remedy = "write: control NAME X Y Z [sigma S] site X Y Z [sigma S]"
        name = cursor.name("control point")
        _new(name, self._control, "control point", cursor)
        measured = np.array(cursor.row("control"))
        measured_sigma = cursor.sigma("control")
        if not cursor.keyword("site"):
            raise cursor.fail(f"control point {name} has no place on the site", remedy)
        site = np.array(cursor.row("site"))
        site_sigma = cursor.sigma("site")
        cursor.end(remedy)
        # 0 stands for the sigma of the head, which may still follow
        self._control[name] = ControlPoint(
            name, measured, measured_sigma or 0.0, site, site_sigma or 0.0, line
        )
        self._places[f"control {name}"] = cursor.where

    def _take_photograph(self, cursor: Cursor, line: int) -> None:
        name = cursor.name("photo")
        _new(name, self._photographs, "photo", cursor)
        sigma = cursor.sigma("photo")
        station = cursor.name("station") if cursor.keyword("station") else None
        cursor.end("write: photo NAME [sigma PIXELS] [station NAME]")
        self._photographs[name] = Photograph(name, sigma or 1.0, (), station, line)
        self._places[f"photo {name}"] = cursor.where

    def _take_mark(self, cursor: Cursor, line: int) -> None:
        remedy = "write: mark PHOTO U V at X Y Z [sigma S]"
        photograph = cursor.name("photo")
        image = np.array(cursor.row("mark", "uv"))
        if not cursor.keyword("at"):
            raise cursor.fail("the mark has no place on the wall", remedy)
        position = np.array(cursor.row("at"))
        sigma = cursor.sigma("mark")
        cursor.end(remedy)
        mark = PhotoMark(image, position, sigma or 0.0, line)
        self._marks.append(_Mark(photograph, mark, cursor.where))

    def _take_rule(self, cursor: Cursor, line: int) -> None:
        kind = None if cursor.keyword("*") else cursor.kind()
        courses = cursor.courses() if cursor.keyword("course") else None
        zone = cursor.name("zone") if cursor.keyword("zone") else None
        if kind is None and (courses or zone):
            raise cursor.fail(
                "a depth for every kind with a course or zone", "write: depth * D …, or name a kind"
            )
        depth, sigma, source = cursor.length("depth"), cursor.sigma("depth"), cursor.source("depth")
        rule = DepthRule(kind, depth, sigma, source, line, courses, zone)
        for earlier in self._rules:
            if _overlap(rule, earlier):
                raise cursor.fail(
                    f"a second depth for {kind or '*'!r} of the same courses and zone",
                    f"the first is on line {earlier.line}",
                )
        self._rules.append(rule)

    def _take_canon(self, cursor: Cursor, line: int) -> None:
        remedy = "write: canon KIND LENGTH HEIGHT sigma S source TEXT"
        kind = cursor.kind()
        _new(kind, self._canons, "canon of", cursor)
        length, height, sigma = cursor.length("length"), cursor.length("height"), cursor.sigma("canon")
        if sigma is None:
            raise cursor.fail(f"the canon of {kind} has no sigma", remedy)
        self._canons[kind] = Canon(kind, length, height, sigma, cursor.source("canon"), line)

    def _take_extrusion(self, cursor: Cursor, line: int) -> None:
        cursor.check_first(self._extrusion, "extrude")
        self._extrusion = read_extrusion(cursor)

    def _take_orientation(self, cursor: Cursor, line: int) -> None:
        cursor.check_first(self._orientation, "orientation")
        self._orientation = cursor.text("orientation")

    def _take_surface(self, cursor: Cursor, line: int) -> None:
        remedy = "write: surface NAME plane, or: surface NAME cylinder [sigma S]"
        name = cursor.name("surface")
        _new(name, self._surfaces, "surface", cursor)
        kind = cursor.word()
        if kind not in ("plane", "cylinder"):
            raise cursor.fail(f"surface {name} is {kind!r}", remedy)
        sigma = cursor.sigma("surface")
        cursor.end(remedy)
        self._surfaces[name] = SurfaceRule(name, kind, sigma, line)

    # --- checks once all lines are read ---

    def _control_point(self, point: ControlPoint) -> ControlPoint:
        where = self._places[f"control {point.name}"]
        measured = point.measured_sigma or self._common_sigma(f"control point {point.name}", where)
        site = point.site_sigma or self._common_sigma(f"control point {point.name}", where)
        return replace(point, measured_sigma=measured, site_sigma=site)

    def _finished_photographs(self) -> tuple[Photograph, ...]:
        marks: dict[str, list[PhotoMark]] = {name: [] for name in self._photographs}
        for mark in self._marks:
            if mark.photograph not in marks:
                raise missing("photo", mark.photograph, self._photographs, mark.where)
            sigma = mark.mark.sigma or self._common_sigma("the mark", mark.where)
            marks[mark.photograph].append(replace(mark.mark, sigma=sigma))
        for name, photograph in self._photographs.items():
            where = self._places[f"photo {name}"]
            if len(marks[name]) < CHECKED:
                raise SurveyError(
                    f"photo {name} has {len(marks[name])} marks",
                    where=where,
                    remedy=f"tie it to the wall by {CHECKED} marks or more",
                )
            if photograph.station is not None and photograph.station not in self._stations:
                raise missing("station", photograph.station, self._stations, where)
        return tuple(
            replace(photograph, marks=tuple(marks[name])) for name, photograph in self._photographs.items()
        )

    def _common_sigma(self, what: str, where: str) -> float:
        if self.sigma is None:
            raise SurveyError(
                f"{what} has no sigma", where=where, remedy="write 'sigma 0.003' (metres) before the stones"
            )
        return self.sigma


def read_extrusion(cursor: Cursor) -> Extrusion:
    """Read ``[along DX DY DZ] [tail T]``."""
    remedy = "write: extrude [along DX DY DZ] [tail T]"
    if not cursor.peek():
        raise cursor.fail("extrude has no values", remedy)
    direction = np.array(cursor.row("along")) if cursor.keyword("along") else None
    if direction is not None and not direction.any():
        raise cursor.fail("the direction has no length", remedy)
    tail = cursor.length("tail") if cursor.keyword("tail") else 1.0
    if tail > 1.0:
        raise cursor.fail(
            f"tail {tail:g} is larger than the face", "it must be greater than 0, and 1 at most"
        )
    cursor.end(remedy)
    return Extrusion(direction, tail)


def _overlap(first: DepthRule, second: DepthRule) -> bool:
    """Return whether two equally specific rules would hold for the same stone."""
    if (first.kind, first.zone) != (second.kind, second.zone):
        return False
    if first.courses is None or second.courses is None:
        return first.courses is second.courses
    return first.courses[0] <= second.courses[1] and second.courses[0] <= first.courses[1]


def _new(name: str, items: Mapping[str, _Numbered], what: str, cursor: Cursor) -> None:
    if name in items:
        raise cursor.fail(f"{what} {name} a second time", f"the first is on line {items[name].line}")


def missing(what: str, name: str, names_known: Iterable[str], where: str) -> SurveyError:
    """Make the error of a name that is missing in the head."""
    names = ", ".join(names_known) or "none"
    return SurveyError(f"no {what} {name}", where=where, remedy=f"{what}s of this survey: {names}")
