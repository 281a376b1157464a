"""Commands that ask how far a scene is from falling, how probable it is, and what explains its measured movement."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from ground.errors import UsageError
from moma.cli.console import reporting, say
from moma.cli.options import (
    DEFAULT_DB,
    AcceptUnsound,
    Common,
    Db,
    Json,
    Out,
    Overwrite,
    SceneArgument,
)
from moma.cli.progress import progress_bars


@contextmanager
def _going_on(folder: Path) -> Iterator[None]:
    """Say how to go on where a with-block is stopped."""
    try:
        yield
    except KeyboardInterrupt:
        if any(folder.glob("unfinished-*/*.json")):
            say(f"stopped; what was found is kept in {folder}, and the same command goes on from there")
        raise


@dataclass(frozen=True)
class _AssessChoices:
    """Loads of an assessment, and how far it goes."""

    load: Annotated[
        list[str] | None,
        typer.Option(
            "--load",
            metavar="LOAD",
            help='"horizontal x", "horizontal 30" (degrees from x), "tilt y", "force CODE FX FY FZ", '
            '"weight CODE,CODE", "thrust CODE x", "settlement CODE -z" or "thickness"; also several. '
            "Default: [[assess]] of the scene, which may ask more, or horizontal: square to each façade and along it.",
        ),
    ] = None
    code: Annotated[
        str | None,
        typer.Option(
            "--code",
            metavar="CODE",
            help="Check mechanisms of accelerations by a code, ntc2008 or ntc2018, for the [site] of the scene.",
        ),
    ] = None
    confirm: Annotated[
        bool,
        typer.Option("--confirm", help="Confirm each candidate by runs: which loads are held, which lost."),
    ] = False
    weakest: Annotated[
        bool, typer.Option("--weakest", help="Seek the direction of the weakest horizontal push, too.")
    ] = False
    at: Annotated[
        float | None,
        typer.Option(
            "--at",
            metavar="SECONDS",
            help="Instant at which loads that change are taken. Default: from which they are constant.",
        ),
    ] = None
    leave_out_loose: Annotated[
        bool,
        typer.Option(
            "--leave-out-loose", help="Leave out, and list, stones that fall under their own weight."
        ),
    ] = False


@reporting
def assess(
    *,
    scene: SceneArgument,
    asked: _AssessChoices,
    out: Out = None,
    overwrite: Overwrite = False,
    common: Common,
) -> None:
    """Find how far a scene is from falling: limit load, bound and candidate, and mechanism of each load."""
    from moma.cli.text.assessments import assessment_lines
    from moma.cli.text.formats import as_json
    from pipelines.assess.assess import AssessOptions
    from pipelines.assess.assess import assess as answered

    folder = out or Path("out") / f"{scene.stem}-assess"
    with progress_bars() as listener, _going_on(folder):
        done = answered(
            scene,
            common.db,
            folder,
            asked.load or (),
            listener,
            AssessOptions(
                asked.confirm, asked.code, asked.weakest, asked.at, asked.leave_out_loose, overwrite
            ),
        )
    for warning in done.warnings:
        say(f"warning: {warning}")
    print(as_json(done.summary) if common.json else "\n".join(assessment_lines(done, common.verbose)))
    if not done.decided:
        raise typer.Exit(1)


@reporting
def pushover(
    scene: SceneArgument,
    out: Out = None,
    overwrite: Overwrite = False,
    db: Db = DEFAULT_DB,
    json: Json = False,
) -> None:
    """Push stones in a test rig as the scene's table [pushover] says: force against displacement, with a band."""
    from moma.cli.text.assessments import pushover_lines
    from moma.cli.text.formats import as_json
    from pipelines.assess.pushover.push import push

    folder = out or Path("out") / f"{scene.stem}-pushover"
    with progress_bars() as listener:
        done = push(scene, db, folder, listener, overwrite=overwrite)
    print(as_json(done.summary) if json else "\n".join(pushover_lines(done)))


@reporting
def compare(
    *,
    scene: SceneArgument,
    battered: Annotated[
        bool,
        typer.Option(
            "--battered", help="Walls may have been built leaning: a uniform lean of one is no movement."
        ),
    ] = False,
    out: Out = None,
    overwrite: Overwrite = False,
    accept_unsound: AcceptUnsound = False,
    common: Common,
) -> None:
    """Run a scene; compare the movement of its courses and faces with their measured departure from level and plumb."""
    from moma.cli.text.assessments import comparison_lines
    from moma.cli.text.formats import as_json
    from pipelines.assess.compare import compare as compared

    folder = out or Path("out") / f"{scene.stem}-compare"
    with progress_bars() as listener:
        done = compared(scene, common.db, folder, listener, accept_unsound, battered, overwrite)
    print(as_json(done.summary) if common.json else "\n".join(comparison_lines(done, common.verbose)))


@reporting
def diagnose(
    *,
    file: Annotated[
        Path,
        typer.Argument(
            metavar="DIAGNOSIS.toml", help="File with [[hypotheses]]; also a scene that has them."
        ),
    ],
    jobs: Annotated[int, typer.Option("--jobs", metavar="N", min=1, help="Runs at a time.")] = 1,
    out: Out = None,
    overwrite: Overwrite = False,
    accept_unsound: AcceptUnsound = False,
    common: Common,
) -> None:
    """Find which of several causes explains the measured deformation, by how much of each, and when it acted."""
    from moma.cli.text.formats import as_json
    from moma.cli.text.studies import diagnosis_lines
    from pipelines.assess.diagnosis.diagnose import diagnose as diagnosed

    folder = out or Path("out") / f"{file.stem}-diagnose"
    with progress_bars() as listener, _going_on(folder):
        done = diagnosed(file, common.db, folder, listener, jobs, accept_unsound, overwrite=overwrite)
    print(as_json(done.summary) if common.json else "\n".join(diagnosis_lines(done, common.verbose)))


@reporting
def study(
    *,
    file: Annotated[
        Path,
        typer.Argument(metavar="STUDY.toml", help="File with [study], [[inputs]] and [[quantities]]."),
    ],
    workers: Annotated[
        int, typer.Option("--workers", metavar="N", min=1, help="Samples at a time, each in a process.")
    ] = 1,
    part: Annotated[
        str | None,
        typer.Option(
            "--part",
            metavar="K/N",
            help="Take the K-th of N parts of the samples alone, for arrays of jobs that share the folder; "
            "the same command without it writes the results.",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="ADDRESS",
            help="Take the samples by the workers of a Dask scheduler, tcp://HOST:PORT, that share the folder.",
        ),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Go on with the stones as they were, whatever the database holds now."),
    ] = False,
    out: Out = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Use the folder of another study; its samples stay there.")
    ] = False,
    common: Common,
) -> None:
    """Find how probable it is that a scene falls, as much of it is not known, and what to measure next."""
    from moma.cli.text.formats import as_json
    from moma.cli.text.studies import part_line, study_lines
    from pipelines.assess.study.study import run_study

    folder = out or Path("out") / f"{file.stem}-study"
    with progress_bars() as listener:
        try:
            done = run_study(
                file, common.db, folder, listener, workers, _part(part), resume, overwrite, scheduler
            )
        except KeyboardInterrupt:
            say(f"stopped; its samples are kept in {folder}, and the same command goes on from there")
            raise
    if common.json:
        print(as_json(dict(done.summary)))
    else:
        print("\n".join(study_lines(done, common.verbose)) if done.run is not None else part_line(done))


def _part(words: str | None) -> Any:
    from pipelines.assess.study.sampling import Part

    if words is None:
        return Part()
    found = re.fullmatch(r"([0-9]{1,7})/([0-9]{1,7})", words)
    if found is None or not 1 <= int(found[1]) <= int(found[2]):
        raise UsageError(f"no part: {words!r}", where="--part", remedy="give K/N, as 7/200, K from 1 to N")
    return Part(int(found[1]), int(found[2]))
