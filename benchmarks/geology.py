"""Folds and faults of Renouf, Dubois & Alart (2006), several seeds: `python -m benchmarks.geology [--full] [--write]`.

A tenth of the disks, or with `--full` all of them: some five minutes of processor time for each fault, and an hour and
a half for each fold. Runs that stand in the folder are not made again. `--write` puts the tables into docs/geology.md.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.report import (
    Row,
    Table,
    commit,
    guarded,
    machine,
    options_of,
    print_json,
    print_table,
    progress,
    spread,
    table_lines,
    write_between,
)
from mechanics.arrays import Array
from mechanics.planar.measures.cells import members
from mechanics.planar.measures.stress import mean_stress, moments
from mechanics.planar.measures.tessellation import tessellation
from pipelines.draw.elevations.sheet import new_sheet
from pipelines.geology.file import read_geology
from pipelines.geology.observe import Instants, read_rows
from pipelines.geology.run import run_geology

__all__ = ["main"]

_ROOT = Path(__file__).resolve().parents[1]
_SCENES = _ROOT / "data" / "samples" / "geology"
_PAGE = _ROOT / "docs" / "geology.md"
# γ of the paper [N]; with lengths times 0.3162, and so the weight of the cover, it is scaled with them
_GAMMA = (0.0, 1e3, 1e4, 1e5)
_SCALE = 0.3162
# sweeps of the paper, and of the run that is compared with it
_SWEEPS, _MANY = 100, 1000
_FAULT: Table = (
    ("gamma", "γ of the paper, N", "g"),
    ("seeds", "seeds", "d"),
    ("pressure", "p of W1, 10 to 40 s, kPa", ""),
    ("over", "over γ = 0", ""),
    ("pushed", "p of the reactions alone, over γ = 0", ""),
    ("lambda_x", "λx of W1", ""),
    ("lambda_y", "λy of W1", ""),
    ("front", "front ahead of the tip, m", ""),
    ("angle", "apical angle, °", ""),
    ("ratio", "P/S", ""),
    ("residual", "residual over slip", ""),
    ("eta", "η, median", ".1e"),
)
_FOLD: Table = (
    ("cell", "cell", ""),
    ("lambda_x", "λx at the end", ""),
    ("lambda_y", "λy at the end", ""),
    ("shear", "ln of the ratio of stretches", ""),
    ("pressure", "p, mean of the last tenth, kPa", ""),
)
_SWEPT: Table = (
    ("experiment", "experiment", ""),
    ("curve", "curve of the cells", ""),
    ("change", "1,000 sweeps instead of 100: mean change", ".3g"),
    ("spread", "spread over seeds: mean standard deviation", ".3g"),
    ("ratio", "change over spread", ".2f"),
    ("between", "mean change between two seeds, over spread", ".2f"),
    ("shift", "change of the mean of the curve, over spread of the means", ".2f"),
)


def main() -> None:
    """Make the runs that are not there, and print the tables."""
    parser = options_of("geology", __doc__)
    parser.add_argument("--full", action="store_true", help="all disks of the paper, 100 sweeps alone")
    parser.add_argument("--out", type=Path, help="folder of the runs; default: out/geology-seeds or -full")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    parser.add_argument("--only", nargs="+", choices=("fault", "fold"), default=["fault", "fold"])
    parser.add_argument("--stored", action="store_true", help="make no run, and take those that are there")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/geology.md")
    options = parser.parse_args()
    out: Path = options.out or Path("out") / ("geology-full" if options.full else "geology-seeds")
    if not options.stored:
        for kind, gamma, seed, sweeps in _wanted(options.seeds, options.only):
            if sweeps == _SWEEPS or not options.full:
                _make(out, kind, gamma, seed, sweeps, options.threads, options.full)
    runs = [_read(path.parent) for path in sorted(out.glob("*/summary.json"))]
    if options.json:
        print_json([{key: run[key] for key in ("name", "summary")} for run in runs])
        return
    fault, fold, swept = _fault_rows(runs), _fold_rows(runs), _swept_rows(runs)
    for rows, table in ((fault, _FAULT), (fold, _FOLD), (swept, _SWEPT)):
        print_table(rows, table)
        print()
    if options.write:
        if fault and not options.full:
            _draw(runs, _ROOT / "docs" / "images" / "geology-cohesion.png")
        about = [f"Measured at {commit()} on {machine()}.", ""]
        for name, rows, table in (("fault", fault, _FAULT), ("fold", fold, _FOLD), ("sweeps", swept, _SWEPT)):
            if rows:
                name += "-full" if options.full else ""
                write_between(name, about + table_lines(rows, table), _PAGE)


def _wanted(seeds: Sequence[int], only: Sequence[str]) -> Iterable[tuple[str, float, int, int]]:
    """Return kind, γ, seed and sweeps of all runs; all γ of a seed before the next seed."""
    for seed in seeds:
        if "fault" in only:
            yield from (("fault", gamma, seed, _SWEEPS) for gamma in _GAMMA)
        if "fold" in only:
            yield ("fold", 0.0, seed, _SWEEPS)
    yield from ((kind, 0.0, seeds[0], _MANY) for kind in ("fault", "fold") if kind in only)


def _make(out: Path, kind: str, gamma: float, seed: int, sweeps: int, threads: int, full: bool) -> None:
    name = f"{kind}-{gamma:g}-{seed}-{sweeps}"
    if (out / name / "summary.json").exists():
        return
    text = (_SCENES / f"{kind}{'' if full else '-tenth'}.toml").read_text(encoding="utf-8")
    for table, line in (
        ("[sample]", f"seed = {seed}"),
        ("[solver]", f"threads = {threads}"),
        ("[contact]", f"cohesion = {(1.0 if full else _SCALE) * gamma!r}"),
    ):
        text = text.replace(table, f"{table}\n{line}", 1)
    lines = [line for line in text.splitlines() if not line.startswith("cohesion = 0.0")]
    text = "\n".join(lines).replace(f"_iterations = {_SWEEPS}", f"_iterations = {sweeps}")
    out.mkdir(parents=True, exist_ok=True)
    scene = out / f"{name}.toml"
    scene.write_text(text, encoding="utf-8")
    progress(name)
    run_geology(scene, kind, out / name, resume=True)


def _read(folder: Path) -> dict[str, Any]:
    kind, gamma, seed, sweeps = folder.name.rsplit("-", 3)
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    cells = {name: read_rows(folder / file) for name, file in summary["cells"].items()}
    return {
        "name": folder.name,
        "folder": folder,
        "kind": kind,
        "gamma": float(gamma),
        "seed": int(seed),
        "sweeps": int(sweeps),
        "summary": summary,
        "cells": cells,
    }


def _pushing(run: Mapping[str, Any]) -> float:
    """Return the mean pressure of W1 in the second phase by the reactions r + hγ, without the pulls [Pa]."""
    folder, cohesion = run["folder"], run["summary"]["cohesion"]
    with np.load(folder.parent / ".samples" / f"{run['summary']['sample']}.npz") as sample:
        start, radius = sample["centre"], sample["radius"]
    scene = read_geology(folder / "scene.toml", run["kind"])
    group = np.isin(np.arange(len(radius)), members(scene.cells[0], start))
    instants = Instants(tuple(sorted((folder / "arrays").glob("fields-*.npz"))))
    found = []
    for fields in instants:
        if fields.time < 0.25 * instants[-1].time:
            continue
        place = fields.position[:, :2]
        shares = tessellation(place[: len(radius)], radius)
        pull = np.where(fields.gap <= cohesion["range"], cohesion["pull"], 0.0) * (
            fields.bodies[:, 1] < len(radius)
        )
        moment = moments(
            len(radius), place, fields.bodies, fields.point, fields.force + pull[:, None] * fields.normal
        )
        inner = group & shares.inside
        found.append(mean_stress(moment[inner], float(shares.share[inner].sum())).pressure)
    return float(np.mean(found))


def _chosen(runs: Sequence[Mapping[str, Any]], **of: Any) -> list[Mapping[str, Any]]:
    return [run for run in runs if all(run[key] == value for key, value in of.items())]


def _late(cell: Mapping[str, Array], column: str, since: float) -> float:
    late = cell["time"] >= since * cell["time"][-1]
    return float(cell[column][late].mean())


def _fault_rows(runs: Sequence[Mapping[str, Any]]) -> list[Row]:
    rows: list[Row] = []
    without = {
        run["seed"]: _late(run["cells"]["W1"], "p", 0.25)
        for run in _chosen(runs, kind="fault", gamma=0.0, sweeps=_SWEEPS)
    }
    pushed = {run["seed"]: _pushing(run) for run in _chosen(runs, kind="fault", gamma=0.0, sweeps=_SWEEPS)}
    for gamma in _GAMMA:
        group = _chosen(runs, kind="fault", gamma=gamma, sweeps=_SWEEPS)
        if not group:
            continue
        cells, summaries = [run["cells"]["W1"] for run in group], [run["summary"] for run in group]
        measures = [summary["measures"] for summary in summaries]
        pressure = [_late(cell, "p", 0.25) for cell in cells]
        over = [
            p / without[run["seed"]] for p, run in zip(pressure, group, strict=True) if run["seed"] in without
        ]
        rows.append(
            {
                "gamma": gamma,
                "seeds": len(group),
                "pressure": spread((1e-3 * p for p in pressure), 1),
                "over": spread(over, 2),
                "pushed": spread(
                    (_pushing(run) / pushed[run["seed"]] for run in group if run["seed"] in pushed),
                    2,
                ),
                "lambda_x": spread((cell["lambda_x"][-1] for cell in cells), 2),
                "lambda_y": spread((cell["lambda_y"][-1] for cell in cells), 2),
                "front": spread((one["front ahead of the tip [m]"] for one in measures), 1),
                "angle": spread((one["trishear: apical angle [°]"] for one in measures), 0),
                "ratio": spread((one["trishear: propagation to slip [-]"] for one in measures), 2),
                "residual": spread((one["trishear: residual over slip [-]"] for one in measures), 3),
                "eta": float(np.median([summary["natural_map"]["median"] for summary in summaries])),
            }
        )
    return rows


def _draw(runs: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Draw the front and the residual of the trishear against γ, a point for each run."""
    group = _chosen(runs, kind="fault", sweeps=_SWEEPS)
    gamma = [run["gamma"] for run in group]
    figure = new_sheet((8.0, 3.0))
    for axes, name, label in zip(
        figure.subplots(1, 2),
        ("front ahead of the tip [m]", "trishear: residual over slip [-]"),
        ("front ahead of the tip [m]", "residual of the trishear over slip [-]"),
        strict=True,
    ):
        axes.plot(gamma, [run["summary"]["measures"][name] for run in group], "o", color="#8a3b12")
        axes.set_xscale("symlog", linthresh=_GAMMA[1])
        axes.set_xlabel("γ of the paper [N]", fontsize=8)
        axes.set_ylabel(label, fontsize=8)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)


def _fold_rows(runs: Sequence[Mapping[str, Any]]) -> list[Row]:
    group = _chosen(runs, kind="fold", sweeps=_SWEEPS)
    names = [name for name in (group[0]["cells"] if group else ()) if name.startswith("W")]
    rows: list[Row] = []
    for name in names:
        cells = [run["cells"][name] for run in group]
        rows.append(
            {
                "cell": name,
                "lambda_x": spread((cell["lambda_x"][-1] for cell in cells), 2),
                "lambda_y": spread((cell["lambda_y"][-1] for cell in cells), 2),
                "shear": spread((cell["shear"][-1] for cell in cells), 2),
                "pressure": spread((1e-3 * _late(cell, "p", 0.9) for cell in cells), 1),
            }
        )
    return rows


def _swept_rows(runs: Sequence[Mapping[str, Any]]) -> list[Row]:
    """Compare the curves of a run with ten times the sweeps with the spread of the curves over seeds."""
    rows: list[Row] = []
    for many in _chosen(runs, sweeps=_MANY):
        alike = _chosen(runs, kind=many["kind"], gamma=many["gamma"], sweeps=_SWEEPS)
        same = [run for run in alike if run["seed"] == many["seed"]]
        if len(alike) < 2 or not same:
            continue
        names = [name for name in many["cells"] if name.startswith("W")]
        for column in ("lambda_x", "lambda_y", "p", "q"):
            curves = {run["seed"]: np.array([run["cells"][name][column] for name in names]) for run in alike}
            here, asked = curves[many["seed"]], np.array([many["cells"][name][column] for name in names])
            change, spread = np.abs(asked - here).mean(), np.std([*curves.values()], axis=0, ddof=1).mean()
            between = np.mean([np.abs(one - other).mean() for one, other in combinations(curves.values(), 2)])
            means = np.std([curve.mean(axis=1) for curve in curves.values()], axis=0, ddof=1)
            rows.append(
                {
                    "experiment": many["kind"],
                    "curve": column + (", Pa" if column in "pq" else ""),
                    "change": float(change),
                    "spread": float(spread),
                    "ratio": float(change / spread),
                    "between": float(between / spread),
                    "shift": float(np.mean(np.abs((asked - here).mean(axis=1)) / means)),
                }
            )
    return rows


if __name__ == "__main__":
    guarded(main)
