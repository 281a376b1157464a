import os
import sqlite3
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import func, select

from archmodel.database.session import Database, open_database
from archmodel.store.stones import store_survey
from archmodel.tables.entities import Entity
from ground.errors import DatabaseError
from tests.archmodel.stones import SHA, box_stone, contents


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[Database]:
    with open_database(f"sqlite:///{tmp_path / 'moma.db'}") as database:
        yield database


def test_a_new_database_has_foreign_keys_and_a_write_ahead_log(empty: Database) -> None:
    with empty.session(read_only=True) as session:
        assert session.connection().exec_driver_sql("PRAGMA foreign_keys").scalar() == 1
        assert session.connection().exec_driver_sql("PRAGMA journal_mode").scalar() == "wal"


def test_a_missing_database_is_not_made_by_a_reader(tmp_path: Path) -> None:
    file = tmp_path / "none.db"
    with pytest.raises(DatabaseError, match=r"none\.db: there is no database; take in a survey first"):
        open_database(f"sqlite:///{file}", create=False)
    assert not file.exists()


def test_an_empty_file_is_laid_out_or_refused(tmp_path: Path) -> None:
    file = tmp_path / "empty.db"
    file.touch()
    with pytest.raises(DatabaseError, match="the database is empty"):
        open_database(f"sqlite:///{file}", create=False)
    assert file.read_bytes() == b""
    open_database(f"sqlite:///{file}").close()
    open_database(f"sqlite:///{file}", create=False).close()


def test_a_file_that_is_no_database_is_refused_and_untouched(tmp_path: Path) -> None:
    file = tmp_path / "wall.moma"
    file.write_text("stone W01-01 header\n" * 100)
    with pytest.raises(
        DatabaseError, match=r"wall\.moma: is not a MOMA database; name another file with --db"
    ):
        open_database(f"sqlite:///{file}")
    assert file.read_text() == "stone W01-01 header\n" * 100
    assert os.listdir(tmp_path) == ["wall.moma"]


@pytest.mark.parametrize("create", [True, False])
def test_another_programs_database_is_refused_and_untouched(tmp_path: Path, create: bool) -> None:
    file = tmp_path / "photos.db"
    with sqlite3.connect(file) as connection:
        connection.execute("CREATE TABLE entity (id INTEGER PRIMARY KEY)")
    connection.close()
    before = file.read_bytes()
    with pytest.raises(DatabaseError, match="is not a MOMA database"):
        open_database(f"sqlite:///{file}", create=create)
    assert file.read_bytes() == before


def test_a_folder_or_a_file_in_no_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DatabaseError, match="is a folder"):
        open_database(f"sqlite:///{tmp_path}")
    with pytest.raises(DatabaseError, match="there is no folder"):
        open_database(f"sqlite:///{tmp_path / 'none' / 'moma.db'}")


def test_a_database_in_memory_works_and_is_gone_when_closed() -> None:
    with open_database("sqlite://") as database, database.session() as session:
        assert session.scalar(select(func.count(Entity.id))) == 0


def rollback_mode(database: Database) -> sqlite3.Connection:
    """A writer in a database that is just being made: laid out, not yet with its write-ahead log."""
    database.close()
    writer = sqlite3.connect(str(database.engine.url.database), isolation_level=None, check_same_thread=False)
    writer.execute("PRAGMA journal_mode = DELETE")
    writer.execute("BEGIN IMMEDIATE")
    return writer


def test_opening_waits_for_the_writer_of_a_database_that_is_just_being_made(empty: Database) -> None:
    writer = rollback_mode(empty)
    timer = threading.Timer(0.3, writer.execute, ["COMMIT"])
    timer.start()
    with open_database(empty.url) as database, database.session() as session:
        assert session.connection().exec_driver_sql("PRAGMA journal_mode").scalar() == "wal"
    timer.join()
    writer.close()


def test_opening_waits_no_longer_than_asked(empty: Database) -> None:
    writer = rollback_mode(empty)
    with pytest.raises(DatabaseError, match="locked by another program"):
        open_database(empty.url, lock_timeout=0.05)
    writer.close()


def test_a_full_disk_is_said_to_be_full_and_nothing_is_changed(empty: Database) -> None:
    before = contents(empty)

    def write_much() -> None:
        with empty.session() as session:
            session.connection().exec_driver_sql("PRAGMA max_page_count = 1")  # at most as large as it is
            store_survey(session, "a", "a.moma", SHA, (box_stone(f"A{number}") for number in range(500)))

    with pytest.raises(DatabaseError, match=r"moma\.db: the disk is full; make room"):
        write_much()
    assert contents(empty) == before


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_write_permission_is_named(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(DatabaseError, match="check the permissions"):
            open_database(f"sqlite:///{tmp_path / 'moma.db'}")
    finally:
        tmp_path.chmod(0o700)
