"""Results of a run of disks: quality, rows, fields, figures, summary and report."""

import csv
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.arrays import Array
from mechanics.planar.measures.blocks import blocks_of
from mechanics.planar.measures.cells import members
from mechanics.planar.model import PlanarState, build_planar_model
from mechanics.planar.result import PlanarResult
from pipelines.geology.experiments.fault import Fault
from pipelines.geology.figures import draw_course, draw_curves, draw_instant, draw_shapes, draw_trishear
from pipelines.geology.file import GeologyScene
from pipelines.geology.observe import WHOLE, Fields, Instants
from pipelines.geology.paraview import write_series
from pipelines.geology.report import write_report
from pipelines.geology.sample import PreparedSample
from pipelines.geology.viewer import disks_model
from pipelines.results.folder import RUN_INDEX, source_of
from pipelines.results.summary import as_json
from pipelines.run.record import versions
from pipelines.run.unfinished import UnfinishedRun
from survey.conventions import PER_CENT, PER_MILLE

_MOST_OVERLAP = PER_CENT  # over the smallest radius, beyond which a run says so first [-]
_FABRIC = ("anisotropy", "fabric_direction", "coordination", "porosity")  # columns of a cell
_EXPERIMENT = "experiment.csv"  # rows of what the experiment observes
_OVERLAP_ROUNDING = PER_MILLE  # of an overlap that is just as large as allowed [-]


@dataclass(frozen=True)
class Observations:
    """All that was observed in a run.

    Attributes
    ----------
    cells : columns of the rows by cell
    experiment : columns of what the experiment observes; none if it observes nothing
    instants : of all disks
    """

    cells: Mapping[str, Mapping[str, Array]]
    experiment: Mapping[str, Array]
    instants: Instants


def quality_of(scene: GeologyScene, sample: PreparedSample, result: PlanarResult) -> dict[str, Any]:
    """Return how far a run can be trusted, as it stands in summary.json.

    Overlaps are over the smallest radius, and beside that over the mean radius; *mean* is that of the contacts that
    touch, over all steps.
    """
    history, smallest, mean = result.history, float(sample.radius.min()), float(sample.radius.mean())
    eta, unsolved, steps = history.natural_map, result.errors.unconverged_steps, result.steps
    overlap = {"mean": float(history.mean_overlap.mean()), "max": float(history.overlap.max())}
    quality: dict[str, Any] = {
        "overlap": {name: value / smallest for name, value in overlap.items()},
        "overlap_over_mean_radius": {name: value / mean for name, value in overlap.items()},
        "natural_map": {"median": float(np.median(eta)), "max": float(eta.max())},
        "unconverged_steps": unsolved,
        "unconverged_share": unsolved / steps,
        "tolerance": scene.solver.tolerance,
        "cohesion": {
            "pull": scene.contact.cohesion,
            "range": scene.contact.cohesion_range * scene.sample.smallest,
        },
    }
    largest, cautions = quality["overlap"]["max"], []
    if largest > _MOST_OVERLAP * (1.0 + _OVERLAP_ROUNDING):
        cautions.append(f"overlaps reach {largest:.2%} of the smallest radius, more than {_MOST_OVERLAP:.0%}")
    if unsolved:
        cautions.append(
            f"{unsolved} of {steps} steps ({unsolved / steps:.0%}) were left above η = {scene.solver.tolerance:g}"
        )
    quality["cautions"] = cautions
    quality["headline"] = (
        f"overlap over the smallest radius: mean {quality['overlap']['mean']:.3%}, largest {largest:.2%} "
        f"(mean radius: {quality['overlap_over_mean_radius']['mean']:.3%}, "
        f"{quality['overlap_over_mean_radius']['max']:.2%}); η: median {np.median(eta):.1e}, largest {eta.max():.1e}; "
        f"{unsolved / steps:.0%} of {steps} steps above {scene.solver.tolerance:g}; "
        f"γ = {_pulls(scene)} N within d_w = {quality['cohesion']['range']:.3g} m"
    )
    return quality


def _pulls(scene: GeologyScene) -> str:
    """Return the pull γ of the contacts in words; of layers, the least and the largest."""
    pulls = _cohesions(scene)
    return f"{min(pulls):g}" if min(pulls) == max(pulls) else f"{min(pulls):g} to {max(pulls):g}"


def _cohesions(scene: GeologyScene) -> list[float]:
    """Return the pull of the contacts within each layer [N]."""
    cohesion = scene.contact.cohesion
    return [cohesion if layer.cohesion is None else layer.cohesion for layer in scene.layers] or [cohesion]


def write_results(
    folder: Path,
    scene: GeologyScene,
    sample: PreparedSample,
    result: PlanarResult,
    observed: Observations,
    archive: UnfinishedRun,
) -> dict[str, Any]:
    """Write all files of a run into an empty folder; return the summary."""
    quality = quality_of(scene, sample, result)
    rows, instants = observed.cells, observed.instants
    cells = _write_rows(folder, rows)
    if observed.experiment:
        _write_columns(folder / _EXPERIMENT, observed.experiment)
    write_series(folder, instants, sample, scene.cells, rows)
    (folder / "arrays").mkdir()
    for path in instants.paths:
        shutil.copyfile(path, folder / "arrays" / path.name)
    if scene.output.figures:
        _draw(folder, scene, sample, result, observed, quality["headline"])
    measures = scene.experiment.measures(sample.centre, sample.radius, instants, rows[WHOLE])
    summary: dict[str, Any] = {
        "scene": scene.name,
        "note": scene.note,
        "kind": scene.kind,
        **quality,
        "outcome": str(result.outcome),
        "disks": len(sample.radius),
        "smallest_radius": float(sample.radius.min()),
        "sample": sample.digest,
        "steps": result.steps,
        "time": {"simulated": result.time, "wall": sum(result.wall_time.values()), **result.wall_time},
        "energy": result.errors.energy,
        "cells": cells,
        "blocks": _blocks(scene, sample, instants),
        "fabric": {name: _fabric(columns) for name, columns in rows.items()},
        "measures": {name: value if np.isfinite(value) else None for name, value in measures.items()},
        "versions": dict(versions()),
        "version": version("moma-masonry"),
        "resumed": archive.resumed,
        "warnings": list(archive.warnings),
    }
    (folder / "scene.toml").write_text(scene.text, encoding="utf-8")
    model = disks_model(scene.name, sample.radius, sample.layer, sample.centre, scene.cells, instants)
    write_report(folder / "report.html", scene, summary, rows, model)
    summary["source"] = source_of([scene.document.path], folder)
    summary["files"] = sorted([RUN_INDEX, *(entry.name for entry in folder.iterdir())])
    (folder / RUN_INDEX).write_text(as_json(summary), encoding="utf-8")
    return summary


def _write_rows(folder: Path, rows: Mapping[str, Mapping[str, Array]]) -> dict[str, str]:
    """Write the rows of each cell; return the file of each."""
    cells = {}
    for number, (name, columns) in enumerate(rows.items()):
        cells[name] = f"cell-{number:03d}.csv"
        _write_columns(folder / cells[name], columns)
    return cells


def _write_columns(path: Path, columns: Mapping[str, Array]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(map(repr, column.tolist()) for column in columns.values()), strict=True))


def _blocks(scene: GeologyScene, sample: PreparedSample, instants: Instants) -> list[dict[str, float]]:
    """Return the blocks of a cohesive sample at each instant; none of one without cohesion."""
    if not any(pull > 0 for pull in _cohesions(scene)):
        return []
    reach, rows = scene.contact.cohesion_range * scene.sample.smallest, []
    for fields in instants:
        place = fields.position[: len(sample.radius), :2]
        blocks = blocks_of(sample.centre, place, sample.radius, reach)
        rows.append(
            {
                "time": fields.time,
                "detached": len(blocks.detached),
                "detached_disks": blocks.detached_disks,
                "largest_share": blocks.largest_share,
            }
        )
    return rows


def _fabric(columns: Mapping[str, Array]) -> dict[str, float | None]:
    """Return the fabric of a cell at the end, as its columns are called."""
    last = {name: float(columns[name][-1]) for name in _FABRIC}
    return {name: value if np.isfinite(value) else None for name, value in last.items()}


def _draw(
    folder: Path,
    scene: GeologyScene,
    sample: PreparedSample,
    result: PlanarResult,
    observed: Observations,
    line: str,
) -> None:
    """Draw the curves of the cells and of the experiment, the instants that are asked for, and the last one."""
    model, start = build_planar_model(result.scene)
    ends = _ends_of(scene.experiment.phases(scene.time.step * scene.time.steps))
    draw_curves(folder / "cells.png", observed.cells, ends, line)
    if observed.experiment:
        draw_course(folder / "course.png", observed.experiment, ends, line)
    chosen = _drawn(scene, start, observed.instants)
    followed = {cell.name: members(cell, sample.centre) for cell in scene.cells}
    for fields in chosen:
        walls = model.ends(_state(fields))
        draw_instant(folder, fields, sample.radius, sample.layer, walls, followed, line)
    if followed:
        draw_shapes(folder / "shapes.png", chosen, sample.radius, followed, line)
    if isinstance(fault := scene.experiment, Fault):
        last = observed.instants[-1]
        fit = fault.trishear(sample.centre, last)
        if fit is not None:
            draw_trishear(folder, last, sample.radius, fit.model, fault.speed, line)


def _drawn(scene: GeologyScene, start: PlanarState, instants: Instants) -> list[Fields]:
    """Return the instants of which figures are drawn, in the order of time; the start, if it is asked for."""
    steps = {round(time / scene.time.step) for time in scene.output.figures_at}
    last = instants[-1]
    chosen = [fields for fields in instants[:-1] if fields.step in steps]
    if 0 in steps:
        place, pairs = np.column_stack([start.centre, start.angle]), np.zeros((0, 2))
        rest, bodies = np.zeros_like(last.pressure), pairs.astype(np.int64)
        begin = Fields(0, 0.0, place, start.velocity, rest, rest, rest, bodies, pairs, pairs, pairs, rest[:0])
        chosen.insert(0, begin)
    return [*chosen, last]


def _ends_of(phases: Mapping[str, tuple[float, float]]) -> Sequence[float]:
    """Return the instants at which one phase ends and another begins [s]."""
    return [end for _, end in phases.values()][:-1]


def _state(fields: Fields) -> PlanarState:
    position = fields.position
    return PlanarState(fields.time, position[:, :2], position[:, 2], fields.velocity)
