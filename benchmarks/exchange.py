"""A large building as one document, out and in: `python -m benchmarks.exchange [--stones N] [--json]`.

One wall of N stones on SQLite: ten points and four corners each, the plane and the solid made of them, and three
relations for each stone. Each row is a process of its own on one core. See benchmarks/README.md.
"""

import argparse
import tempfile
from pathlib import Path

from benchmarks.child import run_child
from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from moma.errors import ExchangeError

__all__ = ["main"]

# what is done, with which kind of document
_STAGES = (
    ("make", ""),
    ("export", ".json"),
    ("import", ".json"),
    ("export", ".json.gz"),
    ("import", ".json.gz"),
)
_TABLE: Table = (
    ("stage", "what is done", ""),
    ("document", "document", ""),
    ("rows", "rows", "d"),
    ("seconds", "s", ".3g"),
    ("processor", "s of the processor", ".3g"),
    ("us_per_row", "µs per row", ".3g"),
    ("file_mb", "file, MB", ".4g"),
    ("memory_mb", "most memory, MB", ".3g"),
    ("before_mb", "of which the program", ".3g"),
)


def main() -> None:
    """Make the database, carry it out and in, print."""
    options = _options()
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="moma-exchange-", dir=options.folder) as name:
        for stage, suffix in _STAGES:
            progress(f"{stage} {suffix}")
            row = _child(stage, Path(name), options.stones, suffix)
            rows.append({"stage": stage, "document": suffix or "–"} | _derived(row) | {"machine": machine()})
    if options.json:
        print_json(rows)
        return
    print(f"{machine()}; {environment('moma-masonry', 'numpy', 'SQLAlchemy')}\n")
    print_table(rows, _TABLE)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.exchange", description=__doc__)
    parser.add_argument("--stones", type=int, default=100_000, help="stones of the wall (100000)")
    parser.add_argument(
        "--folder", type=Path, help="where to write, 2 GB for 100000 stones; else where the system does"
    )
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each stage")
    return parser.parse_args()


def _child(stage: str, folder: Path, stones: int, suffix: str) -> Row:
    return run_child(
        "benchmarks.exchange_child",
        stage,
        folder,
        stones,
        suffix,
        where=f"{stage} {suffix}",
        error=ExchangeError,
    )


def _derived(row: Row) -> Row:
    return row | {
        "us_per_row": 1e6 * row["seconds"] / row["rows"],
        "file_mb": row["bytes"] / 1e6,
        "memory_mb": row["memory"] / 1e6,
        "before_mb": row["before"] / 1e6,
    }


if __name__ == "__main__":
    guarded(main)
