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
    Columns,
    Db,
    Format,
    Header,
    Json,
    Kind,
    Kinds,
    KindWhere,
    Overwrite,
    Planes,
    Repair,
    Sheet,
    Sigma,
    Snap,
    Support,
    SurveyFiles,
    Unit,
    Up,
    Verbose,
)
from moma.cli.progress import progress_bars
from moma.errors import UsageError

__all__ = ["Level", "Moved", "ingest", "sample", "survey_report"]


class Level(StrEnum):
    """Grades of what a survey does not tell about masonry."""

    GOOD = "good"
    MEDIUM = "medium"
    POOR = "poor"


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
            kind, out or Path(kind), listener, moved=moved, small=small, phases=phases, courses=courses
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
    format: Format = None,
    header: Header = None,
    columns: Columns = None,
    sheet: Sheet = None,
    codes: Codes = None,
    kind: Kind = None,
    kinds: Kinds = None,
    sigma: Sigma = None,
    unit: Unit = None,
    up: Up = None,
    repair: Repair = None,
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
    from pipelines.ingest.reading_options import format_of_all, reading_options

    if rejects is not None and not keep_going:
        raise UsageError("--rejects without --keep-going", remedy="give --keep-going too")
    name = format_of_all(files) if format is None else format.value
    solids = {"--snap": snap, "--planes": planes, "--up": up, "--repair": repair}
    tables = {"--columns": columns, "--sheet": sheet, "--kinds": kinds}
    for option, given in solids.items():
        if given is not None and name != "solids":
            raise UsageError(f"{option} with format {name}", remedy="it is for --format solids")
    for option, text in tables.items():
        if text is not None and name in ("moma", "solids"):
            raise UsageError(f"{option} with format {name}", remedy="it is for tables and lists of points")
    if unit is not None and name == "moma":
        raise UsageError("--unit with format moma", remedy="its lengths are metres")
    options = reading_options(
        *(header, codes, kind, sigma, unit, snap, planes, columns, sheet, kinds, up and up.value, repair)
    )
    rules = kind_rules(kind_where or (), support or ())
    with compiling_beside("ingest"), progress_bars() as listener:
        report = ingest_files(
            files,
            db,
            name,
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
    format: Format = None,
    header: Header = None,
    columns: Columns = None,
    sheet: Sheet = None,
    codes: Codes = None,
    kind: Kind = None,
    kinds: Kinds = None,
    sigma: Sigma = None,
    unit: Unit = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the report; default: out/survey-FILE."),
    ] = None,
    mortar: Annotated[
        Level | None, typer.Option(help="Quality of the mortar, for the masonry quality index.")
    ] = None,
    state: Annotated[
        Level | None, typer.Option(help="State and strength of the stones, for the masonry quality index.")
    ] = None,
    overwrite: Overwrite = False,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Judge survey files without a database: precision, what has moved, masonry, kinds, stones to measure again."""
    from moma.cli.text.runs_and_surveys import survey_report_lines
    from pipelines.ingest.reading_options import format_of_all, reading_options
    from pipelines.reports.survey.report import INDEX, report_surveys
    from survey.quality.masonry.index import given_grade

    name = format_of_all(files) if format is None else format.value
    options = reading_options(header, codes, kind, sigma, unit, columns=columns, sheet=sheet, kinds=kinds)
    folder = out or Path("out") / f"survey-{files[0].resolve().stem}"
    levels = {"MM": mortar, "SM": state}
    given = {name: given_grade(level.value) for name, level in levels.items() if level is not None}
    with progress_bars() as listener:
        report = report_surveys(files, folder, name, options, listener, given, overwrite)
    for warning in report.study.warnings:
        say(f"warning: {warning}")
    lines = survey_report_lines(report, verbose)
    print((folder / INDEX).read_text(encoding="utf-8").rstrip() if json else "\n".join(lines))
