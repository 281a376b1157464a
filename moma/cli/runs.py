"""Commands that list, show and compare simulation runs, and print their reports."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from archmodel.quantities import units_of
from ground.errors import UsageError
from moma.cli.console import reporting, say
from moma.cli.options import Common, Json, Verbose, check_ending

_LIST = (
    *("run", "scene", "stored_at", "outcome", "stones", "contacts", "natural_map", "balance"),
    *("reaction", "wall"),
)
_MORE = ("penetration", "energy")
_STAGES = ("name", "outcome", "stones", "laid", "removed", "held", "weight", "reaction", "bed", "time")
_CELLS = ("cell", "lambda_x", "lambda_y", "p", "q", "porosity", "coordination")
_UNITS = {
    **units_of("cell of disks", "stage", "stone", "joint", "joint in the database"),
    **dict.fromkeys(("time", "wall"), "s"),
}
_TABLES: dict[str, tuple[str, tuple[str, ...] | None]] = {
    "stages": ("stages of building", _STAGES),
    "cells": ("cells of disks at the end", _CELLS),
    "peaks": (
        "largest values during the run, and at its end",
        ("peak", "value", "end", "unit", "time", "stones"),
    ),
    "largest_stresses": ("largest Von Mises stresses, exceeded in 1 % of the volume", None),
    "largest_openings": ("joints that have opened most", None),
    "least_centred": ("joints with the resultant farthest out of the kern", None),
    "most_used_friction": ("joints that use most of their friction", None),
    "structures": ("largest results of courses and other structures", None),
}
"""Tables of a run: heading, and columns; None: all."""


@reporting
def runs(
    *,
    number: Annotated[
        int | None, typer.Argument(metavar="[N]", help="Number of a run to show in full; default: list all.")
    ] = None,
    against: Annotated[int | None, typer.Option("--against", metavar="M", help="Compare with run M.")] = None,
    common: Common,
) -> None:
    """List the simulation runs, or show one in full, or compare two."""
    from archmodel.database.session import open_database
    from archmodel.describe.runs import compare_runs, describe_run, list_runs
    from moma.cli.text.formats import as_json

    if number is None and against is not None:
        raise UsageError("--against needs a run to compare", remedy=f"moma runs N --against {against}")
    with open_database(common.db, create=False) as database, database.session(read_only=True) as session:
        if number is not None and against is not None:
            found: Any = compare_runs(session, number, against)
        else:
            found = list_runs(session) if number is None else describe_run(session, number)
    if common.json:
        print(as_json(found))
    elif number is None and found:
        marked = [
            row | {"outcome": row["outcome"] + (" (caution)" if row["cautions"] else "")} for row in found
        ]
        print(_table(marked, _LIST + _MORE if common.verbose else _LIST, reaction=None))
        say(f"{len(found)} found")
    elif number is None:
        say("no run found; simulate with moma run SCENE.toml")
    else:
        print(_comparison(found) if against is not None else _full(found, common.verbose))


def _table(
    rows: Sequence[Mapping[str, object]], names: Iterable[str] | None = None, **units: str | None
) -> str:
    """Format rows as a table of some columns, or of all, with the units of the catalogue."""
    from moma.cli.text.formats import as_table

    return as_table({name: (_UNITS | units).get(name) for name in names or rows[0]}, rows)


def _full(run: dict[str, Any], verbose: bool) -> str:
    """Format one run as lines and tables; with the scene file if `verbose`."""
    from moma.cli.text.formats import as_lines

    scene_text = run.pop("scene_text")
    tables = {name: run.pop(name) for name in _TABLES}
    parts = [as_lines(run)]
    for name, rows in tables.items():
        heading, columns = _TABLES[name]
        if rows:
            parts.append(f"{heading}\n{_table(rows, columns)}")
    return "\n\n".join([*parts, *([f"scene file\n{scene_text.rstrip()}"] if verbose else [])])


def _comparison(change: dict[str, Any]) -> str:
    """Format the differences between two runs."""
    from moma.cli.text.formats import as_lines, as_table

    names = {"stresses": ("largest changes of Von Mises stress", "Pa")}
    names["displacements"] = ("largest changes of displacement", "m")
    tables = {name: change.pop(name) for name in names}
    structures = change.pop("structures")
    parts = [as_lines(change)]
    for name, rows in tables.items():
        heading, unit = names[name]
        if rows:
            columns = {"code": None, "run": unit, "against": unit, "change": unit}
            parts.append(f"{heading}\n{as_table(columns, rows)}")
    if structures:
        parts.append(f"largest changes of courses and other structures\n{_table(structures)}")
    return "\n\n".join(parts)


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

    check_ending(out, ".pdf")
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
