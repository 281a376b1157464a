"""Command line of MOMA. Commands import heavy packages themselves, so that help is fast."""

import gc
import signal
from typing import Annotated

import typer

from moma.cli.assess import assess, compare, diagnose, pushover, study
from moma.cli.console import PlainCommand, PlainGroup, open_streams
from moma.cli.database import export, import_, migrate, serve, view
from moma.cli.entities import query, schema, show
from moma.cli.geology import geology
from moma.cli.knowledge import entries, matrix, record
from moma.cli.proposals import outlines, propose
from moma.cli.relations import load_path, relate
from moma.cli.runs import report, runs
from moma.cli.scenes import check, run, trade, warm_up
from moma.cli.surveys import cloud, ingest, orient, sample, survey_report

app = typer.Typer(
    cls=PlainGroup,
    name="moma",
    help="From a stone-by-stone survey of a historic building to a mechanical simulation of it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def main() -> None:
    """Run the command line; exit code 0 done, 1 failed, 2 wrong use, 130 ended by Ctrl-C or SIGTERM."""
    open_streams()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # raises KeyboardInterrupt, as Ctrl-C does
    try:
        app(prog_name="moma")
    finally:
        # the process ends: its last searches for garbage would take a short command a third of its time
        gc.freeze()


def _print_version(asked: bool) -> None:
    if asked:
        import moma

        print(f"moma {moma.__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


# in the usual order of use
_COMMANDS = (
    sample,
    cloud,
    outlines,
    orient,
    ingest,
    survey_report,
    record,
    entries,
    matrix,
    relate,
    propose,
    query,
    schema,
    show,
    load_path,
    check,
    run,
    assess,
    pushover,
    compare,
    diagnose,
    study,
    trade,
    geology,
    runs,
    view,
    report,
    serve,
    export,
    import_,
    migrate,
    warm_up,
)
for _command in _COMMANDS:
    app.command(_command.__name__.strip("_").replace("_", "-"), cls=PlainCommand)(_command)
# another name of trade, which reads as commerce to some
app.command("tradeoff", hidden=True, cls=PlainCommand)(trade)
