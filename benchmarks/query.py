"""A building of many stones asked: `python -m benchmarks.query [--stones N] [--db URL…] [--plans] [--json]`.

N stones with their relations, phases, mason marks, and twelve runs with results of every stone, in a database that is
made for it: a file, and on PostgreSQL where a server can be started. Each row is a process of its own. See
benchmarks/README.md for what the columns mean.
"""

import argparse
import json
import math
import os
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection, event, select, text
from sqlalchemy.orm import Session

from archmodel.assertions.declare import declare_phase
from archmodel.assertions.statements import say_mason_mark, say_of_phase
from archmodel.database.session import Database, open_database
from archmodel.describe.runs import describe_run
from archmodel.describe.trace import trace
from archmodel.query.api import find
from archmodel.relations.load_paths import load_path
from archmodel.store.find_by_code import Subjects
from archmodel.store.run_record import Columns, ErrorMeasures, RunRecord, StoneResult
from archmodel.store.runs import store_run
from archmodel.store.stone_record import StoneRecord
from archmodel.store.stones import store_survey
from archmodel.tables.entities import Entity
from archmodel.tables.entries import new_entry
from archmodel.tables.relations import Relation
from benchmarks.report import Row, alone, columns, guarded, options_of, peak_bytes, progress, show
from mechanics.arrays import Array, Ints
from moma.cli.text.query import Question as Query
from moma.cli.text.query import answer
from pipelines.ingest.relate import relate
from tests.postgresql import Unavailable, running_server

_BUILT = columns(
    "database database | what stored | seconds processor, s :.3g | memory_mb memory it took, MB :.3g"
)
_ASKED = columns(
    "database database | what asked | rows found :d | cold first time, ms :.3g | warm again, ms :.3g | "
    "used processor, ms :.3g | target meant, ms :.3g"
)
COURSES = 100
RUNS = 12
_HEIGHT, _GAP, _POINTS = 0.29, 0.01, 10
_ARCH_STONES = 15
_EVERY = 2000  # stones for each arch
_REPEATS = 9

Ask = Callable[[Session, int], int]
Step = Callable[[Database, int], None]


def main() -> None:
    """Make the building in every database, ask it everything, print."""
    parser = options_of("query", __doc__)
    parser.add_argument("--stones", type=int, default=100_000, help="stones of the building (100000)")
    parser.add_argument("--db", nargs="+", metavar="URL", help="empty databases to fill instead")
    parser.add_argument("--plans", action="store_true", help="print how the database answers each question")
    options = parser.parse_args()
    stored: list[Row] = []
    found: list[Row] = []
    with ExitStack() as held:
        for name, url in _databases(options, held):
            for step in STEPS:
                progress(f"{name}: {step}")
                stored.append({"database": name, "what": step} | alone(built, url, step, options.stones))
            for key, question in QUESTIONS.items():
                progress(f"{name}: {question.words}")
                row: Row = {"database": name, "what": question.words, "target": question.target}
                found.append(row | alone(asked, url, key, options.stones))
    if options.json:
        show([*stored, *found], as_json=True)
        return
    show(stored, _BUILT, as_json=False)
    show(found, _ASKED, as_json=False)
    for row in found if options.plans else ():
        print(f"\n{row['database']}: {row['what']}")
        print("\n--\n".join(row["plans"]))


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


# --- what is asked, and what it costs ---


def built(url: str, step: str, count: int) -> Row:
    """Return what a step of making a building of so many stones costs."""
    with open_database(url) as database:
        with database.engine.connect() as connection:
            clock = _processor_clock(connection)
        before, start = peak_bytes(), clock()
        STEPS[step](database, count)
        seconds = clock() - start
        with database.engine.connect().execution_options(moma_read_only=False) as connection:
            connection.execute(text("ANALYZE"))
            connection.commit()
    return {"seconds": seconds, "memory_mb": (peak_bytes() - before) / 1e6}


def _processor_clock(connection: Connection) -> Callable[[], float]:
    """A clock [s] for what is asked through this connection.

    The server's part has a resolution of 10 ms, so ask often; it is zero where the server is on another machine.
    """
    if connection.dialect.name == "sqlite":  # works within this process
        return time.process_time
    number = connection.exec_driver_sql("SELECT pg_backend_pid()").scalar_one()
    server = Path(f"/proc/{number}/stat")
    tick = os.sysconf("SC_CLK_TCK")

    def clock() -> float:
        if not server.exists():
            return time.process_time()
        user, system = server.read_text().rpartition(")")[2].split()[11:13]
        return time.process_time() + (int(user) + int(system)) / tick

    return clock


def asked(url: str, name: str, count: int) -> Row:
    """Return what a question costs at first, and the median of several; and how the database goes about it."""
    with open_database(url) as database:
        return _asked(database, name, count)


def _asked(database: Database, name: str, count: int) -> Row:
    ask, times, found = QUESTIONS[name].ask, [], 0
    clock, before = time.process_time, 0.0
    for repeat in range(_REPEATS + 1):
        if repeat == 1:
            with database.engine.connect() as connection:  # the one that the pool will give again
                clock = _processor_clock(connection)
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
    """Return the plan by which the database answers each statement."""
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


@dataclass(frozen=True)
class Question:
    """Question, and the time within which it should be answered [ms]; None: no matter."""

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


# --- the stones: a wall in running bond of headers and stretchers, and free arches before it ---


def _store_stones(database: Database, count: int) -> None:
    """Take them in as one survey."""
    with database.session() as session:
        store_survey(session, "building", "building.moma", f"{count:064x}", _stones(count))


def _stones(count: int) -> Iterator[StoneRecord]:
    rng = np.random.default_rng(5)
    arches = count // _EVERY
    in_wall = count - arches * _ARCH_STONES
    for number in range(in_wall):
        course, place = divmod(number, in_wall // COURSES)
        header = (place + course) % 2 == 0
        x = 0.45 * place + (0.15 if header else 0.0)
        length = 0.29 if header else 0.59
        low, high = (_HEIGHT + _GAP) * course, (_HEIGHT + _GAP) * course + _HEIGHT
        face = np.array([[x, 0, low], [x + length, 0, low], [x + length, 0, high], [x, 0, high]])
        depth = float(rng.uniform(0.5, 0.7) if header else rng.uniform(0.25, 0.35))
        code = f"W{course + 1}-{place + 1}"
        yield _stone(rng, code, "header" if header else "stretcher", course + 1, face, depth)
    for arch in range(arches):
        yield from _arch(rng, arch)


def _arch(rng: np.random.Generator, arch: int) -> Iterator[StoneRecord]:
    """A semicircle of stones, 10 m before the wall, joints of 10 mm."""
    bounds = np.linspace(math.pi, 0.0, _ARCH_STONES + 1)
    for place, (left, right) in enumerate(pairwise(bounds.tolist())):
        left, right = left - 0.004, right + 0.004
        directions = np.array(
            [[math.cos(angle), 0.0, math.sin(angle)] for angle in (left, right, right, left)]
        )
        face = directions * np.array([1.0, 1.0, 1.4, 1.4])[:, None] + [4.0 * arch, -10.0, 0.0]
        last = place in (0, _ARCH_STONES - 1)
        kind = "springer" if last else "keystone" if place == _ARCH_STONES // 2 else "voussoir"
        yield _stone(rng, f"A{arch + 1}-{place + 1}", kind, None, face, 0.45)


def _stone(
    rng: np.random.Generator, code: str, kind: str, course: int | None, face: Array, depth: float
) -> StoneRecord:
    """A prism behind a face (4, 3) that is seen from the side of negative y."""
    middle = face.mean(axis=0)
    points = middle + rng.uniform(-0.1, 0.1, (_POINTS, 3)) * [1.0, 0.02, 1.0]
    return StoneRecord(
        code=code,
        kind=kind,
        course=course,
        line=1,
        vertices=face,
        points=points,
        sigma=0.003,
        normal=np.array([0.0, -1.0, 0.0]),
        offset=-float(middle[1]),
        centroid=middle,
        axes=np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
        covariance=np.diag([4e-6, 9e-6, 1e-6]),
        rms=0.002,
        redundancy=_POINTS - 3,
        rejected=(),
        outline=face,
        depth=depth,
        depth_sigma=0.03,
        depth_source="rule of the benchmark",
        solid_vertices=np.vstack([face, face + np.array([0.0, depth, 0.0])]),
        solid_faces=((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
        vertex_sigma=np.full((8, 3), 0.003),
        length=float(np.ptp(face[:, 0])),
        height=float(np.ptp(face[:, 2])),
        area=float(np.ptp(face[:, 0]) * np.ptp(face[:, 2])),
        zone="wall" if course is not None else "arches",
    )


# --- what follows from them, and what is known besides ---


def _relate(database: Database, count: int) -> None:
    """Relations, courses and arches from the geometry."""
    with database.session() as session:
        relate(session)


def _store_knowledge(database: Database, count: int) -> None:
    """Phases of the lowest 90 courses, a third each; a mason mark on every 19th stone."""
    with database.session() as session:
        entry = new_entry(session, "declaration", "the benchmark")
        for phase in (1, 2, 3):
            declare_phase(session, entry, str(phase), 1200 + 100 * phase, 1250 + 100 * phase)
            low, high = 30 * phase - 29, 30 * phase
            numbers = session.scalars(select(Entity.id).where(Entity.course.between(low, high))).all()
            say_of_phase(session, entry, Subjects(tuple(numbers)), str(phase))
        numbers = session.scalars(select(Entity.id).where(Entity.id % 19 == 3)).all()
        for sign in range(5):
            say_mason_mark(session, entry, Subjects(tuple(numbers[sign::5])), f"sign {sign + 1}")


def _store_results(database: Database, count: int) -> None:
    """Runs with results of all stones; the last with its joints, and four contact points in each."""
    rng = np.random.default_rng(6)
    with database.session(read_only=True) as session:
        codes = list(session.scalars(select(Entity.code).order_by(Entity.id)))
        pairs = _touching(session)
    for run in range(1, RUNS + 1):
        stresses, values = rng.lognormal(12.0, 1.2, count).tolist(), rng.random((count, 3)).tolist()
        results = tuple(
            StoneResult(
                code,
                "deformable",
                stress / 2,
                stress,
                stress / 4,
                1e-5 * more[0],
                2e3 * more[1],
                _values(more),
            )
            for code, stress, more in zip(codes, stresses, values, strict=True)
        )
        record = RunRecord(
            scene="benchmark",
            scene_text='[scene]\nname = "benchmark"\n',
            outcome="equilibrium",
            summary={},
            versions={"moma": "benchmark"},
            results=results,
            errors=ErrorMeasures(1e-7, 1e-9, 1e-6, 1e-7, 1e-6),
            joints=_joints(pairs, rng) if run == RUNS else None,
            contacts=_contacts(pairs, rng) if run == RUNS else None,
        )
        with database.session() as session:
            store_run(session, record)


def _values(more: list[float]) -> dict[str, float]:
    return {"joint_pressure": 1e5 * more[0], "joint_kern": 2.0 * more[1], "joint_opening": 1e-4 * more[2]}


def _touching(session: Session) -> Ints:
    """(n, 2) pairs of stones that have a joint, as indices from 0."""
    rows = session.execute(
        select(Relation.subject_id, Relation.object_id).where(Relation.kind.in_(("rests_on", "beside")))
    )
    numbers = np.array([tuple(row) for row in rows], dtype=np.int64).reshape(-1, 2)
    return numbers - 1  # in a new database stones are numbered from 1


def _joints(pairs: Ints, rng: np.random.Generator) -> Columns:
    count = len(pairs)
    names = "area force_normal force_shear pressure_mean pressure_max friction_use slipping open gap opening sliding"
    return {
        "first": pairs[:, 0],
        "second": pairs[:, 1],
        **_vectors("", rng.random((count, 3))),
        **_vectors("n", np.tile([0.0, 0.0, 1.0], (count, 1))),
        "parted": np.zeros(count, dtype=bool),
        "kern": np.where(rng.random(count) < 0.1, np.nan, 2.0 * rng.random(count)),
        **{name: rng.random(count) for name in names.split()},
        "width": np.full(count, np.nan),
    }


def _vectors(prefix: str, values: Array) -> dict[str, Array]:
    """Return the components of vectors (n, 3) by the names of their columns."""
    return {f"{prefix}{axis}": column for axis, column in zip("xyz", values.T, strict=True)}


def _contacts(pairs: Ints, rng: np.random.Generator) -> Columns:
    count = 4 * len(pairs)
    return {
        "candidate": np.repeat(pairs[:, 0], 4),
        "antagonist": np.repeat(pairs[:, 1], 4),
        "joint": np.arange(count) // 4,
        **_vectors("", rng.random((count, 3))),
        **_vectors("n", np.tile([0.0, 0.0, 1.0], (count, 1))),
        **_vectors("f", rng.random((count, 3))),
        **{name: rng.random(count) for name in ("area", "gap", "opening", "slide")},
        "status": np.array(["stick", "slip", "open"])[rng.integers(0, 3, count)],
    }


STEPS: Mapping[str, Step] = {
    "stones": _store_stones,
    "relations": _relate,
    "knowledge": _store_knowledge,
    f"{RUNS} runs": _store_results,
}


if __name__ == "__main__":
    guarded(main)
