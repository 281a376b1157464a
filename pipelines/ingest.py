"""Survey files into the database: read, fit, outline, find the depth, extrude, store; one stone at a time."""

import hashlib
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sqlalchemy.orm import Session

from archmodel.database import home_of, open_database
from archmodel.entities import kind_named
from archmodel.records import StoneRecord
from archmodel.store import store_survey
from moma.errors import NoDatabaseError, SurveyError, UsageError
from pipelines.frame_records import frame_record
from pipelines.progress import Listener, Progress, silent
from pipelines.reading_options import check_survey_file
from pipelines.rejects import check_targets, default_path, rejects_text
from pipelines.relate import relate
from pipelines.spool import Spool
from pipelines.stone_records import stone_record
from survey.extrusion import SurveyedBlock
from survey.formats.reading import ReadingOptions, open_survey
from survey.measured import SurveyedStream, survey_stones
from survey.records import Reject

__all__ = ["FileReport", "IngestReport", "Refusal", "ingest"]


_PATIENCE = 300.0
"""How long to wait for another program that writes [s]: not less than a large survey takes, since waiting is cheaper
than fitting it anew."""


@dataclass(frozen=True)
class Refusal:
    """A stone that was not taken in, and why."""

    code: str | None
    reason: str


@dataclass(frozen=True)
class FileReport:
    """What became of one file.

    Attributes
    ----------
    path : the file
    survey : name of the survey in the database
    stones : how many it holds, by kind
    rejected : measured points left out as blunders, by stone code
    rms : root mean square distance of the accepted points from their planes, worst stone [m]
    worst : code of that stone; empty if none was measured in space
    shapes : faces that are not one plane, in words, by stone code
    refused : stones that were not taken in
    rejects : the file that holds them; None if there are none
    frame : how the survey was carried into the frame of the site; None if it was there
    again : how many of the stones were in the database already, and have a new measurement now
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


@dataclass(frozen=True)
class IngestReport:
    """What became of all files."""

    url: str
    files: tuple[FileReport, ...]


def ingest(
    paths: Sequence[str | Path],
    url: str,
    format: str = "moma",
    progress: Listener = silent,
    *,
    options: ReadingOptions | None = None,
    keep_going: bool = False,
    rejects: str | Path | None = None,
    again: bool = False,
) -> IngestReport:
    """Take survey files into the database: all of them, or, if anything is wrong in any, none.

    Parameters
    ----------
    paths : survey files
    url : of the database, made if it does not exist
    format : name of their format
    progress : told after every stone
    options : what the files leave unsaid
    keep_going : take the good stones of each file, and write the others to a file of rejects with the reasons
    rejects : that file, if there is one survey file; by default ``NAME.rejects.SUFFIX`` beside each survey file
    again : stones that are in the database already were measured again: their old measurements are kept as superseded;
        otherwise they are an error

    Raises
    ------
    UsageError : no such file, one named twice, no such format, a file of rejects that would replace one of the user's
    SurveyError, GeometryError : at the line or stone that is wrong, or has the code of one in another of the files;
        the database is not touched
    DatabaseError : a stone or a file is in the database already; the database is unchanged
    """
    surveys = [Path(path) for path in paths]
    if not surveys:
        raise UsageError("no survey file", remedy="name at least one")
    if rejects is not None and len(surveys) > 1:
        raise UsageError(
            f"one file of rejects for {len(surveys)} survey files", remedy="take in one file at a time"
        )
    _check_files(surveys)
    targets = [Path(rejects) if rejects is not None else default_path(survey) for survey in surveys]
    if keep_going:
        check_targets(targets, surveys)
    with ExitStack() as held:
        _open_if_there(url, held)
        spools = [held.enter_context(Spool()) for _ in surveys]
        tallies = [
            _measure(path, spool, format, options, keep_going, progress)
            for path, spool in zip(surveys, spools, strict=True)
        ]
        if len(surveys) > 1:
            _check_codes(tallies, spools)
        for path, target, tally in zip(surveys, targets, tallies, strict=True):
            if tally.refused:
                stations = _listed_stations(tally, options) if format in _LISTS else []
                text = rejects_text(path, format, tally.refused, stations)
                held.enter_context(_published(target, text))
        with open_database(url, lock_timeout=_PATIENCE) as database, database.session() as session:
            for tally, spool in zip(tallies, spools, strict=True):
                _store(session, tally, _told(spool, tally, progress), again)
            progress(Progress("relate", 0, None))
            relate(session, only=[number for tally in tallies for number in tally.stored])
        reports = tuple(
            _report(tally, target if tally.refused else None)
            for tally, target in zip(tallies, targets, strict=True)
        )
    return IngestReport(database.url, reports)


@dataclass
class _Tally:
    """What is counted while the stones of a file go by."""

    path: Path
    stream: SurveyedStream
    stones: Counter[str] = field(default_factory=Counter)
    rejected: dict[str, int] = field(default_factory=dict)
    shapes: dict[str, str] = field(default_factory=dict)
    rms: float = 0.0
    worst: str = ""
    refused: list[Reject] = field(default_factory=list)
    again: int = 0
    stored: Sequence[int] = ()

    def count(self, block: SurveyedBlock) -> None:
        face = block.face
        self.stones[block.kind] += 1
        if face.rejected_points:
            self.rejected[block.code] = len(face.rejected_points)
        if str(face.shape.kind) not in ("plane", "untested"):
            self.shapes[block.code] = face.shape.text
        if face.provenance.source == "points" and face.fit.rms >= self.rms:
            self.rms, self.worst = face.fit.rms, block.code


def _open_if_there(url: str, held: ExitStack) -> None:
    """Open the database early: the kinds that it registers are known then, and what is wrong with it is said first."""
    try:
        held.enter_context(open_database(url, create=False))
    except NoDatabaseError:
        home_of(url).engine(create=True).dispose()  # whether one could be made


def _check_files(surveys: Sequence[Path]) -> None:
    seen: set[Path] = set()
    for path in surveys:
        check_survey_file(path)
        if path.resolve() in seen:
            raise UsageError("is named twice", where=str(path), remedy="name each survey file once")
        seen.add(path.resolve())


def _check_codes(tallies: Sequence["_Tally"], spools: Sequence[Spool]) -> None:
    """Refuse files that contradict each other before a database is made for them."""
    places: dict[str, str] = {}
    for tally, spool in zip(tallies, spools, strict=True):
        for stone in spool:
            place = f"{tally.stream.head.path}:{stone.line}"
            if (first := places.setdefault(stone.code, place)) != place:
                what = f"the code {stone.code} is taken by the stone at {first}"
                raise SurveyError(what, where=place, remedy="give each stone a code of its own")


_LISTS = ("pnezd", "penzd")


def _listed_stations(tally: "_Tally", options: ReadingOptions | None) -> list[int]:
    """Lines of the stations that stand among the points of a list, not in its header file."""
    elsewhere = () if options is None or options.head is None else options.head.stations
    known = {one.name for one in elsewhere}
    return [one.line for one in tally.stream.head.stations if one.name not in known]


def _measure(
    path: Path,
    spool: Spool,
    format: str,
    options: ReadingOptions | None,
    keep_going: bool,
    progress: Listener,
) -> _Tally:
    """The good stones of one file into a spool; the first bad one ends it, or is kept for the rejects."""
    tally = _Tally(path, survey_stones(open_survey(path, format, options)))
    stage, head, kinds = f"fit {path.name}", tally.stream.head, set[str]()
    for one in tally.stream.stones:
        made = one if isinstance(one, Reject) else _of_known_kind(one, head.path, kinds)
        if not isinstance(made, Reject):
            tally.count(made)
            spool.append(stone_record(made))
            progress(Progress(stage, tally.stones.total(), None, made.code))
        elif keep_going:
            tally.refused.append(made)
        else:
            raise made.error
    if not tally.stones:
        first = f"; the first: {tally.refused[0].error}" if tally.refused else ""
        what = f"none of its {len(tally.refused)} stones can be taken in{first}"
        raise SurveyError(what, where=str(path), remedy="correct the file")
    return tally


def _store(session: Session, tally: _Tally, stones: Iterator[StoneRecord], again: bool) -> None:
    head = tally.stream.head
    stored = store_survey(
        session,
        head.name,
        head.path,
        _sha256(tally.path),
        stones,
        stations={one.name: one.position.tolist() for one in head.stations},
        frame=frame_record(tally.stream.transform),
        again=again,
    )
    tally.stored = (*stored.new, *stored.again)
    tally.again = len(stored.again)


def _told(stones: Iterable[StoneRecord], tally: _Tally, progress: Listener) -> Iterator[StoneRecord]:
    total = tally.stones.total()
    for number, stone in enumerate(stones, start=1):
        progress(Progress(f"store {tally.path.name}", number, total, stone.code))
        yield stone


def _of_known_kind(block: SurveyedBlock, path: str, known: set[str]) -> SurveyedBlock | Reject:
    """The stone, if the hierarchy has its kind; `known` holds kinds that were found there, and is added to."""
    if block.kind in known:
        return block
    try:
        kind_named(block.kind)
    except UsageError as error:
        record = block.face.record
        where = f"{path}:{record.line}: stone {block.code}"
        return Reject(block.code, SurveyError(error.what, where=where, remedy=error.remedy), record.spans)
    known.add(block.kind)
    return block


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@contextmanager
def _published(path: Path, text: bytes) -> Iterator[None]:
    """A file that appears whole, and only if nothing fails until the end of the block."""
    part = path.with_name(f"{path.name}.part")
    try:
        part.write_bytes(text)
    except OSError as error:
        raise UsageError(
            f"the rejects cannot be written: {error.strerror or error}",
            where=str(path),
            remedy="name a file that can be written with --rejects",
        ) from error
    try:
        yield
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def _report(tally: _Tally, rejects: Path | None) -> FileReport:
    return FileReport(
        path=tally.stream.head.path,
        survey=tally.stream.head.name,
        stones=dict(sorted(tally.stones.items())),
        rejected=tally.rejected,
        rms=tally.rms,
        worst=tally.worst,
        shapes=tally.shapes,
        refused=tuple(Refusal(one.code, str(one.error)) for one in tally.refused),
        rejects=None if rejects is None else str(rejects),
        frame=frame_record(tally.stream.transform),
        again=tally.again,
    )
