import builtins
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from types import ModuleType
from typing import Any

import pytest
from sqlalchemy import select, text
from sqlalchemy.exc import DBAPIError

from archmodel.database.limits import deadline
from archmodel.database.postgresql import WRITE_LOCK
from archmodel.database.session import open_database
from archmodel.store.stones import store_survey
from archmodel.tables.entities import Entity
from ground.errors import DatabaseError, MissingLibraryError
from tests.archmodel.stones import SHA, box_stone, store
from tests.postgresql import Server


@pytest.fixture
def url(postgresql: Server) -> Iterator[str]:
    with postgresql.database() as made:
        yield made


def test_the_driver_may_be_named(url: str) -> None:
    with open_database(url.replace("postgresql:", "postgresql+psycopg:")) as database:
        assert database.url == url.replace("/tmp/", "%2Ftmp%2F")
        assert database.engine.dialect.driver == "psycopg"


def test_an_empty_database_is_laid_out_or_refused(url: str) -> None:
    with pytest.raises(DatabaseError, match="the database is empty; take in a survey first"):
        open_database(url, create=False)
    open_database(url).close()
    open_database(url, create=False).close()


def test_a_database_that_is_not_there_is_to_be_made_on_the_server(postgresql: Server) -> None:
    with pytest.raises(
        DatabaseError, match=r'database "castle" does not exist.*; make it .*: createdb castle'
    ):
        open_database(postgresql.url("castle"))


def test_a_statement_that_takes_too_long_is_stopped_and_known_by_its_code(url: str) -> None:
    with open_database(url) as database:
        with database.session(read_only=True) as session, deadline(session, 0.05) as limit:
            with pytest.raises(DBAPIError) as stopped:
                session.execute(text("SELECT pg_sleep(20)"))
            assert limit.stopped(stopped.value)
            assert not limit.stopped(ValueError("statement timeout"))
        with database.session(read_only=True) as session:
            assert session.execute(text("SELECT 1")).scalar() == 1


def test_a_server_that_does_not_run_is_said_not_to_answer() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        with pytest.raises(DatabaseError, match=r"no PostgreSQL server answers \(.*refused.*\); start it"):
            open_database(f"postgresql://ada@127.0.0.1:{port}/castle")
    with pytest.raises(DatabaseError, match="no PostgreSQL server answers"):
        open_database("postgresql:///castle?host=/nowhere")


def test_a_wrong_password_is_refused_and_none_is_ever_printed(postgresql: Server, url: str) -> None:
    name = url.split("?")[0].rpartition("/")[2]
    secret = f"postgresql://guarded:abracadabra@/{name}?host={postgresql.folder}"
    with pytest.raises(DatabaseError, match="wrong user or password") as refused:
        open_database(secret)
    chain: BaseException | None = refused.value
    while chain is not None:
        assert "abracadabra" not in f"{chain} {chain!r}"
        chain = chain.__cause__
    with open_database(secret.replace("abracadabra", "open sesame")) as database:
        assert "sesame" not in f"{database.url} {database!r} {database.home.place}"
        assert "guarded:***@" in database.url
    for wrong in ("postgresql://ada:abracadabra@[::1/castle", "postgresql://ada:abracadabra@localhost"):
        with pytest.raises(DatabaseError) as refused:
            open_database(wrong)
        assert "abracadabra" not in str(refused.value)


def test_psycopg_is_asked_for_where_it_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without_psycopg(
        name: str,
        globals: Mapping[str, object] | None = None,
        locals: Mapping[str, object] | None = None,
        fromlist: Sequence[str] = (),
        level: int = 0,
    ) -> ModuleType:
        if name == "psycopg":
            raise ModuleNotFoundError("No module named 'psycopg'", name="psycopg")
        return real(name, globals, locals, fromlist, level)

    monkeypatch.setattr(builtins, "__import__", without_psycopg)
    with pytest.raises(MissingLibraryError, match=r"pip install 'moma-masonry\[postgresql\]'"):
        open_database("postgresql:///castle")


@pytest.mark.parametrize("create", [True, False])
def test_another_programs_database_is_refused_and_untouched(
    url: str, postgresql: Server, create: bool
) -> None:
    statement(postgresql, url, "CREATE TABLE photo (id integer)")
    with pytest.raises(DatabaseError, match="is not a MOMA database; name another database with --db"):
        open_database(url, create=create)
    assert statement(postgresql, url, "SELECT tablename FROM pg_tables WHERE schemaname = 'public'") == [
        ("photo",)
    ]


def test_one_who_may_not_make_tables_is_told_whom_to_ask(url: str, postgresql: Server) -> None:
    guest = url.replace("moma@", "guest@")
    with pytest.raises(DatabaseError, match=r"you may not do this .*permission denied.*; ask its owner"):
        open_database(guest)


def test_a_writer_has_the_lock_and_lets_it_go(url: str, postgresql: Server) -> None:
    held = f"SELECT count(*) FROM pg_locks WHERE locktype = 'advisory' AND objid = {WRITE_LOCK} AND granted"
    with open_database(url) as database:
        with database.session(read_only=True) as session:
            session.scalar(select(Entity.id))
            assert statement(postgresql, url, held) == [(0,)]
        with database.session() as session:
            session.scalar(select(Entity.id))
            assert statement(postgresql, url, held) == [(1,)]
        assert statement(postgresql, url, held) == [(0,)]


def test_a_writer_sees_what_was_written_while_it_waited(url: str) -> None:
    """The lock's own statement must not fix what it sees."""
    with open_database(url) as database, open_database(url) as other:
        with database.session() as session:
            store_survey(session, "a", "a.moma", SHA, [box_stone("A1")])
            program = (
                "import sys; from sqlalchemy import select; from archmodel.database.session import open_database\n"
                "from archmodel.tables.entities import Entity\n"
                "with open_database(sys.argv[1]) as d:\n"
                "    print('ready', flush=True)\n"
                "    with d.session() as s: print(s.scalars(select(Entity.code)).all())\n"
            )
            process = subprocess.Popen(
                [sys.executable, "-c", program, url], stdout=subprocess.PIPE, text=True
            )
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            with other.session(read_only=True) as reading:
                waiting = text("SELECT count(*) FROM pg_locks WHERE locktype = 'advisory' AND NOT granted")
                while reading.scalar(waiting) == 0:
                    pass
        assert process.communicate(timeout=30)[0] == "['A1']\n"


def test_a_reader_sees_one_state_throughout(url: str) -> None:
    with open_database(url) as database, database.session(read_only=True) as reading:
        assert reading.scalars(select(Entity.code)).all() == []
        store(database, [box_stone("A1")], "a")
        assert reading.scalars(select(Entity.code)).all() == []


def test_a_connection_that_the_server_ended_is_said_to_be_lost(url: str, postgresql: Server) -> None:
    with open_database(url) as database:
        with database.session() as session:
            number = session.scalar(text("SELECT pg_backend_pid()"))

        def work_while_it_is_ended() -> None:
            with database.session() as session:
                assert session.scalar(text("SELECT pg_backend_pid()")) == number
                statement(postgresql, url, f"SELECT pg_terminate_backend({number}, 5000)")
                session.scalar(select(Entity.id))

        with pytest.raises(DatabaseError, match="connection to the server was lost"):
            work_while_it_is_ended()
        with database.session() as session:  # and a new one is made
            assert session.scalar(select(Entity.id)) is None


@pytest.mark.parametrize(
    ("state", "said"),
    [
        ("53100", "the disk of the server is full; make room"),
        ("53300", "the server has too many users; try again later"),
        ("40P01", "locked by another program"),
        ("XX000", "the database refused: something; nothing was changed"),
    ],
)
def test_what_a_server_says_rarely_is_understood_too(url: str, state: str, said: str) -> None:
    """The server raises these itself, asked to."""
    failing = text(f"DO $$ BEGIN RAISE EXCEPTION 'something' USING ERRCODE = '{state}'; END $$")
    with (
        open_database(url) as database,
        pytest.raises(DatabaseError, match=said),
        database.session() as session,
    ):
        session.execute(failing)


def test_a_reader_is_patient_with_a_migration_as_long_as_was_asked(url: str, postgresql: Server) -> None:
    name = url.split("?")[0].rpartition("/")[2]
    open_database(url).close()
    with postgresql.connect(name) as migrating, open_database(url, lock_timeout=0.05) as database:
        migrating.execute("BEGIN; LOCK TABLE entity IN ACCESS EXCLUSIVE MODE")
        with pytest.raises(DatabaseError, match="locked"), database.session(read_only=True) as session:
            session.scalar(select(Entity.id))


def test_texts_are_sorted_by_code_points_whatever_the_servers_language(url: str) -> None:
    codes = ["W01", "a1", "B1", "Ä1", "_1", "b1", "A 1", "A-1", "é", "z", "1"]
    with open_database(url) as database, database.session() as session:
        store_survey(session, "a", "a.moma", SHA, [box_stone(code) for code in codes])
        assert session.scalars(select(Entity.code).order_by(Entity.code)).all() == sorted(codes)
        query = text('SELECT code::text COLLATE "default" AS c FROM entity ORDER BY c')
        assert session.scalars(query).all() != sorted(codes)  # the server's own order is another


def statement(server: Server, url: str, sql: str) -> list[tuple[Any, ...]]:
    """What the server itself says, in a connection beside."""
    with server.connect(url.split("?")[0].rpartition("/")[2]) as connection:
        cursor = connection.execute(sql.encode())
        return cursor.fetchall() if cursor.description else []
