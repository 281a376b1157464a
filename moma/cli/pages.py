"""Commands for pages: a database in a viewer, on paper, and over HTTP."""

from pathlib import Path
from typing import Annotated

import typer

from moma.cli.console import reporting, say
from moma.cli.options import DEFAULT_DB, Db, Json, Verbose
from moma.errors import UsageError

__all__ = ["report", "serve", "view"]


@reporting
def view(
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
    elevation: Annotated[
        Path | None,
        typer.Option("--elevation", metavar="FILE.svg", help="Draw the main elevation to scale there too."),
    ] = None,
    scale: Annotated[
        int | None,
        typer.Option(
            "--scale", metavar="N", min=1, help="1 : N of the elevation; default: fits a sheet of A4."
        ),
    ] = None,
    db: Db = DEFAULT_DB,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Write one page, without network, in which the stones can be turned, searched and coloured."""
    from moma.cli.text.formats import as_json
    from pipelines.reports.view import write_comparison_view, write_view

    if pages:
        for name, given in (("--where", where), ("--run", run), ("--elevation", elevation)):
            if given:
                raise UsageError(f"{name} with pages", remedy="it is for the stones of a database")
        done = write_comparison_view(pages, out)
    else:
        done = write_view(db, out, kind, where or (), run, title, elevation, scale)
    if json:
        print(as_json({"page": str(done.path), "stones": done.stones, "scale": done.scale}))
        return
    print(
        f"{done.path}: {f'{done.stones} stones' if done.stones else f'{len(pages or ())} views side by side'}"
    )
    if elevation is not None:
        print(f"{elevation}: 1 : {done.scale}")


@reporting
def report(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Folder of results, or a page.")],
    pdf: Annotated[
        bool, typer.Option("--pdf", help="Print it to PDF through an installed Chromium, Chrome or Edge.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="The PDF; default: RUN.pdf beside the folder or page."),
    ] = None,
    language: Annotated[
        str, typer.Option("--language", metavar="TAG", help="en, de, fr or it, for the page's fixed words.")
    ] = "en",
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Check that a report is as it was written, and print it to PDF."""
    from moma.cli.text.formats import as_json
    from pipelines.reports.page.paper import appraise_page, print_pdf

    page = run / "report.html" if run.is_dir() else run
    sound = appraise_page(page)
    target = None
    if pdf:
        # beside the folder, which holds what the run wrote and nothing else
        target = out or run.with_name(f"{run.resolve().name if run.is_dir() else run.stem}.pdf")
        print_pdf(page, target, language)
    if json:
        print(
            as_json({"page": str(page), "as_written": sound, "pdf": None if target is None else str(target)})
        )
        return
    states = {True: "as it was written", False: "CHANGED since it was written", None: "states no checksum"}
    print(f"{page}: {states[sound]}")
    if target is not None:
        print(target)
    else:
        say("to print it: --pdf, or open it in a browser and print to A4")


@reporting
def serve(
    host: Annotated[
        str,
        typer.Option(
            "--host",
            metavar="ADDRESS",
            help="Address to listen on; others than this one are reached from outside.",
        ),
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option("--port", metavar="N", min=0, max=65535, help="Port; 0: any.")] = 8000,
    token: Annotated[
        str | None,
        typer.Option(
            "--token",
            metavar="TEXT",
            envvar="MOMA_TOKEN",
            help="Ask every request for this token.",
            show_default=False,
        ),
    ] = None,
    seconds: Annotated[
        float, typer.Option("--time-limit", metavar="S", min=0.1, help="Longest time of one query [s].")
    ] = 5.0,
    rows: Annotated[
        int, typer.Option("--row-limit", metavar="N", min=1, help="Most rows of one answer.")
    ] = 10_000,
    db: Db = DEFAULT_DB,
    verbose: Verbose = False,
) -> None:
    """Serve a database over HTTP, to be read only: viewer, queries, entities, runs, schema, downloads."""
    from pipelines.reports.serve.settings import ServeSettings, serve_database

    serve_database(db, ServeSettings(host=host, port=port, token=token, seconds=seconds, rows=rows), say)
