"""Two threads beside one: `python -m benchmarks.threads [--only STAGE …] [--json]`; see benchmarks/README.md."""

import argparse
from collections.abc import Mapping

from benchmarks.child import run_child
from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from moma.errors import SolverError

__all__ = ["SIZES", "main"]

# disks or bricks along and up: about 84,000 contacts in the plane, a wall of 40 × 40 bricks, 10,000 bodies that touch
SIZES: Mapping[str, int] = {
    "sweeps in the plane": 168,
    "sweeps in space": 40,
    "detection": 40,
    "elastic factorisation": 40,
    "elastic first step": 40,
    "factors of bodies": 100,
}
_TABLE: Table = (
    ("stage", "stage", ""),
    ("size", "size", "d"),
    ("contacts", "contacts", "d"),
    ("wall_1", "one thread: wall ms", ".4g"),
    ("cpu_1", "CPU ms", ".4g"),
    ("wall_2", "two: wall ms", ".4g"),
    ("cpu_2", "CPU ms", ".4g"),
    ("ratio", "times as fast", ".2f"),
    ("same_bits", "same bits", ""),
)


def main() -> None:
    """Run each stage with one and two threads, in processes of their own and in turns."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.threads", description=__doc__)
    parser.add_argument("--only", nargs="+", choices=list(SIZES), default=list(SIZES))
    parser.add_argument(
        "--size", type=int, help="disks or bricks along and up, instead of those of the table"
    )
    parser.add_argument(
        "--repeats", type=int, default=5, help="measurements in a process, of which the least counts"
    )
    parser.add_argument("--turns", type=int, default=2, help="processes for each number of threads")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each stage")
    options = parser.parse_args()
    rows = [
        _compared(stage, options.size or SIZES[stage], options.repeats, options.turns)
        for stage in options.only
    ]
    if options.json:
        print_json([row | {"machine": machine()} for row in rows])
        return
    print(f"{machine()}; {environment('moma-masonry', 'numba', 'numpy', 'scipy')}\n")
    print_table(rows, _TABLE)


def _compared(stage: str, size: int, repeats: int, turns: int) -> Row:
    """Least wall and processor times of both numbers of threads [ms], and whether all had the same bits."""
    runs: dict[int, list[Row]] = {1: [], 2: []}
    for turn in range(turns):
        for threads, found in runs.items():
            progress(f"{stage}, turn {turn + 1}, {threads} thread{'s' * (threads > 1)}")
            found.append(
                run_child(
                    "benchmarks.threads_child",
                    stage,
                    size,
                    threads,
                    repeats,
                    where=stage,
                    error=SolverError,
                    threads=threads,
                )
            )
    row: Row = {"stage": stage, "size": size, "contacts": runs[1][0]["contacts"]}
    for threads, found in runs.items():
        row |= {f"{kind}_{threads}": 1e3 * min(one[kind] for one in found) for kind in ("wall", "cpu")}
    row["ratio"] = row["wall_1"] / row["wall_2"]
    row["same_bits"] = (
        "yes" if len({one["digest"] for found in runs.values() for one in found}) == 1 else "no"
    )
    return row


if __name__ == "__main__":
    guarded(main)
