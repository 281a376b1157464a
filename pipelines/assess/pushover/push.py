"""A loading test of a scene from file to files: test, band, pictures, report, and the record in the database."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from archmodel.database.session import open_database
from archmodel.store.run_record import RunRecord
from archmodel.tables.entries import latest_entry
from ground.errors import UsageError
from mechanics.arrays import Array
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.limit.loading_test import LoadingTest, loading_test
from mechanics.scene.rig import Rig
from mechanics.scene.scene import Fidelity, Scene
from pipelines.assess.pushover.band import Band, banded, varied
from pipelines.assess.pushover.findings import doubts_of, headline_of
from pipelines.draw.elevations.sheet import require_figures
from pipelines.draw.loading import draw_curve, draw_pushed
from pipelines.reports.pushover import write_pushover
from pipelines.results.folder import check_replaceable, replacing, source_of
from pipelines.results.summary import as_json
from pipelines.run.assemble import Assembly, assemble_stones
from pipelines.run.filling import stays_open
from pipelines.run.inputs import scene_inputs
from pipelines.run.plausibility import impossible_values
from pipelines.run.record import store_record, versions
from pipelines.run.soundness import refuse_unsound, unsound_stones
from pipelines.scene.file import SceneFile, read_scene
from pipelines.scene.laws import law_rules
from pipelines.scene.pushover import Pushing
from pipelines.scene.rig_cautions import rig_cautions
from pipelines.scene.selection import Groups, select_groups, select_stones
from pipelines.scene.stages import refuse_stages

_MISSING = ("", "nan", "na")
_FORM = "give lines with a displacement in mm and a force in kN, separated by a comma"


def read_curve(path: Path) -> Array:
    """Return a measured curve (n, 2): displacement and force [m], [N].

    Lines before the first with two numbers are headings; columns after the second are left out, and so are lines where
    one of the two is missing, as instruments write them.

    Raises
    ------
    UsageError : the file cannot be read, or a line after the headings has no two numbers
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"the measured curve cannot be read: {error}", where=str(path)) from error
    rows: list[tuple[float, float]] = []
    for number, line in enumerate(lines, start=1):
        cells = [cell.strip() for cell in line.split(",")[:2]]
        if len(cells) < 2 or any(cell.lower() in _MISSING for cell in cells):
            continue
        try:
            displacement, force = map(float, cells)
        except ValueError as error:
            if rows:
                raise UsageError("no two numbers", where=f"{path}:{number}", remedy=_FORM) from error
            continue
        rows.append((displacement, force))
    if not rows:
        raise UsageError("no measured points", where=str(path), remedy=_FORM)
    return np.array(rows) * [1e-3, 1e3]


INDEX = "pushover.json"
"""Index of the results of a loading test."""

REPORT = "report.html"
"""Page for people."""

COLUMNS = ("displacement", "force", "inertia", "lift")
"""Columns of curve.csv: of the push [m], on the jaws [N], the error of the rate [N], and rise of the beam [m]."""

_SOUND_FIRST = "mend the scene until `moma check` finds nothing"


@dataclass(frozen=True)
class Pushed:
    """Result of a loading test.

    Attributes
    ----------
    folder : of the files
    summary : contents of pushover.json
    run : its number in the database
    test : the curve, and the stones
    """

    folder: Path
    summary: dict[str, Any]
    run: int
    test: LoadingTest


def push(
    path: str | Path,
    url: str,
    folder: str | Path,
    progress: Listener = silent,
    stop: Callable[[], bool] = lambda: False,
    overwrite: bool = False,
) -> Pushed:
    """Push the stones of a scene in a test rig as its table [pushover] says; keep curve and report in a folder.

    Parameters
    ----------
    path : scene file
    url : of the database
    folder : of the results; earlier ones there are replaced
    progress, stop : called and asked at every step
    overwrite : replace the results of another scene in the folder

    Raises
    ------
    UsageError : the scene has no [pushover]; the folder holds other files, or results of another scene
    UnsoundSceneError : the scene has problems that `check_scene` reports
    SceneError, GeometryError, SolverError : see `assemble_stones` and `loading_test`
    DatabaseError : the database cannot be read or written
    """
    require_figures()
    folder, scene = Path(folder), read_scene(path)
    refuse_stages(scene.stages, scene.document, "moma pushover")
    check_replaceable(folder, INDEX, () if overwrite else (Path(path),))
    asked = _asked(scene)
    measured = None if asked.measured is None else read_curve(Path(path).parent / asked.measured)
    progress(Progress("blocks", 0, None, "reading the stones"))
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        as_of, models = latest_entry(session), select_stones(scene, session)
        groups = select_groups(scene, session, models)
        assembled = assemble_stones(scene, models, groups)
        inputs = scene_inputs(scene, assembled, groups, session) | {"Rig": _rig(asked)}
    problems = (*impossible_values(scene, assembled.models), *unsound_stones(assembled))
    refuse_unsound(problems, str(path), _SOUND_FIRST)
    stones = _in_rig(scene, assembled.scene, groups, asked.rig)
    number, total = 0, 1 + len(asked.scatter)

    def within(report: Progress) -> None:
        """Tell how far one of the tests is."""
        text = f"test {number + 1} of {total}, {report.text}" if total > 1 else report.text
        progress(replace(report, text=text))

    def tested(name: str, factor: float) -> LoadingTest:
        """Test with one parameter times a factor."""
        nonlocal number
        number += 1
        return loading_test(*varied(stones, asked.rig, name, factor), asked.to, asked.step, within, stop)

    test = loading_test(stones, asked.rig, asked.to, asked.step, within, stop)
    progress(Progress("push", 1, total, found=headline_of(test, None)))
    band = banded(test, asked.scatter, asked.level, tested) if asked.scatter and not test.stopped else None
    summary = _summary(assembled, stones, asked, test, band, measured)
    summary["inputs"] = {title: list(lines) for title, lines in inputs.items()}
    curve = None if band is None else band.curve
    with replacing(folder, INDEX) as fresh:
        _write(fresh, scene, summary, test, curve, measured)
    with open_database(url, create=False) as database:
        run = store_record(database, folder, _record(scene, summary, as_of))
    return Pushed(folder, summary, run, test)


def _record(scene: SceneFile, summary: dict[str, Any], as_of: int | None) -> RunRecord:
    """Return the record of a push, as of an entry of the database."""
    return RunRecord(
        scene=scene.name,
        scene_text=scene.text,
        outcome="pushed",
        summary=summary,
        versions=versions(),
        results=(),
        as_of=as_of,
    )


def _asked(scene: SceneFile) -> Pushing:
    """Return the table [pushover] of a scene that has it."""
    if scene.pushover is None:
        raise UsageError(
            "the scene has no table [pushover]",
            where=str(scene.document.path),
            remedy="say where it is pushed and how far (docs/scene.md)",
        )
    return scene.pushover


def _write(
    folder: Path,
    scene: SceneFile,
    summary: dict[str, Any],
    test: LoadingTest,
    band: Array | None,
    measured: Array | None,
) -> None:
    """Write curve, pictures and report of a test into a folder, and list them in its summary."""
    columns = np.column_stack([test.displacement, test.force, test.inertia, test.lift])
    np.savetxt(folder / "curve.csv", columns, "%.7g", ",", header=",".join(COLUMNS), comments="")
    draw_curve(folder / "curve.png", f"{scene.name}: {summary['headline']}", test, band, measured)
    draw_pushed(folder / "peak.png", f"{scene.name}, at the largest force", test, test.peak)
    draw_pushed(folder / "end.png", f"{scene.name}, at the end", test, test.end)
    files = [INDEX, REPORT, "scene.toml", "curve.csv", "curve.png", "peak.png", "end.png"]
    summary |= {"files": files, "source": source_of([scene.document.path], folder)}
    (folder / "scene.toml").write_text(scene.text, encoding="utf-8")
    write_pushover(folder / REPORT, summary)
    (folder / INDEX).write_text(as_json(summary), encoding="utf-8")


def _in_rig(scene: SceneFile, stones: Scene, groups: Groups, rig: Rig) -> Scene:
    """Return stones, all of them rigid or fixed, with laws that also hold for what the rig puts below and above them.

    Its base and beam count as of the material of all other stones.
    """
    general = next(
        (material.material.name for material in scene.materials if not material.stones),
        scene.materials[0].material.name,
    )
    materials = {block.code: block.material.name for block in stones.blocks} | dict.fromkeys(
        rig.pieces, general
    )
    rules = law_rules(scene.document, scene.laws, groups, materials, stones.contact.thickness)
    return replace(stones.rigid, contact=replace(stones.contact, rules=rules))


def _rig(asked: Pushing) -> tuple[str, ...]:
    """Describe the rig, its push, and the scatter that makes the band."""
    rig, turns = asked.rig, ", ".join(f"{1e3 * to:g}" for to in asked.to)
    scatter = ", ".join(f"{name} {100 * value:g} %" for name, value in asked.scatter.items())
    return (
        f"head {rig.head}, vertical force {1e-3 * rig.load:g} kN, pushed at {rig.height:g} m above the lowest point",
        f"push along ({', '.join(f'{component:z.4g}' for component in rig.direction)}) to {turns} mm in turn",
        f"coefficients of variation: {scatter}" if scatter else "no scatter: all values are taken as certain",
    )


def _summary(
    assembled: Assembly,
    stones: Scene,
    asked: Pushing,
    test: LoadingTest,
    band: Band | None,
    measured: Array | None,
) -> dict[str, Any]:
    """Return the contents of pushover.json, but for its files."""
    soft = sum(block.fidelity is Fidelity.DEFORMABLE for block in assembled.scene.blocks)
    doubts = doubts_of(test)
    cautions = [
        *doubts,
        *rig_cautions(stones, asked.rig, asked.step),
        *([f"{soft} deformable stones count as rigid"] if soft else []),
        *stays_open(assembled),
    ]
    forwards, backwards = test.strength
    model = test.model
    weight = float(model.mass[test.free].sum() * np.linalg.norm(model.scene.gravity))
    return {
        "scene": assembled.scene.name,
        "headline": "; but ".join([headline_of(test, band), *doubts[:1]]),
        "cautions": [*cautions, *assembled.remarks],
        "stones": len(assembled.scene.blocks),
        "weight": weight,
        "direction": list(asked.rig.direction),
        "wall": None if assembled.wall is None else assembled.wall.record,
        "load": asked.rig.load,
        "height": asked.rig.height,
        "head": str(asked.rig.head),
        "strength": {"forwards": forwards, "backwards": backwards},
        "stiffness": test.stiffness,
        "early_stiffness": test.early_stiffness,
        "turning": test.turning,
        "settling": test.settling,
        "steps": len(test.force),
        "errors": {
            "unsolved": test.unsolved,
            "rate": float(np.abs(test.inertia[test.calm]).max(initial=0.0)),
            "disturbed": int(np.sum(~test.calm)),
            "energy": test.energy_error,
        },
        "band": None
        if band is None
        else {
            "level": band.level,
            "strength": band.strength,
            "by_one_sigma": dict(band.parts),
            "scatter": dict(asked.scatter),
        },
        "measured": None if measured is None else _beside(test, measured),
        "versions": dict(versions()),
    }


def _beside(test: LoadingTest, measured: Array) -> dict[str, Any]:
    """Return the largest forces of a measured curve (n, 2), and those predicted over them."""
    most, least = float(measured[:, 1].max()), float(measured[:, 1].min())
    strength, backwards = test.strength
    return {
        "strength": {"forwards": most, "backwards": min(least, 0.0)},
        "ratio": {
            "forwards": strength / most if strength and most > 0 else None,
            "backwards": backwards / least if backwards and least < 0 else None,
        },
    }
