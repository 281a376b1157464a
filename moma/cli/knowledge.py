"""Command that records knowledge in the database."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer

from moma.cli.console import reporting
from moma.cli.options import At, Common, Sheet


@reporting
def entries(common: Common) -> None:
    """List the acts of recording: number, time, author and grounds; `--at` takes their numbers."""
    from archmodel.database.session import open_database
    from archmodel.describe.history import list_entries
    from moma.cli.text.formats import as_json, as_table

    with open_database(common.db, create=False) as database, database.session(read_only=True) as session:
        rows = list_entries(session)
    if common.json:
        print(as_json(rows))
    elif rows:
        print(as_table(dict.fromkeys(rows[0]), rows))


@dataclass(frozen=True)
class TableChoices:
    """Meaning of what tables and vocabularies do not say themselves."""

    columns: Annotated[
        str | None,
        typer.Option(
            "--columns",
            metavar="MAP",
            help="Columns of tables that are not recognised, e.g. 'code=Inventar,phase=Zeitstellung'.",
        ),
    ] = None
    sheet: Sheet = None
    vocabulary: Annotated[
        str | None,
        typer.Option(
            "--vocabulary",
            metavar="NAME",
            help="Which vocabulary a SKOS file extends: observation, document, material or mark.",
        ),
    ] = None


@reporting
def record(
    *,
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE…", help="Files of knowledge: TOML, tables, GeoJSON, GeoPackage, GraphML, SKOS."
        ),
    ],
    author: Annotated[
        str | None,
        typer.Option(
            "--author", metavar="NAME", help="Author of the statements; default: that of the files."
        ),
    ] = None,
    source: Annotated[
        str | None,
        typer.Option(
            "--source", metavar="TEXT", help="Grounds of the statements; default: that of the files."
        ),
    ] = None,
    tables: TableChoices,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Report what would be recorded; change nothing.")
    ] = False,
    common: Common,
) -> None:
    """Record knowledge of a building: materials, phases, structures, marks, observations, corrections, …"""
    from moma.cli.text.formats import as_json
    from moma.cli.text.knowledge import record_lines
    from pipelines.record.record import record as record_files

    report = record_files(files, common.db, author=author, source=source, **vars(tables), dry_run=dry_run)
    print(as_json(asdict(report)) if common.json else "\n".join(record_lines(report, common.verbose)))


@reporting
def matrix(
    *,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE", help="Draw the matrix: .svg, .html (with stones of units) or .graphml."
        ),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="End with code 1 if matrix and dates contradict each other.")
    ] = False,
    author: Annotated[
        str | None,
        typer.Option(
            "--author", metavar="NAME", help="Only relations that this author states; default: all."
        ),
    ] = None,
    at: At = None,
    common: Common,
) -> None:
    """Order stratigraphic units in time: matrix of Harris, relative dates, contradictions with phases."""
    from archmodel.database.as_known import as_known, entry_named
    from archmodel.database.session import open_database
    from moma.cli.text.formats import as_json
    from moma.cli.text.knowledge import matrix_lines
    from pipelines.draw.stratigraphy.matrix import draw, study

    with open_database(common.db, create=False) as database, database.session(read_only=True) as session:
        entry = None if at is None else entry_named(session, at)
        with as_known(session, entry) as then:
            report = study(then, author)
    if out is not None:
        out.write_text(draw(report, out), encoding="utf-8")
    print(as_json(report.as_values()) if common.json else "\n".join(matrix_lines(report, common.verbose)))
    if check and report.contradictions:
        raise typer.Exit(1)
