"""The server reads, and nothing else: routes, headers, token, limits, and requests of people who mean harm."""

import csv
import hashlib
import io
import json
import os
import signal
import subprocess
import sys
import time
import urllib.request
from urllib.parse import quote

import numpy as np
import pytest

from archmodel.database.session import open_database
from ground.errors import MissingLibraryError
from pipelines.reports.serve.settings import ServeSettings
from pipelines.results.table_csv import csv_text

pytest.importorskip("fastapi")
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore:.*httpx.*")

HTML = {"accept": "text/html"}


def client_of(database, **settings):
    from fastapi.testclient import TestClient

    from pipelines.reports.serve.app import application

    app = application(database, ServeSettings(**settings))
    return TestClient(app, base_url="http://127.0.0.1", raise_server_exceptions=False)


@pytest.fixture(scope="module")
def database(sample_database):
    with open_database(f"sqlite:///{sample_database}", create=False) as found:
        yield found


@pytest.fixture(scope="module")
def client(database):
    return client_of(database)


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("/", "98 entities"),
        ("/query?kind=voussoir", "V4"),
        ("/entity/V4", "History"),
        ("/runs", "Runs"),
        ("/schema", "voussoir"),
        ("/view?kind=voussoir", "moma-viewer"),
    ],
)
def test_every_page_is_there_with_a_policy_that_loads_nothing_from_elsewhere(client, address, words):
    answer = client.get(address, headers=HTML)
    assert answer.status_code == 200
    assert words in answer.text
    policy = answer.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert "http" not in policy
    for name in ("x-content-type-options", "x-frame-options", "referrer-policy", "cache-control"):
        assert name in answer.headers


def test_answers_are_those_of_the_query_language(client):
    where = "depth < 0.44 and volume > 0.065"
    rows = client.get(
        "/query", params={"kind": "voussoir", "where": where, "format": "json", "columns": "code,depth"}
    )
    assert [row["code"] for row in rows.json()["rows"]] == ["V1", "V7"]
    assert rows.json()["truncated"] is False
    text = client.get(
        "/query", params={"kind": "voussoir", "where": where, "format": "csv", "columns": "code"}
    ).text
    assert text == "code\nV1\nV7\n"
    faces = client.get("/query", params={"kind": "keystone", "format": "geojson"})
    assert faces.headers["content-type"] == "application/geo+json"
    assert [one["id"] for one in faces.json()["features"]] == ["V4"]
    told = client.get("/entity/V4?format=json").json()
    assert (told["code"], told["kind"]) == ("V4", "keystone")
    assert told["history"]


def test_solids_are_nodes_of_their_codes(client):
    import trimesh

    data = client.get("/stones.glb?kind=voussoir").content
    scene = trimesh.load(io.BytesIO(data), file_type="glb")
    assert {"V1", "V4", "V7"} <= set(scene.geometry)
    assert all(one.is_watertight for one in scene.geometry.values())


def test_the_description_of_the_interface_names_only_reading(client):
    paths = client.get("/openapi.json").json()["paths"]
    assert "/query" in paths
    assert {method for one in paths.values() for method in one} == {"get"}


def test_rows_are_limited_and_the_answer_says_so(database):
    found = client_of(database, rows=5)
    answer = found.get("/query?format=json").json()
    assert (len(answer["rows"]), answer["truncated"]) == (5, True)
    assert "the first; there are more" in found.get("/query", headers=HTML).text
    assert found.get("/view").status_code == 400
    assert found.get("/stones.glb").status_code == 400


def test_a_query_that_takes_too_long_is_stopped(database):
    found = client_of(database, seconds=1e-6)
    began = time.process_time()
    answer = found.get("/query?format=json")
    assert answer.status_code == 503
    assert "was stopped" in answer.json()["error"]
    assert time.process_time() - began < 5.0
    # the connection that was interrupted is sound for others
    assert client_of(database).get("/query?format=json").status_code == 200


def test_a_token_is_asked_of_every_request(database):
    found = client_of(database, token="s3cret")
    for headers in ({}, {"authorization": "Bearer wrong"}, {"authorization": "Basic s3cret"}):
        assert found.get("/", headers=headers).status_code == 401
    assert found.get("/openapi.json").status_code == 401
    assert found.get("/", headers={"authorization": "Bearer s3cret"}).status_code == 200
    assert found.get("/?token=s3cret").status_code == 200  # which leaves a cookie
    assert found.get("/runs").status_code == 200


def test_only_its_own_names_reach_it(database):
    found = client_of(database)
    assert found.get("/", headers={"host": "127.0.0.1:8000"}).status_code == 200
    assert found.get("/", headers={"host": "evil.example"}).status_code == 400


def test_cells_of_csv_are_no_formulas():
    texts = ["=1+1", "+1", "-1", "@cmd", "\t=1", "W01", "a=b"]
    rows = [{"code": text, "depth": -0.5} for text in texts]
    found = list(csv.reader(io.StringIO(csv_text(["code", "depth"], rows))))[1:]
    assert [row[0] for row in found] == ["'=1+1", "'+1", "'-1", "'@cmd", "'\t=1", "W01", "a=b"]
    assert {row[1] for row in found} == {"-0.5"}  # a number stays one


@pytest.mark.parametrize(
    "address", ["/", "/query?kind=voussoir&format=csv", "/stones.glb", "/runs", "/nowhere", "/static/none"]
)
def test_head_answers_as_get_without_a_body(client, address):
    got, head = client.get(address), client.head(address)
    assert (head.status_code, head.content) == (got.status_code, b"")
    assert got.content
    assert head.headers == got.headers


def test_head_needs_the_token_and_changes_answer_405_with_the_methods_there_are(database):
    guarded = client_of(database, token="swallow")
    assert guarded.head("/").status_code == 401
    assert guarded.head("/", headers={"authorization": "Bearer swallow"}).status_code == 200
    refused = guarded.delete("/")
    assert (refused.status_code, refused.headers["allow"]) == (405, "GET, HEAD")


PATHS = (
    *("/", "/query", "/entity/", "/runs/", "/schema", "/view", "/stones.glb", "/static/"),
    *("/openapi.json", "/docs"),
)
PARTS = (
    "../../../../etc/passwd", "..%2f..%2fetc%2fpasswd", "%2e%2e/%2e%2e/", "%00", "%ff%fe", "\u202e", "' OR 1=1 --",
    "'; DROP TABLE entity; --", "<script>alert(1)</script>", "{{7*7}}", "${7*7}", "%0d%0aSet-Cookie: a=b", "a" * 5000,
    "-1", "99999999999999999999", "nan", "1e400", "((((((((((" * 50, "not " * 300, "depth > 0 and " * 100 + "depth > 0",
    "file:///etc/passwd", "\\..\\..\\windows", "W01-01/../../x", "CON", "𝕬", "\ud7ff", "depth = 'x\0y'", "V4?x=y",
    "%ed%a0%80", "%c0%ae%c0%ae/", "%25252e", "exists(", "member_of(is_a(wall))", "code like '%'", "V4%23",
)  # fmt: skip
NAMES = ("kind", "where", "columns", "run", "format", "token", "x", "kind[]", "__proto__", "where")
METHODS = ("GET", "GET", "GET", "GET", "POST", "PUT", "DELETE", "PATCH", "OPTIONS", "HEAD", "TRACE", "BREW")


def hostile(client, count, seed):
    """Send requests made of parts that have broken servers before; return how often each status came."""
    random, seen = np.random.default_rng(seed), {}
    pick = lambda ones: ones[int(random.integers(len(ones)))]  # noqa: E731
    for _ in range(count):
        path = pick(PATHS) + (pick(PARTS) if random.random() < 0.6 else "")
        query = "&".join(f"{pick(NAMES)}={quote(pick(PARTS))}" for _ in range(random.integers(0, 4)))
        headers = {
            "accept": pick(("text/html", "*/*", "\x7f")),
            "x-forwarded-host": pick(PARTS)[:50].encode("ascii", "ignore").decode(),
        }
        address = quote(path, safe="/%.\\?=&") + (f"?{query}" if query else "")
        content = b"\xff\x00{" if random.random() < 0.1 else None
        answer = client.request(pick(METHODS), address, headers=headers, content=content)
        seen[answer.status_code] = seen.get(answer.status_code, 0) + 1
        assert answer.status_code < 500 or answer.status_code == 503, (address, answer.text)
        body = answer.text
        assert "root:" not in body, address
        assert "Traceback" not in body, address
        if answer.headers.get("content-type", "").startswith("text/html"):
            assert "<script>alert" not in body, address
        assert "set-cookie" not in answer.headers, address
    return seen


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_hostile_requests_break_nothing_and_change_nothing(client, sample_database):
    before, names = digest(sample_database), sorted(os.listdir(sample_database.parent))
    seen = hostile(client, 150, seed=1)
    assert {404, 405} <= set(seen)
    assert digest(sample_database) == before
    assert [one for one in sorted(os.listdir(sample_database.parent)) if one not in names] in (
        [],
        ["window.db-shm", "window.db-wal"],
    )


@pytest.mark.slow
def test_a_thousand_hostile_requests_break_nothing_and_change_nothing(client, sample_database):
    before = digest(sample_database)
    hostile(client, 1000, seed=2)
    assert digest(sample_database) == before


def test_without_its_libraries_the_command_names_the_extra(url, monkeypatch):
    from pipelines.reports.serve.serve import serve_database

    monkeypatch.setitem(sys.modules, "uvicorn", None)
    with pytest.raises(MissingLibraryError, match=r"pip install 'moma-masonry\[serve\]'"):
        serve_database(url, ServeSettings(), print)


@pytest.mark.slow
def test_the_command_serves_until_it_is_told_to_stop(url):
    command = [sys.executable, "-m", "moma", "serve", "--port", "18765", "--db", url]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        try:
            for _ in range(300):
                time.sleep(0.2)
                try:
                    with urllib.request.urlopen(
                        "http://127.0.0.1:18765/runs?format=json", timeout=5
                    ) as answer:
                        assert json.load(answer) == []
                    break
                except OSError:
                    continue
            else:
                pytest.fail("it does not answer")
            process.send_signal(signal.SIGINT)
            assert process.wait(20) in (0, 130, -2)
        finally:
            process.kill()
