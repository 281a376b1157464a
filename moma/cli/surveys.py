"""Commands that read survey files, or write one to start from."""

from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from moma.cli.console import reporting, say
from moma.cli.options import (
    DEFAULT_DB,
    Codes,
    Db,
    Format,
    Header,
    Json,
    Kind,
    KindWhere,
    Planes,
    Sigma,
    Snap,
    Support,
    SurveyFiles,
    SurveyFormat,
    Unit,
    Verbose,
)
from moma.cli.progress import progress_bars
from moma.errors import UsageError

__all__ = ["Blunders", "Moved", "ingest", "orient", "sample", "survey_report"]


class Moved(StrEnum):
    """Causes of movement of samples."""

    SETTLEMENT = "settlement"
    THRUST = "thrust"
    EARTHQUAKE = "earthquake"


class Blunders(StrEnum):
    """Treatment of marks that the test finds wrong."""

    REPORT = "report"
    REMOVE = "remove"


@reporting
def sample(
    kind: Annotated[
        str, typer.Argument(help="arch, corner, facings, ribvault, tower, vault, wall or window.")
    ],
    moved: Annotated[
        Moved | None,
        typer.Option(
            help="Move its stones by a simulation: the wall by any cause, facings and tower by settlement."
        ),
    ] = None,
    small: Annotated[
        bool, typer.Option("--small", help="Smaller: the tower, and the wall with --moved settlement.")
    ] = False,
    phases: Annotated[
        bool,
        typer.Option("--phases", help="Upper courses were laid later: the wall with --moved settlement."),
    ] = False,
    courses: Annotated[
        int | None, typer.Option(help="Courses of the tower; default: 40, or 12 with --small.")
    ] = None,
    photographs: Annotated[
        bool, typer.Option("--photographs", help="Twelve photographs of the window too, to orient.")
    ] = False,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for the files; default: KIND.")
    ] = None,
    json: Json = False,
) -> None:
    """Write a synthetic survey with its truth and a scene that runs, to start from."""
    from moma.cli.text.formats import as_json
    from pipelines.samples.write import write_sample

    with progress_bars() as listener:
        written = write_sample(
            kind,
            out or Path(kind),
            listener,
            moved=moved,
            small=small,
            phases=phases,
            courses=courses,
            photographs=photographs,
        )
    lines = [
        f"{written.title}: a synthetic survey of {written.stones} stones",
        *(f"  {path}" for path in written.files),
        "run it with",
        *(f"  {command}" for command in written.commands),
    ]
    print(as_json(asdict(written)) if json else "\n".join(lines))


@reporting
def orient(
    project: Annotated[
        Path | None,
        typer.Argument(metavar="PROJECT.toml", help="Project file; see docs/howto/photographs.md."),
    ] = None,
    photomodeler: Annotated[
        Path | None,
        typer.Option(
            "--photomodeler", metavar="FILE", help="Text export of PhotoModeler, without a project file."
        ),
    ] = None,
    control: Annotated[
        Path | None,
        typer.Option("--control", metavar="FILE", help="Control points: number, name, X, Y, Z, deviations."),
    ] = None,
    calibrate: Annotated[
        str | None,
        typer.Option(
            "--calibrate",
            metavar="LIST",
            help="Parameters of the camera that are estimated, e.g. c,xp,yp,K1,K2.",
        ),
    ] = None,
    fixed_control: Annotated[
        bool,
        typer.Option("--fixed-control", help="Control points keep their places, whatever their deviations."),
    ] = False,
    check: Annotated[
        str | None, typer.Option("--check", metavar="LIST", help="Control points that only check the result.")
    ] = None,
    blunders: Annotated[
        Blunders | None,
        typer.Option(help="Whether marks that the test finds wrong are left out; default: report."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the results; default: out/PROJECT."),
    ] = None,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Orient photographs: bundle adjustment with calibration, precision of every point, blunders."""
    from moma.cli.text.formats import as_json
    from moma.cli.text.photographs import orient_lines
    from moma.kernels.beside import compiling_beside
    from pipelines.reports.photographs.orient import orient_photographs, photomodeler_project
    from pipelines.reports.photographs.project import read_project

    if (project is None) == (photomodeler is None):
        raise UsageError("neither or both of PROJECT.toml and --photomodeler", remedy="give one of them")
    if project is not None:
        for name, given in (
            ("--control", control), ("--calibrate", calibrate), ("--fixed-control", fixed_control or None),
            ("--check", check), ("--blunders", blunders),
        ):  # fmt: skip
            if given is not None:
                raise UsageError(f"{name} with a project file", remedy="write it into the project file")
        read = read_project(project)
    else:
        assert photomodeler is not None
        read = photomodeler_project(
            photomodeler,
            control,
            _names(calibrate),
            fixed_control,
            _names(check),
            (blunders or Blunders.REPORT).value,
        )
    folder = out or Path("out") / (project or photomodeler or Path("photographs")).stem
    with compiling_beside("orient"):
        report = orient_photographs(read, folder)
    for remark in report.values["remarks"]:
        say(f"warning: {remark}")
    left = ("covariance", "marks")
    shown = {name: value for name, value in report.values.items() if name not in left}
    print(as_json({**shown, "folder": str(folder)}) if json else "\n".join(orient_lines(report, verbose)))


def _names(text: str | None) -> tuple[str, ...]:
    return tuple(one.strip() for one in text.split(",") if one.strip()) if text else ()


@reporting
def ingest(
    files: SurveyFiles,
    format: Format = SurveyFormat.MOMA,
    header: Header = None,
    codes: Codes = None,
    kind: Kind = None,
    sigma: Sigma = None,
    unit: Unit = None,
    snap: Snap = None,
    planes: Planes = None,
    kind_where: KindWhere = None,
    support: Support = None,
    keep_going: Annotated[
        bool,
        typer.Option(
            "--keep-going", help="Ingest the good stones, and write the others to a file of rejects."
        ),
    ] = False,
    rejects: Annotated[
        Path | None,
        typer.Option(
            "--rejects", metavar="FILE", help="File of rejects; default: NAME.rejects beside the survey file."
        ),
    ] = None,
    again: Annotated[
        bool,
        typer.Option(
            "--again", help="Accept new measurements of stones in the database; earlier ones are kept."
        ),
    ] = False,
    db: Db = DEFAULT_DB,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Ingest survey files into the database: all of them, or none if anything is wrong."""
    from moma.cli.text.formats import as_json
    from moma.cli.text.runs_and_surveys import ingest_lines
    from moma.kernels.beside import compiling_beside
    from pipelines.ingest.ingest import ingest as ingest_files
    from pipelines.ingest.kind_rules import kind_rules
    from pipelines.ingest.reading_options import reading_options

    if rejects is not None and not keep_going:
        raise UsageError("--rejects without --keep-going", remedy="give --keep-going too")
    for name, given in (("--unit", unit), ("--snap", snap), ("--planes", planes)):
        if given is not None and format is not SurveyFormat.SOLIDS:
            raise UsageError(f"{name} with format {format}", remedy="it is for --format solids")
    options = reading_options(header, codes, kind, sigma, unit, snap, planes)
    rules = kind_rules(kind_where or (), support or ())
    with compiling_beside("ingest"), progress_bars() as listener:
        report = ingest_files(
            files,
            db,
            format.value,
            listener,
            options=options,
            keep_going=rejects or keep_going,
            again=again,
            rules=rules,
        )
    print(as_json(asdict(report)) if json else "\n".join(ingest_lines(report, verbose)))


@reporting
def survey_report(
    files: SurveyFiles,
    format: Format = SurveyFormat.MOMA,
    header: Header = None,
    codes: Codes = None,
    kind: Kind = None,
    sigma: Sigma = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the report; default: out/survey-FILE."),
    ] = None,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Judge survey files without a database: precision, courses, kinds, stones to measure again."""
    from moma.cli.text.runs_and_surveys import survey_report_lines
    from pipelines.ingest.reading_options import reading_options
    from pipelines.reports.survey.report import INDEX, report_surveys

    options = reading_options(header, codes, kind, sigma)
    folder = out or Path("out") / f"survey-{files[0].resolve().stem}"
    with progress_bars() as listener:
        report = report_surveys(files, folder, format.value, options, listener)
    for warning in report.study.warnings:
        say(f"warning: {warning}")
    lines = survey_report_lines(report, verbose)
    print((folder / INDEX).read_text(encoding="utf-8").rstrip() if json else "\n".join(lines))
