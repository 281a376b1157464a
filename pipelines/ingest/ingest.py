"""Ingest of survey files: read, fit, outline, find the depth, extrude and store, one stone at a time."""

import hashlib
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
from sqlalchemy.orm import Session

from archmodel.database.session import home_of, open_database
from archmodel.store.bulk import first_free_id
from archmodel.store.stone_record import StoneRecord
from archmodel.store.stones import store_survey
from archmodel.tables.entities import Entity, kind_named, kinds
from ground.errors import MomaError, NoDatabaseError, SurveyError, UsageError
from mechanics.dynamics.progress import Listener, Progress, silent
from pipelines.ingest.kind_rules import KindRule, apply_rules, check_kinds
from pipelines.ingest.outlined import (
    check_outline_rejects,
    open_source,
    outline_rejects,
    outline_rejects_path,
    read_files,
)
from pipelines.ingest.reading_options import Source, survey_sources
from pipelines.ingest.records import frame_record, stone_record
from pipelines.ingest.rejects import check_targets, default_path, rejects_text
from pipelines.ingest.relate import KnownSolids, relate
from pipelines.ingest.report import IngestReport, Tally
from pipelines.ingest.spool import Spool
from survey.extrusion.extrusion import SurveyedBlock
from survey.formats.options import ReadingOptions
from survey.formats.tables.axes import exchanged, exchanged_station
from survey.records.survey import Reject
from survey.registration.stones import survey_stones

_PATIENCE = (
    300.0  # longest wait for another writer [s]; waiting for a large survey is cheaper than fitting again
)


def ingest(
    paths: Sequence[str | Path],
    url: str,
    format: str = "moma",
    progress: Listener = silent,
    *,
    options: ReadingOptions | None = None,
    keep_going: bool | str | Path = False,
    again: bool = False,
    rules: Sequence[KindRule] = (),
) -> IngestReport:
    """Ingest survey files: all of them or, if anything is wrong in any, none.

    Parameters
    ----------
    paths : survey files, or folders of them; all files of solids are one survey
    url : of the database, created if it does not exist
    format : name of their format
    progress : called after every stone
    options : defaults for what the files leave out
    keep_going : ingest the good stones of each file, and write the others with the reasons to a file of rejects: the
        given one, for a single survey file, or, if True, ``NAME.rejects.SUFFIX`` beside each survey file
    again : stones that are in the database already were measured again: their old measurements are kept as superseded;
        otherwise they are an error; also the same file, read with other options
    rules : which solids are of which kind

    Raises
    ------
    UsageError : no such file, one named twice, no such format, a file of rejects that would replace one of the user's,
        rules for stones that are no solids
    SurveyError, GeometryError : at the line or stone that is wrong, or has the code of one in another of the files;
        the database is not touched
    DatabaseError : a stone or a file is in the database already; the database is unchanged
    """
    sources = survey_sources(paths, format)
    surveys = [source.path for source in sources]
    rejects = None if isinstance(keep_going, bool) else Path(keep_going)
    _refuse_contradictions(rejects, len(surveys), rules, format)
    targets = [rejects or _rejects_path(survey, format, options) for survey in surveys]
    if keep_going:
        _check_targets(targets, sources, format)
    with ExitStack() as stack:
        _open_if_there(url, stack)
        check_kinds(rules)
        options = replace(options or ReadingOptions(), known_kinds=frozenset(kinds()))
        spools = [stack.enter_context(Spool()) for _ in surveys]
        tallies = [
            _measure(source, spool, format, options, rules, bool(keep_going), progress)
            for source, spool in zip(sources, spools, strict=True)
        ]
        if len(surveys) > 1:
            _check_codes(tallies, spools)
            _check_axes(tallies)
        for path, target, tally in zip(surveys, targets, tallies, strict=True):
            if tally.refused:
                stack.enter_context(_published(target, _rejects(path, format, tally, options)))
        with open_database(url, lock_timeout=_PATIENCE) as database, database.session() as session:
            _store_all(session, tallies, spools, again, progress)
        reports = tuple(
            tally.report(target if tally.refused else None)
            for tally, target in zip(tallies, targets, strict=True)
        )
    return IngestReport(database.url, reports)


def _refuse_contradictions(rejects: Path | None, count: int, rules: Sequence[KindRule], format: str) -> None:
    """Refuse one file of rejects for several files, and rules of solids for other stones."""
    if rejects is not None and count > 1:
        raise UsageError(f"one file of rejects for {count} survey files", remedy="ingest one file at a time")
    if rules and format != "solids":
        remedy = "give it with --format solids; surveys give the kind of each stone"
        raise UsageError(f"a rule for solids with format {format}", where=rules[0].option, remedy=remedy)


def _store_all(
    session: Session, tallies: Sequence[Tally], spools: Sequence[Spool], again: bool, progress: Listener
) -> None:
    """Store the stones of all surveys, and relate them."""
    solids = KnownSolids()
    for tally, spool in zip(tallies, spools, strict=True):
        stones = _with_progress(spool, tally, progress)
        # stones measured again keep their numbers, so that their solids cannot be numbered in advance
        _store(session, tally, stones if again else _kept(stones, session, solids), again)
    progress(Progress("relate", 0, None))
    relate(session, only=[number for tally in tallies for number in tally.stored], solids=solids)


def _rejects_path(survey: Path, format: str, options: ReadingOptions | None) -> Path:
    """Return the file of the rejects of a survey, beside it."""
    return outline_rejects_path(survey, options) if format in _OUTLINED else default_path(survey)


def _check_targets(targets: Sequence[Path], sources: Sequence[Source], format: str) -> None:
    """Refuse files of rejects that would replace a file of the user's."""
    if format in _OUTLINED:
        for target in targets:
            check_outline_rejects(target)
    else:
        check_targets(targets, [file for source in sources for file in source.files])


def _rejects(path: Path, format: str, tally: Tally, options: ReadingOptions) -> bytes:
    """Return the stones of a survey that were refused, with the reasons, in the survey's own format."""
    if format in _OUTLINED:
        return outline_rejects(path, options, tally.refused)
    stations = _listed_stations(tally, options) if format in _LISTS else []
    header, sheet = tally.stream.header, options.sheet
    return rejects_text(path, format, tally.refused, stations, header=header, sheet=sheet)


def _open_if_there(url: str, stack: ExitStack) -> None:
    """Open an existing database early, to know its registered kinds and to report its faults first."""
    try:
        stack.enter_context(open_database(url, create=False))
    except NoDatabaseError:
        home_of(url).engine(create=True).dispose()  # fails if none could be created


def _check_codes(tallies: Sequence[Tally], spools: Sequence[Spool]) -> None:
    """Refuse files that give one code to two stones, before a database is created for them."""
    places: dict[str, str] = {}
    for tally, spool in zip(tallies, spools, strict=True):
        for stone in spool:
            place = f"{tally.stream.head.path}:{stone.line}"
            if (first := places.setdefault(stone.code, place)) != place:
                what = f"the code {stone.code} is taken by the stone at {first}"
                raise SurveyError(what, where=place, remedy="give each stone a code of its own")


def _check_axes(tallies: Sequence[Tally]) -> None:
    """Refuse lists of which one has easting and northing exchanged, so that it would be a mirror image."""
    for first, tally in combinations(tallies, 2):
        here, there = (
            {station.name: station.position for station in one.stream.head.stations} for one in (first, tally)
        )
        common = [name for name in here if name in there and exchanged_station(there[name], here[name])]
        places = (np.array(one.centres).reshape(-1, 3) for one in (tally, first))
        if common or exchanged(*places):
            what = f"station {common[0]} is that of" if common else "its stones are beside those of"
            raise SurveyError(
                f"{what} {first.path.name} only if easting and northing of one of the two are exchanged",
                where=str(tally.path),
                remedy="ingest them one by one, one with --format pnezd (northing first), the other with penzd",
            )


_LISTS = ("csv", "pnezd", "penzd", "gsi")
_OUTLINED = ("cloud", "masks")


def _listed_stations(tally: Tally, options: ReadingOptions | None) -> list[int]:
    """List the lines of the stations that are given among the points, not in the header file."""
    elsewhere = () if options is None or options.head is None else options.head.stations
    names = {station.name for station in elsewhere}
    return [station.line for station in tally.stream.head.stations if station.name not in names]


def _measure(
    source: Source,
    spool: Spool,
    format: str,
    options: ReadingOptions | None,
    rules: Sequence[KindRule],
    keep_going: bool,
    progress: Listener,
) -> Tally:
    """Write the good stones of one file into a spool; keep bad ones for the rejects, or refuse the file for them."""
    path = source.path
    stream = survey_stones(open_source(source, format, options, progress))
    tally = Tally(path, stream, read_files(source, options), options or ReadingOptions())
    stage, head, kinds = f"fit {path.name}", tally.stream.head, set[str]()
    for stone in tally.stream.stones:
        made = (
            stone
            if isinstance(stone, Reject)
            else _of_known_kind(apply_rules(stone, rules), head.path, kinds, format not in ("moma", "solids"))
        )
        if not isinstance(made, Reject):
            tally.count(made)
            spool.append(stone_record(made))
            progress(Progress(stage, tally.stones.total(), None, made.code))
        else:
            tally.refused.append(made)
    if tally.refused and not keep_going:
        raise _first_error(tally.refused, tally.stones.total())
    if not tally.stones:
        first = f"; the first: {tally.refused[0].error}" if tally.refused else ""
        what = f"none of its {len(tally.refused)} stones can be ingested{first}"
        raise SurveyError(what, where=str(path), remedy="correct the file")
    if format != "moma" and (question := next(tally.questions(), None)) is not None:
        raise SurveyError(question.what, where=str(path), remedy=question.remedy)
    return tally


def _first_error(refused: Sequence[Reject], good: int) -> MomaError:
    """Return the error of the first stone that is wrong, with the number of the others, and one of another kind."""
    first, *others = (reject.error for reject in refused)
    if not others or not good:
        return first
    pattern = _pattern(first.what)
    another = next((error for error in others if _pattern(error.what) != pattern), None)
    also = "" if another is None else f", as {another.where}: {another.what}"
    count = f"{len(others)} more of {good + len(refused)} stones are wrong{also}"
    remedy = f"{first.remedy}; {count}; --keep-going takes the rest"
    return type(first)(first.what, where=first.where, remedy=remedy)


def _pattern(text: str) -> str:
    """Return what is alike in errors of one kind: the text without what is quoted, and without names and numbers."""
    return re.sub(r"'[^']*'|\S*\d\S*", "", text)


def _store(session: Session, tally: Tally, stones: Iterator[StoneRecord], again: bool) -> None:
    head = tally.stream.head
    stored = store_survey(
        session,
        head.name,
        head.path,
        _sha256(tally.files),
        stones,
        stations={station.name: station.position.tolist() for station in head.stations},
        frame=frame_record(tally.stream.transform),
        again=again,
    )
    tally.stored = (*stored.new, *stored.again)
    tally.again = len(stored.again)


def _with_progress(stones: Iterable[StoneRecord], tally: Tally, progress: Listener) -> Iterator[StoneRecord]:
    total = tally.stones.total()
    for number, stone in enumerate(stones, start=1):
        progress(Progress(f"store {tally.path.name}", number, total, stone.code))
        yield stone


def _kept(stones: Iterator[StoneRecord], session: Session, solids: KnownSolids) -> Iterator[StoneRecord]:
    """Pass stones on to the database, and keep their solids for the relations."""
    for number, stone in enumerate(stones, start=first_free_id(session, Entity)):
        solids.add(number, stone.solid_vertices, stone.solid_faces)
        yield stone


def _of_known_kind(block: SurveyedBlock, path: str, known: set[str], worded: bool) -> SurveyedBlock | Reject:
    """Return the stone, or a reject if the hierarchy has no such kind; `known` collects kinds found there."""
    if block.kind in known:
        return block
    try:
        kind_named(block.kind)
    except UsageError as error:
        record = block.face.record
        where = f"{path}:{record.line}: stone {block.code}"
        remedy = error.remedy
        if worded:
            asked = str(remedy).endswith("?")
            remedy = f'{remedy}{" Or" if asked else "; or"} say what it stands for, e.g. --kinds "{block.kind}=ashlar"'
        return Reject(block.code, SurveyError(error.what, where=where, remedy=remedy), record.spans)
    known.add(block.kind)
    return block


def _sha256(files: Sequence[Path]) -> str:
    """Compute the digest of a file, or of the digests of several."""
    digests = []
    for path in files:
        with path.open("rb") as file:
            digests.append(hashlib.file_digest(file, "sha256").hexdigest())
    return digests[0] if len(digests) == 1 else hashlib.sha256("".join(sorted(digests)).encode()).hexdigest()


@contextmanager
def _published(path: Path, text: bytes) -> Iterator[None]:
    """Write a file that appears complete, and only if nothing fails until the end of the block."""
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
