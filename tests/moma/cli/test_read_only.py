"""Commands on a file system that cannot be written, in a mount namespace of their own."""

import shutil
import sqlite3
import subprocess
import sys

import pytest

from archmodel.database.session import open_database
from archmodel.store.stones import store_survey
from ground.errors import DatabaseError
from tests.archmodel.stones import SHA, box_stone, contents, store
from tests.paths import ROOT


def mounted(folder, *command):
    """Run a command of MOMA with a folder mounted read-only."""
    script = 'mount --bind "$0" "$0" && mount -o remount,bind,ro "$0" && exec "$@"'
    return subprocess.run(
        ["unshare", "-rm", "sh", "-c", script, str(folder), *map(str, command)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture
def shelf(tmp_path):
    """A folder with a database of two stones."""
    shelf = tmp_path / "a shelf"
    shelf.mkdir()
    store(f"sqlite:///{shelf / 'moma.db'}", [box_stone("A"), box_stone("B")])
    if shutil.which("unshare") is None or mounted(shelf, "true").returncode != 0:
        pytest.skip("this system lets nobody mount")
    return shelf


def moma(shelf, *words):
    return mounted(shelf, sys.executable, "-m", "moma", *words, "--db", f"sqlite:///{shelf / 'moma.db'}")


def test_a_database_that_can_only_be_read_is_queried_and_its_change_refused(shelf):
    asked = moma(shelf, "query", "entity", "--columns", "code", "--format", "csv")
    assert asked.returncode == 0, asked.stderr
    assert asked.stdout.split() == ["code", "A", "B"]
    survey = ROOT / "data/samples/window/window.moma"
    refused = moma(shelf, "ingest", survey)
    assert refused.returncode == 1
    lines = [line for line in refused.stderr.splitlines() if not line.startswith("moma: [")]
    assert len(lines) == 1
    assert "the database cannot be written" in lines[0]


def test_an_export_into_a_folder_that_can_only_be_read_is_refused_in_one_line(shelf):
    refused = moma(shelf, "export", shelf / "wall.json")
    assert refused.returncode == 1
    (line,) = refused.stderr.splitlines()
    assert line == (
        f"moma: error: {shelf / 'wall.json'}: it cannot be written: Read-only file system; "
        "name a file in another folder"
    )
    for command in (("import", ROOT / "tests/none.json"), ("run", ROOT / "docs/howto/query/arch.toml")):
        other = mounted(
            shelf, sys.executable, "-m", "moma", *command, "--db", f"sqlite:///{shelf / 'new.db'}"
        )
        assert other.returncode in (1, 2)
        assert len(other.stderr.splitlines()) == 1, other.stderr


def test_rows_in_the_log_of_a_database_are_read_or_it_is_refused(shelf):
    file = shelf / "moma.db"
    with sqlite3.connect(file) as writer:  # its log stays beside the file as long as it is open
        writer.execute("update entity set code = 'C' where code = 'B'")
        writer.commit()
        assert (shelf / "moma.db-wal").stat().st_size > 0
        asked = moma(shelf, "query", "entity", "--columns", "code", "--format", "csv")
    assert (asked.returncode, asked.stdout.split()) == (0, ["code", "A", "C"]), asked.stderr


def test_without_the_right_to_write_its_folder_a_database_can_be_read(tmp_path, monkeypatch):
    url = f"sqlite:///{tmp_path / 'moma.db'}"
    with open_database(url) as database:
        store(database, [box_stone("A")])
        before = contents(database)
    monkeypatch.setattr("archmodel.database.sqlite.os.access", lambda *_: False)
    with open_database(url, create=False) as database:
        assert contents(database) == before

        def write():
            with database.session() as session:
                store_survey(session, "more", "more.moma", SHA[::-1], [box_stone("B")])

        with pytest.raises(DatabaseError, match="cannot be written"):
            write()


@pytest.mark.parametrize(
    "words",
    [("sample", "window", "--out"), ("survey-report", ROOT / "data/samples/window/window.moma", "--out")],
)
def test_a_full_disk_ends_a_command_in_one_line_and_leaves_nothing(shelf, words):
    script = 'mount -t tmpfs -o size=24k tmpfs "$0" && "$@"; code=$?; ls -A "$0"/*; exit $code'
    command = [sys.executable, "-m", "moma", *map(str, words), str(shelf / "out")]
    done = subprocess.run(
        ["unshare", "-rm", "sh", "-c", script, str(shelf), *command],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    line, *_ = [one for one in done.stderr.splitlines() if one.startswith("moma: error")]
    assert line == f"moma: error: {shelf / 'out'}: the disk is full; make room on it and try again"
    assert done.stdout.split() == []
