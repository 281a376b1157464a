"""Storeys of a tower from the survey to equilibrium: `python -m benchmarks.storey [--courses N …] [--json]`.

Each storey, with its core, is a process of its own on one core. See benchmarks/README.md for what the columns mean.
"""

import argparse
import math

from benchmarks.child import run_child
from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from moma.errors import SolverError

__all__ = ["main"]

_TABLE: Table = (
    ("courses", "courses", "d"),
    ("stones", "stones", "d"),
    ("bodies", "with core", "d"),
    ("contacts", "contacts", "d"),
    ("ingest", "ingest s", ".3g"),
    ("core", "core s", ".3g"),
    ("closing", "reading, closing s", ".3g"),
    ("simulation", "simulation s", ".3g"),
    ("total", "in all s", ".3g"),
    ("power_simulation", "simulation ~ bodies to the", ".2f"),
    ("power_total", "in all ~ bodies to the", ".2f"),
    ("memory_gb", "memory GB", ".2f"),
    ("open", "joints left open", "d"),
    ("steps", "steps", "d"),
    ("outcome", "outcome", ""),
    ("reaction", "reaction error", ".1e"),
)


def main() -> None:
    """Run every storey, print."""
    options = _options()
    rows: list[Row] = []
    for courses in options.courses:
        where = f"{courses} courses"
        progress(where)
        rows.append(run_child("benchmarks.storey_child", courses, where=where, error=SolverError))
    for row in rows:
        row["machine"] = machine()
        for key in ("simulation", "total"):
            row[f"power_{key}"] = _power(rows[0], row, key)
    if options.json:
        print_json(rows)
        return
    print(f"{machine()}; {environment('moma-masonry', 'numba', 'numpy', 'scipy')}\n")
    print_table(rows, _TABLE)


def _power(first: Row, row: Row, key: str) -> float | None:
    """Return the exponent with which a time has grown with the bodies since the first storey."""
    if row["bodies"] == first["bodies"]:
        return None
    return math.log(row[key] / first[key]) / math.log(row["bodies"] / first["bodies"])


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.storey", description=__doc__)
    parser.add_argument("--courses", type=int, nargs="+", default=[5, 10, 20, 40], help="(5 10 20 40)")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each storey")
    return parser.parse_args()


if __name__ == "__main__":
    guarded(main)
