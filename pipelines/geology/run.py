"""Run of a geological scene: sample, motion, rows and fields, results, record."""

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any

import numpy as np

from archmodel.database.session import open_database
from archmodel.store.run_record import RunRecord
from ground.errors import SceneError
from mechanics.arrays import Array, Ints
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.planar.result import PlanarResult
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime
from mechanics.planar.simulate import PlanarObserver
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.law import Law
from mechanics.scene.laws.lennard_jones import LennardJones
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import LawRule, Method, SolverSettings
from pipelines.draw.elevations.sheet import require_figures
from pipelines.geology.experiments.experiment import Observed, Setup
from pipelines.geology.experiments.membrane import Membrane
from pipelines.geology.file import GeologyScene, read_geology
from pipelines.geology.observe import ObservedRun
from pipelines.geology.results import Observations, write_results
from pipelines.geology.sample import PreparedSample, prepare
from pipelines.geology.settings import Layer
from pipelines.results.folder import UNFINISHED, check_replaceable
from pipelines.run.planar import run_planar
from pipelines.run.record import error_measures, store_record, versions
from pipelines.run.unfinished import UnfinishedRun
from survey.conventions import TENTH

_ON_THE_FLOOR = TENTH  # gap over the smallest radius below which a disk stands on the floor [-]
_START = 2000  # iterations of ADMM, at most, that find the forces of the sample at rest
_SAMPLES = ".samples"  # folder of prepared samples, beside that of the results


@dataclass(frozen=True)
class GeologyReport:
    """Outcome of a run.

    Attributes
    ----------
    folder : of the results
    summary : contents of summary.json
    warnings : shown to the user
    run : number of the run in the database; None: it is in none
    """

    folder: Path
    summary: dict[str, Any]
    warnings: tuple[str, ...]
    run: int | None = None


def planar_scene(scene: GeologyScene, sample: PreparedSample) -> PlanarScene:
    """Put the sample between the walls of the experiment."""
    contact, solver, time = scene.contact, scene.solver, scene.time
    setup = scene.experiment.setup(time.step, time.step * time.steps)
    codes = tuple(str(number) for number in range(1, len(sample.radius) + 1))
    wall_friction = contact.friction if contact.wall_friction is None else contact.wall_friction
    rules = tuple(
        LawRule(frozenset(codes), frozenset(walls), DryJoint(friction))
        for walls, friction in (
            ([wall.code for wall in setup.walls if wall.code not in setup.smooth], wall_friction),
            (list(setup.smooth), 0.0),
        )
        if walls
    )
    material, layers = _materials(scene, sample)
    rules = (*_between_layers(scene, layers, material, codes), *rules)
    return PlanarScene(
        scene.name,
        tuple(
            Disk(
                code,
                (float(x), float(y)),
                float(radius),
                layers[number].density or scene.sample.density,
                fixed=setup.rough and float(y - radius) < _ON_THE_FLOOR * scene.sample.smallest,
            )
            for code, (x, y), radius, number in zip(
                codes, sample.centre, sample.radius, material.tolist(), strict=True
            )
        ),
        setup.walls,
        (0.0, 0.0 if setup.weightless else -time.gravity),
        _law(scene, contact.friction, contact.cohesion),
        rules,
        largest_overlap=solver.largest_overlap,
        time=PlanarTime(time.step, time.theta, time.step * time.steps, stop_at_equilibrium=False),
        solver=SolverSettings(
            Method.NSGS,
            tolerance=solver.tolerance,
            velocity_tolerance=np.inf,
            max_iterations=solver.max_iterations,
            threads=solver.threads,
        ),
        min_sweeps=solver.min_iterations,
        start_iterations=_START,
        loads=_loads(setup, codes, sample),
        rolling=contact.rolling,
    )


def _loads(setup: Setup, codes: tuple[str, ...], sample: PreparedSample) -> Loads:
    if not setup.membrane:
        return setup.loads
    membrane = Membrane(frozenset(codes), sample.radius, setup.membrane)
    return replace(setup.loads, forces=(*setup.loads.forces, membrane))


def _law(scene: GeologyScene, friction: float, cohesion: float) -> Law:
    if cohesion > 0:
        return LennardJones(friction, cohesion, scene.contact.cohesion_range * scene.sample.smallest)
    return DryJoint(friction)


def _materials(scene: GeologyScene, sample: PreparedSample) -> tuple[Ints, tuple[Layer, ...]]:
    """Return the number of the layer (nd,) of each disk, and the layers; what lies above the last is of the last."""
    layers = scene.layers or (Layer(np.inf),)
    number = np.searchsorted([layer.top for layer in layers[:-1]], sample.centre[:, 1])
    return number.astype(np.int64), layers


def _between_layers(
    scene: GeologyScene, layers: tuple[Layer, ...], material: Ints, codes: tuple[str, ...]
) -> list[LawRule]:
    """Return a rule for each pair of layers: the smaller friction, and the smaller cohesion."""
    if not scene.layers:
        return []
    contact, names = scene.contact, np.array(codes)
    groups = [frozenset(names[material == number].tolist()) for number in range(len(layers))]
    friction = [contact.friction if layer.friction is None else layer.friction for layer in layers]
    cohesion = [contact.cohesion if layer.cohesion is None else layer.cohesion for layer in layers]
    rules = []
    for first, second in combinations_with_replacement(range(len(layers)), 2):
        if groups[first] and groups[second]:
            law = _law(scene, min(friction[first], friction[second]), min(cohesion[first], cohesion[second]))
            rules.append(LawRule(groups[first], groups[second], law))
    return rules


def run_geology(
    path: str | Path,
    kind: str,
    folder: str | Path,
    samples: str | Path | None = None,
    progress: Listener = silent,
    stop: Callable[[], bool] = lambda: False,
    resume: bool | None = None,
    url: str | None = None,
    overwrite: bool = False,
) -> GeologyReport:
    """Run the scene file of an experiment, and write the results into a folder.

    Parameters
    ----------
    path : scene file
    kind : of experiment, `pipelines.geology.file.EXPERIMENTS`
    folder : of the results; earlier results there are replaced when the new ones are complete
    samples : folder of prepared samples; None: `.samples` beside that of the results
    progress : called at every stage and step
    stop : asked after every step; where it says True, the run ends there as interrupted, with results of what there is
    resume : go on with the unfinished run in the folder, if there is one; False: give it up; None: refuse to run then
    url : of the database that keeps the run too, made if it is not there; None: none does
    overwrite : replace the results of another scene in the folder

    Raises
    ------
    UsageError : the folder holds other files, results of another scene or an unfinished run; the scene is not that of
        the run to be resumed; the folder of samples cannot be written
    SceneError : with file and line, at the first mistake
    SolverError : if the motion is no longer finite
    DatabaseError : the database cannot be opened, or not written at the end; the folder is complete then
    """
    folder, scene = Path(folder), _read(path, kind)
    check_replaceable(folder, source=() if overwrite else (Path(path),))
    summary: dict[str, Any] = {}
    rows: dict[str, dict[str, Array]] = {}
    # a database that cannot be opened is told before anything is deposited
    with nullcontext() if url is None else open_database(url) as database:
        sample = prepare(scene, Path(samples) if samples is not None else folder.parent / _SAMPLES, progress)
        planar = planar_scene(scene, sample)
        observation = _observation(scene, sample, planar, folder / UNFINISHED)
        every, observers = scene.output.every, _observers(scene, observation)

        def write(fresh: Path, result: PlanarResult, archive: UnfinishedRun) -> None:
            """Write the results of a run, and keep what they say."""
            progress(Progress("write", 0, 1, "results"))
            rows.update(observation.rows(every))
            instants = observation.instants(observers[-1].wants)
            observed = Observations(rows, observation.experiment_rows(every), instants)
            summary.update(write_results(fresh, scene, sample, result, observed, archive))

        with scene.document.at(kind):
            result, _ = run_planar(
                planar, folder, resume, scene.output.checkpoint, progress, stop, observers, write
            )
        record = _geology_record(scene, result, summary, rows)
        number = None if database is None else store_record(database, folder, record)
    return GeologyReport(folder, summary, tuple(summary["warnings"]), number)


def _read(path: str | Path, kind: str) -> GeologyScene:
    """Return the scene of a file, of which figures can be drawn."""
    require_figures()
    return read_geology(path, kind)


def _observers(scene: GeologyScene, observation: ObservedRun) -> tuple[PlanarObserver, PlanarObserver]:
    """Return the observers of rows and of fields; fields are also taken at the instants that are drawn."""
    drawn = frozenset(round(time / scene.time.step) for time in scene.output.figures_at)
    fields = PlanarObserver(scene.output.fields_every, observation.fields, drawn)
    return PlanarObserver(scene.output.every, observation.row), fields


def _followed_layers(scene: GeologyScene, sample: PreparedSample) -> Ints | None:
    """Return the layers (nd,) of a deposit, whose fabric tells of its preparation; None for other experiments."""
    if scene.kind != "deposit":
        return None
    return _materials(scene, sample)[0] if scene.layers else sample.layer


def _observation(
    scene: GeologyScene, sample: PreparedSample, planar: PlanarScene, place: Path
) -> ObservedRun:
    layer = _followed_layers(scene, sample)
    try:
        return ObservedRun(
            place,
            scene.cells,
            sample.centre,
            sample.radius,
            planar.thickness,
            layer,
            scene.experiment.observables if isinstance(scene.experiment, Observed) else None,
        )
    except SceneError as error:
        scene.document.fail(f"{error.where}: {error.what}", "cells", remedy=error.remedy)


def _geology_record(
    scene: GeologyScene,
    result: PlanarResult,
    summary: Mapping[str, Any],
    rows: Mapping[str, Mapping[str, Array]],
) -> RunRecord:
    """Return the record of a run: settings, quality, measures, and the rows of its cells.

    Parameters
    ----------
    summary : the contents of summary.json
    rows : columns by cell
    """
    return RunRecord(
        scene=scene.name,
        scene_text=scene.text,
        outcome=str(result.outcome),
        summary=summary,
        versions=versions(),
        results=(),
        settings={
            "kind": scene.kind,
            **{name: asdict(table) for name, table in scene.tables.items()},
            "layers": [asdict(layer) for layer in scene.layers],
        },
        steps=result.steps,
        simulated=result.time,
        wall=summary["time"]["wall"],
        errors=error_measures(result.errors),
        cells=rows,
    )
