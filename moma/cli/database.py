"""Commands for whole databases: their layout, export and import, a view of them, and a server."""

import sys
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ground.errors import UsageError
from moma.cli.console import reporting, say
from moma.cli.options import (
    DEFAULT_DB,
    At,
    Common,
    Db,
    DrawnChoices,
    SurveyChoices,
    Verbose,
    check_ending,
)
from moma.cli.surveys import sources


@reporting
def migrate(
    *,
    to: Annotated[
        int | None, typer.Option("--to", metavar="N", help="Version of the layout; default: the newest.")
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Going to an older version, drop what it cannot hold.")
    ] = False,
    common: Common,
) -> None:
    """Migrate a database to the newest layout, or to an older one: completely or not at all."""
    from archmodel.migrations.migrate import migrate as change
    from moma.cli.text.formats import as_json

    if yes and to is None:
        raise UsageError("--yes without --to", remedy="name the older version with --to")
    done = change(common.db, to, lossy=yes)
    if common.json:
        print(as_json(asdict(done)))
        return
    if done.before == done.after:
        print(f"{done.url}: has version {done.after} already")
        return
    print(f"{done.url}: from version {done.before} to {done.after}")
    for one in done.lost:
        print(f"dropped: {one}")
    if done.backup is not None:
        print(f"backup: {done.backup}")


if TYPE_CHECKING:
    from pipelines.ingest.exchange import ExchangeReport
    from pipelines.propose.outlines.editing import OutlineEditor
    from pipelines.record.export.export import Exported


Document = Annotated[
    Path, typer.Argument(metavar="FILE.json", help="The document, or FILE.json.gz; see docs/exchange.md.")
]

Target = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        help="FILE.json or .json.gz: all, as one document; - for standard output. FILE.ifc, .dxf, .gpkg, .glb, "
        ".compas.json, .results.json, .lmgc90.py or .3ddat: for other programs; see docs/howto/other-programs.md. "
        "FILE.graphml: the matrix for yEd; FILE.ttl: the vocabularies as SKOS.",
    ),
]


@reporting
def export(
    *,
    document: Target,
    run: Annotated[
        int | None,
        typer.Option("--run", metavar="N", help="Run whose results go into a file for another program."),
    ] = None,
    crs: Annotated[
        str | None,
        typer.Option(
            "--crs", metavar="NAME", help="Reference system of the site for IFC and GeoPackage: EPSG:25832."
        ),
    ] = None,
    common: Common,
) -> None:
    """Export the database as one JSON document, or its stones into a file for another program."""
    from moma.cli.text.formats import as_json
    from pipelines.ingest.exchange import export_database, export_to_stream
    from pipelines.record.export.export import ENDINGS, export_file

    name = document.name.lower()
    if name.endswith(ENDINGS):
        done = export_file(common.db, document, run, crs)
        print(as_json(asdict(done)) if common.json else _told(done))
        return
    check_ending(document if name != "-" else None, ".json", ".json.gz", *ENDINGS)
    for option, given in (("--run", run), ("--crs", crs)):
        if given is not None:
            remedy = "leave it out: the document has all runs"
            raise UsageError(f"{option} with a JSON document", where=str(document), remedy=remedy)
    if str(document) == "-":
        export_to_stream(common.db, sys.stdout.buffer)
        return
    report = export_database(common.db, document)
    print(as_json(asdict(report)) if common.json else "\n".join(_lines(report, "from", common.verbose)))


def _told(done: "Exported") -> str:
    """Return what was written in one line."""
    results = "" if done.run is None else f", results of run {done.run}"
    size = f"{done.bytes / 1e6:.1f} MB"
    content = f"{done.stones} stones, {done.groups} groups{results}" if done.stones else "knowledge"
    return f"{done.path}: {content} from {done.database} ({size})"


@reporting
def import_(document: Document, common: Common) -> None:
    """Create a database from an exported document: completely, or not at all if anything is wrong."""
    from moma.cli.text.formats import as_json
    from pipelines.ingest.exchange import import_database

    report = import_database(document, common.db)
    print(as_json(asdict(report)) if common.json else "\n".join(_lines(report, "into", common.verbose)))


def _lines(report: "ExchangeReport", way: str, verbose: bool) -> list[str]:
    """Count the rows by section; list empty sections too if `verbose`."""
    total = sum(report.rows.values())
    lines = [f"{report.path}: {total} rows {way} {report.database} ({report.bytes / 1e6:.1f} MB)"]
    return lines + [f"  {count:>8} {name}" for name, count in report.rows.items() if count or verbose]


@dataclass(frozen=True)
class ElevationChoices:
    """Drawing of the main elevation beside a page."""

    elevation: Annotated[
        Path | None,
        typer.Option("--elevation", metavar="FILE.svg", help="Draw the main elevation to scale there too."),
    ] = None
    scale: Annotated[
        int | None,
        typer.Option(
            "--scale", metavar="N", min=1, help="1 : N of the elevation; default: fits a sheet of A4."
        ),
    ] = None


@reporting
def view(
    *,
    pages: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[PAGE…]",
            help="Pages with a viewer, or folders of runs, to show side by side; default: the stones of the database.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="The page.")] = Path("out/view.html"),
    kind: Annotated[
        str, typer.Option("--kind", metavar="KIND", help="Only this kind with its subkinds.")
    ] = "entity",
    where: Annotated[
        list[str] | None,
        typer.Option(
            "--where", metavar="EXPR", help="Condition, e.g. 'course < 4'; if repeated, all must hold."
        ),
    ] = None,
    run: Annotated[
        int | None,
        typer.Option("--run", metavar="N", help="Run whose results are shown; default: each stone's latest."),
    ] = None,
    title: Annotated[
        str | None,
        typer.Option("--title", metavar="TEXT", help="Name of the building; default: the survey's."),
    ] = None,
    drawing: ElevationChoices,
    at: At = None,
    common: Common,
) -> None:
    """Write one page, without network, in which the stones can be turned, searched and coloured."""
    from moma.cli.text.formats import as_json
    from pipelines.reports.view import write_comparison_view, write_view

    check_ending(out, ".html", ".htm")
    elevation, scale = drawing.elevation, drawing.scale
    check_ending(elevation, ".svg")
    if pages:
        for name, given in (("--where", where), ("--run", run), ("--elevation", elevation), ("--at", at)):
            if given:
                raise UsageError(f"{name} with pages", remedy="it is for the stones of a database")
        done = write_comparison_view(pages, out)
    else:
        done = write_view(common.db, out, kind, where or (), run, title, elevation, scale, at)
    if common.json:
        print(as_json({"page": str(done.path), "stones": done.stones, "scale": done.scale}))
        return
    print(
        f"{done.path}: {f'{done.stones} stones' if done.stones else f'{len(pages or ())} views side by side'}"
    )
    if elevation is not None:
        print(f"{elevation}: 1 : {done.scale}")


@dataclass(frozen=True)
class ServerChoices:
    """Address, token and limits of a server; the fields of `ServeSettings` that users choose."""

    host: Annotated[
        str,
        typer.Option(
            "--host",
            metavar="ADDRESS",
            help="Address to listen on; others than this one are reached from outside.",
        ),
    ] = "127.0.0.1"
    port: Annotated[int, typer.Option("--port", metavar="N", min=0, max=65535, help="Port; 0: any.")] = 8000
    token: Annotated[
        str | None,
        typer.Option(
            "--token",
            metavar="TEXT",
            envvar="MOMA_TOKEN",
            help="Ask every request for this token.",
            show_default=False,
        ),
    ] = None
    seconds: Annotated[
        float, typer.Option("--time-limit", metavar="S", min=0.1, help="Longest time of one query [s].")
    ] = 5.0
    rows: Annotated[int, typer.Option("--row-limit", metavar="N", min=1, help="Most rows of one answer.")] = (
        10_000
    )


@reporting
def serve(
    *,
    server: ServerChoices,
    edit: Annotated[
        Path | None,
        typer.Option(
            "--edit",
            metavar="DIR",
            help="Correct the outlines in a folder of moma outlines; with --depth, or --cloud and the like, saves go "
            "into the database.",
        ),
    ] = None,
    drawn: DrawnChoices,
    header: Annotated[
        Path | None, typer.Option("--header", metavar="FILE", help="Header, as for moma ingest.")
    ] = None,
    sigma: Annotated[
        float | None, typer.Option("--sigma", metavar="S", help="Standard deviation, as for moma ingest.")
    ] = None,
    db: Db = DEFAULT_DB,
    verbose: Verbose = False,
) -> None:
    """Serve a database over HTTP, to be read: viewer, queries, entities, runs, schema, downloads; or edit outlines."""
    from pipelines.reports.serve.serve import serve_database
    from pipelines.reports.serve.settings import ServeSettings

    editor = _editor(edit, drawn, SurveyChoices(header=header, sigma=sigma), db)
    serve_database(db, ServeSettings(**vars(server)), say, editor)


def _editor(
    folder: Path | None, drawn: DrawnChoices, survey: SurveyChoices, url: str
) -> "OutlineEditor | None":
    """Return the editor of a folder of outlines; None without one.

    Raises
    ------
    UsageError
        if options of ingest are given without a folder, or do not fit together
    """
    given = [name for name, value in {**vars(drawn), **vars(survey)}.items() if value is not None]
    if folder is None:
        if given:
            raise UsageError(
                f"--{given[0]} without --edit", remedy="name the folder of the outlines: --edit DIR"
            )
        return None
    from pipelines.propose.outlines.editing import SAVED, IngestChoice, OutlineEditor

    if drawn.outlines is not None or drawn.masks is not None:
        raise UsageError(
            "other outlines beside --edit", remedy="leave them out: those of the folder are meant"
        )
    if not given:
        return OutlineEditor(folder, url)
    name, files, options = sources(survey, replace(drawn, outlines=folder / SAVED))
    return OutlineEditor(folder, url, IngestChoice(name, tuple(files), options))
