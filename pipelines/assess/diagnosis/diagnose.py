"""Diagnosis of a survey: hypotheses are fitted to its deformation by runs, ranked, and dated by building phases."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mechanics.dynamics.progress import Listener, Progress, silent
from pipelines.assess.diagnosis.dating import Dating, date_movement
from pipelines.assess.diagnosis.file import DiagnosisFile, read_diagnosis
from pipelines.assess.diagnosis.measurements import Measurements, measurements
from pipelines.assess.diagnosis.results import INDEX, write_diagnosis
from pipelines.assess.diagnosis.search import (
    Case,
    Fitted,
    Runs,
    cases_of,
    check_case,
    fit_cases,
    kept_runner,
    runs_of,
)
from pipelines.assess.diagnosis.trials import Runner, Tried, runner
from pipelines.assess.kept import kept_answers
from pipelines.assess.motions import Motions
from pipelines.draw.elevations.sheet import require_figures
from pipelines.results.folder import UNFINISHED_DIAGNOSIS, check_replaceable, replacing


@dataclass(frozen=True)
class Diagnosis:
    """A diagnosis and its files.

    Attributes
    ----------
    folder : of the files
    summary : contents of diagnosis.json
    battered : whether walls may have been built leaning
    """

    folder: Path
    summary: dict[str, Any]
    battered: bool


def diagnose(
    path: str | Path,
    url: str,
    folder: str | Path,
    progress: Listener = silent,
    jobs: int = 1,
    accept_unsound: bool = False,
    run: Runner | None = None,
    overwrite: bool = False,
) -> Diagnosis:
    """Fit each hypothesis of a file to the measured deformation, rank them, and write the diagnosis.

    Answers of runs are kept in the folder until all is done: stopped or killed, the same call goes on from there.

    Parameters
    ----------
    path : file of the diagnosis, or scene with [[hypotheses]]
    url : of the database
    folder : of the results; earlier ones there are replaced
    progress : called after every run, and with the fit of each hypothesis as soon as there is one
    jobs : runs at a time on this machine
    accept_unsound : run scenes that `check_scene` finds unsound all the same
    run : runs scenes elsewhere; `jobs` is not used then
    overwrite : replace the results of another file in the folder

    Raises
    ------
    UsageError : the folder holds other files, or results of another file
    SceneError : at the first mistake of the file, or of a scene with a hypothesis
    UnsoundSceneError : a scene has problems that `check_scene` reports
    DatabaseError : the database cannot be read
    """
    require_figures()
    folder, file = Path(folder), read_diagnosis(path)
    check_replaceable(folder, INDEX, () if overwrite else (Path(path),))
    progress(Progress("blocks", 0, None, "reading the stones"))
    measured = measurements(file, url)
    every = cases_of(file, measured.phases)
    impossible = [check_case(file, case, url, accept_unsound) for case in every]
    cases = tuple(case for case, reason in zip(every, impossible, strict=True) if not reason)
    with kept_answers(folder, UNFINISHED_DIAGNOSIS, (Tried, Motions)) as store:
        if len(store):
            progress(
                Progress("run", 0, None, found=f"going on, with {len(store)} runs that were made before")
            )
        with runner(jobs) if run is None else nullcontext(run) as run_all:
            runs = runs_of(file, url, kept_runner(file, measured.solids, store, run_all))
            done = fit_cases(cases, measured.deformation, runs, progress)
            dating = _dated(file, cases, measured, done, runs) if measured.phases else None
    progress(Progress("write", 0, 1, "pictures"))
    with replacing(folder, INDEX) as fresh:
        summary = write_diagnosis(fresh, file, cases, measured, done, dating, tuple(filter(None, impossible)))
    progress(Progress("write", 1, 1))
    return Diagnosis(folder, summary, file.battered)


def _dated(
    file: DiagnosisFile, cases: Sequence[Case], measured: Measurements, done: Fitted, runs: Runs
) -> Dating:
    """Date the best hypothesis, with a run of what it would have moved if all phases had stood."""
    best = done.ranking.hypotheses[0]
    case = next(case for case in cases if case.hypothesis.name == best.name and not case.later)
    (tried,) = runs([(case, best.fit.amplitudes)])
    return date_movement(file, done.ranking, measured, tried.motions or Motions({}, {}))
