"""The commands that ask the database."""

from typing import Annotated

import typer

from moma.cli.options import DEFAULT_DB, Db, Json, ListFormat, Verbose
from moma.console import reporting, say
from moma.errors import UsageError

__all__ = ["query", "show"]


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
    db: Db = DEFAULT_DB,
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


@reporting
def show(
    code: Annotated[str, typer.Argument(metavar="CODE", help="Code of a stone or of a structure.")],
    history: Annotated[
        bool, typer.Option("--history", help="All that was ever said of it, in the order of the records.")
    ] = False,
    at: Annotated[
        int | None, typer.Option("--at", metavar="ENTRY", help="As it was known when this entry was made.")
    ] = None,
    db: Db = DEFAULT_DB,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Show one stone or structure: what it is, what is known of it, what was measured and computed."""
    from dataclasses import asdict

    from archmodel import history as past
    from archmodel.database import open_database
    from archmodel.query import describe
    from moma.listing import as_json
    from moma.telling_entities import entity_lines, history_lines

    if history and at is not None:
        raise UsageError("--history and --at ask for two things", remedy="give one of them")
    with open_database(db, create=False) as database, database.session(read_only=True) as session:
        if history:
            events = [asdict(event) for event in past.history(session, code)]
            print(as_json(events) if json else history_lines(code, events))
            return
        description = describe(session, code, at) if at is not None else describe(session, code)
    print(as_json(description) if json else entity_lines(description))
