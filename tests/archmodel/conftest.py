"""A small wall with known numbers, and databases to put it in."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from archmodel.database import Database, open_database
from archmodel.records import StoneRecord
from archmodel.store import store_survey
from tests.archmodel.stones import SHA, box_stone

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


@pytest.fixture
def new_database(new_url: Callable[[], str]) -> Iterator[Callable[[], Database]]:
    """Further databases, laid out and empty, beside the fixture `empty` and of the same kind."""
    with ExitStack() as held:
        yield lambda: held.enter_context(open_database(new_url()))


@pytest.fixture
def empty(new_database: Callable[[], Database]) -> Database:
    return new_database()


@pytest.fixture
def filled(empty: Database) -> Database:
    with empty.session() as session:
        store_survey(session, "window", "window.moma", SHA, WALL)
    return empty
