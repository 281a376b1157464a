"""Report on ingested survey files, counted stone by stone."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.arrays import Array
from pipelines.ingest.records import frame_record
from survey.extrusion.extrusion import SurveyedBlock
from survey.formats.options import ReadingOptions
from survey.geometry.convexity import is_convex
from survey.records.plausible import LENGTH, doubt_of, lies_on_its_side, question_of_unit
from survey.records.review import Doubtful
from survey.records.snapping import Snapping
from survey.records.survey import Reject
from survey.registration.stones import SurveyedStream

_LEAST_DECIMALS = 3  # of rounded coordinates [m]; with fewer they are whole centimetres by design
_MOST_DECIMALS = 6  # of rounded coordinates [m]; with more they are not rounded


@dataclass(frozen=True)
class Refusal:
    """A rejected stone and the reason."""

    code: str | None
    reason: str


@dataclass(frozen=True)
class Question:
    """Doubt about a file as a whole.

    Attributes
    ----------
    what : in words
    remedy : the options of which one answers it
    """

    what: str
    remedy: str


@dataclass(frozen=True)
class SolidsReport:
    """Properties of the solids of a file.

    Attributes
    ----------
    convex : number of convex solids
    not_convex : codes of the others
    remarks : changes that made them solids with plane faces, by code
    snapping : changes by bringing their faces into common planes; None if not requested
    decimals : decimals of their coordinates in metres, from 3 to 6; None if they have fewer or more
    """

    convex: int
    not_convex: tuple[str, ...]
    remarks: dict[str, tuple[str, ...]]
    snapping: Snapping | None
    decimals: int | None = None


@dataclass(frozen=True)
class FileReport:
    """Report on one file.

    Attributes
    ----------
    path : the file
    survey : name of the survey in the database
    stones : number of its stones, by kind
    rejected : measured points left out as blunders, by stone code
    rms : root mean square distance of the accepted points of the worst stone from its plane [m]
    worst : code of that stone; empty if none was measured in space
    shapes : faces that are not one plane, in words, by stone code
    refused : rejected stones
    rejects : the file that holds them; None if there are none
    frame : transform of the survey into the frame of the site; None if it was surveyed there
    again : number of stones that were in the database and now have a new measurement
    solids : properties of the stones, in a file of solids
    remarks : changes that made the outlines of measured faces polygons, by stone code
    doubts : sizes that hardly any stone has, in words, by stone code
    reading : how the file was read, in words
    questions : what the file as a whole makes doubtful, with the option that would answer it
    review : of outlines, what to look at
    """

    path: str
    survey: str
    stones: dict[str, int]
    rejected: dict[str, int]
    rms: float
    worst: str
    shapes: dict[str, str]
    refused: tuple[Refusal, ...] = ()
    rejects: str | None = None
    frame: dict[str, Any] | None = None
    again: int = 0
    solids: SolidsReport | None = None
    remarks: dict[str, tuple[str, ...]] = field(default_factory=dict)
    doubts: dict[str, str] = field(default_factory=dict)
    reading: tuple[str, ...] = ()
    questions: tuple[str, ...] = ()
    review: tuple[Doubtful, ...] = ()


@dataclass(frozen=True)
class IngestReport:
    """Report on all files."""

    url: str
    files: tuple[FileReport, ...]


@dataclass
class Tally:
    """Running counts over the stones of a file."""

    path: Path
    stream: SurveyedStream
    files: Sequence[Path]
    options: ReadingOptions = field(default_factory=ReadingOptions)
    stones: Counter[str] = field(default_factory=Counter)
    rejected: dict[str, int] = field(default_factory=dict)
    shapes: dict[str, str] = field(default_factory=dict)
    rms: float = 0.0
    worst: str = ""
    refused: list[Reject] = field(default_factory=list)
    again: int = 0
    stored: Sequence[int] = ()
    convex: Counter[bool] = field(default_factory=Counter)
    not_convex: list[str] = field(default_factory=list)
    remarks: dict[str, tuple[str, ...]] = field(default_factory=dict)
    decimals: int = 0
    changed: dict[str, tuple[str, ...]] = field(default_factory=dict)
    doubts: dict[str, str] = field(default_factory=dict)
    lengths: list[float] = field(default_factory=list)
    boxes: list[Array] = field(default_factory=list)
    centres: list[Array] = field(default_factory=list)

    def count(self, block: SurveyedBlock) -> None:
        """Count one more accepted stone."""
        face = block.face
        self.stones[block.kind] += 1
        self.centres.append(face.fit.centroid)
        if face.rejected_points:
            self.rejected[block.code] = len(face.rejected_points)
        if str(face.shape.kind) not in ("plane", "untested"):
            self.shapes[block.code] = face.shape.text
        if face.provenance.source == "solid":
            self._count_solid(block)
        elif face.remarks:
            self.changed[block.code] = face.remarks
        self.lengths.append(float(np.ptp(block.solid.vertices, axis=0).max()))
        if (doubt := doubt_of(self.lengths[-1], LENGTH)) is not None:
            self.doubts[block.code] = doubt.text
        if face.provenance.source == "points" and face.fit.rms >= self.rms:
            self.rms, self.worst = face.fit.rms, block.code

    def _count_solid(self, block: SurveyedBlock) -> None:
        convex = is_convex(block.solid)
        self.convex[convex] += 1
        vertices = block.solid.vertices
        self.boxes.append(np.concatenate([vertices.min(axis=0), vertices.max(axis=0)]))
        if not convex:
            self.not_convex.append(block.code)
        if block.face.remarks:
            self.remarks[block.code] = block.face.remarks
        while self.decimals <= _MOST_DECIMALS and not _has_decimals(block.solid.vertices, self.decimals):
            self.decimals += 1

    def _solids(self) -> SolidsReport | None:
        if not self.convex:
            return None
        codes = tuple(self.not_convex)
        decimals = self.decimals if _LEAST_DECIMALS <= self.decimals <= _MOST_DECIMALS else None
        return SolidsReport(self.convex[True], codes, self.remarks, self.stream.snapping, decimals)

    def report(self, rejects: Path | None) -> FileReport:
        """Make the report on the file; `rejects` is the file with the rejected stones."""
        return FileReport(
            path=self.stream.head.path,
            survey=self.stream.head.name,
            stones=dict(sorted(self.stones.items())),
            rejected=self.rejected,
            rms=self.rms,
            worst=self.worst,
            shapes=self.shapes,
            refused=tuple(Refusal(reject.code, str(reject.error)) for reject in self.refused),
            rejects=None if rejects is None else str(rejects),
            frame=frame_record(self.stream.transform),
            again=self.again,
            solids=self._solids(),
            remarks=self.changed,
            doubts=self.doubts,
            reading=(*self.stream.remarks, *self._unused_rules()),
            questions=tuple(f"{question.what}: {question.remedy}" for question in self.questions()),
            review=self.stream.review,
        )

    def _unused_rules(self) -> Iterator[str]:
        """Yield remarks on depths that are stated for kinds of which there is no stone: a slip, or another part."""
        rules = [rule for rule in self.stream.head.depth_rules if rule.kind not in (None, *self.stones)]
        if rules and self.stones:
            named = ", ".join(f"{rule.kind} (line {rule.line})" for rule in rules)
            yield f"depths are stated for kinds without a stone: {named}; kinds are {', '.join(sorted(self.stones))}"

    def questions(self) -> Iterator[Question]:
        """Ask for the unit if most stones are of an impossible size, and for the axis if they lie on their side."""
        question = question_of_unit(self.lengths, "stones") if self.options.unit is None else None
        if question is not None:
            yield Question(*question)
        if self.boxes and self.options.up is None and lies_on_its_side(np.array(self.boxes)):
            what = "few stones stand on others along z, but some do along y"
            yield Question(what, "give --up y if y points upwards, or --up z if they lie as they should")


def _has_decimals(places: Array, count: int) -> bool:
    """Return True if coordinates have at most so many decimals, to within double precision."""
    scaled = places * 10.0**count
    return bool(np.abs(scaled - np.round(scaled)).max() <= 1e-6)
