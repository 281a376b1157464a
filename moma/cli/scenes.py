"""Commands that check and simulate scenes."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer

from mechanics.dynamics.outcome import Outcome
from moma.cli.console import reporting, say, short_lived
from moma.cli.options import (
    AcceptUnsound,
    Common,
    Out,
    Overwrite,
    Profile,
    Resume,
    SceneArgument,
)
from moma.cli.progress import Interruption, progress_bars


@reporting
def check(
    *,
    scene: SceneArgument,
    pictures: Annotated[
        Path | None,
        typer.Option(
            "--pictures",
            metavar="DIR",
            help="Draw into DIR the movements of corners, the widths of joints, gaps and overlaps.",
        ),
    ] = None,
    explain: Annotated[
        bool, typer.Option("--explain", help="List the model of each stone, with the reason.")
    ] = False,
    profile: Profile = None,
    overwrite: Overwrite = False,
    common: Common,
) -> None:
    """Check whether a scene is sound, and estimate its cost; run nothing."""
    from moma.cli.text.checks import check_lines
    from moma.cli.text.formats import as_json
    from moma.cli.text.runs_and_surveys import profile_lines
    from pipelines.run.check import check_scene

    with progress_bars() as listener:
        report = check_scene(scene, common.db, pictures, profile, listener, overwrite)
    for warning in report.warnings:
        say(f"warning: {warning}")
    lines = check_lines(report, common.verbose, explain)
    if profile is not None:
        lines[1:1] = profile_lines(profile)
    if pictures is not None:
        lines += [f"  {pictures / name}" for name in report.files]
    print(as_json(asdict(report)) if common.json else "\n".join(lines))
    if report.problems:
        raise typer.Exit(1)


@dataclass(frozen=True)
class _RunChoices:
    """Options of a run."""

    meshes: Annotated[
        Path | None,
        typer.Option(
            "--meshes",
            metavar="FILE",
            help="Write the meshes of deformable stones for Gmsh, Code_Aster, Abaqus, …; see docs/runs.md.",
        ),
    ] = None
    animate: Annotated[
        bool, typer.Option("--animate", help="Draw the motion as motion.gif too, of up to 60 pictures.")
    ] = False
    repeat: Annotated[
        bool,
        typer.Option(
            "--repeat-half-step",
            help="Run it once more at half the step: how far peaks of stones that rock lie apart.",
        ),
    ] = False
    resume: Resume = None
    overwrite: Overwrite = False
    accept_unsound: AcceptUnsound = False
    profile: Profile = None


@reporting
def run(
    *,
    scene: SceneArgument,
    out: Out = None,
    choices: _RunChoices,
    common: Common,
) -> None:
    """Simulate a scene; write tables, pictures and a report, and store the results in the database."""
    with short_lived():
        from ground.kernels.beside import compiling_beside
        from moma.cli.text.formats import as_json
        from moma.cli.text.runs_and_surveys import run_lines
        from pipelines.run.run import RunOptions, run_scene
        from pipelines.run.unfinished import finished_run
        from pipelines.scene.file import read_scene

    folder, stop = out or Path("out") / scene.stem, Interruption()
    if choices.resume and (summary := finished_run(folder, read_scene(scene).text)) is not None:
        say(f"{folder}: the run there has finished; leave out --resume to run the scene again")
        print(as_json(summary) if common.json else f"{summary['scene']}: {summary['headline']}")
        return
    with compiling_beside("run"), progress_bars() as listener, stop.handled():
        done = run_scene(
            scene,
            common.db,
            folder,
            stop.listening(listener),
            stop,
            choices.resume,
            RunOptions(
                choices.profile,
                choices.meshes,
                choices.accept_unsound,
                choices.overwrite,
                choices.animate,
                choices.repeat,
            ),
        )
    for warning in done.warnings:
        say(f"warning: {warning}")
    print(as_json(done.summary) if common.json else "\n".join(run_lines(done, common.verbose)))
    if done.summary["outcome"] == "interrupted":
        say(f"the same command with --resume goes on after step {done.summary['steps']}")
    if not Outcome(done.summary["outcome"]).decided:
        raise typer.Exit(1)


@reporting
def trade(
    *,
    scene: SceneArgument,
    budget: Annotated[
        float,
        typer.Option(
            "--budget", metavar="MINUTES", help="Time for all runs, including those of earlier calls."
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
            help="Quantity of the error: von_mises_p99, support_reactions, …; see docs/howto/trade.md.",
        ),
    ] = None,
    jobs: Annotated[
        int, typer.Option("--jobs", metavar="N", help="Number of parallel runs, at most one per core.")
    ] = 1,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder of the study; default: out/SCENE-trade."),
    ] = None,
    accept_unsound: AcceptUnsound = False,
    common: Common,
) -> None:
    """Run a scene at many settings; compare the cost and the error of each with the finest."""
    from moma.cli.text.formats import as_json
    from moma.cli.text.tradeoff import trade_lines
    from pipelines.tradeoff.study import Asked, run_trade

    asked = Asked(60.0 * budget, jobs, error, of, accept_unsound)
    folder = out or Path("out") / f"{scene.stem}-trade"
    try:
        with progress_bars() as listener:
            done = run_trade(scene, common.db, folder, asked, listener)
    except KeyboardInterrupt:
        say(f"stopped; completed runs are kept in {folder}, and the same command resumes from there")
        raise typer.Exit(1) from None
    print(as_json(done.record) if common.json else "\n".join(trade_lines(done, common.verbose)))
    if done.record["reference"] is None:
        raise typer.Exit(1)


@reporting
def warm_up(*, common: Common) -> None:
    """Compile all kernels once, so that no later command has to; those of a wheel that fit are only loaded."""
    from ground.kernels.uses import all_kernels, recording
    from mechanics.dynamics.progress import Progress
    from moma.cli.text.formats import as_json

    uses, failed = all_kernels(), list[str]()
    with progress_bars() as listener, recording() as compiled:
        for number, use in enumerate(uses, start=1):
            try:
                use.compile()
            except Exception as error:
                failed.append(f"{use.module}.{use.name}: {type(error).__name__}")
            listener(Progress("compile", number, len(uses), use.name))
    for name in failed:
        say(f"warning: not compiled: {name}; commands that need it compile it")
    done = {"kernels": len(uses), "compiled": len(compiled), "failed": len(failed)}
    text = f"{len(uses)} kernels: {len(compiled)} compiled now, {len(uses) - len(compiled)} were there"
    print(as_json(done) if common.json else text)
