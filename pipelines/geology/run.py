"""Run of a geological scene: sample, motion, rows and fields, figures, summary."""

import csv
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.arrays import Array
from mechanics.dynamics.progress import Listener, Progress, silent
from mechanics.planar.model import build_planar_model
from mechanics.planar.result import PlanarResult
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime
from mechanics.planar.simulate import PlanarObserver
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.law import Law
from mechanics.scene.laws.lennard_jones import LennardJones
from mechanics.scene.scene import LawRule, Method, SolverSettings
from moma.errors import SceneError
from pipelines.geology.figures import draw_curves, draw_instant
from pipelines.geology.file import GeologyScene, read_geology
from pipelines.geology.observe import CELL_COLUMNS, WHOLE, Fields, Observation
from pipelines.geology.sample import PreparedSample, prepare
from pipelines.results.folder import RUN_INDEX, UNFINISHED, check_replaceable
from pipelines.results.summary import as_json
from pipelines.results.vtu import VERTEX, Grid, cells_of, write_pvd, write_vtu
from pipelines.run.planar import run_planar
from pipelines.run.record import versions
from pipelines.run.unfinished import UnfinishedRun

__all__ = ["GeologyReport", "planar_scene", "run_geology"]

_SAMPLES = ".samples"  # folder of prepared samples, beside that of the results


@dataclass(frozen=True)
class GeologyReport:
    """Outcome of a run.

    Attributes
    ----------
    folder : of the results
    summary : contents of summary.json
    warnings : shown to the user
    """

    folder: Path
    summary: dict[str, Any]
    warnings: tuple[str, ...]


def planar_scene(scene: GeologyScene, sample: PreparedSample) -> PlanarScene:
    """Put the sample between the walls of the experiment."""
    contact, solver, time = scene.contact, scene.solver, scene.time
    setup = scene.experiment.setup(time.step, time.step * time.steps)
    law: Law = DryJoint(contact.friction)
    if contact.cohesion > 0:
        law = LennardJones(contact.friction, contact.cohesion, contact.cohesion_range * scene.sample.smallest)
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
    return PlanarScene(
        scene.name,
        tuple(
            Disk(code, (float(x), float(y)), float(radius), scene.sample.density)
            for code, (x, y), radius in zip(codes, sample.centre, sample.radius, strict=True)
        ),
        setup.walls,
        (0.0, 0.0 if setup.weightless else -time.gravity),
        law,
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
        loads=setup.loads,
    )


def run_geology(
    path: str | Path,
    kind: str,
    folder: str | Path,
    samples: str | Path | None = None,
    progress: Listener = silent,
    stop: Callable[[], bool] = lambda: False,
    resume: bool | None = None,
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

    Raises
    ------
    UsageError : the folder holds other files or an unfinished run, or the scene is not that of the run to be resumed
    SceneError : with file and line, at the first mistake
    SolverError : if the motion is no longer finite
    """
    folder, scene = Path(folder), read_geology(path, kind)
    check_replaceable(folder)
    sample = prepare(scene, Path(samples) if samples is not None else folder.parent / _SAMPLES, progress)
    planar = planar_scene(scene, sample)
    observation = _observation(scene, sample, planar, folder / UNFINISHED)
    observers = (
        PlanarObserver(scene.output.every, observation.row),
        PlanarObserver(scene.output.fields_every, observation.fields),
    )
    summary: dict[str, Any] = {}

    def write(fresh: Path, result: PlanarResult, archive: UnfinishedRun) -> None:
        progress(Progress("write", 0, 1, "results"))
        summary.update(_write(fresh, scene, sample, result, observation, archive))

    with scene.document.at(kind):
        run_planar(planar, folder, resume, scene.output.checkpoint, progress, stop, observers, write)
    return GeologyReport(folder, summary, tuple(summary["warnings"]))


def _observation(
    scene: GeologyScene, sample: PreparedSample, planar: PlanarScene, place: Path
) -> Observation:
    try:
        return Observation(place, scene.cells, sample.centre, sample.radius, planar.thickness)
    except SceneError as error:
        scene.document.fail(f"{error.where}: {error.what}", "cells", remedy=error.remedy)


def _write(
    folder: Path,
    scene: GeologyScene,
    sample: PreparedSample,
    result: PlanarResult,
    observation: Observation,
    archive: UnfinishedRun,
) -> dict[str, Any]:
    """Write all files of a run into an empty folder; return the summary."""
    warnings = list(archive.warnings)
    history, smallest = result.history, float(sample.radius.min())
    overlap = history.penetration
    share = result.errors.unconverged_steps / result.steps
    quality = {
        "overlap": {"mean": float(overlap.mean()), "max": float(overlap.max())},
        "natural_map": {
            "median": float(np.median(history.natural_map)),
            "max": float(history.natural_map.max()),
        },
        "unconverged_steps": result.errors.unconverged_steps,
    }
    line = (
        f"overlap: mean {overlap.mean():.2%}, largest {overlap.max():.2%} of the smaller width; η: median "
        f"{np.median(history.natural_map):.1e}, largest {history.natural_map.max():.1e}; "
        f"{share:.0%} of {result.steps} steps above {scene.solver.tolerance:g}"
    )
    rows = observation.rows(scene.output.every)
    cells = {}
    for number, (name, columns) in enumerate(rows.items()):
        cells[name] = f"cell-{number:03d}.csv"
        with (folder / cells[name]).open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(CELL_COLUMNS)
            writer.writerows(zip(*(map(repr, column.tolist()) for column in columns.values()), strict=True))
    instants = observation.instants(scene.output.fields_every)
    _write_fields(folder, instants, sample)
    duration = scene.time.step * scene.time.steps
    if scene.output.figures:
        model, _start = build_planar_model(result.scene)
        phases = [end for _, end in scene.experiment.phases(duration).values()][:-1]
        draw_curves(folder / "cells.png", rows, phases, line)
        for fields in instants[-1:]:
            draw_instant(folder, fields, sample.radius, sample.layer, _ends(model, fields), line)
    measures = scene.experiment.measures(sample.centre, sample.radius, instants, rows[WHOLE])
    summary: dict[str, Any] = {
        "scene": scene.name,
        "kind": scene.kind,
        "headline": line,
        "outcome": str(result.outcome),
        "disks": len(sample.radius),
        "smallest_radius": smallest,
        "sample": sample.digest,
        "steps": result.steps,
        "time": {"simulated": result.time, "wall": sum(result.wall_time.values()), **result.wall_time},
        **quality,
        "energy": result.errors.energy,
        "cells": cells,
        "measures": {name: value if np.isfinite(value) else None for name, value in measures.items()},
        "versions": dict(versions()),
        "version": version("moma-masonry"),
        "resumed": archive.resumed,
        "warnings": warnings,
    }
    (folder / "scene.toml").write_text(scene.text, encoding="utf-8")
    summary["files"] = sorted([RUN_INDEX, *(entry.name for entry in folder.iterdir())])
    (folder / RUN_INDEX).write_text(as_json(summary), encoding="utf-8")
    return summary


def _ends(model: Any, fields: Fields) -> Array:
    from mechanics.planar.model import PlanarState

    position = fields.position
    return np.asarray(model.ends(PlanarState(fields.time, position[:, :2], position[:, 2], fields.velocity)))


def _write_fields(folder: Path, instants: Sequence[Fields], sample: PreparedSample) -> None:
    """Write the instants for ParaView: a point for each disk."""
    place = folder / "fields"
    os.makedirs(place)
    count, datasets = len(sample.radius), []
    cells = cells_of(VERTEX, np.arange(count)[:, None].tolist())
    for fields in instants:
        name = f"fields/{fields.step:08d}.vtu"
        grid = Grid(
            np.column_stack([fields.position[:count, :2], np.zeros(count)]),
            cells,
            {
                "radius": sample.radius,
                "layer": sample.layer,
                "velocity": np.column_stack([fields.velocity[:count, :2], np.zeros(count)]),
                "spin": fields.velocity[:count, 2],
                "turn": fields.position[:count, 2],
                "pressure": fields.pressure,
                "volume": fields.volume,
                "shear": fields.shear,
            },
            {},
            {"radius": "m", "velocity": "m/s", "spin": "rad/s", "turn": "rad", "pressure": "Pa"},
        )
        write_vtu(folder / name, grid)
        datasets.append((fields.time, name))
    write_pvd(folder / "fields.pvd", datasets)
