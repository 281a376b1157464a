"""Folds, faults, heaps and wedges of disks, several seeds: `python -m benchmarks.geology [--only …] [--write]`.

*fault*, *fold*: those of Renouf, Dubois & Alart (2006) with a tenth of the disks, or with `--full` all of them: some
five minutes of processor time for each fault, and an hour and a half for each fold. *friction*, *heaps*, *taper*,
*sandbox*: friction angles, heaps and wedges. Runs that stand in the folder are not made again. `--write` puts the
tables into docs/geology.md.
"""

import json
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.report import (
    ROOT,
    Row,
    Table,
    columns,
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
from benchmarks.taper import critical_slope
from mechanics.arrays import Array
from mechanics.planar.measures.cells import members
from mechanics.planar.measures.tensors import mean_stress, moments
from mechanics.planar.measures.tessellation import tessellation
from pipelines.draw.elevations.sheet import new_sheet
from pipelines.geology.file import read_geology
from pipelines.geology.observe import WHOLE, Instants, read_rows
from pipelines.geology.run import run_geology

_SCENES = ROOT / "data" / "samples" / "geology"
_PAGE = ROOT / "docs" / "geology.md"
# γ of the paper [N]; with lengths times 0.3162, and so the weight of the cover, it is scaled with them
_GAMMA = (0.0, 1e3, 1e4, 1e5)
_SCALE = 0.3162
# sweeps of the paper, and of the run that is compared with it
_SWEEPS, _MANY = 100, 1000
_FAULT = columns(
    "gamma γ of the paper, N :g | seeds seeds :d | pressure p of W1, 10 to 40 s, kPa | "
    "over over γ = 0 | pushed p of the reactions alone, over γ = 0 | lambda_x λx of W1 | "
    "lambda_y λy of W1 | front front ahead of the tip, m | angle apical angle, ° | ratio P/S | "
    "residual residual over slip | eta η, median :.1e"
)
_FOLD = columns(
    "cell cell | lambda_x λx at the end | lambda_y λy at the end | "
    "shear ln of the ratio of stretches | pressure p, mean of the last tenth, kPa"
)
_SWEPT = columns(
    "experiment experiment | curve curve of the cells | "
    "change 1,000 sweeps instead of 100: mean change :.3g | "
    "spread spread over seeds: mean standard deviation :.3g | ratio change over spread :.2f | "
    "between mean change between two seeds, over spread :.2f | "
    "shift change of the mean of the curve, over spread of the means :.2f"
)
_GRANULAR_SEEDS = 3
_BASAL = "friction angle of the base [°]"  # measure of a wedge
_DENSITY = 2600.0  # [kg/m³]
_SOLID = 0.82  # share of a sample that its disks fill [-]
# vertical strains between which ratios of stresses are means [-]
_EARLY, _LATE = (0.1, 0.2), (0.2, 0.4)

Tables = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class _Case:
    """Runs that differ by their seeds.

    Attributes
    ----------
    group : table in which it has a row
    name, words : of its folders, and of its row
    kind : of experiment
    tables : of the scene
    """

    group: str
    name: str
    words: str
    kind: str
    tables: Tables


# radii of the fold of Renouf, Dubois & Alart (2006), and as far apart as in most of the literature [m]
_EVEN, _GRADED = {"smallest": 0.42, "largest": 0.56}, {"smallest": 0.3, "largest": 0.66}
_DENSE, _LOOSE = {"falling_friction": 0.05}, {"falling_friction": 0.4}
_ROLLING, _BLOCKED = {"friction": 0.4}, {"rolling": False, "friction": 0.5}


def _with(tables: Tables, **more: Mapping[str, Any]) -> Tables:
    return {name: {**tables.get(name, {}), **more.get(name, {})} for name in {**tables, **more}}


def _shipped(name: str) -> Tables:
    """Return the tables of a shipped scene."""
    return tomllib.loads((_SCENES / f"{name}.toml").read_text(encoding="utf-8"))


def _cases() -> tuple[_Case, ...]:
    biaxial, heap = (_with(_shipped(name), contact=_ROLLING) for name in ("biaxial", "repose"))
    stiff = "0.42 to 0.56 m, cannot turn, μ = 0.5"
    return (
        _Case("friction", "fold", "0.42 to 0.56 m", "biaxial", _with(biaxial, sample=_EVEN | _LOOSE)),
        _Case(
            "friction",
            "fold-dense",
            "0.42 to 0.56 m, dense",
            "biaxial",
            _with(biaxial, sample=_EVEN | _DENSE),
        ),
        _Case("friction", "graded", "0.3 to 0.66 m", "biaxial", _with(biaxial, sample=_GRADED | _LOOSE)),
        _Case(
            "friction",
            "blocked-dense",
            f"{stiff}, dense",
            "biaxial",
            _with(biaxial, sample=_EVEN | _DENSE, contact=_BLOCKED),
        ),
        _Case("heaps", "heap-fold", "0.42 to 0.56 m", "repose", _with(heap, sample=_EVEN)),
        _Case("heaps", "heap-graded", "0.3 to 0.66 m", "repose", _with(heap, sample=_GRADED)),
        _Case("heaps", "heap-blocked", stiff, "repose", _with(heap, sample=_EVEN, contact=_BLOCKED)),
        _Case("taper", "taper", "wedge", "wedge", _shipped("taper")),
        _Case("sandbox", "sandbox", "level layer", "wedge", _shipped("sandbox")),
    )


_FRICTION = columns(
    "words radii | seeds seeds :d | disks disks | before porosity at the start | after at 20 to 40 % | "
    "peak sin φ: largest over 1 % strain | early 10 to 20 % strain | late 20 to 40 % | "
    "angle φ, 20 to 40 %, °"
)
_HEAPS = columns("words radii | seeds seeds :d | disks disks | angle angle of repose, °")
_WEDGES = columns(
    "seeds seeds :d | disks disks | internal φ of the disks, ° | basal φ_b measured, ° | "
    "slope slope, ° | critical critical slope, ° | beyond slope minus critical, °"
)
_SANDBOX = columns(
    "seeds seeds :d | disks disks | slope surface slope, ° | thrusts thrusts | "
    "spacing spacing over thickness | dip dip, ° | force force on the wall over ½ ρ g t² | "
    "basal φ_b measured, °"
)
_TABLES: Mapping[str, Table] = {
    "friction": _FRICTION,
    "heaps": _HEAPS,
    "taper": _WEDGES,
    "sandbox": _SANDBOX,
}


def main() -> None:
    """Make the runs that are not there, and print the tables."""
    parser = options_of("geology", __doc__)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--full", action="store_true", help="all disks of the paper, 100 sweeps alone")
    parser.add_argument("--out", type=Path, help="folder of the runs; default: out/geology-seeds or -full")
    parser.add_argument(
        "--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5], help="(1 to 5, three of granular)"
    )
    parser.add_argument("--only", nargs="+", choices=("fault", "fold", *_TABLES), default=["fault", "fold"])
    parser.add_argument("--stored", action="store_true", help="make no run, and take those that are there")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/geology.md")
    options = parser.parse_args()
    out: Path = options.out or Path("out") / ("geology-full" if options.full else "geology-seeds")
    paper, cases = set(options.only) & {"fault", "fold"}, _cases()
    if not options.stored:
        for kind, gamma, seed, sweeps in _wanted(options.seeds, options.only):
            if sweeps == _SWEEPS or not options.full:
                _make(out, kind, gamma, seed, sweeps, options.threads, options.full)
        # a seed of all cases before the next one: tables are whole early
        for seed in options.seeds[:_GRANULAR_SEEDS]:
            for case in (case for case in cases if case.group in options.only):
                _make_case(out, case, seed)
    runs = [read_run(path.parent) for path in sorted(out.glob("f*-*-*-*/summary.json"))] if paper else []
    grains = {case.name: _read_case(out, case) for case in cases}
    if options.json:
        every = [*runs, *(run | {"name": name} for name, group in grains.items() for run in group)]
        print_json([{key: run[key] for key in ("name", "summary")} for run in every])
        return
    suffix = "-full" if options.full else ""
    tables: list[tuple[str, list[Row], Table]] = []
    if paper:
        tables = [
            (f"fault{suffix}", _fault_rows(runs), _FAULT),
            (f"fold{suffix}", _fold_rows(runs), _FOLD),
            (f"sweeps{suffix}", _swept_rows(runs), _SWEPT),
        ]
    for group, make in _MAKERS.items():
        if group in options.only:
            rows = [make(case, grains) for case in cases if case.group == group and grains[case.name]]
            tables.append((group, rows, _TABLES[group]))
    about = [f"Measured at {commit()} on {machine()}.", ""]
    for name, rows, table in tables:
        print_table(rows, table)
        print()
        if options.write and rows:
            write_between(name, about + table_lines(rows, table), _PAGE)
            if name == "fault":
                _draw(runs, ROOT / "docs" / "images" / "geology-cohesion.png")


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


def read_run(folder: Path) -> dict[str, Any]:
    """Return what a finished run left: summary, rows of the cells, and what its name tells."""
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


def pushing(run: Mapping[str, Any]) -> float:
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
    pushed = {run["seed"]: pushing(run) for run in _chosen(runs, kind="fault", gamma=0.0, sweeps=_SWEEPS)}
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
                    (pushing(run) / pushed[run["seed"]] for run in group if run["seed"] in pushed),
                    2,
                ),
                "lambda_x": spread((cell["lambda_x"][-1] for cell in cells), 2),
                "lambda_y": spread((cell["lambda_y"][-1] for cell in cells), 2),
                "front": spread((one["front ahead of the tip [m]"] for one in measures), 1),
                "angle": _determined(measures, "trishear: apical angle [°]", 0),
                "ratio": _determined(measures, "trishear: propagation to slip [-]", 2),
                "residual": spread((one["trishear: residual over slip [-]"] for one in measures), 3),
                "eta": float(np.median([summary["natural_map"]["median"] for summary in summaries])),
            }
        )
    return rows


def _determined(measures: Sequence[Mapping[str, float]], name: str, digits: int) -> str:
    """Return mean ± standard deviation over the runs whose motion determines a measure, and how many these are."""
    found = [one[name] for one in measures if one.get(name) is not None]
    if not found:
        return "not determined"
    return spread(found, digits) + (f" ({len(found)} seeds)" if len(found) < len(measures) else "")


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


# --- granular matter ---


def _make_case(out: Path, case: _Case, seed: int) -> None:
    name = f"{case.name}-{seed}"
    if (out / name / "summary.json").exists():
        return
    tables = _with(
        case.tables,
        sample={"density": _DENSITY, "seed": seed},
        solver={"min_iterations": 100, "max_iterations": 100},
        output={"figures": False},
    )
    lines = []
    for table, keys in tables.items():
        lines += [f"[{table}]", *(f"{key} = {json.dumps(value)}" for key, value in keys.items())]
    out.mkdir(parents=True, exist_ok=True)
    scene = out / f"{name}.toml"
    scene.write_text("\n".join(lines) + "\n", encoding="utf-8")
    progress(name)
    run_geology(scene, case.kind, out / name, resume=True)


def _read_case(out: Path, case: _Case) -> list[dict[str, Any]]:
    """Return the runs of a case: summary, measures, and columns of the rows of all disks."""
    runs = []
    for folder in sorted(
        path for path in out.glob(f"{case.name}-*") if path.name[len(case.name) + 1 :].isdigit()
    ):
        if not (folder / "summary.json").exists():
            continue
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        columns = read_rows(folder / summary["cells"][WHOLE])
        runs.append({"summary": summary, "measures": summary["measures"], "columns": columns})
    return runs


def _measured(runs: Sequence[Mapping[str, Any]], name: str, digits: int, unit: float = 1.0) -> str | None:
    """Return mean ± standard deviation of a measure over the runs that have it."""
    found = [unit * run["measures"][name] for run in runs if run["measures"][name] is not None]
    return spread(found, digits) if found else None


def _row(case: _Case, runs: Sequence[Mapping[str, Any]]) -> Row:
    return {
        "words": case.words,
        "seeds": len(runs),
        "disks": spread((run["summary"]["disks"] for run in runs), 0),
    }


def _friction_row(case: _Case, runs: Mapping[str, Sequence[Mapping[str, Any]]]) -> Row:
    own = runs[case.name]
    ratio, porosity = [], []
    for run in own:
        columns = run["columns"]
        strain = case.tables["biaxial"]["strain"] * columns["time"] / columns["time"][-1]
        during = [(strain > low) & (strain <= high) for low, high in (_EARLY, _LATE)]
        ratio.append([float((columns["q"] / columns["p"])[part].mean()) for part in during])
        porosity.append((float(columns["porosity"][0]), float(columns["porosity"][during[1]].mean())))
    return _row(case, own) | {
        "before": spread((one[0] for one in porosity), 3),
        "after": spread((one[1] for one in porosity), 3),
        "peak": _measured(own, "sin φ, peak [-]", 2),
        "early": spread((one[0] for one in ratio), 3),
        "late": spread((one[1] for one in ratio), 3),
        "angle": spread((float(np.degrees(np.arcsin(one[1]))) for one in ratio), 1),
    }


def _heaps_row(case: _Case, runs: Mapping[str, Sequence[Mapping[str, Any]]]) -> Row:
    own = runs[case.name]
    return _row(case, own) | {
        "angle": _measured(own, "angle of repose [°]", 1),
    }


def _taper_row(case: _Case, runs: Mapping[str, Sequence[Mapping[str, Any]]]) -> Row:
    """Compare with Dahlen's slope for the friction of the disks at large strain, and that of the base of each run."""
    own, alike = runs[case.name], runs["graded"]
    row = _row(case, own) | {
        "basal": _measured(own, _BASAL, 1),
        "slope": _measured(own, "slope [°]", 1),
    }
    if alike:
        angles = [float(run["measures"]["friction angle [°]"]) for run in alike]
        internal = float(np.radians(np.mean(angles)))
        critical = [
            np.degrees(critical_slope(internal, float(np.radians(run["measures"][_BASAL])))) for run in own
        ]
        beyond = [run["measures"]["slope [°]"] - slope for run, slope in zip(own, critical, strict=True)]
        row |= {"internal": spread(angles, 1), "critical": spread(critical, 1), "beyond": spread(beyond, 1)}
    return row


def _sandbox_row(case: _Case, runs: Mapping[str, Sequence[Mapping[str, Any]]]) -> Row:
    own, wedge = runs[case.name], case.tables["wedge"]
    weight = 0.5 * _SOLID * _DENSITY * 9.81 * wedge["height"] ** 2
    return _row(case, own) | {
        "slope": _measured(own, "slope [°]", 1),
        "thrusts": _measured(own, "thrusts", 1),
        "spacing": _measured(own, "spacing of thrusts [m]", 1, 1.0 / wedge["height"]),
        "dip": _measured(own, "dip of thrusts [°]", 0),
        "force": _measured(own, "force on the wall [N/m]", 1, 1.0 / weight),
        "basal": _measured(own, _BASAL, 1),
    }


_MAKERS = {"friction": _friction_row, "heaps": _heaps_row, "taper": _taper_row, "sandbox": _sandbox_row}


if __name__ == "__main__":
    guarded(main)
