"""Commands about relations between stones."""

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Annotated

import typer

from moma.cli.console import reporting, say
from moma.cli.options import At, Common

if TYPE_CHECKING:
    from pipelines.ingest.relate import RelationReport


@reporting
def relate(
    *,
    width: Annotated[
        float | None,
        typer.Option(
            "--width", metavar="M", help="Widest open joint in metres; default: as last time, initially 0.04."
        ),
    ] = None,
    angle: Annotated[
        float | None,
        typer.Option(
            "--angle",
            metavar="DEG",
            help="Largest angle between the faces of a joint; default: as last time, initially 12.",
        ),
    ] = None,
    common: Common,
) -> None:
    """Recompute the relations between stones, the courses and the arches; see docs/relations.md."""
    from archmodel.database.session import open_database
    from archmodel.relations.store import held_settings
    from moma.cli.text.formats import as_json, as_table
    from pipelines.ingest.relate import relate as compute

    given = {name: value for name, value in (("width", width), ("angle", angle)) if value is not None}
    with open_database(common.db, create=False) as database, database.session() as session:
        report = compute(session, replace(held_settings(session), **given))
    if common.json:
        print(as_json(asdict(report)))
        return
    columns = dict.fromkeys(("what", "new", "as before", "no longer"))
    print(as_table(columns, _changes(report)))
    if report.entry is None:
        say(f"{report.stones} stones; nothing changed")
    else:
        say(f"{report.stones} stones with {report.values} new values; entry {report.entry}")


def _changes(report: "RelationReport") -> list[dict[str, object]]:
    """Tabulate the changes of each kind of row."""
    sorts = {**report.relations, "structures": report.structures, "memberships": report.memberships}
    return [
        {"what": name, "new": one.added, "as before": one.kept, "no longer": one.superseded}
        for name, one in sorts.items()
    ]


@reporting
def load_path(
    *,
    code: Annotated[str, typer.Argument(metavar="CODE", help="Code of a stone.")],
    up: Annotated[
        bool, typer.Option("--up", help="Show the stones that it carries, not those that carry it.")
    ] = False,
    at: At = None,
    common: Common,
) -> None:
    """Show all stones that carry a stone, directly or through others; with --up, all that it carries."""
    from archmodel.database.as_known import as_known, entry_named
    from archmodel.database.session import open_database
    from archmodel.relations.load_paths import load_path as follow
    from moma.cli.text.formats import as_json, as_table, some

    with open_database(common.db, create=False) as database, database.session(read_only=True) as session:
        entry = None if at is None else entry_named(session, at)
        with as_known(session, entry) as then:
            path = follow(then, code, up=up)
    if common.json:
        print(as_json(asdict(path)))
        return
    if not path.stones:
        say(f"nothing is known to rest on {code}" if up else f"{code} is not known to rest on anything")
        return
    columns = dict.fromkeys(("level", "code", "kind", "course", "zone", "through"))
    rows = [{**asdict(stone), "through": ", ".join(stone.through)} for stone in path.stones]
    shown = {name: None for name in columns if any(row[name] is not None for row in rows)}
    print(as_table(shown, rows))
    last = [stone.code for stone in path.last]
    say(
        f"{len(path.stones)} stones on {path.levels} levels; it ends at {some(last)}"
        if last
        else f"{len(path.stones)} stones on {path.levels} levels, in a circle"
    )
