import os
import sqlite3
import subprocess
import sys
import threading
from datetime import UTC, datetime
from pathlib import Path

import pytest
from sqlalchemy import func, select

from archmodel.database import Database, open_database
from archmodel.entities import Entity
from archmodel.entries import Entry
from archmodel.layout import SchemaVersion
from archmodel.store import store_survey
from moma.errors import DatabaseError
from tests.archmodel.stones import SHA, box_stone, contents


def test_a_new_database_has_foreign_keys_and_a_write_ahead_log(empty: Database) -> None:
    with empty.session(read_only=True) as session:
        assert session.connection().exec_driver_sql("PRAGMA foreign_keys").scalar() == 1
        assert session.connection().exec_driver_sql("PRAGMA journal_mode").scalar() == "wal"


def test_foreign_keys_are_enforced(empty: Database) -> None:
    with pytest.raises(DatabaseError, match="FOREIGN KEY"), empty.session() as session:
        session.connection().exec_driver_sql(
            "INSERT INTO entity_result VALUES (1, 1, 'rigid', 0, 0, 0, 0, '{}')"
        )


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


def test_a_database_of_another_schema_version_is_refused(empty: Database) -> None:
    with empty.session() as session:
        session.scalars(select(SchemaVersion)).one().version = 99
    with pytest.raises(DatabaseError, match="schema version 99, this program reads version 3"):
        open_database(empty.url)


@pytest.mark.parametrize(
    "url",
    [
        "moma.db",
        "",
        "sqlite://moma.db",
        "sqlite://user@host/moma.db",
        "sqlite:///a.db?mode=ro",
        "sqlite:///a\0b.db",
        "postgresql://localhost/moma",
        "nosuch:///moma.db",
        "http://[::1/moma",
    ],
)
def test_a_wrong_url_says_how_to_write_one(url: str) -> None:
    with pytest.raises(DatabaseError, match="write sqlite:///FILE with three slashes"):
        open_database(url)


def test_a_folder_or_a_file_in_no_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DatabaseError, match="is a folder"):
        open_database(f"sqlite:///{tmp_path}")
    with pytest.raises(DatabaseError, match="there is no folder"):
        open_database(f"sqlite:///{tmp_path / 'none' / 'moma.db'}")


def test_a_database_in_memory_works_and_is_gone_when_closed() -> None:
    with open_database("sqlite://") as database, database.session() as session:
        assert session.scalar(select(func.count(Entity.id))) == 0


def test_a_locked_database_is_said_to_be_locked(empty: Database) -> None:
    impatient = open_database(empty.url, lock_timeout=0.05)
    with empty.session() as session:
        session.scalar(select(func.count(Entity.id)))  # takes the write lock
        with (
            pytest.raises(DatabaseError, match="locked by another program; wait"),
            impatient.session() as other,
        ):
            other.scalar(select(func.count(Entity.id)))
    impatient.close()


def test_a_reader_waits_for_no_writer_and_sees_the_last_commit(empty: Database) -> None:
    impatient = open_database(empty.url, lock_timeout=0.05)
    with empty.session() as session:
        store_survey(session, "a", "a.moma", SHA, [box_stone("A1")])
        with impatient.session(read_only=True) as other:
            assert other.scalar(select(func.count(Entity.id))) == 0
    with impatient.session(read_only=True) as other:
        assert other.scalar(select(func.count(Entity.id))) == 1
    impatient.close()


def test_a_reading_session_cannot_write(filled: Database) -> None:
    before = contents(filled)
    with pytest.raises(DatabaseError, match="cannot be written"), filled.session(read_only=True) as session:
        session.connection().exec_driver_sql("DELETE FROM measurement")
    assert contents(filled) == before
    with filled.session() as session:  # the same connection can write again afterwards
        session.add(Entry(action="run", source="", settings={}, version="", recorded_at=_now()))
    assert contents(filled) != before


def test_an_error_of_the_program_undoes_the_session(filled: Database) -> None:
    before = contents(filled)

    def write_and_fail() -> None:
        with filled.session() as session:
            session.add(Entry(action="run", source="", settings={}, version="", recorded_at=_now()))
            session.flush()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        write_and_fail()
    assert contents(filled) == before


def test_many_processes_can_open_one_new_database_at_once(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'moma.db'}"
    program = (
        "import sys; from archmodel.database import open_database\n"
        "from archmodel.store import store_survey; from tests.archmodel.stones import box_stone\n"
        "print('ready', flush=True); sys.stdin.readline()\n"
        "name = sys.argv[2]; database = open_database(sys.argv[1])\n"
        "with database.session() as session:\n"
        "    store_survey(session, name, name, name * 64, [box_stone(name + str(i)) for i in range(50)])\n"
    )
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", program, url, name],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for name in "abcd"
    ]
    for process in processes:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
    for process in processes:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    for process in processes:
        process.communicate(timeout=60)
    assert [process.returncode for process in processes] == [0, 0, 0, 0]
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        assert session.scalar(select(func.count(Entity.id))) == 200


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


def test_threads_can_share_a_database(empty: Database) -> None:
    errors: list[BaseException] = []

    def take_in(name: str) -> None:
        try:
            with empty.session() as session:
                store_survey(session, name, name, name * 64, [box_stone(f"{name}{i}") for i in range(20)])
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=take_in, args=(name,)) for name in "abcdef"]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    with empty.session(read_only=True) as session:
        assert session.scalar(select(func.count(Entity.id))) == 120


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_write_permission_is_named(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    try:
        with pytest.raises(DatabaseError, match="check the permissions"):
            open_database(f"sqlite:///{tmp_path / 'moma.db'}")
    finally:
        tmp_path.chmod(0o700)


def _now() -> datetime:
    return datetime.now(UTC)
