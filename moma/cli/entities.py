"""Commands that query the database."""

from dataclasses import dataclass
from typing import Annotated

import typer

from ground.errors import UsageError
from moma.cli.console import reporting, say, short_lived
from moma.cli.options import DEFAULT_DB, At, Common, Json, ListFormat, Verbose

RunNumber = Annotated[
    int | None,
    typer.Option("--run", metavar="N", help="Run whose results are shown; default: each stone's latest."),
]
Columns = Annotated[
    str | None,
    typer.Option("--columns", metavar="NAMES", help="Attributes to show, e.g. code,phase,von_mises_max@12."),
]


@dataclass(frozen=True)
class _ListChoices:
    """Form of a list or count of entities."""

    format: Annotated[ListFormat | None, typer.Option(help="Format of the list; default: table.")] = None
    flat: Annotated[
        bool, typer.Option("--flat", help="GeoJSON in the plane of the wall: along it, and up.")
    ] = False
    sort: Annotated[
        str | None,
        typer.Option(
            "--sort", metavar="NAMES", help="Order by attributes, e.g. phase,-depth; -: largest first."
        ),
    ] = None
    top: Annotated[int | None, typer.Option("--top", metavar="N", min=1, help="Only the first N.")] = None
    count_by: Annotated[
        str | None,
        typer.Option("--count-by", metavar="NAMES", help="Count by attributes, e.g. phase or mark,phase."),
    ] = None
    share_of: Annotated[
        str | None,
        typer.Option(
            "--share-of", metavar="NAME", help="With --count-by: sum and share of a number, e.g. area."
        ),
    ] = None
    only_in: Annotated[
        str | None,
        typer.Option(
            "--only-in",
            metavar="EXPR",
            help="With --count-by: only groups of which it is true throughout, e.g. 'phase = 2'.",
        ),
    ] = None
    excel: Annotated[
        bool,
        typer.Option("--excel", help="CSV for spreadsheets: marked as UTF-8, with ; and decimal commas."),
    ] = False


@reporting
def query(
    *,
    kind: Annotated[
        str,
        typer.Argument(
            metavar="KIND", help="Kind of stone or structure, with subkinds: voussoir, structure."
        ),
    ],
    where: Annotated[
        list[str] | None,
        typer.Option(
            "--where", metavar="EXPR", help="Condition, e.g. 'depth > 0.4'; if repeated, all must hold."
        ),
    ] = None,
    run: RunNumber = None,
    at: At = None,
    columns: Columns = None,
    shown: _ListChoices,
    common: Common,
) -> None:
    """List the stones or structures of a kind that satisfy conditions, or count them."""
    with short_lived():
        from archmodel.database.as_known import as_known, entry_named
        from archmodel.database.session import open_database
        from moma.cli.text.query import Question, answer, listed

        if common.json and shown.format not in (None, "json"):
            raise UsageError(
                f"--json and --format {shown.format} request two formats", remedy="give one of them"
            )
        wanted = "json" if common.json else shown.format or "table"
        if shown.excel and (common.json or shown.format not in (None, "csv")):
            raise UsageError("--excel is CSV for spreadsheets", remedy="leave out the other format")
        if (shown.share_of or shown.only_in) and shown.count_by is None:
            raise UsageError("--share-of and --only-in need --count-by", remedy="give --count-by phase, say")
        if shown.flat and wanted != "geojson":
            raise UsageError("--flat is for faces", remedy="give --format geojson too")
        question = Question(
            kind,
            tuple(where or ()),
            run,
            listed(columns),
            everything=common.verbose,
            flat=shown.flat,
            sort=listed(shown.sort) or (),
            top=shown.top,
            count_by=listed(shown.count_by),
            share_of=shown.share_of,
            only_in=shown.only_in,
        )
        with open_database(common.db, create=False) as database, database.session(read_only=True) as session:
            entry = None if at is None else entry_named(session, at)
            with as_known(session, entry) as then:
                text, note = answer(then, question, "excel" if shown.excel else str(wanted))
        if text:
            print(text)
        if note:
            say(note)


@reporting
def schema(
    kind: Annotated[
        str | None,
        typer.Argument(metavar="KIND", help="Only this kind and its subkinds.", show_default=False),
    ] = None,
    db: Annotated[
        str | None,
        typer.Option(
            "--db",
            metavar="URL",
            envvar="MOMA_DB",
            help="Entity database whose registered kinds are shown too; default: moma.db, if it exists.",
        ),
    ] = None,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Show the model: kinds with their attributes, structures, relations."""
    from pathlib import Path

    from archmodel.database.session import open_database
    from archmodel.describe.schema_tree import schema as tree_of
    from moma.cli.text.formats import as_json
    from moma.cli.text.schema import print_schema

    url = db if db is not None or not Path("moma.db").exists() else DEFAULT_DB
    if url is None:
        tree = tree_of(kind=kind)
    else:
        with open_database(url, create=False) as database, database.session(read_only=True) as session:
            tree = tree_of(session, kind)
    if json:
        print(as_json(tree))
    else:
        print_schema(tree)


@reporting
def show(
    *,
    code: Annotated[str, typer.Argument(metavar="CODE", help="Code of a stone or structure.")],
    history: Annotated[
        bool, typer.Option("--history", help="Show everything recorded about it, in order.")
    ] = False,
    at: At = None,
    common: Common,
) -> None:
    """Show one stone or structure: kind, knowledge, measurements and results."""
    from dataclasses import asdict

    from archmodel.database.as_known import entry_named
    from archmodel.database.session import open_database
    from archmodel.describe import history as past
    from archmodel.describe.entity import describe
    from moma.cli.text.entities import entity_lines, history_lines
    from moma.cli.text.formats import as_json

    if history and at is not None:
        raise UsageError("--history and --at exclude each other", remedy="give one of them")
    with open_database(common.db, create=False) as database, database.session(read_only=True) as session:
        if history:
            events = [asdict(event) for event in past.history(session, code)]
            print(as_json(events) if common.json else history_lines(code, events))
            return
        description = describe(session, code, None if at is None else entry_named(session, at))
    print(as_json(description) if common.json else entity_lines(description))
