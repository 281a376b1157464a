"""MOMA and LMGC90 side by side: `python -m benchmarks.lmgc90 [--write] [--json]`.

Same blocks, friction, law (gap Signorini and Coulomb, inelastic), time step and θ; every run is a process of its
own with one thread, the two programs in turns. Without `--scenes` the scenes of `rigid_scenes` are made on the way;
`--write` puts the tables into benchmarks/README.md, which says what their columns mean.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.generated import rigid_scenes
from benchmarks.report import (
    Row,
    Table,
    commit,
    environment,
    guarded,
    machine,
    print_json,
    progress,
    table_lines,
    write_between,
)
from benchmarks.runs import Run, Runner, fastest, figures
from benchmarks.scenes import list_scenes, write_scene
from moma.errors import UsageError

__all__ = ["main"]

_TIMES_TABLE: Table = (
    ("scene", "scene", ""),
    ("setting", "setting", ""),
    ("contacts", "contacts", "d"),
    ("contacts_theirs", "LMGC90's", "d"),
    ("ours_step_ms", "step ms", ".3g"),
    ("theirs_step_ms", "LMGC90", ".3g"),
    ("ratio_step", "ratio", ".1f"),
    ("ratio_step_fresh", "with detection", ".1f"),
    ("ours_first_ms", "first ms", ".3g"),
    ("theirs_first_ms", "LMGC90", ".3g"),
    ("ratio_first", "ratio", ".1f"),
    ("ratio_total", "ratio of all", ".1f"),
    ("ours_sweeps", "iterations", ".0f"),
    ("theirs_sweeps", "LMGC90", ".0f"),
    ("ours_sweeps_first", "first", "d"),
    ("theirs_sweeps_first", "LMGC90", "d"),
)
_EXACT_TABLE: Table = (
    ("scene", "scene", ""),
    ("setting", "setting", ""),
    ("tolerance", "tolerance", ".0e"),
    ("ours_eta", "η", ".0e"),
    ("theirs_eta", "LMGC90", ".0e"),
    ("ours_penetration", "penetration", ".0e"),
    ("theirs_penetration", "LMGC90", ".0e"),
    ("ours_drift", "drift m/s", ".0e"),
    ("theirs_drift", "LMGC90", ".0e"),
    ("ours_displacement", "moved m", ".0e"),
    ("theirs_displacement", "LMGC90", ".0e"),
    ("ours_balance", "balance", ".0e"),
    ("theirs_balance", "LMGC90", ".0e"),
    ("ours_reaction", "reaction", ".0e"),
    ("theirs_reaction", "LMGC90", ".0e"),
)
_TIMES = (
    "ours_step",
    "theirs_step",
    "ours_first",
    "theirs_first",
    "theirs_step_relaxed",
    "theirs_first_relaxed",
)
_RELAXED: Table = (
    ("theirs_step_relaxed_ms", "LMGC90 relaxed: step ms", ".3g"),
    ("theirs_first_relaxed_ms", "first ms", ".3g"),
)
# in these the run at the same accuracy must be no worse than LMGC90's
_MATCHED = ("eta", "penetration", "drift", "balance")
_TIGHTER = 10**0.5


def main() -> None:
    """Run the scenes and print."""
    options, measured = _options(), commit()
    if options.steps < 2:
        raise UsageError(
            f"{options.steps} steps", where="--steps", remedy="give 2 or more: the first and a settled one"
        )
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            row
            for path in list_scenes(_scenes(options, Path(folder)), tuple(options.only))
            for row in _Pair(path, options).rows()
        ]
    if options.json:
        print_json(rows)
        return
    for row in rows:
        row |= {f"{key}_ms": None if row[key] is None else 1e3 * row[key] for key in _TIMES}
    setting = f"θ = {options.theta}, h = {options.step} s, {options.steps} steps"
    if options.relaxation is not None:
        setting += f"; LMGC90 as shipped (relaxation 0.1), and with relaxation {options.relaxation:g}"
    lines = [
        f"Measured at {measured}: {machine()}; {rows[0]['versions']}; {setting}.",
        "",
        *table_lines(rows, _TIMES_TABLE if options.relaxation is None else (*_TIMES_TABLE, *_RELAXED)),
        "",
        *table_lines(rows, _EXACT_TABLE),
    ]
    print("\n".join(lines))
    if options.write:
        write_between("lmgc90", lines)


def _scenes(options: argparse.Namespace, folder: Path) -> Path:
    """The folder of the scenes: that of `--scenes`, or an empty one into which they are written."""
    if options.scenes is not None:
        return Path(options.scenes)
    for scene in rigid_scenes():
        write_scene(scene, folder / f"{scene.name}.npz")
    return folder


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.lmgc90", description=__doc__)
    parser.add_argument("--scenes", help="folder with .npz scenes (made on the way)")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="these scenes alone")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each row")
    parser.add_argument("--write", action="store_true", help="put the tables into benchmarks/README.md")
    parser.add_argument("--steps", type=int, default=60, help="time steps of each run (60)")
    parser.add_argument("--settled", type=int, default=20, help="steps at the end that count as settled (20)")
    parser.add_argument("--step", type=float, default=1e-3, help="time step in seconds (0.001)")
    parser.add_argument(
        "--theta", type=float, default=0.5, help="θ of both programs (0.5, LMGC90's default there)"
    )
    parser.add_argument(
        "--repeats", type=int, default=1, help="runs of each side, in turns; the fastest counts (1)"
    )
    parser.add_argument(
        "--tolerance", type=float, help="η of our steps; without it, as exact as LMGC90's run or more"
    )
    parser.add_argument(
        "--sweeps", type=int, default=20000, help="largest number of our sweeps in a step (20000)"
    )
    parser.add_argument(
        "--accurate", action="store_true", help="one more row for each scene, at --accurate-tolerance"
    )
    parser.add_argument(
        "--accurate-tolerance", type=float, default=1e-9, help="η of the accurate rows (1e-9)"
    )
    parser.add_argument(
        "--lmgc90-python", default=sys.executable, help="interpreter that has compas_lmgc90 (this one)"
    )
    parser.add_argument(
        "--relaxation",
        type=float,
        default=1.0,
        help="time LMGC90 with this relaxation too (1); the package fixes 0.1",
    )
    parser.add_argument("--ours-only", action="store_true", help="leave LMGC90 out")
    return parser.parse_args()


class _Pair:
    """The two sides of one scene."""

    def __init__(self, path: Path, options: argparse.Namespace) -> None:
        self._path, self._options = path, options
        self._runner = Runner(path, options)

    def rows(self) -> list[Row]:
        """One row, and one more for the accurate setting."""
        options = self._options
        theirs = None if options.ours_only else self._runner.lmgc90()
        tolerance, ours = self._matched(theirs)
        for _ in range(options.repeats - 1):
            theirs = None if theirs is None else fastest(theirs, self._runner.lmgc90())
            ours = fastest(ours, self._runner.moma(tolerance))
        driven = None
        if theirs is not None and options.relaxation is not None:
            driven = self._runner.lmgc90(options.relaxation)
        rows = [self._row("same accuracy" if theirs else "given", tolerance, ours, theirs, driven)]
        if options.accurate:
            exact = options.accurate_tolerance
            rows.append(self._row("accurate", exact, self._runner.moma(exact), theirs, driven))
        for row in rows:
            fresh = self._runner.moma(row["tolerance"], fresh=True)
            row["ours_step_fresh"] = fresh.step
            row["ratio_step_fresh"] = None if theirs is None else theirs.step / fresh.step
        return rows

    def _matched(self, theirs: Run | None) -> tuple[float, Run]:
        """The loosest tolerance, from LMGC90's own η downwards, at which our run is nowhere less exact than its."""
        if self._options.tolerance is not None or theirs is None or theirs.verdict is None:
            tolerance = self._options.tolerance or 1e-4
            return tolerance, self._runner.moma(tolerance)
        goal = theirs.verdict
        tolerance = _rounded(min(goal.eta_first, goal.eta))
        while True:
            ours = self._runner.moma(tolerance)
            assert ours.verdict is not None
            worse = [key for key in _MATCHED if getattr(ours.verdict, key) > getattr(goal, key)]
            if not worse or tolerance < self._options.accurate_tolerance:
                return tolerance, ours
            progress(f"{self._path.stem}: at η = {tolerance:.1e} less exact in {', '.join(worse)}")
            tolerance /= _TIGHTER

    def _row(self, setting: str, tolerance: float, ours: Run, theirs: Run | None, driven: Run | None) -> Row:
        options = self._options
        assert ours.verdict is not None
        row: Row = {
            "scene": self._path.stem,
            "setting": setting,
            "blocks": len(self._runner.scene.vertices),
            "contacts": ours.verdict.contacts,
            "contacts_theirs": theirs.verdict.contacts if theirs and theirs.verdict else None,
            "tolerance": tolerance,
            "size": self._runner.judge.size,
        }
        for side, run in (("ours", ours), ("theirs", theirs)):
            row |= {f"{side}_{key}": value for key, value in figures(run).items()}
        for key in ("step", "first", "total"):
            row[f"ratio_{key}"] = None if theirs is None else getattr(theirs, key) / getattr(ours, key)
        row |= {
            "relaxation": options.relaxation,
            "theirs_first_relaxed": driven.first if driven else None,
            "theirs_step_relaxed": driven.step if driven else None,
            "step": options.step,
            "theta": options.theta,
            "steps": options.steps,
            "machine": machine(),
            "versions": ", ".join(
                [environment("moma-masonry", "numba", "numpy"), *([theirs.program] if theirs else [])]
            ),
        }
        return row


def _rounded(value: float) -> float:
    """Down to one significant figure."""
    unit = 10.0 ** np.floor(np.log10(value))
    return float(np.floor(value / unit) * unit)


if __name__ == "__main__":
    guarded(main)
