"""An assessment of a scene from file to answers: its stones, each question, files, and the record in the database."""

import csv
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from archmodel.database.session import open_database
from archmodel.store.run_record import MovingStone, RunRecord
from archmodel.tables.entries import latest_entry
from ground.errors import MissingLibraryError, UsageError
from mechanics.arrays import Array
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.limit.assembly import RigidAssembly, assembly
from mechanics.limit.dead_load import Standing, at_instant, stands
from mechanics.limit.joints import Resultants, resultants
from mechanics.limit.limit_load import Mechanism
from mechanics.limit.pushover import Pushover
from mechanics.results.forecast.plan import loose_blocks
from mechanics.scene.scene import Fidelity, Scene
from pipelines.assess.answers import (
    FALLS,
    NOT_DECIDED,
    Answer,
    answer,
    confirmer,
    fallen,
    leader,
    refuse_unanswerable,
)
from pipelines.assess.codes.check import CODES
from pipelines.assess.directions import facade_pushes, weakest_push
from pipelines.assess.kept import Kept, kept_answers
from pipelines.assess.questions import LoadQuestion, Question, parse_question, scene_questions
from pipelines.draw.mechanism import draw_mechanisms
from pipelines.draw.plots import draw_capacity
from pipelines.reports.assessment import write_assessment
from pipelines.reports.page.known import Known, known_stones
from pipelines.reports.page.scenes import assessment_model
from pipelines.results.folder import UNFINISHED_ASSESSMENT, check_replaceable, replacing, source_of
from pipelines.results.summary import as_json
from pipelines.results.table_csv import inert
from pipelines.run.assemble import Assembly, assemble_stones
from pipelines.run.inputs import scene_inputs
from pipelines.run.record import store_record, versions
from pipelines.run.soundness import problems_of, refuse_unsound, some
from pipelines.scene.file import SceneFile, read_scene
from pipelines.scene.fingerprint import digest, fingerprint
from pipelines.scene.selection import select_groups, select_stones
from pipelines.scene.site import Site
from pipelines.scene.stages import refuse_stages
from survey.conventions import ATTEMPTS, MOST

INDEX = "assessment.json"
"""Index of the results of an assessment."""

JOINT_COLUMNS = (
    *("first", "second", "x", "y", "z", "force_normal", "force_shear", "place_x", "place_y", "place_z"),
    *("kern", "edge", "friction_use"),
)
"""Columns of forces-N.csv: stones, centroid [m], resultant [N], where it meets the joint [m], kern, edge, use [-]."""

CURVE_COLUMNS = ("displacement", "multiplier", "inertia")
"""Columns of pushover-N.csv: way of the stone that is led [m], λ at rest, and what inertia took of the load [-]."""

REPORT = "report.html"
"""Page for people."""

_SOUND_FIRST = "limit loads need sound joints: mend the scene until `moma check` finds nothing"
_LOOSE = MOST  # share of the stones that may be left out as loose, at most [-]
_RUNS = ATTEMPTS  # by which a candidate is confirmed, at most


@dataclass(frozen=True)
class Assessment:
    """Answers about a scene.

    Attributes
    ----------
    folder : of the files
    summary : contents of assessment.json
    run : its number in the database
    warnings : requests that were not met
    decided : it is known whether the stones stand under their dead load
    """

    folder: Path
    summary: dict[str, Any]
    run: int
    warnings: tuple[str, ...]
    decided: bool = True


@dataclass(frozen=True)
class AssessOptions:
    """Choices of an assessment beside its loads.

    Attributes
    ----------
    confirm : candidates of all loads are confirmed by runs, also of those that do not ask for it
    code : by which mechanisms of pushes on all stones are checked (`pipelines.assess.codes.check.CODES`), where their
        question names no other; needs [site] in the scene
    weakest : seek the direction of the weakest horizontal push, too
    instant : at which loads that change with time are taken [s]; None: the one from which they are constant
    leave_out_loose : stones that fall under their own weight are left out, and listed, if the others stand
    overwrite : replace the results of another scene in the folder
    """

    confirm: bool = False
    code: str | None = None
    weakest: bool = False
    instant: float | None = None
    leave_out_loose: bool = False
    overwrite: bool = False


def assess(
    path: str | Path,
    url: str,
    folder: str | Path,
    loads: Sequence[str] = (),
    progress: Listener = silent,
    options: AssessOptions | None = None,
) -> Assessment:
    """Answer how far a scene is from falling, on the stones of a database; keep the answers there and in a folder.

    Each answer is kept in the folder as soon as there is one: stopped or killed, the same call goes on from there.

    Parameters
    ----------
    path : scene file
    url : of the database
    folder : of the results; earlier ones there are replaced
    loads : in words (`parse_question`); none: those of the scene's [[assess]], or horizontal pushes square to each
        façade, both ways, and along it
    progress : called at every stage
    options : further choices

    Raises
    ------
    UsageError : the folder holds other files, or results of another scene; a load cannot be read; there is no such code
        or no site
    UnsoundSceneError : the scene has problems that `check_scene` reports
    SceneError, GeometryError, SolverError : see `assemble` and `mechanics.limit`
    DatabaseError : the database cannot be read or written
    """
    options = options or AssessOptions()
    folder, scene, asked = Path(folder), read_scene(path), tuple(map(parse_question, loads))
    refuse_stages(scene.stages, scene.document, "moma assess")
    check_replaceable(folder, INDEX, () if options.overwrite else (Path(path),))
    if options.code is not None:
        _refuse_code(options.code, scene)
    progress(Progress("blocks", 0, None, "reading the stones"))
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        as_of = latest_entry(session)
        models = select_stones(scene, session)
        progress(Progress("blocks", 0, None, f"closing the joints of {len(models)} stones"))
        groups = select_groups(scene, session, models)
        assembled = assemble_stones(scene, models, groups)
        inputs = scene_inputs(scene, assembled, groups, session)
        stones = known_stones(session, [model.record.code for model in models])
    questions = [
        _asked(question, options) for question in asked or scene_questions(scene, groups, assembled.origin)
    ]
    dead = at_instant(assembled.scene, options.instant)
    on = assembly(dead)
    refuse_unsound(problems_of(scene, assembled, loose_blocks(on.model, on.state)), str(path), _SOUND_FIRST)
    for question in questions:
        refuse_unanswerable(on, question)
    progress(Progress("assess", 0, len(questions), "do the stones stand by themselves?"))
    on, standing, left_out = _standing(on, dead, options.leave_out_loose, progress)
    questions = questions or [_asked(push, options) for push in facade_pushes(on.model.scene.blocks)]
    if options.weakest and standing.outcome.rests:
        progress(Progress("assess", 0, len(questions), "the weakest direction"))
        questions.append(_asked(weakest_push(on), options))
    inputs_digest = digest(sorted(fingerprint(on.model.scene, on.model, on.state, models).items()))
    with kept_answers(folder, UNFINISHED_ASSESSMENT, (Answer, Mechanism, Pushover)) as store:
        if len(store):
            text = f"going on, with {len(store)} answers that were found before"
            progress(Progress("assess", 0, len(questions), found=text))
        if standing.outcome.rests:
            outwards = None if assembled.wall is None else assembled.wall.outwards
            answers = _answered(on, questions, scene.site, store, inputs_digest, progress, outwards)
        else:
            answers = [fallen(on, question, standing) for question in questions]
    summary = _summary(assembled, on, answers, _unchecked(questions, options), standing, left_out)
    summary["inputs"] = {title: list(lines) for title, lines in inputs.items()}
    progress(Progress("write", 0, 1, "pictures"))
    with replacing(folder, INDEX) as fresh:
        warnings = _write_files(fresh, scene, assembled, on, answers, stones, summary)
    with open_database(url, create=False) as database:
        run = store_record(database, folder, _record(scene, on, answers, summary, as_of))
    progress(Progress("write", 1, 1))
    return Assessment(folder, summary, run, warnings, standing.outcome.decided)


def _unchecked(questions: Sequence[Question], options: AssessOptions) -> list[str]:
    """Return the names of the loads whose mechanisms the code, if there is any, does not check."""
    return [
        question.name
        for question in questions
        if options.code and isinstance(question, LoadQuestion) and question.code is None
    ]


def _write_files(
    folder: Path,
    scene: SceneFile,
    assembled: Assembly,
    on: RigidAssembly,
    answers: Sequence[Answer],
    stones: Known,
    summary: dict[str, Any],
) -> tuple[str, ...]:
    """Write all files of an assessment, and list them in its summary; return the requests that were not met."""
    warnings: tuple[str, ...] = ()
    carried = [_carried(on, reply) for reply in answers]
    summary["files"] = [INDEX, REPORT, "scene.toml", *_write_forces(folder, on, assembled, carried)]
    titles = [_title(scene.name, reply.told["headline"]) for reply in answers]
    summary["files"] += _write_curves(folder, answers, titles)
    blocks, mechanisms = on.model.scene.blocks, [reply.mechanism for reply in answers]
    try:
        drawn = list(zip(titles, mechanisms, carried, strict=True))
        summary["files"] += draw_mechanisms(folder, blocks, on, drawn, assembled.towards)
    except MissingLibraryError as error:
        warnings = (f"no pictures: {error}",)
    summary["source"] = source_of([scene.document.path], folder)
    limits = [
        (reply.told["name"], reply.told["headline"], reply.mechanism, forces)
        for reply, forces in zip(answers, carried, strict=True)
    ]
    model = assessment_model(scene.name, blocks, on, limits, assembled.towards, assembled.origin, stones)
    write_assessment(folder / REPORT, summary, model)
    (folder / "scene.toml").write_text(scene.text, encoding="utf-8")
    (folder / INDEX).write_text(as_json(summary), encoding="utf-8")
    return warnings


def _standing(
    on: RigidAssembly, dead: Scene, leave_out: bool, progress: Listener
) -> tuple[RigidAssembly, Standing, tuple[str, ...]]:
    """Return stones under their dead load alone, without those that fall if they may be left out, and their codes."""
    left_out: tuple[str, ...] = ()
    standing = stands(on, progress)
    first = standing.rest or on, standing
    while leave_out and standing.outcome is Outcome.COLLAPSED and standing.moved:
        loose = set(left_out) | set(standing.moved)
        blocks = tuple(block for block in dead.blocks if block.code not in loose)
        if len(loose) > _LOOSE * len(on.free):
            return *first, ()
        left_out = tuple(sorted(loose))
        on = assembly(replace(dead, blocks=blocks))
        standing = stands(on, progress)
    return standing.rest or on, standing, left_out


def _answered(
    on: RigidAssembly,
    questions: Sequence[Question],
    site: Site | None,
    store: Kept,
    inputs: str,
    progress: Listener,
    outwards: Array | None,
) -> list[Answer]:
    """Answer the questions that are not answered yet; each answer is kept, and told, as soon as there is one."""
    answers: list[Answer] = []
    total = len(questions)

    def within(report: Progress) -> None:
        """Tell how far the runs of a question are, as a part of the whole."""
        done = f" {report.done}" if report.done else ""
        text = f"{questions[len(answers)].name}: {report.stage}{done}"
        progress(Progress("assess", len(answers), total, ", ".join(filter(None, (text, report.text)))))

    confirming, leading = confirmer(on, _RUNS, progress=within), leader(on, progress=within)
    for number, question in enumerate(questions):
        progress(Progress("assess", number, total, question.name))
        decides = [inputs, digest([question, site])]
        kept_answer: Answer | None = store.get(decides)
        if kept_answer is None:
            kept_answer = answer(on, question, confirming, leading, site, outwards)
            store.put(decides, kept_answer)
        answers.append(kept_answer)
        progress(Progress("assess", number + 1, total, question.name, kept_answer.told["headline"]))
    return answers


def _asked(question: Question, options: AssessOptions) -> Question:
    """Return a question with what the options ask of all loads."""
    if not isinstance(question, LoadQuestion):
        return question
    code = options.code if question.whole and question.code is None else question.code
    return replace(question, confirm=question.confirm or options.confirm, code=code)


def _refuse_code(code: str, scene: SceneFile) -> None:
    """Refuse a code of the option --code that is not known, or cannot be followed without [site]."""
    if code not in CODES:
        raise UsageError(f"no such code: {code!r}", where="--code", remedy=f"give one of {', '.join(CODES)}")
    if scene.site is None:
        raise UsageError(
            "a check by a code needs the seismic action",
            where=scene.document.path,
            remedy="add a table [site] (docs/scene.md)",
        )


def _summary(
    assembled: Assembly,
    on: RigidAssembly,
    answers: Sequence[Answer],
    unchecked: Sequence[str],
    standing: Standing,
    left_out: Sequence[str],
) -> dict[str, Any]:
    """Return all answers; `unchecked` are the loads that the code of the option --code does not take."""
    soft = sum(block.fidelity is Fidelity.DEFORMABLE for block in assembled.scene.blocks)
    crushing = (
        "stones are rigid and do not crush" if on.crushing is None else "stones crush at their strength"
    )
    until = assembled.scene.loads.until
    cautions = [
        *([f"left out, as they fall under their own weight: {', '.join(left_out)}"] if left_out else []),
        *_states(standing),
        *(
            ["loads that change are taken as they are in the end, but where an instant is named"]
            if until
            else []
        ),
        f"{crushing}; joints keep their geometry until the mechanism moves",
        *([f"{soft} deformable stones count as rigid"] if soft else []),
        *([f"gaps of up to {1e3 * on.widest:.2g} mm count as closed"] if on.widest > 1e-6 else []),
        *(
            [f"not checked by the code, which takes pushes on all stones: {', '.join(unchecked)}"]
            if unchecked
            else []
        ),
    ]
    loads = [solved.told for solved in answers]
    return {
        "scene": assembled.scene.name,
        "stones": len(on.model.mass),
        "free": len(on.free),
        "weight": on.weight,
        "contacts": len(on.contacts),
        "cautions": [*cautions, *assembled.remarks],
        "loads": loads,
        "governs": min(range(len(loads)), key=lambda number: _limit(loads[number])),
        "wall": None if assembled.wall is None else assembled.wall.record,
        "origin": assembled.origin.tolist(),
        "standing": {
            "outcome": str(standing.outcome),
            "reason": standing.reason,
            "moved": list(standing.moved),
        },
        "left_out": list(left_out),
        "headline": _headline(loads, standing, left_out),
        "versions": dict(versions()),
    }


def _headline(loads: Sequence[dict[str, Any]], standing: Standing, left_out: Sequence[str]) -> str:
    """Return the decisive load in a sentence: the least that is known, or what cannot stand at all."""
    without = f"without {some(left_out)}, which fall under their own weight, " if left_out else ""
    if standing.outcome is Outcome.COLLAPSED:
        loose = f": {some(standing.moved)}" if standing.moved else ""
        return f"it {FALLS}{loose}; --leave-out-loose assesses the rest, if that stands"
    if not standing.outcome.rests:
        return f"{NOT_DECIDED} whether it stands under its own weight: {standing.reason}"
    if standing.falls_as_drawn:
        without += f"rests only after moving by {_short(standing.farthest)}; as drawn it falls; "
    elif standing.outcome is Outcome.SETTLED:
        without += f"although {standing.reason}, "
    least = min(loads, key=_limit)
    if loads[0]["kind"] == "load" and not np.isfinite(_limit(least)):
        return f"{without}nothing limits its loads"
    governs = "governs: " if sum(load["kind"] == "load" for load in loads) > 1 else ""
    return f"{without}{governs}{least['headline']}"


def _title(name: str, headline: str) -> str:
    """Return the title of the pictures of an answer: all that its first line says, in letters that VTK's font has."""
    return f"{name}\n{headline}".replace("λ =", "multiplier")


def _states(standing: Standing) -> list[str]:
    """Return cautions on the state from which limit loads start, where the dead load moves stones or breaks bonds."""
    if not standing.outcome.rests:
        return []
    states = []
    if standing.outcome is Outcome.SETTLED:
        states.append(f"under the dead load alone {standing.reason}")
    if standing.falls_as_drawn:
        states.append(
            f"as drawn it falls: no forces in its joints balance the dead load. It rests after moving by "
            f"{_short(standing.farthest)}, and joints are taken where stones rest"
        )
    elif standing.rest is not None and standing.farthest > 0.0:
        states.append(
            f"joints are those of the stones at rest, {_short(standing.farthest)} at most from where they are drawn"
        )
    if standing.broken:
        pairs = some([" and ".join(pair) for pair in standing.broken])
        states.append(f"the dead load breaks the mortar between {pairs}: it holds nothing here")
    return states


def _short(length: float) -> str:
    """Return a length [m] in millimetres."""
    return f"{1e3 * length:.2g} mm"


def _limit(load: dict[str, Any]) -> float:
    """Return the least load known at which an answer says that stones fall [-]; infinite without one."""
    if load.get("outcome") == FALLS:
        return 0.0
    runs = load.get("confirmation", {})
    limits = [
        load.get("limit", load.get("candidate")),
        load.get("bound"),
        runs.get("held") or runs.get("lost"),
    ]
    return min((value for value in limits if value is not None), default=float("inf"))


def _carried(on: RigidAssembly, given_answer: Answer) -> Resultants | None:
    """Return the resultants of all joints at a limit; None where nothing balances."""
    if not given_answer.force.any():
        return None
    return resultants(on.joints, on.contacts, given_answer.force, on.strength.shear(given_answer.force))


def _write_forces(
    folder: Path, on: RigidAssembly, assembled: Assembly, carried: Sequence[Resultants | None]
) -> list[str]:
    """Write the resultants of all joints at each limit, with places in the frame of the site; return file names."""
    codes, names = [block.code for block in on.model.scene.blocks], []
    for number, forces in enumerate(carried, start=1):
        if forces is None:
            continue
        numbers = np.column_stack(
            [
                on.joints.section.centroid + assembled.origin,
                forces.normal,
                forces.shear,
                forces.place + assembled.origin,
                forces.kern,
                forces.edge,
                forces.friction_use,
            ]
        )
        names.append(f"forces-{number}.csv")
        with (folder / names[-1]).open("w", encoding="utf-8", newline="") as file:
            table = csv.writer(file)
            table.writerow(JOINT_COLUMNS)
            for (a, b), row in zip(on.joints.bodies.tolist(), numbers.tolist(), strict=True):
                table.writerow(
                    [inert(codes[a]), inert(codes[b]), *("" if np.isnan(v) else f"{v:.7g}" for v in row)]
                )
    return names


def _write_curves(folder: Path, answers: Sequence[Answer], titles: Sequence[str]) -> list[str]:
    """Write each capacity curve as a table and a picture; return file names."""
    names = []
    for number, (solved, title) in enumerate(zip(answers, titles, strict=True), start=1):
        if solved.curve is None:
            continue
        columns = np.column_stack([solved.curve.displacement, solved.curve.multiplier, solved.curve.inertia])
        table, picture = f"pushover-{number}.csv", f"pushover-{number}.png"
        np.savetxt(folder / table, columns, "%.7g", ",", header=",".join(CURVE_COLUMNS), comments="")
        draw_capacity(folder / picture, title, solved.curve, solved.told["bound"])
        names += [table, picture]
    return names


def _record(
    scene: SceneFile, on: RigidAssembly, answers: Sequence[Answer], summary: dict[str, Any], as_of: int | None
) -> RunRecord:
    """Return the record of an assessment: its summary, and the stones that move."""
    return RunRecord(
        scene=scene.name,
        scene_text=scene.text,
        outcome="assessed",
        summary=summary,
        versions=versions(),
        results=(),
        as_of=as_of,
        mechanisms={solved.told["name"]: _moving(on, solved) for solved in answers},
    )


def _moving(on: RigidAssembly, solved: Answer) -> tuple[MovingStone, ...]:
    speed = {
        block.code: float(pace)
        for block, pace in zip(on.model.scene.blocks, solved.mechanism.speed, strict=True)
    }
    return tuple(
        MovingStone(stone["code"], speed[stone["code"]], tuple(stone["velocity"]), tuple(stone["spin"]))
        for stone in solved.told["mechanism"]["stones"]
    )
