"""A large survey, from file to database: `python -m benchmarks.ingest [--stones N] [--json]`.

One wall of N stones, ten points and four corners each, some with blunders and worn corners, in the native format and as
tables. Each row is a process of its own on one core. See benchmarks/README.md for what the columns mean.
"""

import argparse
import tempfile
from pathlib import Path

from benchmarks.child import run_child
from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from moma.errors import SurveyError

__all__ = ["main"]

# what is done, with which file, of how many times N stones
_STAGES = (
    ("read", "moma", 1),
    ("read", "csv", 1),
    ("read", "pnezd", 1),
    ("read, fit, extrude", "moma", 1),
    ("read, fit, extrude", "moma", 2),
    ("the same, all kept", "moma", 1),
    ("ingest into SQLite", "moma", 1),
)
_TABLE: Table = (
    ("stage", "what is done", ""),
    ("format", "format", ""),
    ("stones", "stones", "d"),
    ("points", "points and corners", "d"),
    ("seconds", "s", ".3g"),
    ("us_per_stone", "µs per stone", ".3g"),
    ("us_per_line", "µs per line", ".3g"),
    ("file_mb", "file, MB", ".3g"),
    ("memory_mb", "memory it took, MB", ".3g"),
    ("memory_per_stone", "kB per stone", ".3g"),
    ("arrays_per_stone", "of which numbers", ".3g"),
    ("rejected", "points left out", "d"),
)


def main() -> None:
    """Make the files, run every stage, print."""
    options = _options()
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="moma-ingest-") as name:
        folder = Path(name)
        for format, times in {(format, times): None for _, format, times in _STAGES}:
            progress(f"write {format}, {options.stones * times} stones")
            _child("write", format, folder / f"{times}.{format}", options.stones * times)
        for stage, format, times in _STAGES:
            progress(f"{stage}, {format}, {options.stones * times} stones")
            row = _child(stage, format, folder / f"{times}.{format}", options.stones * times)
            rows.append({"stage": stage, "format": format} | _derived(row) | {"machine": machine()})
    if options.json:
        print_json(rows)
        return
    print(f"{machine()}; {environment('moma-masonry', 'numba', 'numpy', 'SQLAlchemy')}\n")
    print_table(rows, _TABLE)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.ingest", description=__doc__)
    parser.add_argument("--stones", type=int, default=100_000, help="stones of the wall (100000)")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each stage")
    return parser.parse_args()


def _child(stage: str, format: str, path: Path, stones: int) -> Row:
    return run_child(
        "benchmarks.ingest_child", stage, format, path, stones, where=f"{stage}, {format}", error=SurveyError
    )


def _derived(row: Row) -> Row:
    if not row["stones"]:
        return row
    per_stone = {
        "us_per_stone": 1e6 * row["seconds"] / row["stones"],
        "us_per_line": 1e6 * row["seconds"] / row["lines"],
        "memory_mb": row["memory"] / 1e6,
        "file_mb": row["file"] / 1e6,
    }
    if row["arrays"] is not None:
        per_stone |= {
            "memory_per_stone": row["memory"] / row["stones"] / 1e3,
            "arrays_per_stone": row["arrays"] / row["stones"] / 1e3,
        }
    return row | per_stone


if __name__ == "__main__":
    guarded(main)
