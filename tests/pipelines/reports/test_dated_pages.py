"""Pages of a day: what they show was known then, a wrong day is refused, and a server copies each day once."""

import shutil
from datetime import UTC, datetime, timedelta

import pytest

from archmodel.database import as_known as module
from archmodel.database.session import open_database
from archmodel.tables.entries import Entry
from ground.errors import UsageError
from pipelines.record.record import record
from pipelines.reports.serve.settings import ServeSettings
from pipelines.reports.view import write_view

CORRECTION = """
[record]
author = "A. Mason"
source = "seen round the corner"

[[correction]]
stones = ["V4"]
set = { code = "V4-old" }
"""


@pytest.fixture(scope="module")
def corrected(sample_database, tmp_path_factory):
    """URL of a database in which V4 got another code at the last entry; all entries before are of 1990."""
    folder = tmp_path_factory.mktemp("corrected")
    file = folder / "correction.toml"
    file.write_text(CORRECTION, encoding="utf-8")
    url = f"sqlite:///{shutil.copy(sample_database, folder / 'corrected.db')}"
    record([file], url)
    with open_database(url) as database, database.session() as session:
        for entry in session.query(Entry).filter(Entry.id <= 2):
            entry.recorded_at = datetime(1990, 5, 1, tzinfo=UTC) + timedelta(hours=entry.id)
    return url


def page(url, tmp_path, at=None):
    write_view(url, tmp_path / "page.html", "voussoir", at=at)
    return (tmp_path / "page.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("at", ["2", "1990-05-01"])
def test_a_page_shows_what_was_known_then_and_says_so(corrected, tmp_path, at):
    text = page(corrected, tmp_path, at)
    assert "as known at entry 2 of 1990-05-01" in text
    assert ">V4<" in text
    assert "V4-old" not in text


def test_a_page_of_now_says_nothing_of_a_day(corrected, tmp_path):
    text = page(corrected, tmp_path)
    assert "V4-old" in text
    assert "as known at" not in text


@pytest.mark.parametrize("at", ["99", "1989-12-31", "soon", "1990-13-01"])
def test_a_day_without_knowledge_is_refused(corrected, tmp_path, at):
    with pytest.raises(UsageError):
        page(corrected, tmp_path, at)
    assert not (tmp_path / "page.html").exists()


@pytest.fixture
def client(corrected):
    pytest.importorskip("fastapi")
    from fastapi.testclient import TestClient

    from pipelines.reports.serve.app import application

    with open_database(corrected, create=False) as database:
        app = application(database, ServeSettings())
        yield TestClient(app, base_url="http://127.0.0.1", raise_server_exceptions=False)


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore:.*httpx.*")
def test_a_server_copies_each_day_once_and_refuses_others(client, monkeypatch):
    copied = []

    def counted(session, entry, copy=module._copy_at):
        copied.append(entry)
        return copy(session, entry)

    monkeypatch.setattr(module, "_copy_at", counted)
    for at in ("2", "1990-05-01", "1990"):
        rows = client.get(f"/query?kind=voussoir&columns=code&format=json&at={at}").json()["rows"]
        assert {"code": "V4"} in rows
        assert client.get(f"/entity/V4?format=json&at={at}").json()["code"] == "V4"
    assert "as known at entry 2" in client.get("/view?kind=voussoir&at=1990").text
    assert copied == [2]
    assert client.get("/entity/V4?format=json").status_code == 404
    for at in ("99", "1989", "soon"):
        assert client.get(f"/query?at={at}").status_code in (400, 404)
        assert client.get(f"/view?at={at}").status_code in (400, 404)
    assert copied == [2]
