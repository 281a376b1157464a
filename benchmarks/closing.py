"""Closing the joints of a wall: `python -m benchmarks.closing [--stones N …] [--mesh SIZE] [--json]`.

A generated wall with an arch, measured with 3 mm noise and worn corners, is simplified and its joints are closed. Each
size is a process of its own on one core. See benchmarks/README.md for what the columns mean.
"""

import argparse

from benchmarks.child import run_child
from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from moma.errors import GeometryError

__all__ = ["main"]

_TABLE: Table = (
    ("stage", "what is done", ""),
    ("stones", "stones", "d"),
    ("seconds", "s", ".3g"),
    ("ms_per_stone", "ms per stone", ".3g"),
    ("ratio", "per stone, to the smallest wall", ".2f"),
    ("memory_mb", "memory it took, MB", ".3g"),
    ("joints", "joints", "d"),
    ("open", "left open", "d"),
    ("moved_mm", "farthest corner moved, mm", ".1f"),
    ("nodes", "nodes per stone", ".0f"),
)


def main() -> None:
    """Close every wall, print."""
    options = _options()
    rows: list[Row] = []
    for stones in options.stones:
        progress(f"{stones} stones")
        rows += run_child(
            "benchmarks.closing_child", stones, options.mesh, where=f"{stones} stones", error=GeometryError
        )["rows"]
    first = {row["stage"]: row["seconds"] / row["stones"] for row in reversed(rows)}
    for row in rows:
        each = row["seconds"] / row["stones"]
        row |= {
            "ms_per_stone": 1e3 * each,
            "ratio": each / first[row["stage"]],
            "memory_mb": row["memory"] / 1e6,
            "machine": machine(),
        }
    if options.json:
        print_json(rows)
        return
    print(f"{machine()}; {environment('moma-masonry', 'numba', 'numpy', 'scipy')}\n")
    print_table(rows, _TABLE)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.closing", description=__doc__)
    parser.add_argument(
        "--stones", type=int, nargs="+", default=[1000, 10_000], help="about so many (1000 10000)"
    )
    parser.add_argument(
        "--mesh", type=float, default=0.0, metavar="SIZE", help="mesh with tetrahedra of this size too [m]"
    )
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each stage")
    return parser.parse_args()


if __name__ == "__main__":
    guarded(main)
