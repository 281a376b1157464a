"""`moma serve --edit`: a page whose saves reach the database, from this machine and with the token alone."""

import numpy as np
import pytest
from sqlalchemy import select

from archmodel.database.session import open_database
from archmodel.tables.entities import Entity
from ground.errors import UsageError
from pipelines.ingest.ingest import ingest
from pipelines.ingest.outlined import mask_options
from pipelines.propose.outlines.draw import INDEX, PAGE
from pipelines.propose.outlines.editing import SAVED, IngestChoice, OutlineEditor
from pipelines.propose.outlines.features import Feature
from pipelines.propose.outlines.write import NAMES, geojson_text
from pipelines.reports.outlines.page import editor_html
from pipelines.reports.serve.serve import serve_database
from pipelines.reports.serve.settings import ServeSettings
from survey.formats.options import ReadingOptions
from tests.moma.commands import fails, prints

pytest.importorskip("fastapi")
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore:.*httpx.*")

TOKEN = {"Authorization": "Bearer secret"}
SAID = {"kind": "header", "course": 1, "evidence": "proposed from image"}


def square(code, left, width=0.5, **said):
    ring = np.array([[left, 0.0], [left + width, 0.0], [left + width, 0.3], [left, 0.3]])
    return Feature(code, ring, {**SAID, **said})


@pytest.fixture
def folder(tmp_path):
    made = tmp_path / "drawn"
    made.mkdir()
    stones = [square(f"C01-0{k + 1}", 0.51 * k) for k in range(3)]
    (made / NAMES[0]).write_text(geojson_text(stones, "outlines"), encoding="utf-8")
    (made / INDEX).write_text("{}", encoding="utf-8")
    pixels = np.full((30, 160, 3), 150, np.uint8)
    shown = [{"code": stone.code, "ring": stone.ring.tolist(), "said": dict(stone.said)} for stone in stones]
    page = editor_html("Wall", pixels, np.diag([0.01, -0.01]), np.array([0.005, 0.295]), shown, [], [])
    (made / PAGE).write_text(page, encoding="utf-8")
    return made


@pytest.fixture
def client(folder, tmp_path):
    from fastapi.testclient import TestClient

    from pipelines.reports.serve.app import application

    url = f"sqlite:///{tmp_path / 'walls.db'}"
    options = mask_options(ReadingOptions(), depth=0.3)
    ingest([folder / NAMES[0]], url, "masks", options=options)
    editor = OutlineEditor(folder, url, IngestChoice("masks", (), options))
    with open_database(url) as database:
        app = application(database, ServeSettings(token="secret"), editor)
        yield TestClient(app, base_url="http://127.0.0.1", raise_server_exceptions=False), database


def held(database):
    with database.session(read_only=True) as session:
        rows = session.execute(
            select(Entity.code, Entity.kind, Entity.hypothesis, Entity.length)
            .where(Entity.x.is_not(None))
            .order_by(Entity.code)
        )
        return {code: (kind, hypothesis, round(length, 3)) for code, kind, hypothesis, length in rows}


def test_proposals_are_hypotheses_that_corrections_supersede_and_nothing_is_forgotten(client, folder):
    asked, database = client
    assert held(database) == {f"C01-0{k}": ("header", True, 0.5) for k in (1, 2, 3)}
    by_hand = square("C01-01", 0.0, 0.4, evidence="corrected by hand")
    text = geojson_text([by_hand, square("C01-02", 0.51)], "outlines")
    answer = asked.post("/outlines", content=text, headers=TOKEN)
    assert answer.status_code == 200, answer.text
    assert answer.json()["superseded"] == ["C01-03"]
    assert "2 stones, 1 by hand, 1 proposals superseded" in answer.json()["text"]
    assert (folder / SAVED).read_text(encoding="utf-8") == text
    assert held(database) == {"C01-01": ("header", False, 0.4), "C01-02": ("header", True, 0.5)}
    history = prints("show", "C01-03", "--history", "--db", database.url)
    assert "deleted in the page" in history
    columns = ("--columns", "code,length", "--format", "csv", "--db", database.url)
    before = prints("query", "header", "--at", 1, *columns)
    assert [line.split(",")[0] for line in before.split()[1:]] == ["C01-01", "C01-02", "C01-03"]
    assert float(before.split()[1].split(",")[1]) == pytest.approx(0.5, abs=1e-6)


def test_a_save_that_cannot_be_read_changes_nothing(client, folder):
    asked, database = client
    twice = geojson_text([square("C01-01", 0.0), square("C01-01", 0.6)], "outlines")
    for content in ("{", twice):
        answer = asked.post("/outlines", content=content, headers=TOKEN)
        assert answer.status_code in (400, 503)
        assert answer.json()["error"]
    assert not (folder / SAVED).exists()
    assert len(held(database)) == 3


def test_the_page_and_its_saves_need_the_token(client):
    asked, _ = client
    assert asked.get("/outlines").status_code == 401
    assert asked.post("/outlines", content="{}").status_code == 401
    assert asked.post("/query", content="{}", headers=TOKEN).status_code == 405
    page = asked.get("/outlines", headers=TOKEN)
    assert page.status_code == 200
    assert 'data-save="outlines"' in page.text
    policy = page.headers["content-security-policy"]
    assert "connect-src 'self'" in policy
    assert "unsafe" not in policy


def test_outlines_are_edited_on_this_machine_alone(folder, tmp_path):
    url = f"sqlite:///{tmp_path / 'walls.db'}"
    with pytest.raises(UsageError, match="from outside"):
        serve_database(url, ServeSettings(host="0.0.0.0"), print, OutlineEditor(folder, url))
    with pytest.raises(UsageError, match="there is no outlines"):
        OutlineEditor(tmp_path, url)
    assert "name the folder" in fails(2, "serve", "--depth", 0.3)
