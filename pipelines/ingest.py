"""Survey files into the database: read, fit, outline, find the depth, extrude, check, store."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from archmodel.database import open_database
from archmodel.entities import kind_named
from archmodel.records import StoneRecord
from archmodel.store import store_survey
from moma.errors import GeometryError, SurveyError, UsageError
from pipelines.progress import Listener, Progress, silent
from survey.depth import depth_for
from survey.extrusion import SurveyedBlock, extrude
from survey.faces import outline_face
from survey.formats.csv_points import read_csv
from survey.formats.moma_ascii import read_moma
from survey.records import BlockRecord, Survey
from survey.watertight import check_watertight

__all__ = ["FORMATS", "FileReport", "IngestReport", "ingest"]

FORMATS: Mapping[str, Callable[[Path], Survey]] = {"moma": read_moma, "csv": read_csv}
"""Readers of survey files by the name of their format."""


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
    worst : code of that stone
    """

    path: str
    survey: str
    stones: Mapping[str, int]
    rejected: Mapping[str, int]
    rms: float
    worst: str


@dataclass(frozen=True)
class IngestReport:
    """What became of all files: every one is in the database."""

    url: str
    files: tuple[FileReport, ...]


@dataclass(frozen=True)
class _Measured:
    """A survey file, computed but not stored."""

    survey: Survey
    sha256: str
    stones: tuple[StoneRecord, ...]


def ingest(
    paths: Sequence[str | Path], url: str, format: str = "moma", progress: Listener = silent
) -> IngestReport:
    """Take survey files into the database: all of them, or, if anything is wrong in any, none.

    Parameters
    ----------
    paths : survey files
    url : of the database, made if it does not exist
    format : name of their format
    progress : told after every stone

    Raises
    ------
    UsageError : no such file, no such format
    SurveyError, GeometryError : at the line or stone that is wrong; the database is not touched
    DatabaseError : a stone or a file is in the database already; the database is unchanged
    """
    if format not in FORMATS:
        raise UsageError(f"unknown format {format!r}", remedy=f"known formats: {', '.join(FORMATS)}")
    if not paths:
        raise UsageError("no survey file", remedy="name at least one")
    measured = [_measure(Path(path), FORMATS[format], progress) for path in paths]
    with open_database(url) as database, database.session() as session:
        for one in measured:
            store_survey(
                session,
                one.survey.head.name,
                one.survey.head.path,
                one.sha256,
                one.stones,
                observer=one.survey.head.viewpoint(None),
            )
    return IngestReport(url, tuple(_report(one) for one in measured))


def _measure(path: Path, read: Callable[[Path], Survey], progress: Listener) -> _Measured:
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "no such file"
        raise UsageError(what, where=str(path), remedy="name a survey file")
    survey = read(path)
    stones = []
    for number, record in enumerate(survey.blocks, start=1):
        stones.append(_stone(record, survey))
        progress(Progress(f"fit {path.name}", number, len(survey.blocks), record.code))
    return _Measured(survey, hashlib.sha256(path.read_bytes()).hexdigest(), tuple(stones))


def _stone(record: BlockRecord, survey: Survey) -> StoneRecord:
    """From measured points to an extruded, checked stone; errors name file, line and stone."""
    where = f"{survey.head.path}:{record.line}: stone {record.code}"
    try:
        kind_named(record.kind)
        block = extrude(
            outline_face(record, survey.head.viewpoint(None)), depth_for(record, survey.head.depth_rules)
        )
        check_watertight(block.solid)
    except UsageError as error:
        raise SurveyError(error.what, where=where, remedy=error.remedy) from error
    except (SurveyError, GeometryError) as error:
        raise type(error)(error.what, where=where, remedy=error.remedy) from error
    return _stone_record(record, block)


def _stone_record(record: BlockRecord, block: SurveyedBlock) -> StoneRecord:
    fit = block.face.fit
    return StoneRecord(
        code=record.code,
        kind=record.kind,
        course=record.course,
        line=record.line,
        vertices=record.vertices,
        points=record.points,
        sigma=record.sigma,
        normal=fit.normal,
        offset=fit.offset,
        covariance=fit.covariance,
        rms=fit.rms,
        redundancy=fit.redundancy,
        rejected=block.face.rejected_points,
        outline=block.face.outline,
        depth=block.depth.value,
        depth_sigma=block.depth.sigma,
        depth_source=block.depth.source,
        solid_vertices=block.solid.vertices,
        solid_faces=block.solid.faces,
        notes=record.notes,
    )


def _report(measured: _Measured) -> FileReport:
    kinds = sorted({stone.kind for stone in measured.stones})
    worst = max(measured.stones, key=lambda stone: stone.rms)
    return FileReport(
        path=measured.survey.head.path,
        survey=measured.survey.head.name,
        stones={kind: sum(stone.kind == kind for stone in measured.stones) for kind in kinds},
        rejected={stone.code: len(stone.rejected) for stone in measured.stones if stone.rejected},
        rms=worst.rms,
        worst=worst.code,
    )
