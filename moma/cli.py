"""The command ``moma``. Everything heavy is imported by the command that needs it, so that help is fast."""

from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from moma.console import progress_bars, reporting, say
from moma.errors import UsageError

__all__ = [
    "ListFormat",
    "SurveyFormat",
    "app",
    "check",
    "ingest",
    "main",
    "query",
    "run",
    "show",
    "survey_report",
]


class SurveyFormat(StrEnum):
    """Formats of survey files."""

    MOMA = "moma"
    CSV = "csv"
    PNEZD = "pnezd"
    PENZD = "penzd"
    SOLIDS = "solids"


class ListFormat(StrEnum):
    """Formats of a list of entities."""

    TABLE = "table"
    CSV = "csv"
    JSON = "json"


Db = Annotated[
    str, typer.Option("--db", metavar="URL", envvar="MOMA_DB", help="Entity database, as sqlite:///FILE.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Say more; show the traceback of an error.")]
SurveyFiles = Annotated[
    list[Path], typer.Argument(metavar="FILE…", help="Survey files; see docs/formats.md.")
]
Format = Annotated[SurveyFormat, typer.Option(help="Format of the survey files.")]
Header = Annotated[
    Path | None,
    typer.Option(
        "--header", metavar="FILE", help="Head (stations, control, depths) for formats without their own."
    ),
]
Codes = Annotated[
    str | None,
    typer.Option("--codes", metavar="TEMPLATE", help="How codes are made up, e.g. '{block}:{role}'."),
]
Kind = Annotated[
    str | None, typer.Option("--kind", metavar="KIND", help="Kind of stones that do not say it; else ashlar.")
]
Sigma = Annotated[
    float | None,
    typer.Option(
        "--sigma",
        metavar="S",
        help="Standard deviation of a coordinate in metres, where a file does not say it.",
    ),
]
SceneArgument = Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene file; see docs/scene.md.")]

_DEFAULT_DB = "sqlite:///moma.db"

app = typer.Typer(
    name="moma",
    help="From a stone-by-stone survey of a historic building to a mechanical simulation of it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def main() -> None:
    """Run the command line; exit code 0 done, 1 failed, 2 wrong use."""
    app(prog_name="moma")


def _print_version(asked: bool) -> None:
    if asked:
        import moma

        print(f"moma {moma.__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


@app.command()
@reporting
def ingest(
    files: SurveyFiles,
    format: Format = SurveyFormat.MOMA,
    header: Header = None,
    codes: Codes = None,
    kind: Kind = None,
    sigma: Sigma = None,
    keep_going: Annotated[
        bool,
        typer.Option("--keep-going", help="Take the good stones, write the others to a file of rejects."),
    ] = False,
    rejects: Annotated[
        Path | None,
        typer.Option(
            "--rejects", metavar="FILE", help="That file; else NAME.rejects beside the survey file."
        ),
    ] = None,
    db: Db = _DEFAULT_DB,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Take survey files into the database: all of them, or none if anything is wrong."""
    from moma.listing import as_json
    from moma.telling import ingest_lines
    from pipelines.ingest import ingest as take_in
    from pipelines.reading_options import reading_options

    if rejects is not None and not keep_going:
        raise UsageError("--rejects without --keep-going", remedy="give --keep-going too")
    options = reading_options(header, codes, kind, sigma)
    with progress_bars() as listener:
        report = take_in(
            files, db, format.value, listener, options=options, keep_going=keep_going, rejects=rejects
        )
    print(as_json(asdict(report)) if json else "\n".join(ingest_lines(report, verbose)))


@app.command(name="survey-report")
@reporting
def survey_report(
    files: SurveyFiles,
    format: Format = SurveyFormat.MOMA,
    header: Header = None,
    codes: Codes = None,
    kind: Kind = None,
    sigma: Sigma = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for the report; else out/survey-FILE.")
    ] = None,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Judge survey files: precision, what to measure again, courses, kinds; no database is needed."""
    from moma.telling import survey_report_lines
    from pipelines.reading_options import reading_options
    from pipelines.survey_report import INDEX, report_surveys

    options = reading_options(header, codes, kind, sigma)
    folder = out or Path("out") / f"survey-{files[0].stem}"
    with progress_bars() as listener:
        report = report_surveys(files, folder, format.value, options, listener)
    for warning in report.study.warnings:
        say(f"warning: {warning}")
    lines = survey_report_lines(report, verbose)
    print((folder / INDEX).read_text(encoding="utf-8").rstrip() if json else "\n".join(lines))


@app.command()
@reporting
def query(
    kind: Annotated[
        str, typer.Argument(metavar="KIND", help="Kind of entity, with its subkinds, e.g. voussoir.")
    ],
    where: Annotated[
        list[str] | None,
        typer.Option("--where", metavar="EXPR", help="Condition, e.g. 'depth > 0.4'; all given ones hold."),
    ] = None,
    format: Annotated[ListFormat | None, typer.Option(help="Format of the list; else table.")] = None,
    db: Db = _DEFAULT_DB,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """List the entities of a kind that satisfy conditions."""
    from archmodel.database import open_database
    from archmodel.query import attributes, find_rows
    from moma.listing import as_csv, as_json, as_table, shown_columns

    if json and format not in (None, ListFormat.JSON):
        raise UsageError(f"--json and --format {format} ask for two formats", remedy="give one of them")
    conditions = where or []
    with open_database(db, create=False) as database, database.session(read_only=True) as session:
        rows = find_rows(session, kind, conditions)
    units = {attribute.name: attribute.unit for attribute in attributes()}
    if json or format is ListFormat.JSON:
        print(as_json(rows))
    elif format is ListFormat.CSV:
        print(as_csv(units, rows))
    elif rows:
        columns = units if verbose else {name: units[name] for name in shown_columns(units, rows, conditions)}
        print(as_table(columns, rows))
        say(f"{len(rows)} found")
    else:
        say(f"no {kind} found" + "".join(f", where {one}" for one in conditions))


@app.command()
@reporting
def show(
    code: Annotated[str, typer.Argument(metavar="CODE", help="Code of a stone.")],
    db: Db = _DEFAULT_DB,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Show one entity: what it is, what was measured, what was computed."""
    from archmodel.database import open_database
    from archmodel.query import describe
    from moma.listing import as_json, as_lines

    with open_database(db, create=False) as database, database.session(read_only=True) as session:
        description = describe(session, code)
    print(as_json(description) if json else as_lines(description))


@app.command()
@reporting
def check(scene: SceneArgument, db: Db = _DEFAULT_DB, json: Json = False, verbose: Verbose = False) -> None:
    """Say whether a scene is sound and what it will cost; run nothing."""
    from moma.listing import as_json
    from moma.telling import check_lines
    from pipelines.check import check_scene

    report = check_scene(scene, db)
    print(as_json(asdict(report)) if json else "\n".join(check_lines(report, verbose)))
    if report.problems:
        raise typer.Exit(1)


@app.command()
@reporting
def run(
    scene: SceneArgument,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for the results; else out/SCENE.")
    ] = None,
    db: Db = _DEFAULT_DB,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Simulate a scene; write tables, pictures and a report, and keep the results in the database."""
    from moma.listing import as_json
    from moma.telling import run_lines
    from pipelines.run import run_scene

    with progress_bars() as listener:
        done = run_scene(scene, db, out or Path("out") / scene.stem, listener)
    for warning in done.warnings:
        say(f"warning: {warning}")
    print(as_json(done.summary) if json else "\n".join(run_lines(done, verbose)))
