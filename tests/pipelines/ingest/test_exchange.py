"""A new database appears when it is complete or not at all, whatever happens on the way."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from archmodel.database.session import open_database
from ground.errors import DatabaseError, ExchangeError
from pipelines.ingest import exchange
from pipelines.ingest.exchange import export_database, import_database
from tests.archmodel.random_databases import everything, fill
from tests.paths import ROOT


@pytest.fixture
def document(tmp_path: Path) -> Path:
    """A document, in a folder of its own."""
    folder = tmp_path / "documents"
    folder.mkdir()
    with open_database(f"sqlite:///{folder / 'source.db'}") as database, database.session() as session:
        fill(session, Random(3), 3)
    export_database(f"sqlite:///{folder / 'source.db'}", folder / "building.json")
    return folder / "building.json"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    place = tmp_path / "databases"
    place.mkdir()
    return place


def test_what_was_done_is_told(document: Path, folder: Path):
    report = import_database(document, f"sqlite:///{folder / 'new.db'}")
    assert (report.path, report.database) == (str(document), f"sqlite:///{folder / 'new.db'}")
    assert report.bytes == document.stat().st_size
    assert report.rows == {
        name: len(rows) for name, rows in json.loads(document.read_bytes())["tables"].items()
    }
    assert [one.name for one in folder.iterdir()] == ["new.db"]
    with (
        open_database(report.database, create=False) as new,
        open_database(f"sqlite:///{document.parent / 'source.db'}") as source,
    ):
        assert everything(new) == everything(source)


def test_databases_of_every_kind_are_made_of_it(document: Path, folder: Path, new_url: Callable[[], str]):
    url = new_url()
    assert import_database(document, url).rows["entity"] == 3
    export_database(url, folder / "again.json")
    assert (folder / "again.json").read_bytes() == document.read_bytes()
    with pytest.raises(ExchangeError, match="it is not empty, its table entry has rows"):
        import_database(document, url)


def test_a_name_with_odd_characters_is_a_name(document: Path, folder: Path):
    odd = folder / "a b%20#ü.db"
    import_database(document, f"sqlite:///{odd}")
    assert export_database(f"sqlite:///{odd}", folder / "again.json").rows
    assert (folder / "again.json").read_bytes() == document.read_bytes()


def test_nothing_is_left_of_a_document_that_is_wrong(document: Path, folder: Path):
    document.write_bytes(document.read_bytes()[:-3])
    with pytest.raises(ExchangeError, match="it ends before"):
        import_database(document, f"sqlite:///{folder / 'new.db'}")
    assert not [*folder.iterdir()]


def test_a_missing_document_makes_no_database(folder: Path):
    with pytest.raises(ExchangeError, match=r"no\.json: it cannot be read: No such file"):
        import_database(folder / "no.json", f"sqlite:///{folder / 'new.db'}")
    assert not [*folder.iterdir()]


def test_an_empty_database_is_filled_in_place(document: Path, folder: Path):
    url = f"sqlite:///{folder / 'laid-out.db'}"
    open_database(url).close()
    inode = (folder / "laid-out.db").stat().st_ino
    whole = document.read_bytes()
    document.write_bytes(whole[:-3])
    with pytest.raises(ExchangeError):
        import_database(document, url)
    with open_database(url, create=False) as database:
        assert not any(everything(database).values())
    document.write_bytes(whole)
    assert import_database(document, url).rows["entity"] == 3
    assert (folder / "laid-out.db").stat().st_ino == inode


def test_a_database_that_somebody_else_made_meanwhile_is_left_alone(
    document: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
):
    theirs = folder / "new.db"
    real = exchange.import_building

    def slow(path: Path, database: object) -> dict[str, int]:
        theirs.write_text("theirs")
        return real(path, database)  # type: ignore[arg-type]

    monkeypatch.setattr(exchange, "import_building", slow)
    with pytest.raises(
        ExchangeError, match=r"new\.db: another process has created this database in the meantime"
    ):
        import_database(document, f"sqlite:///{theirs}")
    assert theirs.read_text() == "theirs"
    assert [one.name for one in folder.iterdir()] == ["new.db"]


def test_errors_name_the_database_that_was_asked_for(document: Path, folder: Path):
    with pytest.raises(DatabaseError) as caught:
        import_database(document, f"sqlite:///{folder / 'no' / 'new.db'}")
    assert str(caught.value).startswith(str(folder / "no" / "new.db"))


def test_there_must_be_a_database_to_export(folder: Path):
    with pytest.raises(DatabaseError, match="there is no database"):
        export_database(f"sqlite:///{folder / 'no.db'}", folder / "building.json")
    assert not [*folder.iterdir()]


def test_a_killed_import_leaves_no_database_and_the_next_one_works(document: Path, folder: Path):
    """Killed as soon as the unfinished file is there; it is not under the name that was asked for."""
    url = f"sqlite:///{folder / 'new.db'}"
    code = (
        "import os, sys, time\n"
        "from pathlib import Path\n"
        "import archmodel.exchange.store as storing\n"
        "storing.SectionStore.finish = lambda self: (print('storing', flush=True), time.sleep(60))\n"
        "from pipelines.ingest.exchange import import_database\n"
        "import_database(Path(sys.argv[1]), sys.argv[2])\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, str(document), url], cwd=ROOT, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "storing\n"
        os.kill(child.pid, signal.SIGKILL)
    assert child.returncode == -signal.SIGKILL
    assert not (folder / "new.db").exists()
    started = time.monotonic()
    assert import_database(document, url).rows["entity"] == 3
    assert time.monotonic() - started < 30
