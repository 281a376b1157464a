"""The commands that carry a whole building as one document."""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from moma.cli.console import reporting
from moma.cli.options import DEFAULT_DB, Db, Json, Verbose

if TYPE_CHECKING:
    from pipelines.exchange import ExchangeReport

__all__ = ["export", "import_"]

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
    """Write all that the database holds into one JSON document."""
    from moma.cli.text.formats import as_json
    from pipelines.exchange import export_database, export_to_stream

    if str(document) == "-":
        export_to_stream(db, sys.stdout.buffer)
        return
    report = export_database(db, document)
    print(as_json(asdict(report)) if json else "\n".join(_lines(report, "from", verbose)))


@reporting
def import_(document: Document, db: Db = DEFAULT_DB, json: Json = False, verbose: Verbose = False) -> None:
    """Make a database of such a document: all of it, or none if anything is wrong."""
    from moma.cli.text.formats import as_json
    from pipelines.exchange import import_database

    report = import_database(document, db)
    print(as_json(asdict(report)) if json else "\n".join(_lines(report, "into", verbose)))


def _lines(report: "ExchangeReport", way: str, verbose: bool) -> list[str]:
    """How many rows were carried; of empty sections too if `verbose`."""
    total = sum(report.rows.values())
    lines = [f"{report.path}: {total} rows {way} {report.database} ({report.bytes / 1e6:.1f} MB)"]
    return lines + [f"  {count:>8} {name}" for name, count in report.rows.items() if count or verbose]
