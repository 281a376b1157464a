"""Commands for whole databases: their layout, export and import."""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from moma.cli.console import reporting
from moma.cli.options import DEFAULT_DB, Db, Json, Verbose
from moma.errors import UsageError

__all__ = ["export", "import_", "migrate"]


@reporting
def migrate(
    to: Annotated[
        int | None, typer.Option("--to", metavar="N", help="Version of the layout; default: the newest.")
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Going to an older version, drop what it cannot hold.")
    ] = False,
    db: Db = DEFAULT_DB,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Migrate a database to the newest layout, or to an older one: completely or not at all."""
    from archmodel.migrations.migrate import migrate as change
    from moma.cli.text.formats import as_json

    if yes and to is None:
        raise UsageError("--yes without --to", remedy="name the older version with --to")
    done = change(db, to, lossy=yes)
    if json:
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


Document = Annotated[
    Path, typer.Argument(metavar="FILE.json", help="The document, or FILE.json.gz; see docs/exchange.md.")
]

Target = Annotated[
    Path,
    typer.Argument(
        metavar="FILE.json",
        help="The document, or FILE.json.gz, or - for standard output; see docs/exchange.md.",
    ),
]


@reporting
def export(document: Target, db: Db = DEFAULT_DB, json: Json = False, verbose: Verbose = False) -> None:
    """Export the whole database as one JSON document."""
    from moma.cli.text.formats import as_json
    from pipelines.ingest.exchange import export_database, export_to_stream

    if str(document) == "-":
        export_to_stream(db, sys.stdout.buffer)
        return
    report = export_database(db, document)
    print(as_json(asdict(report)) if json else "\n".join(_lines(report, "from", verbose)))


@reporting
def import_(document: Document, db: Db = DEFAULT_DB, json: Json = False, verbose: Verbose = False) -> None:
    """Create a database from an exported document: completely, or not at all if anything is wrong."""
    from moma.cli.text.formats import as_json
    from pipelines.ingest.exchange import import_database

    report = import_database(document, db)
    print(as_json(asdict(report)) if json else "\n".join(_lines(report, "into", verbose)))


def _lines(report: "ExchangeReport", way: str, verbose: bool) -> list[str]:
    """Count the rows by section; list empty sections too if `verbose`."""
    total = sum(report.rows.values())
    lines = [f"{report.path}: {total} rows {way} {report.database} ({report.bytes / 1e6:.1f} MB)"]
    return lines + [f"  {count:>8} {name}" for name, count in report.rows.items() if count or verbose]
