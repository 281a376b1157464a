"""Cost against size: `python -m benchmarks.scaling [--json]`.

Running-bond walls and boxes of disks from about 100 to 100,000 contacts: detection, sweeps, a step with a fixed number
of sweeps, memory; with one thread and more. See benchmarks/README.md for what the columns mean.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from moma.errors import SolverError

__all__ = ["main"]

# bricks and courses, columns and rows: about 100, 300, 1,000, … contacts
_WALLS = ((4, 3), (6, 5), (10, 9), (20, 14), (40, 22), (50, 55), (80, 107))
_DISKS = ((8, 5), (14, 8), (25, 14), (45, 23), (80, 43), (140, 73), (250, 135))
# the wall of 1,600 bricks on which detection has a goal
_NAMED = ("wall", 40, 40)
_TABLE: Table = (
    ("kind", "scene", ""),
    ("bodies", "bodies", "d"),
    ("contacts", "contacts", "d"),
    ("detection_ms", "detection ms", ".3g"),
    ("sweep_ns", "sweep ns per contact", ".3g"),
    ("sliding", "of which slide", ".0%"),
    ("stick_ns", "where all stick", ".3g"),
    ("step_ms", "step ms", ".3g"),
    ("step_ns", "step ns per contact", ".3g"),
    ("speedup_sweep", "{} threads: sweep", ".2f"),
    ("speedup_step", "step", ".2f"),
    ("default_first_ms", "default solver: first ms", ".3g"),
    ("default_iterations", "iterations", "d"),
    ("default_step_ms", "later ms", ".3g"),
    ("bytes_kept", "bytes per contact kept", ".0f"),
    ("bytes_peak", "at most", ".0f"),
    ("bytes_peak_default", "default solver", ".0f"),
)
_FITTED = {
    "detection": "detection",
    "step_1": "step",
    "default_first": "first step with the default solver",
    "default_step": "later ones",
}


def main() -> None:
    """Run all sizes and print."""
    options = _options()
    threads = sorted({1, min(options.threads, os.cpu_count() or 1)})
    kinds = {"wall": _WALLS, "disks": _DISKS}
    rows: list[Row] = []
    for kind in options.kinds:
        cases = [(kind, *size) for size in kinds[kind]]
        if kind == _NAMED[0]:
            cases.append(_NAMED)
        rows += [_run(*case, threads) for case in cases if _expected(*case) <= options.largest]
    rows = [_derived(row, threads) for row in rows]
    for kind in options.kinds:
        _fit([row for row in rows if row["kind"] == kind])
    if options.json:
        print_json(rows)
        return
    print(f"{machine()}; {environment('moma-masonry', 'numba', 'numpy')}\n")
    table = [(key, heading.format(threads[-1]), form) for key, heading, form in _TABLE]
    print_table(
        rows,
        table if len(threads) > 1 else [one for one in table if "more" not in one[0] and "up" not in one[0]],
    )
    for kind in options.kinds:
        mine = [row for row in rows if row["kind"] == kind]
        if mine and mine[0]["exponent_step_1"] is not None:
            fits = ", ".join(f"{name} {mine[0][f'exponent_{key}']:.2f}" for key, name in _FITTED.items())
            print(f"\n{kind}: cost ~ contacts to the power of: {fits}")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.scaling", description=__doc__)
    parser.add_argument("--kinds", nargs="+", choices=["wall", "disks"], default=["wall", "disks"])
    parser.add_argument("--largest", type=int, default=200_000, help="no scene with more contacts (200000)")
    parser.add_argument("--threads", type=int, default=2, help="compare one thread with this many (2)")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each scene")
    return parser.parse_args()


def _expected(kind: str, across: int, high: int) -> int:
    """About how many contacts a scene has."""
    return 12 * across * high if kind == "wall" else 3 * across * high


def _run(kind: str, across: int, high: int, threads: list[int]) -> Row:
    progress(f"{kind} {across} x {high}")
    command = [sys.executable, "-m", "benchmarks.scaling_child", kind, str(across), str(high)]
    done = subprocess.run(
        [*command, "--threads", *map(str, threads)],
        cwd=Path(__file__).resolve().parents[1],
        env=os.environ | {"NUMBA_NUM_THREADS": str(threads[-1]), "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        said = done.stderr.strip().splitlines()
        raise SolverError(said[-1] if said else "no word", where=f"{kind} {across} x {high}")
    row: Row = json.loads(done.stdout.splitlines()[-1])
    return row


def _derived(row: Row, threads: list[int]) -> Row:
    last, contacts = threads[-1], row["contacts"]
    row |= {
        "detection_ms": 1e3 * row["detection"],
        "sweep_ns": 1e9 * row["sweep_1"] / contacts,
        "stick_ns": 1e9 * row["sweep_stick"] / contacts,
        "step_ms": 1e3 * row["step_1"],
        "step_ns": 1e9 * row["step_1"] / contacts,
        "default_first_ms": 1e3 * row["default_first"],
        "default_step_ms": 1e3 * row["default_step"],
        "threads": last,
        "machine": machine(),
    }
    if last > 1:
        for name in ("sweep", "step"):
            row[f"speedup_{name}"] = row[f"{name}_wall_1"] / row[f"{name}_wall_{last}"]
    return row


def _fit(rows: list[Row]) -> None:
    """Put the exponent p of cost ~ contacts^p, least squares in logarithms, into every row of a kind."""
    contacts = np.log([row["contacts"] for row in rows])
    for key in _FITTED:
        power = None
        if len(rows) > 1:
            power = float(np.polyfit(contacts, np.log([row[key] for row in rows]), 1)[0])
        for row in rows:
            row[f"exponent_{key}"] = power


if __name__ == "__main__":
    guarded(main)
