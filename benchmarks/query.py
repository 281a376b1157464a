"""A building of many stones asked: `python -m benchmarks.query [--stones N] [--db URL…] [--plans] [--json]`.

N stones with their relations, phases, mason marks, and twelve runs with results of every stone, in a database that is
made for it: a file, and on PostgreSQL where a server can be started. Each row is a process of its own. See
benchmarks/README.md for what the columns mean.
"""

import argparse
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

from benchmarks.child import run_child
from benchmarks.query_child import QUESTIONS, STEPS
from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from moma.errors import DatabaseError
from tests.postgresql import Unavailable, running_server

__all__ = ["main"]

_BUILT: Table = (
    ("database", "database", ""),
    ("what", "stored", ""),
    ("seconds", "processor, s", ".3g"),
    ("memory_mb", "memory it took, MB", ".3g"),
)
_ASKED: Table = (
    ("database", "database", ""),
    ("what", "asked", ""),
    ("rows", "found", "d"),
    ("cold", "first time, ms", ".3g"),
    ("warm", "again, ms", ".3g"),
    ("used", "processor, ms", ".3g"),
    ("target", "meant, ms", ".3g"),
)


def main() -> None:
    """Make the building in every database, ask it everything, print."""
    options = _options()
    built: list[Row] = []
    asked: list[Row] = []
    with ExitStack() as held:
        for name, url in _databases(options, held):
            for step in STEPS:
                progress(f"{name}: {step}")
                row = _child("build", step, url, options.stones)
                built.append({"database": name, "what": step, "memory_mb": row["memory"] / 1e6} | row)
            for key, question in QUESTIONS.items():
                progress(f"{name}: {question.words}")
                row = _child("ask", key, url, options.stones)
                asked.append({"database": name, "what": question.words, "target": question.target} | row)
    if options.json:
        print_json([*built, *asked])
        return
    print(f"{options.stones} stones; {machine()}; {environment('moma-masonry', 'SQLAlchemy', 'psycopg')}\n")
    print_table(built, _BUILT)
    print()
    print_table(asked, _ASKED)
    for row in asked if options.plans else ():
        print(f"\n{row['database']}: {row['what']}")
        print("\n--\n".join(row["plans"]))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.query", description=__doc__)
    parser.add_argument("--stones", type=int, default=100_000, help="stones of the building (100000)")
    parser.add_argument(
        "--db", nargs="+", default=None, metavar="URL", help="empty databases to fill instead"
    )
    parser.add_argument("--plans", action="store_true", help="print how the database answers each question")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each row")
    return parser.parse_args()


def _databases(options: argparse.Namespace, held: ExitStack) -> Iterator[tuple[str, str]]:
    """Names and URLs of databases that are empty."""
    if options.db is not None:
        yield from ((url.split(":")[0], url) for url in options.db)
        return
    folder = Path(held.enter_context(tempfile.TemporaryDirectory(prefix="moma-query-")))
    yield "SQLite", f"sqlite:///{folder / 'building.db'}"
    try:
        server = held.enter_context(running_server())
    except Unavailable as reason:
        progress(f"no PostgreSQL: {reason}")
        return
    yield "PostgreSQL", held.enter_context(server.database())


def _child(action: str, name: str, url: str, stones: int) -> Row:
    return run_child(
        "benchmarks.query_child", action, name, url, stones, where=f"{action} {name}", error=DatabaseError
    )


if __name__ == "__main__":
    guarded(main)
