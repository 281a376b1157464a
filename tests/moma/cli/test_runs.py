"""`moma runs`: what it prints, as tables and as JSON, and its errors."""

import json

import pytest
from typer.testing import CliRunner

from archmodel.database.session import open_database
from archmodel.store.runs import store_run
from archmodel.store.stones import store_survey
from moma.cli import app
from tests.archmodel.stones import SHA, box_stone, run_record


@pytest.fixture
def url(tmp_path):
    url = f"sqlite:///{tmp_path / 'moma.db'}"
    with open_database(url) as database, database.session() as session:
        store_survey(session, "wall", "wall.moma", SHA, [box_stone("A"), box_stone("B")])
        store_run(session, run_record({"A": 1e5, "B": 2e5}))
        store_run(session, run_record({"A": 4e5, "B": 2e5}, scene="again"))
    return url


def invoke(*words):
    return CliRunner().invoke(app, ["runs", *map(str, words)])


def test_all_runs_are_listed(url):
    done = invoke("--db", url)
    assert done.exit_code == 0, done.output
    lines = done.stdout.splitlines()
    assert len(lines) == 4
    assert lines[0].split()[:4] == ["run", "scene", "stored_at", "outcome"]
    assert [line.split()[1] for line in lines[2:]] == ["window", "again"]
    told = json.loads(invoke("--db", url, "--json").stdout)
    assert [(one["run"], one["stones"]) for one in told] == [(1, 2), (2, 2)]


def test_one_run_is_told_in_full(url):
    done = invoke(1, "--db", url)
    assert done.exit_code == 0, done.output
    assert "largest Von Mises stresses" in done.stdout
    assert "scene file" not in done.stdout
    assert "joints" not in done.stdout  # none are kept of it
    assert 'name = "window"' in invoke(1, "--db", url, "-v").stdout
    told = json.loads(invoke(1, "--db", url, "--json").stdout)
    assert [row["code"] for row in told["largest_stresses"]] == ["B", "A"]
    assert told["versions"] == {"moma": "0.1.0"}


def test_two_runs_are_compared(url):
    done = invoke(2, "--against", 1, "--db", url)
    assert done.exit_code == 0, done.output
    assert "largest changes of Von Mises stress" in done.stdout
    assert "displacement" not in done.stdout  # they are equal
    told = json.loads(invoke(2, "--against", 1, "--db", url, "--json").stdout)
    assert told["stresses"] == [{"code": "A", "run": 4e5, "against": 1e5, "change": 3e5}]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((7,), "there is no run 7; there are 1, 2"),
        ((10**30,), "there is no run 1000000000000000000000000000000; there are 1, 2"),
        ((1, "--against", 3), "there is no run 3; there are 1, 2"),
        (("--against", 1), "--against needs a run to compare"),
    ],
)
def test_a_wrong_number_is_one_line(url, words, said):
    done = invoke(*words, "--db", url)
    assert done.exit_code == 2
    assert done.stdout == ""
    assert done.stderr.splitlines() == [done.stderr.strip()]
    assert said in done.stderr
