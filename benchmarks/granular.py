"""Friction angles, heaps and wedges of disks, several seeds: `python -m benchmarks.granular [--write] [--json]`.

Runs that stand in the folder are not made again. `--write` puts the tables into docs/geology.md.
"""

import argparse
import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.report import (
    Row,
    Table,
    commit,
    guarded,
    machine,
    print_json,
    print_table,
    progress,
    spread,
    table_lines,
    write_between,
)
from mechanics.planar.measures.taper import critical_slope
from pipelines.geology.observe import WHOLE, read_rows
from pipelines.geology.run import run_geology

__all__ = ["main"]

_ROOT = Path(__file__).resolve().parents[1]
_SCENES = _ROOT / "data" / "samples" / "geology"
_PAGE = _ROOT / "docs" / "geology.md"
_SEEDS = [1, 2, 3]
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
_FOLD, _GRADED = {"smallest": 0.42, "largest": 0.56}, {"smallest": 0.3, "largest": 0.66}
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
        _Case("friction", "fold", "0.42 to 0.56 m", "biaxial", _with(biaxial, sample=_FOLD | _LOOSE)),
        _Case(
            "friction",
            "fold-dense",
            "0.42 to 0.56 m, dense",
            "biaxial",
            _with(biaxial, sample=_FOLD | _DENSE),
        ),
        _Case("friction", "graded", "0.3 to 0.66 m", "biaxial", _with(biaxial, sample=_GRADED | _LOOSE)),
        _Case(
            "friction",
            "blocked-dense",
            f"{stiff}, dense",
            "biaxial",
            _with(biaxial, sample=_FOLD | _DENSE, contact=_BLOCKED),
        ),
        _Case("heaps", "heap-fold", "0.42 to 0.56 m", "repose", _with(heap, sample=_FOLD)),
        _Case("heaps", "heap-graded", "0.3 to 0.66 m", "repose", _with(heap, sample=_GRADED)),
        _Case("heaps", "heap-blocked", stiff, "repose", _with(heap, sample=_FOLD, contact=_BLOCKED)),
        _Case("taper", "taper", "wedge", "wedge", _shipped("taper")),
        _Case("sandbox", "sandbox", "level layer", "wedge", _shipped("sandbox")),
    )


_FRICTION: Table = (
    ("words", "radii", ""),
    ("seeds", "seeds", "d"),
    ("disks", "disks", ""),
    ("before", "porosity at the start", ""),
    ("after", "at 20 to 40 %", ""),
    ("peak", "sin φ: largest over 1 % strain", ""),
    ("early", "10 to 20 % strain", ""),
    ("late", "20 to 40 %", ""),
    ("angle", "φ, 20 to 40 %, °", ""),
)
_HEAPS: Table = (
    ("words", "radii", ""),
    ("seeds", "seeds", "d"),
    ("disks", "disks", ""),
    ("angle", "angle of repose, °", ""),
)
_WEDGES: Table = (
    ("seeds", "seeds", "d"),
    ("disks", "disks", ""),
    ("internal", "φ of the disks, °", ""),
    ("basal", "φ_b measured, °", ""),
    ("slope", "slope, °", ""),
    ("critical", "critical slope, °", ""),
    ("beyond", "slope minus critical, °", ""),
)
_SANDBOX: Table = (
    ("seeds", "seeds", "d"),
    ("disks", "disks", ""),
    ("slope", "surface slope, °", ""),
    ("thrusts", "thrusts", ""),
    ("spacing", "spacing over thickness", ""),
    ("dip", "dip, °", ""),
    ("force", "force on the wall over ½ ρ g t²", ""),
    ("basal", "φ_b measured, °", ""),
)
_TABLES: Mapping[str, Table] = {
    "friction": _FRICTION,
    "heaps": _HEAPS,
    "taper": _WEDGES,
    "sandbox": _SANDBOX,
}


def main() -> None:
    """Make the runs that are not there, and print the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.granular", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/granular"), help="folder of the runs")
    parser.add_argument("--seeds", type=int, nargs="+", default=_SEEDS)
    parser.add_argument("--only", nargs="+", choices=[*_TABLES], default=[*_TABLES])
    parser.add_argument("--stored", action="store_true", help="make no run, and take those that are there")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/geology.md")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each run")
    options = parser.parse_args()
    cases = _cases()
    if not options.stored:
        # a seed of all cases before the next one: tables are whole early
        for seed in options.seeds:
            for case in (case for case in cases if case.group in options.only):
                _make(options.out, case, seed)
    runs = {case.name: _read(options.out, case) for case in cases}
    if options.json:
        print_json([{"case": name, **run["summary"]} for name, group in runs.items() for run in group])
        return
    makers = {"friction": _friction_row, "heaps": _heaps_row, "taper": _taper_row, "sandbox": _sandbox_row}
    for group in options.only:
        rows = [makers[group](case, runs) for case in cases if case.group == group and runs[case.name]]
        print_table(rows, _TABLES[group])
        print()
        if options.write and rows:
            about = [f"Measured at {commit()} on {machine()}.", ""]
            write_between(group, about + table_lines(rows, _TABLES[group]), _PAGE)


def _make(out: Path, case: _Case, seed: int) -> None:
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


def _read(out: Path, case: _Case) -> list[dict[str, Any]]:
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


if __name__ == "__main__":
    guarded(main)
