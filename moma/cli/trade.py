"""The command that measures speed against accuracy."""

from pathlib import Path
from typing import Annotated

import typer

from moma.cli.console import progress_bars, reporting, say
from moma.cli.options import DEFAULT_DB, Db, Json, SceneArgument, Verbose

__all__ = ["trade"]


@reporting
def trade(
    scene: SceneArgument,
    budget: Annotated[
        float,
        typer.Option(
            "--budget", metavar="MINUTES", help="Time of all runs, those of earlier calls included."
        ),
    ] = 10.0,
    error: Annotated[
        float, typer.Option("--error", metavar="E", help="Recommend the cheapest setting below this error.")
    ] = 0.05,
    of: Annotated[
        str | None,
        typer.Option(
            "--of",
            metavar="QUANTITY",
            help="What the error is of: von_mises_p99, support_reactions, …; see docs/howto/trade.md.",
        ),
    ] = None,
    jobs: Annotated[
        int, typer.Option("--jobs", metavar="N", help="Runs at a time, at most one per core.")
    ] = 1,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder of the study; else out/SCENE-trade."),
    ] = None,
    db: Db = DEFAULT_DB,
    json: Json = False,
    verbose: Verbose = False,
) -> None:
    """Run a scene at many settings: what does each cost, and how far is it from the finest?"""
    from moma.cli.text.formats import as_json
    from moma.cli.text.tradeoff import trade_lines
    from pipelines.tuning.tradeoff.study import Asked, run_trade

    asked = Asked(60.0 * budget, jobs, error, of)
    folder = out or Path("out") / f"{scene.stem}-trade"
    try:
        with progress_bars() as listener:
            done = run_trade(scene, db, folder, asked, listener)
    except KeyboardInterrupt:
        say(f"stopped; what has ended is kept in {folder}, and the same command goes on from there")
        raise typer.Exit(1) from None
    print(as_json(done.record) if json else "\n".join(trade_lines(done, verbose)))
    if done.record["reference"] is None:
        raise typer.Exit(1)
