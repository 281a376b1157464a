"""Single-table or joined inheritance, measured: `python -m benchmarks.inheritance [--entities N] [--json]`.

The same entities in four layouts of tables, on SQLite and, where a server can be started, on PostgreSQL. What came out
is in docs/design/architectural-model.md.
"""

import argparse
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Engine, create_engine, func, insert, select, text
from sqlalchemy.orm import Session

from archmodel.store.bulk import batches
from archmodel.tables.entities import kinds, own_attributes
from archmodel.tables.hierarchy import kind_chain, kind_of
from benchmarks.inheritance_layouts import COMMON, LAYOUTS, Layout, make_layout
from benchmarks.processor import processor_clock
from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from tests.postgresql import Unavailable, running_server

__all__ = ["main"]

_REPEATS = 5  # of a question, at least
_LEAST = 0.3  # and for so long [s]
# parts of a building; the rest is stretchers
_KINDS = {
    "header": 0.30,
    "voussoir": 0.16,
    "keystone": 0.01,
    "springer": 0.02,
    "jamb": 0.05,
    "lintel": 0.02,
    "quoin": 0.03,
    "corbel": 0.02,
    "rib_segment": 0.04,
    "shaft": 0.02,
    "rubble": 0.05,
}
_TABLE: Table = (
    ("database", "database", ""),
    ("layout", "layout", ""),
    ("insert", "insert, s", ".3g"),
    ("size", "size, MB", ".3g"),
    ("own_indexed", "headers by tail_length, indexed, ms", ".3g"),
    ("own", "voussoirs by rank, not indexed, ms", ".3g"),
    ("common", "headers by depth, ms", ".3g"),
    ("general", "ashlars by depth, ms", ".3g"),
    ("everything", "100 entities with all attributes, ms", ".3g"),
    ("objects", "5,000 voussoirs as objects, ms", ".3g"),
    ("mixed", "5,000 of all kinds as objects, ms", ".3g"),
    ("rows", "rows found", ""),
)


def main() -> None:
    """Fill and ask every layout on every database, print."""
    options = _options()
    rows: list[Row] = []
    with ExitStack() as held:
        for database, urls in _databases(held):
            for name in LAYOUTS:
                progress(f"{database}, {name}")
                rows.append(
                    {"database": database, "layout": name} | _measure(next(urls), name, options.entities)
                )
    if options.json:
        print_json(rows)
        return
    print(f"{machine()}; {environment('SQLAlchemy', 'psycopg')}\n")
    print_table(rows, _TABLE)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.inheritance", description=__doc__)
    parser.add_argument("--entities", type=int, default=100_000, help="how many (100000)")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each row")
    return parser.parse_args()


def _databases(held: ExitStack) -> Iterator[tuple[str, Iterator[str]]]:
    """Each kind of database, and URLs of empty ones."""
    folder = Path(held.enter_context(tempfile.TemporaryDirectory(prefix="moma-inheritance-")))
    yield "SQLite", (f"sqlite:///{folder / str(number)}.db" for number in range(len(LAYOUTS)))
    try:
        server = held.enter_context(running_server())
    except Unavailable as reason:
        progress(f"no PostgreSQL: {reason}")
        return
    yield "PostgreSQL", (held.enter_context(server.database()) for _ in LAYOUTS)


def _measure(url: str, name: str, count: int) -> Row:
    layout = make_layout(name)
    with _engine(url) as engine:
        layout.metadata.create_all(engine)
        tables = _tables(layout, list(_entities(count)))
        with engine.begin() as connection:
            clock = processor_clock(connection)
            start = clock()
            for table, rows in tables:
                for batch in batches(rows):
                    connection.execute(insert(table), batch)
            row: Row = {"insert": clock() - start}
        row["size"] = _size(engine) / 1e6
        with engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
            connection.execute(text("ANALYZE"))
        found = {}
        for question, ask in _QUESTIONS.items():
            row[question], found[question] = _time(engine, partial(ask, layout, count))
    return row | {"rows": " ".join(str(found[question]) for question in _QUESTIONS)}


@contextmanager
def _engine(url: str) -> Iterator[Engine]:
    engine = create_engine(url.replace("postgresql://", "postgresql+psycopg://"))
    try:
        yield engine
    finally:
        engine.dispose()


def _time(engine: Engine, ask: Callable[[Session], int]) -> tuple[float, int]:
    """Milliseconds of processor for a question, warm, each time in a new session; and how many rows it found."""
    with engine.connect() as connection:
        clock = processor_clock(connection)
        with Session(connection) as session:
            found = ask(session)
        repeats, start = 0, clock()
        while repeats < _REPEATS or clock() - start < _LEAST:
            with Session(connection) as session:
                ask(session)
            repeats += 1
        return 1e3 * (clock() - start) / repeats, found


def _size(engine: Engine) -> float:
    with engine.connect() as connection:
        if engine.dialect.name == "sqlite":
            pages = connection.scalar(text("PRAGMA page_count"))
            return float(pages or 0) * float(connection.scalar(text("PRAGMA page_size")) or 0)
        return float(connection.scalar(select(func.pg_database_size(func.current_database()))) or 0)


# --- the entities ---


def _entities(count: int) -> Iterator[dict[str, Any]]:
    """Every attribute of every entity, kinds shuffled."""
    rng = np.random.default_rng(3)
    names = [*_KINDS, "stretcher"]
    parts = [*_KINDS.values(), 1.0 - sum(_KINDS.values())]
    for number, kind in enumerate(rng.choice(names, count, p=parts).tolist(), start=1):
        numbers = iter(rng.random(12).round(6).tolist())
        row: dict[str, Any] = {name: next(numbers) for name in COMMON if COMMON[name].__name__ == "Float"}
        row |= {"id": number, "kind": kind, "code": f"S{number}", "course": 1 + number * 100 // (count + 1)}
        row |= {"zone": "tower", "depth_source": "measured in the breach of the tower"}
        own = own_attributes(kinds()[kind]).values()
        row["own"] = {
            one.name: int(rng.integers(1, 51)) if one.unit == "-" else float(rng.random()) for one in own
        }
        yield row


def _tables(layout: Layout, entities: Sequence[dict[str, Any]]) -> list[tuple[Any, list[dict[str, Any]]]]:
    """Each table with its rows, parents first."""
    within = {kind: {kind_of(cls) for cls in kind_chain(kinds()[kind])} for kind in kinds()}
    tables = []
    for table in layout.metadata.sorted_tables:
        kept = {column.name for column in table.columns} - ({"own"} if "JSON" not in layout.name else set())
        tables.append((table, [_row(one, kept) for one in entities if table.name in within[one["kind"]]]))
    return tables


def _row(entity: dict[str, Any], kept: set[str]) -> dict[str, Any]:
    flat = {**entity["own"], **entity}
    return {name: flat.get(name) for name in kept}


# --- the questions: each fetches all that it finds ---


def _shown(cls: Any) -> list[Any]:
    return [cls.code, cls.kind, cls.course, cls.depth, cls.length, cls.height, cls.volume]


def _by_own_indexed(layout: Layout, count: int, session: Session) -> int:
    header, tail = layout.classes["header"], layout.own("header", "tail_length")
    return len(session.execute(select(*_shown(header), tail).where(tail > 0.99)).all())


def _by_own(layout: Layout, count: int, session: Session) -> int:
    voussoir, rank = layout.classes["voussoir"], layout.own("voussoir", "rank")
    return len(session.execute(select(*_shown(voussoir), rank).where(rank == 25)).all())


def _by_common(layout: Layout, count: int, session: Session) -> int:
    header = layout.classes["header"]
    return len(session.execute(select(*_shown(header)).where(header.depth > 0.99)).all())


def _by_general(layout: Layout, count: int, session: Session) -> int:
    ashlar = layout.classes["ashlar"]
    return len(session.execute(select(*_shown(ashlar)).where(ashlar.depth > 0.996)).all())


def _everything(layout: Layout, count: int, session: Session) -> int:
    """What a list of entities needs: all attributes of whatever kinds there are, without objects."""
    entity = layout.classes["entity"]
    statement = select(entity.__table__)
    if layout.is_joined:
        for cls in layout.classes.values():
            table = cls.__table__
            if table is not entity.__table__ and table.name == cls.__mapper__.polymorphic_identity:
                statement = statement.add_columns(*table.columns).outerjoin(
                    table, table.c.id == entity.__table__.c.id
                )
    middle = count // 2
    return len(session.execute(statement.where(entity.__table__.c.id.between(middle, middle + 99))).all())


def _objects(layout: Layout, count: int, session: Session) -> int:
    voussoirs = session.scalars(select(layout.classes["voussoir"]).limit(5000)).all()
    return sum(_own_of(layout, one) is not None for one in voussoirs)


def _mixed(layout: Layout, count: int, session: Session) -> int:
    entity = layout.classes["entity"]
    found = session.scalars(select(entity).where(entity.id <= 5000)).all()
    return sum(_own_of(layout, one) is not None for one in found)


def _own_of(layout: Layout, entity: Any) -> object:
    """The first of its own attributes; to load them is part of the question."""
    names = own_attributes(kinds()[entity.kind])
    if not names:
        return 0.0
    return entity.own if "JSON" in layout.name else getattr(entity, next(iter(names)))


_QUESTIONS: dict[str, Callable[[Layout, int, Session], int]] = {
    "own_indexed": _by_own_indexed,
    "own": _by_own,
    "common": _by_common,
    "general": _by_general,
    "everything": _everything,
    "objects": _objects,
    "mixed": _mixed,
}


if __name__ == "__main__":
    guarded(main)
