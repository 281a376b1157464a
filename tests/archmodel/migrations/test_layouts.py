"""Each version's layout stays as it was; what programs of version 1 wrote is carried over, and read."""

import gzip
import hashlib
import shutil
import sqlite3
import subprocess
import sys
from ast import literal_eval
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import MetaData, create_mock_engine, select, text
from sqlalchemy.dialects import postgresql, sqlite

from archmodel.database.session import open_database
from archmodel.exchange.reader import import_building
from archmodel.exchange.writer import write_building
from archmodel.migrations.migrate import LAYOUTS, migrate
from archmodel.query.api import find
from archmodel.tables.layout import SCHEMA_VERSION
from archmodel.tables.surveys import Measurement
from ground.errors import DatabaseError, UsageError
from tests.archmodel.migrations.next_version import connected
from tests.archmodel.stones import box_stone, store
from tests.paths import ROOT

VERSION1 = Path(__file__).with_name("version1")
# a new version gets a line; a line never changes
DIGESTS = {1: "1973ca77c03f0158", 2: "b166377f8d2be3d3"}


def digest(layout: MetaData) -> str:
    """Return a digest of the statements that lay out a database, on both kinds of databases."""
    lines: list[str] = []
    for dialect in (sqlite, postgresql):
        engine = create_mock_engine(
            f"{dialect.dialect.name}://",
            lambda one, *_, d=dialect: lines.append(str(one.compile(dialect=d.dialect()))),
        )
        layout.create_all(engine, checkfirst=False)
    return hashlib.sha256("\n".join(sorted(lines)).encode()).hexdigest()[:16]


@pytest.fixture
def old(tmp_path: Path) -> Path:
    """A database of an arch, with a run, that a program of version 1 made."""
    file = tmp_path / "arch.db"
    with gzip.open(VERSION1 / "arch.db.gz") as packed, file.open("wb") as whole:
        shutil.copyfileobj(packed, whole)
    return file


def test_every_version_has_its_layout_and_a_change_of_the_layout_takes_a_new_version():
    assert list(LAYOUTS) == list(range(1, SCHEMA_VERSION + 1))
    # in a process of its own, as kinds that other tests declare add columns to the tables of this one
    code = f"from {__name__} import LAYOUTS, digest; print({{n: digest(one) for n, one in LAYOUTS.items()}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert literal_eval(done.stdout) == DIGESTS


def test_a_database_of_version_1_is_refused_with_the_way_out_and_migrated(old: Path):
    url = f"sqlite:///{old}"
    with pytest.raises(
        DatabaseError, match=r"schema version 1, this program reads version 2; moma migrate --db "
    ):
        open_database(url)
    done = migrate(url)
    assert (done.before, done.after) == (1, 2)
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        assert len(find(session, "voussoir", ["depth > 0"])) == 17
        assert session.scalars(text("SELECT DISTINCT minimum_trace FROM entity")).all() == [None]
        assert session.scalars(select(Measurement.evidence)).all() == [[]] * 17
    assert migrate(url, 1).lost == ()
    with connected(url) as connection:
        assert connection.scalar(text("SELECT version FROM moma_schema")) == 1
        assert connection.scalar(text("SELECT count(*) FROM entity_result")) == 17


def test_the_stress_that_leads_gets_its_column_and_goes_back_among_the_further_values(old: Path):
    url = f"sqlite:///{old}"
    leads = "json_extract(\"values\", '$.von_mises_p99')"
    with connected(url) as connection:
        before = connection.execute(text('SELECT "values" FROM entity_result WHERE entity_id > 1')).all()
        mixed = {"mixed": '{"volume":2.0,"von_mises_p99":3e5}'}
        connection.execute(text('UPDATE entity_result SET "values" = :mixed WHERE entity_id = 1'), mixed)
    migrate(url)
    with connected(url) as connection:
        rows = connection.execute(
            text(f"SELECT von_mises_p99, {leads} FROM entity_result ORDER BY entity_id")
        )
        assert rows.all() == [(3e5, None)] + [(None, None)] * 16
    assert migrate(url, 1).lost == ()
    with connected(url) as connection:
        assert connection.scalar(text(f"SELECT {leads} FROM entity_result WHERE entity_id = 1")) == 3e5
        assert (
            connection.execute(text('SELECT "values" FROM entity_result WHERE entity_id > 1')).all() == before
        )


def test_what_version_1_cannot_hold_is_told_on_the_way_back(old: Path):
    url = f"sqlite:///{old}"
    migrate(url)
    with connected(url) as connection:
        connection.execute(text("UPDATE entity SET minimum_trace = 0.5 WHERE id <= 2"))
        connection.execute(text("""UPDATE measurement SET evidence = '[{"a": 1}]' WHERE id = 1"""))
    with pytest.raises(
        UsageError, match=r"minimum_trace of 2 rows of entity; evidence of 1 rows of measurement"
    ):
        migrate(url, 1)


def test_a_database_with_newer_columns_that_says_version_1_keeps_what_they_hold(tmp_path: Path):
    """Programs between both versions made these: all columns but those of the cells of disks."""
    url = f"sqlite:///{tmp_path / 'between.db'}"
    store(url, [box_stone("W01-01")])
    with connected(url) as connection:
        for column in ("spread_x", "spread_y", "a"):
            connection.execute(text(f"ALTER TABLE cell_result DROP COLUMN {column}"))
        connection.execute(text("UPDATE entity SET minimum_trace = 0.5"))
        connection.execute(text("UPDATE moma_schema SET version = 1"))
    assert migrate(url).after == 2
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        assert session.scalars(text("SELECT minimum_trace FROM entity")).all() == [0.5]


@pytest.mark.parametrize("version", [1, 2])
def test_a_layout_that_is_not_known_is_refused_before_anything_fails(old: Path, version: int):
    url = f"sqlite:///{old}"
    if version == 2:
        migrate(url)
    with closing(sqlite3.connect(old)) as connection, connection:
        connection.execute("ALTER TABLE entity DROP COLUMN length")
    with pytest.raises(DatabaseError, match=rf"layout is version {version}, but has no entity\.length"):
        migrate(url)
    if version == 2:
        with pytest.raises(
            DatabaseError, match=r"layout is version 2, but has no entity\.length; it was changed"
        ):
            open_database(url, create=False)


def test_a_document_of_version_1_is_read_as_the_migrated_database(old: Path, tmp_path: Path):
    migrate(f"sqlite:///{old}")
    documents = []
    with open_database(f"sqlite:///{tmp_path / 'read.db'}") as read:
        assert import_building(VERSION1 / "arch.json.gz", read)["entity"] == 17
        with open_database(f"sqlite:///{old}") as migrated:
            for number, database in enumerate((read, migrated)):
                path = tmp_path / f"{number}.json"
                with database.session(read_only=True) as session, path.open("wb") as file:
                    write_building(session, file)
                documents.append(path.read_bytes())
    assert documents[0] == documents[1]
