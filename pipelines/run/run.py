"""A scene from file to results: assemble, simulate, write, and keep the results in the database."""

import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from sqlalchemy.orm import Session

from archmodel.database.session import open_database
from archmodel.relations.members import members_of_structures
from archmodel.store.run_record import StoneResult
from archmodel.tables.entries import latest_entry
from ground.errors import MissingLibraryError, MomaError, UsageError, storing
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.limit.dead_load import self_stress_alone_holds
from mechanics.model.model import Model, build_model
from mechanics.results.forecast.plan import loose_blocks
from mechanics.results.result import Result
from mechanics.scene.scene import Fidelity
from mechanics.scene.state import State
from mechanics.simulate import simulate, simulate_stages
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.files import check_mesh_file, write_meshes
from mechanics.stones.meshing.mesh import VolumeMesh
from pipelines.draw.animation import draw_motion
from pipelines.draw.catalogue import PICTURES
from pipelines.draw.pictures import OF_RESULTS, draw_pictures, drawing_process, missing
from pipelines.draw.plots import history_svg
from pipelines.reports.page.known import Known, known_stones
from pipelines.reports.page.scenes import run_model
from pipelines.reports.run import write_report
from pipelines.results.folder import check_replaceable, replacing, source_of
from pipelines.results.notebook import notebook_html
from pipelines.results.peaks import rocking_caution
from pipelines.results.run_csv import write_joints, write_series
from pipelines.results.stone_values import stone_results
from pipelines.results.structure_values import structure_results
from pipelines.results.summary import as_json, summarise
from pipelines.results.vtk import write_frames, write_joint_grid
from pipelines.results.vtkhdf import RESULTS, write_vtkhdf
from pipelines.results.wall_axes import wall_record
from pipelines.run.assemble import Assembly, assemble_stones
from pipelines.run.filling import filling
from pipelines.run.inputs import run_inputs
from pipelines.run.plausibility import corner_warnings, depth_warnings, unusual_values
from pipelines.run.record import run_record, store_record, versions
from pipelines.run.soundness import caution_of, problems_of, refuse_unsound, unsupported_stages
from pipelines.run.unfinished import UnfinishedRun, unfinished_run
from pipelines.scene.file import SceneFile, read_scene
from pipelines.scene.fingerprint import fingerprint
from pipelines.scene.selection import StoneModel, select_groups, select_stones
from pipelines.scene.settings import ParaView
from pipelines.tuning.expected_errors import ProfileReport, profile_report
from pipelines.tuning.profiles import with_profile

USUAL = ("von_mises", "displacement")
"""Pictures of a scene that does not name any."""


@dataclass(frozen=True)
class RunReport:
    """Results of a run.

    Attributes
    ----------
    folder : of the result files
    summary : contents of summary.json
    warnings : requests that were not fully met
    run : number of the run in the database
    """

    folder: Path
    summary: dict[str, Any]
    warnings: tuple[str, ...]
    run: int

    def _repr_html_(self) -> str:
        """Return headline, cautions and the page in a frame, as notebooks show it."""
        return notebook_html(self.folder, self.summary, self.warnings)


@dataclass(frozen=True)
class RunOptions:
    """Choices of a run beside its scene.

    Attributes
    ----------
    profile : name of the profile whose settings take precedence over the scene's; None: the scene as written
    meshes : file for the volume meshes of the deformable stones; None: none
    accept_unsound : run a scene that `check_scene` finds unsound all the same; every result says so then
    overwrite : replace the results of another scene in the folder
    animate : draw the motion as motion.gif too
    repeat : run it once more at half the step, to tell how far peaks of stones that rock lie apart
    """

    profile: str | None = None
    meshes: str | Path | None = None
    accept_unsound: bool = False
    overwrite: bool = False
    animate: bool = False
    repeat: bool = False


def run_scene(
    path: str | Path,
    url: str,
    folder: str | Path,
    progress: Listener = silent,
    stop: Callable[[], bool] = lambda: False,
    resume: bool | None = None,
    options: RunOptions | None = None,
) -> RunReport:
    """Run a scene file on the stones of a database, and write the results into a folder.

    Parameters
    ----------
    path : scene file
    url : of the database
    folder : of the results; earlier results there are replaced when the new ones are complete
    progress : called at every stage
    stop : asked after every step; where it says True, the run ends there as interrupted, with results of what there is
    resume : go on with the unfinished run in the folder, if there is one; False: give it up; None: refuse to run then
    options : further choices

    Raises
    ------
    UsageError : a building in stages is to be repeated, the folder holds other files, results of another scene or an
        unfinished run, the scene is not that of the run to be resumed, there is no such profile, or the meshes cannot
        be written
    UnsoundSceneError : the scene has problems that `check_scene` reports, and they are not accepted
    SceneError, GeometryError, MeshError, SolverError : see `assemble` and `mechanics.simulate`
    DatabaseError : the database cannot be read, or not written at the end; the folder is complete then
    """
    options, seconds = options or RunOptions(), dict[str, float]()
    folder, scene = Path(folder), read_scene(path)
    check_replaceable(folder, source=() if options.overwrite else (Path(path),))
    if options.meshes is not None:
        check_mesh_file(options.meshes)
    progress(Progress("blocks", 0, None, "reading the stones"))
    with (
        open_database(url, create=False) as database,
        unfinished_run(folder, scene.output, resume, progress) as unfinished,
    ):
        with _timed(seconds, "blocks"), database.session(read_only=True) as session:
            as_of, models = latest_entry(session), select_stones(scene, session)
            scene = with_profile(scene, options.profile, models)
            progress(Progress("blocks", 0, None, f"closing the joints of {len(models)} stones"))
            assembly = _assembled(scene, models, session)
            surveyed = known_stones(session, [model.record.code for model in models])
        if options.meshes is not None:
            check_mesh_file(options.meshes, _elements(assembly))
        with _timed(seconds, "mesh"):
            built = build_model(assembly.scene, lambda done, total: progress(Progress("mesh", done, total)))
        progress(Progress("check", 0, None, "contacts at the start"))
        with _timed(seconds, "check"):
            problems = problems_of(scene, assembly, loose_blocks(*built))
        if not options.accept_unsound:
            refuse_unsound(problems, str(path))
        if options.repeat and assembly.stages:
            remedy = "leave out --repeat-half-step, and halve step in [time] by hand"
            raise UsageError("a building in stages is not repeated", where=str(path), remedy=remedy)
        digests = fingerprint(assembly.scene, *built, models, assembly.stages)
        last = assembly.stages[-1].scene if assembly.stages else assembly.scene
        unfinished.open(last.blocks, digests, versions(), _steps(scene, assembly), bool(resume))
        with drawing_process(OF_RESULTS) if _asked(scene) else nullcontext() as ready:
            result = _simulated(assembly, built, options.repeat, progress, stop, unfinished)
            result = _with_cautions(result, assembly, problems)
            seconds |= result.wall_time
            stones, reached = stone_results(result), profile_report(options.profile, scene, result)
            with replacing(folder) as fresh:
                writing = Writing(seconds, progress, reached, unfinished, ready, surveyed, options.animate)
                summary, warnings = write_results(result, stones, scene, assembly, fresh, writing)
                unfinished.hand_over(fresh)
        if options.meshes is not None:
            with storing(str(options.meshes)):
                write_meshes(options.meshes, _meshes(result, assembly))
        record = run_record(result, stones, scene, assembly, summary, as_of)
        run = store_record(database, folder, record)
        if result.outcome is not Outcome.INTERRUPTED:
            unfinished.remove()
    return RunReport(folder, summary, warnings, run)


def _assembled(scene: SceneFile, models: tuple[StoneModel, ...], session: Session) -> Assembly:
    """Return the scene of the stones, with remarks on what was surveyed, its inputs and its structures."""
    groups = select_groups(scene, session, models)
    assembly = assemble_stones(scene, models, groups)
    remarks = (
        *assembly.remarks,
        *unusual_values(scene, models),
        *corner_warnings(models),
        *depth_warnings(models),
        *unsupported_stages(scene, assembly),
    )
    return replace(
        assembly,
        remarks=remarks,
        inputs=run_inputs(scene, assembly, groups, session),
        structures=members_of_structures(session, [model.record.code for model in models]),
    )


def _steps(scene: SceneFile, assembly: Assembly) -> int:
    """Return the number by which the last checkpoint of a run is known, at most."""
    steps = assembly.scene.time.steps
    # steps of a stage count from the next checkpoint after those of the stages before
    later = (len(assembly.stages) - 1) * (steps + scene.output.checkpoint) if assembly.stages else 0
    return steps + later


def _simulated(
    assembly: Assembly,
    built: tuple[Model, State],
    repeat: bool,
    progress: Listener,
    stop: Callable[[], bool],
    unfinished: UnfinishedRun,
) -> Result:
    """Return the result of a scene or of its stages; of a scene to be repeated, with that at half the step."""
    if assembly.stages:
        return simulate_stages(assembly.stages, progress, stop, built, unfinished)
    result = simulate(assembly.scene, progress, stop, built, unfinished)
    if repeat and result.outcome is not Outcome.INTERRUPTED:
        settings = assembly.scene.time
        halved = replace(assembly.scene, time=replace(settings, step=0.5 * settings.step))
        result = replace(result, repeated=simulate(halved, progress, stop))
    return result


def _with_cautions(result: Result, assembly: Assembly, problems: Sequence[str]) -> Result:
    """Return a result that says first what makes it doubtful: self-stress, then an unsound scene; rocking last."""
    cautions = result.cautions
    if rocking := rocking_caution(result):
        cautions = (*cautions, rocking)
    if problems:
        cautions = (caution_of(problems), *cautions)
    if not assembly.stages and _by_self_stress(result):
        cautions = (_SELF_STRESS, *cautions)
    return replace(result, cautions=cautions)


@dataclass(frozen=True)
class Writing:
    """Circumstances in which the files of a run are written.

    Attributes
    ----------
    seconds : wall seconds by stage, to which those of writing are added
    progress : called before each file
    profile : what was reached of the profile; None: none was asked for
    unfinished : archive of the run; None: it was not kept
    ready : process that draws the pictures; None: a new one
    known : what the database holds of the stones
    animate : draw the motion too
    """

    seconds: dict[str, float] = field(default_factory=dict)
    progress: Listener = silent
    profile: ProfileReport | None = None
    unfinished: UnfinishedRun | None = None
    ready: "subprocess.Popen[str] | None" = None
    known: Known | None = None
    animate: bool = False


def write_results(
    result: Result,
    stones: tuple[StoneResult, ...],
    scene: SceneFile,
    assembly: Assembly,
    folder: Path,
    writing: Writing,
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Write all files of a run into an empty folder; return the summary and the warnings.

    Pictures that cannot be drawn on this machine cause a warning; everything else is written. They are drawn by
    another process beside the other files.
    """
    progress, unfinished = writing.progress, writing.unfinished
    pictures, omitted = chosen_pictures(scene, result)
    earlier = () if unfinished is None else unfinished.warnings
    warnings = [*assembly.remarks, *earlier, *_warnings(result), *omitted]
    history, failed = _write_fields(result, scene, assembly, folder, pictures, writing)
    warnings += failed
    progress(Progress("write", 2, 3, "report.html"))
    structures = structure_results(result, assembly.structures)
    summary = summarise(
        result,
        version=version("moma-masonry"),
        seconds=writing.seconds,
        profile=None if writing.profile is None else asdict(writing.profile),
        structures=structures,
    )
    summary["inputs"] = {title: list(lines) for title, lines in assembly.inputs.items()}
    summary["filling"] = asdict(filling(scene, assembly))
    summary["wall"] = wall_record(assembly.wall, result.bodies)
    summary["versions"] = dict(versions())
    model = run_model(result, stones, assembly.towards, assembly.origin, writing.known, structures=structures)
    write_report(folder / "report.html", result, summary, stones, warnings, history, model)
    (folder / "scene.toml").write_text(scene.text, encoding="utf-8")
    summary["resumed"] = [] if unfinished is None else unfinished.resumed
    summary["source"] = source_of([scene.document.path], folder)
    summary["origin"] = assembly.origin.tolist()
    summary["warnings"] = warnings
    summary["files"] = sorted(["summary.json", *(entry.name for entry in folder.iterdir())])
    (folder / "summary.json").write_text(as_json(summary), encoding="utf-8")
    progress(Progress("write", 3, 3))
    return summary, tuple(warnings)


def _warnings(result: Result) -> Iterator[str]:
    """Yield warnings of steps that are not solved, and of a static equilibrium that was not found."""
    # of a relaxation only the final equilibrium counts, whose steps are all solved
    relaxed = result.outcome.rests and result.scene.time.relaxation
    if result.errors.unconverged_steps and not relaxed:
        yield (
            f"{result.errors.unconverged_steps} of {result.steps} steps were left above the solver's "
            "tolerance; allow more max_iterations in [solver], or a smaller step in [time]"
        )
    if result.static is not None and not result.static.found:
        yield (
            f"no static equilibrium was found in {result.static.steps} steps, with balance "
            f"{result.static.balance:.1e}; the run began at rest, all loads at once"
        )


def _write_fields(
    result: Result,
    scene: SceneFile,
    assembly: Assembly,
    folder: Path,
    pictures: Sequence[str],
    writing: Writing,
) -> tuple[str, list[str]]:
    """Write fields, tables and pictures; return the drawing of the history, and warnings."""
    warnings = list[str]()
    with ThreadPoolExecutor(1) as beside:
        drawing = beside.submit(draw_pictures, result, folder, pictures, assembly.towards, writing.ready)
        with _timed(writing.seconds, "files"):
            writing.progress(Progress("write", 0, 3, "results for ParaView"))
            if scene.output.paraview is not ParaView.PVD:
                write_vtkhdf(folder / RESULTS, result.bodies, result.scene.blocks, result.frames)
            if scene.output.paraview is not ParaView.VTKHDF:
                write_frames(result, folder)
            write_joint_grid(result, folder)
            write_joints(folder / "joints.csv", result, assembly.origin)
            write_series(folder, result, assembly.origin)
            try:
                history = history_svg(result.history)
            except MissingLibraryError as error:
                history = ""
                warnings.append(f"no curve of the history: {error}")
        with _timed(writing.seconds, "pictures"):
            writing.progress(Progress("write", 1, 3, "pictures"))
            try:
                drawing.result()
                if writing.animate:
                    draw_motion(result, folder, assembly.towards)
            except MissingLibraryError as error:
                warnings.append(f"no pictures: {error}")
    return history, warnings


_SELF_STRESS = "rigid joints admit a rest as surveyed, held only by self-stress, which no load applies"


def _by_self_stress(result: Result) -> bool:
    """Return whether forces between rigid joints could hold stones that do not stand, as no load brings them about."""
    scene = result.scene
    rigid = all(block.fidelity is not Fidelity.DEFORMABLE for block in scene.blocks)
    if not (
        scene.steady and rigid and result.outcome in (Outcome.COLLAPSED, Outcome.MOVING, Outcome.SETTLED)
    ):
        return False
    try:
        return self_stress_alone_holds(scene)
    except MomaError:
        return False


def _elements(assembly: Assembly) -> dict[str, Element]:
    """Return the kind of finite elements of each deformable stone."""
    blocks = (block for block in assembly.scene.blocks if block.fidelity is Fidelity.DEFORMABLE)
    return {block.code: block.element for block in blocks}


def _meshes(result: Result, assembly: Assembly) -> dict[str, VolumeMesh]:
    """Return the undeformed mesh of each deformable stone, in the frame of the site."""
    return {
        body.code: VolumeMesh(body.element, body.reference + assembly.origin, body.cells)
        for body in result.bodies
        if body.element is not None
    }


def _asked(scene: SceneFile) -> tuple[str, ...]:
    """Return the pictures that a scene asks for."""
    return USUAL if scene.output.pictures is None else scene.output.pictures


def chosen_pictures(scene: SceneFile, result: Result) -> tuple[tuple[str, ...], list[str]]:
    """Return the pictures to draw, and a warning for each requested one that would show nothing.

    Where none of them shows anything, the first of all that does is drawn.
    """
    reasons = {name: missing(result, name) for name in _asked(scene)}
    drawn = tuple(name for name, reason in reasons.items() if reason is None)
    if reasons and not drawn:
        drawn = tuple(name for name in PICTURES if missing(result, name) is None)[:1]
    instead = f"; {drawn[0]}.png is drawn instead" if drawn and drawn[0] not in reasons else ""
    omitted = [
        f"no picture {name}: {reason}{instead}" for name, reason in reasons.items() if reason is not None
    ]
    return drawn, [] if scene.output.pictures is None else omitted


@contextmanager
def _timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    start = time.perf_counter()
    yield
    seconds[stage] = time.perf_counter() - start
