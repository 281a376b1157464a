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

__all__ = ["Moved", "ingest", "sample", "survey_report"]


class Moved(StrEnum):
    """Causes of movement of samples."""

    SETTLEMENT = "settlement"
    THRUST = "thrust"
    EARTHQUAKE = "earthquake"


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
