"""Migrations between the layouts of this program, killed at some statement: the old layout is whole, or the new."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from sqlalchemy import event, inspect, text
from sqlalchemy.engine import Engine

from archmodel.assertions.canons import declare_canon
from archmodel.assertions.declare import declare_phase
from archmodel.assertions.opinions import decide, set_rule
from archmodel.assertions.statements import say_of_phase
from archmodel.assertions.stratigraphy import say_stratigraphy, subjects_named
from archmodel.assertions.terms import declare_term
from archmodel.database.session import open_database
from archmodel.migrations.migrate import LAYOUTS, migrate
from archmodel.store.find_by_code import subjects
from archmodel.tables.entries import new_entry
from tests.archmodel.migrations.next_version import connected, rows_of
from tests.archmodel.stones import box_stone, store

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked")


@pytest.fixture
def url(new_url: Callable[[], str]) -> str:
    """The URL of a database of version 2 with rows in the tables that version 1 lacks."""
    made = new_url()
    store(made, [box_stone("A"), box_stone("B", at=(2.0, 0.0, 0.0))])
    fill(made)
    return made


def fill(url: str) -> None:
    """State what version 1 cannot hold."""
    with open_database(url) as database, database.session() as session:
        about = subjects(session, ["A"])
        for author, phase in (("Ada", "I"), ("Ben", "II")):
            entry = new_entry(session, "declaration", "seen", author=author)
            declare_phase(session, entry, phase)
            say_of_phase(session, entry, about, phase)
        decide(session, entry, "of_phase", about, {"author": "Ada"})
        set_rule(session, entry, "of_phase", "certainty", ())
        things = subjects_named(session, ["A", "B"])
        say_stratigraphy(session, entry, [(things["A"], "cuts", things["B"])])
        declare_canon(session, entry, "header", "depth > length", 0.1)
        declare_term(session, entry, "mark", "star", labels={"de": "Stern"})


@contextmanager
def counted(at: int | None) -> Iterator[list[int]]:
    """Count statements, and the commit as one more; end this process by SIGKILL at the one of this number."""
    count = [0]

    def tick(*_: object) -> None:
        if count[0] == at:
            os.kill(os.getpid(), signal.SIGKILL)
        count[0] += 1

    for name in ("before_cursor_execute", "commit"):
        event.listen(Engine, name, tick)
    try:
        yield count
    finally:
        for name in ("before_cursor_execute", "commit"):
            event.remove(Engine, name, tick)


def killed(url: str, to: int, at: int) -> bool:
    """Migrate in a process of its own that is killed at a statement; return whether it was."""
    child = os.fork()
    if not child:
        try:
            with counted(at):
                migrate(url, to, lossy=True)
        finally:
            os._exit(0)
    return os.WIFSIGNALED(os.waitpid(child, 0)[1])


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("to", [2, 1])
def test_a_migration_killed_at_a_statement_leaves_the_old_layout_whole(url: str, to: int) -> None:
    since = 3 - to
    migrate(url, 1, lossy=True)  # Alembic makes its own table once
    migrate(url, 2)
    fill(url)
    with counted(None) as count:
        migrate(url, 1, lossy=True)
        down = count[0]
        migrate(url, 2)
        up = count[0] - down
    fill(url)
    if since == 1:
        migrate(url, 1, lossy=True)
    total = up if to == 2 else down
    before = rows_of(url, since)
    for at in (1, total // 4, total // 2, 3 * total // 4, total - 2, total - 1):  # the last is the commit
        assert killed(url, to, at), at
        assert rows_of(url, since) == before, at
        with connected(url) as connection:
            assert set(inspect(connection).get_table_names()) - {"alembic_version"} == set(
                LAYOUTS[since].tables
            ), at
            assert connection.scalar(text("SELECT version FROM moma_schema")) == since, at
    assert not killed(url, to, total)
    with connected(url) as connection:
        assert connection.scalar(text("SELECT version FROM moma_schema")) == to
    assert set(rows_of(url, to)) == set(LAYOUTS[to].tables)
