"""moma relate, moma load-path: what they print, and one line for every mistake."""

import pytest

from tests.moma.commands import answer, fails, invoke, prints
from tests.paths import ROOT

SAMPLE = ROOT / "data/samples/window/window.moma"


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    """A database with the sample in it, related; tests do not write into it."""
    url = f"sqlite:///{tmp_path_factory.mktemp('db') / 'window.db'}"
    prints("ingest", SAMPLE, "--db", url)
    prints("relate", "--db", url)
    return url


def table(text):
    """Rows of a table by the words of their first column."""
    return {line.split("  ")[0].strip(): line.split() for line in text.splitlines()[2:]}


def test_a_second_time_nothing_changes(database):
    done = invoke("relate", "--db", database)
    assert done.exit_code == 0
    rows = table(done.stdout)
    assert rows["rests_on"][1] == rows["rests_on"][3] == "0"
    assert int(rows["rests_on"][2]) > 150
    assert "98 stones; nothing changed" in done.stderr


def test_other_tolerances_find_other_joints(tmp_path):
    url = f"sqlite:///{tmp_path / 'window.db'}"
    invoke("ingest", SAMPLE, "--db", url)
    invoke("relate", "--db", url)
    # joints are 8 to 15 mm wide
    report = answer("relate", "--width", "0.002", "--db", url)
    assert report["relations"]["rests_on"]["superseded"] > 100
    assert report["entry"] is not None
    again = answer("relate", "--db", url)
    assert again["entry"] is None  # as last time
    wide = answer("relate", "--width", "0.04", "--db", url)
    assert wide["relations"]["rests_on"]["added"] == report["relations"]["rests_on"]["superseded"]


def test_the_load_of_the_keystone_reaches_the_ground_on_both_sides(database):
    path = answer("load-path", "V4", "--db", database)
    level = {one["code"]: one["level"] for one in path["stones"]}
    assert level["V3"] == level["V5"] == 1
    # three voussoirs and two springers on either side; the jambs W04-03 to W07-04 below them
    assert level["V1"] == level["V7"] == 3
    left = {f"W0{course}-03" for course in (8, 9)} | {"W07-03", "W06-03", "W05-04", "W04-03"}
    right = {f"W0{course}-04" for course in (8, 9)} | {"W07-04", "W06-04", "W05-05", "W04-04"}
    assert left | right <= level.keys()
    ground = {one["code"] for one in path["stones"] if one["last"]}
    # courses end at the first, at both ends of the panel
    assert all(one["course"] == 1 for one in path["stones"] if one["last"])
    assert {"W01-02", "W01-09"} <= ground


def test_it_is_a_table_for_people(database):
    done = invoke("load-path", "V4", "--db", database)
    assert done.exit_code == 0
    assert done.stdout.splitlines()[0].split() == ["level", "code", "kind", "course", "through"]
    assert done.stdout.splitlines()[2].split() == ["1", "V3", "voussoir", "V4"]
    assert "levels; it ends at W01-01" in done.stderr
    up = invoke("load-path", "V4", "--up", "--db", database)
    assert {line.split()[1][:3] for line in up.stdout.splitlines()[2:]} == {"W10", "W11", "W12"}


def test_at_an_entry_before_the_relations_there_is_no_path(database):
    done = invoke("load-path", "V4", "--at", "1", "--db", database)
    assert done.exit_code == 0
    assert done.stdout == ""
    assert "V4 is not known to rest on anything" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("load-path", "V44"), "there is no stone 'V44' in the database; did you mean V4?"),
        (("relate", "--width", "-1"), "width is -1; give it between 0 and 1"),
        (("relate", "--angle", "nan"), "angle is nan; give it between 0 and 90"),
    ],
)
def test_a_mistake_is_one_line(database, arguments, said):
    assert fails(2, *arguments, "--db", database) == f"moma: error: {said}"


def test_a_database_that_is_not_there_is_refused(tmp_path):
    done = invoke("relate", "--db", f"sqlite:///{tmp_path / 'none.db'}")
    assert done.exit_code != 0
    assert not (tmp_path / "none.db").exists()
