"""Command that records knowledge in the database."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from moma.cli.console import reporting
from moma.cli.options import DEFAULT_DB, Db, Json, Verbose

__all__ = ["entries", "record"]


@reporting
def entries(db: Db = DEFAULT_DB, json: Json = False, verbose: Verbose = False) -> None:
    """List the acts of recording: number, time, author and grounds; `--at` takes their numbers."""
    from archmodel.database.session import open_database
    from archmodel.describe.entries import list_entries
    from moma.cli.text.formats import as_json, as_table

    with open_database(db, create=False) as database, database.session(read_only=True) as session:
        rows = list_entries(session)
    if json:
        print(as_json(rows))
    elif rows:
        print(as_table(dict.fromkeys(rows[0]), rows))


@reporting
def record(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE.toml…", help="Files of knowledge; see docs/knowledge.md.")
    ],
    author: Annotated[
        str | None,
        typer.Option(
            "--author", metavar="NAME", help="Author of the statements; default: that of the files."
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Report what would be recorded; change nothing.")
    ] = False,
    db: Db = DEFAULT_DB,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Record knowledge of a building: materials, phases, structures, marks, observations, corrections, …"""
    from moma.cli.text.formats import as_json
    from moma.cli.text.knowledge import record_lines
    from pipelines.record.record import record as record_files

    report = record_files(files, db, author=author, dry_run=dry_run)
    print(as_json(asdict(report)) if json else "\n".join(record_lines(report, verbose)))
