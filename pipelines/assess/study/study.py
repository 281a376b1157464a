"""A study of a scene: what is not known goes in, the probability of failure and what to measure next come out."""

import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from archmodel.database.session import open_database
from archmodel.store.run_record import RunRecord, StoneResult
from archmodel.tables.entries import latest_entry
from ground.errors import SceneError, UsageError
from mechanics.arrays import Array
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.scene.scene import Fidelity
from pipelines.assess.study.estimates import Estimates, estimated
from pipelines.assess.study.file import StudyFile, read_study
from pipelines.assess.study.prepare import problem_of, snapshot_content
from pipelines.assess.study.problem import Problem
from pipelines.assess.study.sampling import ATTEMPTS, IncompleteError, Part, Sampler, take
from pipelines.assess.study.settings import InputType, Method
from pipelines.assess.study.summary import INDEX, summary_of
from pipelines.assess.workers.cluster import cluster
from pipelines.assess.workers.pool import workers
from pipelines.assess.workers.store import SAMPLES, Snapshot
from pipelines.draw.elevations.sheet import require_figures
from pipelines.draw.studies import (
    draw_fragility,
    draw_samples,
    draw_shares,
    draw_tornado,
    draw_weighted,
)
from pipelines.reports.study import write_study
from pipelines.results.checkpoints import write_whole
from pipelines.results.folder import locked
from pipelines.results.summary import as_json
from pipelines.results.table_csv import inert
from pipelines.run.record import store_record, versions


def write_results(folder: Path, summary: dict[str, Any], problem: Problem, found: Estimates) -> None:
    """Write tables, pictures and the page of a study, each file whole."""
    measures = [(action["text"], action["stone"], action["share"]) for action in summary["actions"]]
    write_whole(folder / "actions.csv", _csv([("measurement", "stone", "share"), *measures]))
    names = list(found.values)
    rows = np.column_stack([found.values[name] for name in names]).tolist() if names else []
    if found.weights is not None:
        names, rows = [*names, "weight"], np.column_stack([rows, found.weights]).tolist()
    table: list[tuple[Any, ...]] = [("number", *names)]
    table += [(number, *row) for number, row in enumerate(rows)]
    write_whole(folder / "samples.csv", _csv(table))
    drawn = _drawn(folder, summary, problem, found)
    summary["files"] += drawn
    write_study(folder / "report.html", summary, drawn)
    write_whole(folder / INDEX, as_json(summary).encode())


def _drawn(folder: Path, summary: Mapping[str, Any], problem: Problem, found: Estimates) -> list[str]:
    """Draw the pictures of a study; return their names."""
    names, failure = [], summary["failure"]
    name = summary["quantity"]
    if name in found.values and np.isfinite(found.values[name]).sum() > 1:
        level = None if failure is None else failure["level"]
        if found.weights is None:
            names.append("histogram.png")
            draw_samples(folder / names[-1], name, found.values[name], level)
        else:
            names.append("weighted.png")
            draw_weighted(folder / names[-1], name, found.values[name], found.weights, level)
    if len(summary["fragility"]) > 1:
        small = found.weights is not None or found.subset is not None
        draw_fragility(folder / "fragility.png", name, summary["fragility"], small)
        names.append("fragility.png")
    if found.gradient is not None:
        draw_tornado(folder / "tornado.png", summary["shares"]["by_group"])
        draw_shares(folder / "elevation.png", _outlines(problem), summary["shares"]["by_stone"])
        names += ["tornado.png", "elevation.png"]
    return names


def _outlines(problem: Problem) -> dict[str, Array]:
    """Return the outlines (n, 2) of all faces, along the wall and upwards [m]."""
    records = [model.record for model in problem.models]
    towards = sum((record.area * record.normal for record in records), np.zeros(3))
    along = np.cross([0.0, 0.0, 1.0], towards)
    length = float(np.linalg.norm(along))
    along = along / length if length > 0.0 else np.array([1.0, 0.0, 0.0])
    return {
        record.code: np.column_stack([record.outline @ along, record.outline[:, 2]]) for record in records
    }


def _csv(rows: list[tuple[Any, ...]]) -> bytes:
    return "".join(",".join(_cell(value) for value in row) + "\n" for row in rows).encode()


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "" if np.isnan(value) else f"{value:.9g}"
    text = str(inert(str(value)))
    return f'"{text}"' if "," in text or '"' in text else text


_SNAPSHOTS = "snapshot-*.json"
_WHOLE: Mapping[Method, str] = {
    Method.SUBSET: "each level begins from all samples of the one before",
    Method.FIRST_ORDER: "its few samples surround the mean",
}
"""Methods without parts, and why."""


@dataclass(frozen=True)
class Study:
    """Result of a study.

    Attributes
    ----------
    folder : of the files
    summary : contents of study.json; of a part, how many of its samples are there
    complete : it has results, and is no part
    run : its number in the database; None where it is not complete
    """

    folder: Path
    summary: Mapping[str, Any]
    complete: bool
    run: int | None = None


def run_study(
    path: str | Path,
    url: str,
    folder: str | Path,
    progress: Listener = silent,
    count: int = 1,
    part: Part | None = None,
    resume: bool = False,
    overwrite: bool = False,
    scheduler: str | None = None,
) -> Study:
    """Carry what is not known of a scene to its quantities; keep each sample, and go on from those that are there.

    Parameters
    ----------
    path : study file
    url : of the database
    folder : of the study
    progress : called at every sample
    count : worker processes
    part : of the samples that this call takes; the results are written by a call for all
    resume : go on with the snapshot of the folder, whatever the database holds now
    overwrite : take the folder of another study
    scheduler : address of a Dask scheduler whose workers take the samples, in place of processes here

    Raises
    ------
    UsageError : the folder holds other files, or another study; the scheduler does not answer
    SceneError : with file and line, at the first mistake; the scene does not stand at the mean of all inputs
    DatabaseError : the database cannot be read or written
    """
    require_figures()
    folder, file, part = Path(folder), read_study(path), part or Part()
    _refuse_options(file.study.method, part, scheduler, count)
    progress(Progress("blocks", 0, None, "reading the stones"))
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        as_of = latest_entry(session)
        content = None if resume else snapshot_content(file, session)
    begins = not any(folder.glob(_SNAPSHOTS))
    # workers elsewhere stand in another folder
    snapshot = _snapshot(folder.absolute(), content, overwrite)
    with _forgotten(snapshot, begins), file.document.at("correlations" if file.correlations else "inputs"):
        problem = problem_of(snapshot)
    crew = workers(count, take, ATTEMPTS) if scheduler is None else cluster(scheduler, take, ATTEMPTS)
    with crew as run:
        sampler = Sampler(snapshot, run, part, progress)
        with _forgotten(snapshot, begins):
            _refuse_fallen(file, problem, sampler)
        try:
            estimates = estimated(file.study, problem, sampler)
        except IncompleteError as error:
            return Study(folder, {"part": part.number, "parts": part.count, "done": error.done}, False)
    summary = summary_of(file, problem, estimates, sampler, snapshot)
    progress(Progress("write", 0, 1, "pictures"))
    with locked(_made(folder / ".writing")):
        write_results(folder, summary, problem, estimates)
    with open_database(url, create=False) as database:
        number = store_record(database, folder, _record(file, problem, summary, as_of))
    progress(Progress("write", 1, 1))
    return Study(folder, summary, True, number)


def _refuse_options(method: Method, part: Part, scheduler: str | None, count: int) -> None:
    """Refuse parts of a method whose samples depend on those before, and workers both here and elsewhere."""
    if scheduler is not None and count > 1:
        remedy = "give one of the two"
        raise UsageError("both a scheduler and processes here", where="--workers", remedy=remedy)
    if part.count > 1 and method in _WHOLE:
        raise UsageError(
            f"{method} has no parts: {_WHOLE[method]}",
            where="--part",
            remedy="leave out --part, and give --workers or --scheduler",
        )


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _snapshot(folder: Path, content: dict[str, Any] | None, overwrite: bool) -> Snapshot:
    """Return the snapshot of a folder: the one that is there, or a new one of a content."""
    place = str(folder)
    if folder.exists() and not folder.is_dir():
        raise UsageError("is not a folder", where=place, remedy="name another folder")
    found = sorted(folder.glob(_SNAPSHOTS)) if folder.is_dir() else []
    if folder.is_dir() and not found and any(folder.iterdir()):
        raise UsageError("holds files that no study wrote", where=place, remedy="name another folder")
    if content is None:
        if len(found) != 1:
            raise UsageError(
                f"holds {len(found)} unfinished studies", where=place, remedy="leave out --resume"
            )
        return Snapshot(folder, hashlib.sha256(found[0].read_bytes()).hexdigest())
    raw = json.dumps(content, sort_keys=True, ensure_ascii=False).encode()
    made = Snapshot(folder, hashlib.sha256(raw).hexdigest())
    if found and made.path not in found and not overwrite:
        raise UsageError(
            "holds a study of another scene, other stones or other inputs",
            where=place,
            remedy="name another folder, go on with that study by --resume, or keep both by --overwrite",
        )
    return Snapshot.write(folder, content)


@contextmanager
def _forgotten(snapshot: Snapshot, begins: bool) -> Iterator[None]:
    """Empty the folder of a study that begins in it and is refused, so that it can be mended and asked for again."""
    try:
        yield
    except SceneError:
        if begins:
            snapshot.path.unlink(missing_ok=True)
            shutil.rmtree(snapshot.folder / SAMPLES, ignore_errors=True)
        raise


def _refuse_fallen(file: StudyFile, problem: Problem, sampler: Sampler) -> None:
    """Refuse a scene that does not stand at the mean of all inputs, before anything else runs.

    Records have no mean, so a scene that one of them may throw down runs with all.
    """
    if any(table.type is InputType.RECORD for table in problem.inputs):
        return
    (middle,) = sampler(np.zeros((1, problem.dimension)))
    where = file.document.where("study", "scene")
    if not middle.done:
        what = f"the scene has no answer at the mean of all inputs: {middle.reason}"
        raise SceneError(what, where=where, remedy="mend the scene, or the means of its inputs")
    for table, value in zip(problem.quantities, middle.values.values(), strict=True):
        if table.type in ("bound", "candidate", "held", "factor", "outcome") and value <= 0.0:
            raise SceneError(
                "the scene does not stand at the mean of all inputs",
                where=where,
                remedy="see with moma assess how it falls, and mend the scene or the means of its inputs",
            )


def _record(file: StudyFile, problem: Problem, summary: Mapping[str, Any], as_of: int | None) -> RunRecord:
    fixed = {model.record.code for model in problem.models if model.listed is Fidelity.FIXED}
    shares = summary["shares"]["by_stone"]
    return RunRecord(
        scene=file.scene.name,
        scene_text=file.text,
        outcome="studied",
        summary=summary,
        versions=versions(),
        results=tuple(
            StoneResult(
                code,
                str(Fidelity.FIXED if code in fixed else Fidelity.RIGID),
                None,
                None,
                None,
                0.0,
                None,
                {"variance_share": share},
            )
            for code, share in shares.items()
        ),
        as_of=as_of,
    )
