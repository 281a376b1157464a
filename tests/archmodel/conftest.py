"""A small wall with known numbers, and databases to put it in."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from archmodel.database.session import Database, open_database
from archmodel.store.stone_record import StoneRecord
from tests.archmodel.reused_databases import Recycled
from tests.archmodel.stones import box_stone, store
from tests.postgresql import Server

WALL = (
    box_stone("W01-01", "header", course=1, size=(0.3, 0.5, 0.25), at=(0.0, 0.0, 0.0)),
    box_stone("W01-02", "stretcher", course=1, size=(0.8, 0.38, 0.25), at=(0.3, 0.0, 0.0)),
    box_stone("W02-01", "jamb", course=2, size=(0.5, 0.45, 0.25), at=(0.0, 0.0, 0.25)),
    box_stone("V1", "springer", course=None, size=(0.4, 0.45, 0.3), at=(1.0, 0.0, 1.0)),
    box_stone("V2", "voussoir", course=None, size=(0.2, 0.42, 0.3), at=(1.4, 0.0, 1.1)),
    box_stone("V3", "keystone", course=None, size=(0.2, 0.42, 0.32), at=(1.6, 0.0, 1.2), rejected=(2, 5)),
    box_stone("R1", "rubble", course=None, size=(0.2, 0.3, 0.2), at=(3.0, 0.0, 0.0)),
)


@pytest.fixture
def wall() -> tuple[StoneRecord, ...]:
    return WALL


@pytest.fixture(scope="session")
def recycled(postgresql: Server) -> Iterator[Recycled]:
    """Databases of the server, laid out and empty."""
    with ExitStack() as held:
        yield Recycled(postgresql, held)


@pytest.fixture
def new_database(
    backend: str, request: pytest.FixtureRequest, tmp_path: Path
) -> Iterator[Callable[[], Database]]:
    """A function that gives databases that are laid out and empty."""
    with ExitStack() as held:
        if backend == "sqlite":
            files = iter(("moma.db", *(f"moma{number}.db" for number in range(1, 100))))
            yield lambda: held.enter_context(open_database(f"sqlite:///{tmp_path / next(files)}"))
        else:
            pool: Recycled = request.getfixturevalue("recycled")
            yield lambda: held.enter_context(open_database(held.enter_context(pool.url())))


@pytest.fixture
def empty(new_database: Callable[[], Database]) -> Database:
    return new_database()


@pytest.fixture
def filled(empty: Database) -> Database:
    store(empty, WALL, "window")
    return empty
