"""Migration up and down, between version 2 and a made-up version 3."""

import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from random import Random
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from sqlalchemy import func, insert, inspect, select, text, update

from archmodel.database.session import open_database
from archmodel.migrations.migrate import migrate
from archmodel.store.stones import store_survey
from archmodel.tables.entities import Entity
from archmodel.tables.entries import new_entry
from ground.errors import DatabaseError, UsageError
from tests.archmodel.migrations import next_version
from tests.archmodel.migrations.next_version import LAYOUTS, connected, rows_of, run_alembic
from tests.archmodel.random_databases import fill
from tests.archmodel.stones import box_stone, store

NewUrl = Callable[[], str]


def differences(url: str, version: int) -> list[Any]:
    """Return where a database differs from what is declared, as Alembic finds."""
    with connected(url) as connection:
        return list(compare_metadata(MigrationContext.configure(connection), LAYOUTS[version]))


def names(url: str) -> set[tuple[str, str | None]]:
    """Return tables, indexes, keys and sequences."""
    with connected(url) as connection:
        inspector = inspect(connection)
        found: set[tuple[str, str | None]] = {(table, None) for table in inspector.get_table_names()}
        for table, _ in list(found):
            found |= {(table, one["name"]) for one in inspector.get_indexes(table)}
            found |= {(table, one["name"]) for one in inspector.get_unique_constraints(table)}
            found.add((table, inspector.get_pk_constraint(table)["name"]))
        return found | {("", name) for name in inspector.get_sequence_names()} if "postg" in url else found


@pytest.fixture
def wall(new_url: NewUrl) -> str:
    """The URL of a database of version 2 with two surveyed stones."""
    url = new_url()
    store(url, [box_stone("W01-01"), box_stone("W01-02")])
    return url


@pytest.fixture
def newest(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make version 3 the newest of the program."""
    next_version.declare(monkeypatch)


def add_photograph(url: str) -> None:
    with connected(url) as connection:
        tables = next_version.metadata.tables
        connection.execute(insert(tables["photograph"]).values(entity_id=1, path="1.jpg"))
        connection.execute(update(tables["entity"]).where(text("id = 1")).values(weathering="mossy"))


@pytest.mark.parametrize("version", [1, 2, 3])
def test_from_nothing_the_scripts_lead_to_the_declared_layout(new_url: NewUrl, version: int) -> None:
    url = new_url()
    with connected(url) as connection:
        run_alembic(connection, f"{version:04d}")
    assert differences(url, version) == []
    if version == 2:
        store(url, [box_stone("A1")], "window")


def test_indexes_and_keys_are_named_as_in_a_new_database(new_url: NewUrl, wall: str, newest: None) -> None:
    new = names(wall)
    newer = new_url()
    with connected(newer) as connection:
        run_alembic(connection, "0003")
    migrate(wall)
    assert names(wall) == names(newer)
    migrate(wall, 2)
    assert names(wall) - new == {one for one in names(wall) if one[0] == "alembic_version"}
    assert new <= names(wall)


def test_every_row_and_value_is_there_after_going_up_and_down(new_url: NewUrl, newest: None) -> None:
    url = new_url()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("archmodel.database.session.SCHEMA_VERSION", 2)
        with open_database(url) as database, database.session() as session:
            fill(session, Random(3), 5)
    before = rows_of(url, 2)
    assert all(len(rows) == 5 for name, rows in before.items() if name != "moma_schema")
    done = migrate(url)
    assert (done.before, done.after, done.lost) == (2, 3, ())
    assert differences(url, 3) == []
    up = rows_of(url, 3)
    assert (up.pop("photograph"), up["moma_schema"]) == ([], ["(3,)"])
    changed = {name for name, rows in up.items() if rows != before[name]}
    assert changed == {"moma_schema", "survey", "entity"}
    assert [one.removesuffix(", None)") for one in up["entity"]] == [one[:-1] for one in before["entity"]]
    assert migrate(url, 2).lost == ()
    assert differences(url, 2) == []
    assert rows_of(url, 2) == before


def test_an_older_database_is_refused_until_it_is_migrated(wall: str, newest: None) -> None:
    with pytest.raises(DatabaseError, match=r"schema version 2, .* reads version 3; moma migrate --db "):
        open_database(wall)
    migrate(wall)
    with open_database(wall, create=False) as database, database.session() as session:
        store_survey(session, "more", "more.moma", "ef" * 32, [box_stone("A1"), box_stone("A2")])
        session.flush()
        assert session.scalars(select(Entity.code).order_by(Entity.id)).all() == [
            *("W01-01", "W01-02", "A1", "A2")
        ]
        assert session.scalar(select(func.max(Entity.id))) == 4


def test_going_down_says_what_is_lost_and_asks_first(wall: str, newest: None) -> None:
    before = rows_of(wall, 2)
    migrate(wall)
    add_photograph(wall)
    up = rows_of(wall, 3)
    lost = r"version 2 .* cannot hold: photographs \(1\); the weathering of stones \(1\); give --yes"
    with pytest.raises(UsageError, match=lost):
        migrate(wall, 2)
    assert rows_of(wall, 3) == up
    assert migrate(wall, 2, lossy=True).lost == ("photographs (1)", "the weathering of stones (1)")
    assert rows_of(wall, 2) == before


def test_a_migration_that_fails_changes_nothing(
    wall: str, newest: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = rows_of(wall, 2)

    def fail(*arguments: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("archmodel.migrations.steps.end_layout", fail)
    with pytest.raises(ZeroDivisionError):
        migrate(wall)
    assert rows_of(wall, 2) == before
    assert differences(wall, 2) == []


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """An SQLite file of version 2 with a stone."""
    file = tmp_path / "old.db"
    store(f"sqlite:///{file}", [box_stone("W01-01")])
    return file


def test_a_copy_of_the_file_is_kept_and_replaces_none(file: Path, newest: None) -> None:
    url, before = f"sqlite:///{file}", rows_of(f"sqlite:///{file}", 2)
    earlier = file.with_name("old.db.v2.bak")
    earlier.write_text("kept by hand")
    done = migrate(url)
    assert done.backup == f"{file}.v2.2.bak"
    assert earlier.read_text() == "kept by hand"
    assert rows_of(f"sqlite:///{done.backup}", 2) == before
    assert migrate(url).backup is None  # there was nothing to do
    assert sorted(one.name for one in file.parent.glob("*.bak")) == ["old.db.v2.2.bak", "old.db.v2.bak"]


def test_a_database_with_a_broken_reference_is_refused_and_unchanged(file: Path, newest: None) -> None:
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("UPDATE measurement SET survey_id = 77")
    before = rows_of(f"sqlite:///{file}", 2)
    with pytest.raises(DatabaseError, match=r"measurement refers to a row of survey that is not there"):
        migrate(f"sqlite:///{file}")
    assert rows_of(f"sqlite:///{file}", 2) == before
    assert list(file.parent.glob("*.bak")) == []


def test_a_migration_waits_for_a_writer_no_longer_than_asked(wall: str, newest: None) -> None:
    migrate(wall)
    with open_database(wall) as database, database.session() as session:
        new_entry(session, "declaration", "a test")
        with pytest.raises(DatabaseError, match="locked by another program"):
            migrate(wall, 2, lock_timeout=0.05)


def test_what_cannot_be_migrated_is_said(new_url: NewUrl) -> None:
    url = new_url()
    with pytest.raises(DatabaseError, match=r"there is no database|the database is empty"):
        migrate(url)
    with pytest.raises(UsageError, match="version 5 of the layout is not known; name one up to 2"):
        migrate(url, 5)
    with connected(url) as connection:
        connection.execute(text("CREATE TABLE photo (id INTEGER)"))
    with pytest.raises(DatabaseError, match="is not a MOMA database"):
        migrate(url)
    newer = new_url()
    with open_database(newer) as database, database.session() as session:
        session.execute(text("UPDATE moma_schema SET version = 99"))
    with pytest.raises(
        DatabaseError, match="schema version 99, this program knows versions up to 2; install"
    ):
        migrate(newer)


PROGRAM = """
import sys
import pytest
from archmodel.migrations.migrate import migrate
from tests.archmodel.migrations.next_version import declare
declare(pytest.MonkeyPatch())
print("ready", flush=True)
sys.stdin.readline()
migrate(sys.argv[1])
"""


@pytest.mark.parametrize("part", [0.2, 0.5, 0.8])
def test_a_migration_that_is_killed_leaves_all_or_nothing(wall: str, newest: None, part: float) -> None:
    before = rows_of(wall, 2)
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, wall], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdin is not None
        assert process.stdout.readline() == "ready\n"
        process.stdin.write("\n")
        process.stdin.flush()
        time.sleep(part * 0.25)  # it takes about 0.25 s
        process.kill()
    with connected(wall) as connection:
        version = connection.execute(text("SELECT version FROM moma_schema")).scalar_one()
    assert version in (2, 3)
    if version == 2:
        assert rows_of(wall, 2) == before
        assert migrate(wall).before == 2
    assert len(rows_of(wall, 3)["measurement"]) == 2
