"""Command that runs geological scenes."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from moma.cli.console import reporting, say
from moma.cli.options import Json, Out, Overwrite, Resume, SceneArgument, StoreDb
from moma.cli.progress import Interruption, progress_bars

ExperimentName = Literal["deposit", "fold", "fault", "biaxial", "wedge", "repose"]
"""Experiments with disks."""


@reporting
def geology(
    experiment: Annotated[
        ExperimentName, typer.Argument(help="Experiment; the scene has a table of its name.")
    ],
    scene: SceneArgument,
    out: Out = None,
    samples: Annotated[
        Path | None,
        typer.Option(
            "--samples", metavar="DIR", help="Folder of prepared samples; default: .samples beside DIR."
        ),
    ] = None,
    resume: Resume = None,
    overwrite: Overwrite = False,
    db: StoreDb = None,
    json: Json = False,
) -> None:
    """Deform a sample of disks; write rows of its cells, fields, figures, a summary and a report."""
    from moma.cli.text.formats import as_json
    from pipelines.geology.run import run_geology

    folder, stop = out or Path("out") / scene.stem, Interruption()
    with progress_bars() as listener, stop.handled():
        done = run_geology(
            scene,
            experiment,
            folder,
            samples,
            stop.listening(listener),
            stop,
            resume,
            db,
            overwrite,
        )
    for warning in done.warnings:
        say(f"warning: {warning}")
    summary = done.summary
    lines = [
        *(f"caution: {caution}" for caution in summary["cautions"]),
        f"{summary['scene']}: {summary['disks']} disks, {summary['steps']} steps",
        *([f"  {summary['note']}"] if summary["note"] else ()),
        f"  {summary['headline']}",
        *(
            f"  {name}: {'unknown' if value is None else f'{value:.4g}'}"
            for name, value in summary["measures"].items()
        ),
        f"  results in {done.folder}" + ("" if done.run is None else f", run {done.run} in the database"),
    ]
    print(as_json(summary) if json else "\n".join(lines))
    if summary["outcome"] == "interrupted":
        say(f"the same command with --resume goes on after step {summary['steps']}")
        raise typer.Exit(1)
