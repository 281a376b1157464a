import subprocess
import sys
import threading
from collections.abc import Callable
from datetime import UTC, datetime

import pytest
from sqlalchemy import func, select

from archmodel.database.session import Database, open_database
from archmodel.store.stones import store_survey
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry
from archmodel.tables.layout import SchemaVersion
from archmodel.tables.relations import Membership
from ground.errors import DatabaseError
from tests.archmodel.stones import SHA, box_stone, contents


def test_foreign_keys_are_enforced(empty: Database) -> None:
    with pytest.raises(DatabaseError, match=r"(?i)foreign key"), empty.session() as session:
        session.add(Membership(entity_id=1, structure_id=1, entry_id=1, declared=True))


def test_a_database_of_another_schema_version_is_refused(empty: Database) -> None:
    with empty.session() as session:
        session.scalars(select(SchemaVersion)).one().version = 99
    with pytest.raises(DatabaseError, match="schema version 99, this program reads version 2"):
        open_database(empty.url)


@pytest.mark.parametrize(
    "url",
    [
        *("moma.db", "", "sqlite://moma.db", "sqlite://user@host/moma.db", "sqlite:///a.db?mode=ro"),
        *("sqlite:///a\0b.db", "mysql://localhost/moma", "postgresql+psycopg2://localhost/moma"),
        *("nosuch:///moma.db", "http://[::1/moma"),
    ],
)
def test_a_wrong_url_says_how_to_write_one(url: str) -> None:
    with pytest.raises(DatabaseError, match="write sqlite:///FILE with three slashes"):
        open_database(url)


@pytest.mark.parametrize("url", ["postgresql://", "postgresql://localhost", "postgresql://localhost/a\0b"])
def test_a_url_without_a_database_says_how_to_write_one(url: str) -> None:
    with pytest.raises(DatabaseError, match="does not name a database; write postgresql://USER@HOST/NAME"):
        open_database(url)


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


def test_many_processes_can_open_one_new_database_at_once(new_url: Callable[[], str]) -> None:
    url = new_url()
    program = (
        "import sys; from archmodel.database.session import open_database\n"
        "from archmodel.store.stones import store_survey; from tests.archmodel.stones import box_stone\n"
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


def _now() -> datetime:
    return datetime.now(UTC)
