"""Results of a study: study.json, its tables, pictures and the page."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mechanics.arrays import Array
from pipelines.assess.study.estimates import Estimates
from pipelines.assess.study.problem import Problem
from pipelines.assess.study.summary import INDEX
from pipelines.draw.studies import (
    draw_fragility,
    draw_samples,
    draw_shares,
    draw_tornado,
    draw_weighted,
)
from pipelines.reports.study import write_study
from pipelines.results.checkpoints import write_whole
from pipelines.results.summary import as_json
from pipelines.results.table_csv import inert


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
