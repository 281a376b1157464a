"""The command that changes the layout of a database."""

from dataclasses import asdict
from typing import Annotated

import typer

from moma.cli.console import reporting
from moma.cli.options import DEFAULT_DB, Db, Json, Verbose
from moma.errors import UsageError

__all__ = ["migrate"]


@reporting
def migrate(
    to: Annotated[
        int | None, typer.Option("--to", metavar="N", help="Version of the layout; else this program's.")
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="To an older version: drop what it cannot hold.")
    ] = False,
    db: Db = DEFAULT_DB,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Give a database the layout of this program, or of an older one: all of it, or nothing."""
    from archmodel.migrations.migrate import migrate as change
    from archmodel.tables.layout import SCHEMA_VERSION
    from moma.cli.text.formats import as_json

    if yes and to is None:
        raise UsageError("--yes without --to", remedy="name the older version with --to")
    done = change(db, SCHEMA_VERSION if to is None else to, lossy=yes)
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
        print(f"as it was: {done.backup}")
