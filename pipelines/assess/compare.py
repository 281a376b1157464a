"""Comparison of measured with simulated deformation: a scene is run, and its movement set beside the survey."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sqlalchemy.orm import Session

from archmodel.database.session import open_database
from archmodel.relations.members import members_of_structures
from archmodel.relations.zones_and_courses import course_code
from archmodel.store.run_record import StoneResult, StructureValues
from archmodel.tables.entries import latest_entry
from mechanics.arrays import Array
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.model.model import build_model
from mechanics.results.forecast.plan import loose_blocks
from mechanics.results.result import Result
from mechanics.simulate import simulate
from pipelines.assess.motions import stone_motions
from pipelines.draw.elevations.movement import draw_bed_movement, draw_misfit
from pipelines.draw.elevations.sheet import require_figures
from pipelines.ingest.records import surveyed_block
from pipelines.reports.movement import write_comparison
from pipelines.reports.page.known import Known, known_stones
from pipelines.reports.page.model import Lines, Model
from pipelines.reports.page.scenes import run_model
from pipelines.reports.page.surveys import bed_lines
from pipelines.results.folder import check_replaceable, replacing, source_of
from pipelines.results.stone_values import stone_results
from pipelines.results.structure_values import structure_results
from pipelines.results.summary import as_json, summarise
from pipelines.run.assemble import Assembly, assemble_stones
from pipelines.run.inputs import run_inputs
from pipelines.run.record import run_record, store_record, versions
from pipelines.run.soundness import problems_of, refuse_unsound
from pipelines.scene.file import SceneFile, read_scene
from pipelines.scene.selection import StoneModel, select_groups, select_stones
from pipelines.scene.stages import refuse_stages
from survey.quality.departures.beds import measure_beds
from survey.quality.facades import Facade, facades_of
from survey.quality.movement import (
    CourseMovement,
    Misfit,
    PlumbMovement,
    StoneMovement,
    compare_courses,
    compare_plumb,
)
from survey.quality.precision import StoneQuality, appraise

INDEX = "comparison.json"
"""Index of the results of a comparison."""

REPORT = "report.html"
"""Page for people."""

_MEASURED = ("points", "photograph")  # provenance of faces whose place is measured
_WORST = 5.0  # standard deviations at which the colours of a map of misfits end


@dataclass(frozen=True)
class SurveyComparison:
    """A scene beside its survey.

    Attributes
    ----------
    folder : of the files
    summary : contents of comparison.json
    run : its number in the database
    """

    folder: Path
    summary: dict[str, Any]
    run: int


def compare(
    path: str | Path,
    url: str,
    folder: str | Path,
    progress: Listener = silent,
    accept_unsound: bool = False,
    battered: bool = False,
    overwrite: bool = False,
) -> SurveyComparison:
    """Run a scene and compare the movement of its stones with their measured departure from level and plumb.

    Parameters
    ----------
    path : scene file, with the movement that is to be tested: loads, settlements, …
    url : of the database
    folder : of the results; earlier ones there are replaced
    progress : called at every stage
    accept_unsound : run a scene that `check_scene` finds unsound all the same
    battered : walls may have been built leaning: a uniform lean is no movement
    overwrite : replace the results of another scene in the folder

    Raises
    ------
    UsageError : the folder holds other files, or results of another scene
    UnsoundSceneError : the scene has problems that `check_scene` reports
    SceneError, GeometryError, MeshError, SolverError : see `assemble` and `mechanics.simulate`
    DatabaseError : the database cannot be read or written
    """
    require_figures()
    folder, scene = Path(folder), read_scene(path)
    refuse_stages(scene.stages, scene.document, "moma compare")
    check_replaceable(folder, INDEX, () if overwrite else (Path(path),))
    progress(Progress("blocks", 0, None, "reading the stones"))
    with open_database(url, create=False) as database:
        with database.session(read_only=True) as session:
            as_of, models = latest_entry(session), select_stones(scene, session)
            progress(Progress("blocks", 0, None, f"closing the joints of {len(models)} stones"))
            assembly, inputs, surveyed = _assembled(scene, models, session)
        built = build_model(assembly.scene, lambda done, total: progress(Progress("mesh", done, total)))
        if not accept_unsound:
            refuse_unsound(problems_of(scene, assembly, loose_blocks(*built)), str(path))
        result = simulate(assembly.scene, progress, lambda: False, built)
        stones, facades = measured_stones(models)
        courses, plumb = _movements(result, assembly, stones, facades, battered)
        progress(Progress("write", 0, 1, "pictures"))
        structures = structure_results(result, assembly.structures)
        summary = _summary(result, assembly, courses, plumb, battered)
        _add_results(summary["courses"], structures)
        summary["inputs"] = {title: list(lines) for title, lines in inputs.items()}
        values, lines = _values(courses, plumb), _lines(courses, facades, assembly.origin)
        results = tuple(_with_values(stone, values.get(stone.code, {})) for stone in stone_results(result))
        model = run_model(result, results, assembly.towards, assembly.origin, surveyed, lines, structures)
        with replacing(folder, INDEX) as fresh:
            _draw(fresh, facades, stones, courses)
            _write(fresh, scene, summary, model)
        stored = summarise(
            result, version=versions()["moma"], seconds=result.wall_time, structures=structures
        )
        run = store_record(database, folder, run_record(result, results, scene, assembly, stored, as_of))
    progress(Progress("write", 1, 1))
    return SurveyComparison(folder, summary, run)


def _assembled(
    scene: SceneFile, models: tuple[StoneModel, ...], session: Session
) -> tuple[Assembly, Mapping[str, Sequence[str]], Known]:
    """Return the scene of the stones, with their structures; its inputs; and what is known of the stones."""
    groups = select_groups(scene, session, models)
    assembly = assemble_stones(scene, models, groups)
    inputs = run_inputs(scene, assembly, groups, session)
    codes = [model.record.code for model in models]
    assembly = replace(assembly, structures=members_of_structures(session, codes))
    return assembly, inputs, known_stones(session, codes)


def _movements(
    result: Result,
    assembly: Assembly,
    stones: Sequence[StoneQuality],
    facades: Sequence[Facade],
    battered: bool,
) -> tuple[tuple[CourseMovement, ...], tuple[PlumbMovement, ...]]:
    """Return the movements of courses and of faces in a run, beside those that were measured."""
    moved = stone_motions(result.bodies, assembly.origin).displacement
    courses = compare_courses(measure_beds(stones, facades)[0], moved)
    return courses, compare_plumb(stones, facades, moved, battered)


def _add_results(courses: Sequence[dict[str, Any]], structures: Sequence[StructureValues]) -> None:
    """Add the results of a run to each course that has some."""
    of_courses = {structure.code: structure.values for structure in structures}
    for course in courses:
        course["results"] = of_courses.get(course_code(course["zone"], course["course"]), {})


def _lines(courses: Sequence[CourseMovement], facades: Sequence[Facade], origin: Array) -> list[Lines]:
    """Return the lines of the beds in the frame of the scene."""
    outwards = {facade.name: facade.frame.axes[2] for facade in facades}
    return [
        Lines(bed.name, bed.colour, [line - origin for line in bed.lines])
        for bed in bed_lines(courses, outwards)
    ]


def _write(folder: Path, scene: SceneFile, summary: dict[str, Any], model: Model) -> None:
    """Write report, scene and index into a folder, and list all of its files in the summary."""
    write_comparison(folder / REPORT, summary, model)
    (folder / "scene.toml").write_text(scene.text, encoding="utf-8")
    summary["source"] = source_of([scene.document.path], folder)
    summary["files"] = sorted([INDEX, *(entry.name for entry in folder.iterdir())])
    (folder / INDEX).write_text(as_json(summary), encoding="utf-8")


def measured_stones(models: Sequence[StoneModel]) -> tuple[tuple[StoneQuality, ...], tuple[Facade, ...]]:
    """Return the measured stones, and the facades that they make."""
    records = [model.record for model in models if model.record.provenance in _MEASURED]
    stones = tuple(appraise(surveyed_block(record)) for record in records)
    return stones, facades_of(stones)


def _summary(
    result: Result,
    assembly: Assembly,
    courses: Sequence[CourseMovement],
    plumb: Sequence[PlumbMovement],
    battered: bool,
) -> dict[str, Any]:
    walls: dict[tuple[str, str | None], list[Misfit]] = {}
    for course in courses:
        walls.setdefault((course.line.facade, course.line.zone or None), []).append(course.misfit)
    beds = [
        {"facade": facade, "zone": zone, "quantity": "beds", **_told(_sum(wall_beds))}
        for (facade, zone), wall_beds in walls.items()
    ]
    faces = [
        {"facade": wall.facade, "zone": wall.zone, "quantity": "plumb", **_told(wall.misfit)}
        for wall in plumb
    ]
    whole = _sum([*(misfit_of.misfit for misfit_of in courses), *(movement.misfit for movement in plumb)])
    leaning = {(wall.facade, wall.zone): wall.courses for wall in plumb}
    return {
        "scene": result.scene.name,
        "outcome": str(result.outcome),
        "cautions": [
            f"courses are assumed to have been laid level, and faces {'with a batter' if battered else 'plumb'}",
            *result.cautions,
            *assembly.remarks,
        ],
        **_told(whole),
        "walls": [*beds, *faces],
        "courses": [
            _course(course, leaning.get((course.line.facade, course.line.zone or None), {}))
            for course in courses
        ],
        "versions": dict(versions()),
    }


def _sum(misfits: Sequence[Misfit]) -> Misfit:
    return Misfit(
        sum(misfit.chi2 for misfit in misfits),
        sum(misfit.still for misfit in misfits),
        sum(misfit.dof for misfit in misfits),
    )


def _told(misfit: Misfit) -> dict[str, Any]:
    return {"chi2": misfit.chi2, "chi2_still": misfit.still, "dof": misfit.dof}


def _course(movement: CourseMovement, leaning: Mapping[int, StoneMovement]) -> dict[str, Any]:
    """Return a course: of its sag, its slope and its lean what was measured, what simulated, and the σ of both."""
    line = movement.line
    lean = leaning.get(line.course)
    return {
        "facade": line.facade,
        "zone": line.zone or None,
        "course": line.course,
        "measured": line.sag,
        "simulated": movement.sag,
        "sigma": movement.sag_sigma,
        "slope": {"measured": line.slope, "simulated": movement.slope, "sigma": movement.slope_sigma},
        "plumb": None
        if lean is None
        else {"measured": lean.measured, "simulated": lean.simulated, "sigma": lean.sigma},
        **_told(movement.misfit),
    }


def _values(courses: Sequence[CourseMovement], plumb: Sequence[PlumbMovement]) -> dict[str, dict[str, float]]:
    """Return the named values of each stone, by its code."""
    values: dict[str, dict[str, float]] = {}
    for name, groups in (("sag", courses), ("plumb", plumb)):
        for group in groups:
            for code, stone in group.stones.items():
                values.setdefault(code, {}).update(
                    {
                        f"{name}_measured": stone.measured,
                        f"{name}_simulated": stone.simulated,
                        f"{name}_sigma": stone.sigma,
                    }
                )
    return values


def _with_values(result: StoneResult, values: Mapping[str, float]) -> StoneResult:
    return replace(result, values={**result.values, **values})


def _draw(
    folder: Path, facades: Sequence[Facade], stones: Sequence[StoneQuality], courses: Sequence[CourseMovement]
) -> None:
    """Draw of each facade and zone the bed lines, measured and simulated, and the misfit of each stone."""
    by_code = {stone.code: stone for stone in stones}
    walls: dict[tuple[str, str], list[CourseMovement]] = {}
    for course in courses:
        walls.setdefault((course.line.facade, course.line.zone or ""), []).append(course)
    frames = {facade.name: facade for facade in facades}
    for number, ((facade, _), lines) in enumerate(walls.items(), start=1):
        draw_bed_movement(folder / f"beds-{number}.png", lines)
        misfit = {
            code: (stone.measured - stone.simulated) / stone.sigma
            for line in lines
            for code, stone in line.stones.items()
        }
        outlines = [by_code[code].outline for code in misfit]
        draw_misfit(folder / f"misfit-{number}.png", frames[facade], outlines, list(misfit.values()), _WORST)
