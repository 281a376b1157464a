"""One step of `benchmarks.query`, in a process of its own; prints one line of JSON.

python -m benchmarks.query_child build STEP URL STONES
python -m benchmarks.query_child ask QUESTION URL STONES
"""

import json
import statistics
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, event, text
from sqlalchemy.orm import Session

from archmodel.database.session import Database, open_database
from archmodel.describe.runs import describe_run
from archmodel.describe.trace import trace
from archmodel.query.api import find
from archmodel.relations.graph import load_path
from benchmarks.building import (
    COURSES,
    RUNS,
    relate_all,
    store_all_stones,
    store_knowledge,
    store_results,
)
from benchmarks.memory import peak_bytes
from benchmarks.processor import processor_clock
from moma.cli.text.query import Question as Query
from moma.cli.text.query import answer

__all__ = ["QUESTIONS", "STEPS", "Question", "main"]

_REPEATS = 9

Ask = Callable[[Session, int], int]
Step = Callable[[Database, int], None]

STEPS: Mapping[str, Step] = {
    "stones": store_all_stones,
    "relations": relate_all,
    "knowledge": store_knowledge,
    f"{RUNS} runs": store_results,
}


@dataclass(frozen=True)
class Question:
    """What is asked, and within what time it should be answered [ms]; None: no matter."""

    words: str
    ask: Ask
    target: float | None = None


def _table(kind: str, *where: str, format: str = "table") -> Ask:
    """As `moma query` asks, to the text that it prints."""

    def ask(session: Session, count: int) -> int:
        names = [one.format(middle=_middle(count)) for one in where]
        text, _ = answer(session, Query(kind, tuple(names)), format)
        return len(json.loads(text)) if format == "json" else max(0, len(text.splitlines()) - 2)

    return ask


def _middle(count: int) -> str:
    """Code of a stone in the middle of the wall."""
    return f"W{COURSES // 2}-{count // COURSES // 2}"


def _path(course: int) -> Ask:
    """The load path of the stone in the middle of a course."""
    return lambda session, count: len(load_path(session, f"W{course}-{count // COURSES // 2}").stones)


QUESTIONS: Mapping[str, Question] = {
    "kind": Question("headers deeper than 0.698 m", _table("header", "depth > 0.698"), 50.0),
    "code": Question("one stone by its code", _table("entity", "code = {middle}"), 50.0),
    "course": Question("headers of course 50", _table("header", "course = 50"), 50.0),
    "place": Question("stones within 1 m of a stone", _table("entity", "within({middle}, 1)"), 50.0),
    "stress": Question("headers above 5 MPa in their latest run", _table("header", "von_mises_max > 5e6")),
    "across": Question(
        f"headers of phase 2 with a mason mark, above 1 MPa in run {RUNS}",
        _table("header", f"phase = '2' and has_mark() and von_mises_max@{RUNS} > 1e6"),
    ),
    "above": Question(
        "headers of course 50 that rest on a marked stone",
        _table("header", "course = 50 and rests_on(has_mark())"),
    ),
    "all": Question(
        "headers deeper than 0.698 m, all attributes as JSON",
        _table("header", "depth > 0.698", format="json"),
    ),
    "objects": Question(
        "headers deeper than 0.698 m, as objects",
        lambda session, count: len(find(session, "header", ["depth > 0.698"])),
    ),
    "path": Question(f"load path of a stone of course {COURSES // 2}", _path(COURSES // 2), 200.0),
    "top": Question(f"load path of a stone of course {COURSES}", _path(COURSES), 200.0),
    "trace": Question(
        "from a stress to its measured points",
        lambda session, count: len(trace(session, _middle(count)).measurement.points),  # type: ignore[union-attr]
    ),
    "run": Question(
        "a run in full, with its worst stones and joints",
        lambda session, count: len(describe_run(session, RUNS)["largest_stresses"]),
    ),
}


def main() -> None:
    """Do what the command line says."""
    action, name, url, count = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4])
    with open_database(url) as database:
        print(json.dumps(_build(database, name, count) if action == "build" else _ask(database, name, count)))


def _build(database: Database, name: str, count: int) -> dict[str, Any]:
    with database.engine.connect() as connection:
        clock = processor_clock(connection)
    before, start = peak_bytes() or 0, clock()
    STEPS[name](database, count)
    seconds = clock() - start
    with database.engine.connect().execution_options(moma_read_only=False) as connection:
        connection.execute(text("ANALYZE"))
        connection.commit()
    return {"seconds": seconds, "memory": (peak_bytes() or 0) - before}


def _ask(database: Database, name: str, count: int) -> dict[str, Any]:
    """The first time in a new process, then the median of several; and how the database goes about it."""
    ask, times, found = QUESTIONS[name].ask, [], 0
    clock, before = time.process_time, 0.0
    for repeat in range(_REPEATS + 1):
        if repeat == 1:
            with database.engine.connect() as connection:  # the one that the pool will give again
                clock = processor_clock(connection)
            before = clock()
        start = time.perf_counter()
        with database.session(read_only=True) as session:
            found = ask(session, count)
        times.append(1e3 * (time.perf_counter() - start))
    used = 1e3 * (clock() - before) / _REPEATS
    plans = _plans(database, lambda session: ask(session, count))
    return {
        "cold": times[0],
        "warm": statistics.median(times[1:]),
        "used": used,
        "rows": found,
        "plans": plans,
    }


def _plans(database: Database, ask: Callable[[Session], int]) -> list[str]:
    """What the database says of how it answers each statement."""
    said: list[tuple[str, Any]] = []

    def listen(
        connection: Connection, cursor: Any, statement: str, parameters: Any, context: Any, many: bool
    ) -> None:
        said.append((statement, parameters))

    event.listen(database.engine, "before_cursor_execute", listen)
    with database.session(read_only=True) as session:
        ask(session)
    event.remove(database.engine, "before_cursor_execute", listen)
    explain = "EXPLAIN QUERY PLAN " if database.engine.dialect.name == "sqlite" else "EXPLAIN "
    plans = []
    with database.session(read_only=True) as session:
        for statement, parameters in said:
            if statement.lstrip().upper().startswith(("SELECT", "WITH")):
                rows = session.connection().exec_driver_sql(explain + statement, parameters)
                plans.append("\n".join(str(row[-1]) for row in rows))
    return plans


if __name__ == "__main__":
    main()
