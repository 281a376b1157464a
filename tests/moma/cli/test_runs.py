"""`moma runs`: what it prints, as tables and as JSON, and its errors."""

import pytest

from archmodel.database.session import open_database
from archmodel.store.runs import store_run
from archmodel.store.stones import store_survey
from tests.archmodel.stones import SHA, box_stone, run_record
from tests.moma.commands import answer, fails, invoke, prints


@pytest.fixture
def url(tmp_path):
    url = f"sqlite:///{tmp_path / 'moma.db'}"
    with open_database(url) as database, database.session() as session:
        store_survey(session, "wall", "wall.moma", SHA, [box_stone("A"), box_stone("B")])
        store_run(session, run_record({"A": 1e5, "B": 2e5}))
        store_run(session, run_record({"A": 4e5, "B": 2e5}, scene="again"))
    return url


def test_all_runs_are_listed(url):
    text = prints("runs", "--db", url)
    lines = text.splitlines()
    assert len(lines) == 4
    assert lines[0].split()[:4] == ["run", "scene", "stored_at", "outcome"]
    assert [line.split()[1] for line in lines[2:]] == ["window", "again"]
    told = answer("runs", "--db", url)
    assert [(one["run"], one["stones"]) for one in told] == [(1, 2), (2, 2)]


def test_one_run_is_told_in_full(url):
    text = prints("runs", 1, "--db", url)
    assert "largest Von Mises stresses" in text
    assert "scene file" not in text
    assert "joints" not in text  # none are kept of it
    assert 'name = "window"' in invoke("runs", 1, "--db", url, "-v").stdout
    told = answer("runs", 1, "--db", url)
    assert [row["code"] for row in told["largest_stresses"]] == ["B", "A"]
    assert told["versions"] == {"moma": "0.1.0"}


def test_two_runs_are_compared(url):
    text = prints("runs", 2, "--against", 1, "--db", url)
    assert "largest changes of Von Mises stress" in text
    assert "displacement" not in text  # they are equal
    told = answer("runs", 2, "--against", 1, "--db", url)
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
    assert said in fails(2, "runs", *words, "--db", url)
