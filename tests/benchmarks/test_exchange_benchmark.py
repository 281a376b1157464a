"""The benchmark of building documents carries all that it made."""

import json
import subprocess
import sys

import pytest

from tests.paths import ROOT


def run(*words):
    command = [sys.executable, "-m", *map(str, words)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_what_was_made_is_carried(tmp_path):
    made = run("benchmarks.exchange_child", "make", tmp_path, 40, "")
    # for each stone itself, its measurement and three relations
    assert made["rows"] == 40 * 5
    carried = run("benchmarks.exchange_child", "export", tmp_path, 40, ".json")
    # and the entry and the survey
    assert carried["rows"] == 40 * 5 + 2
    tables = json.loads((tmp_path / "made.json").read_text())["tables"]
    assert {len(one["points"]) + len(one["vertices"]) for one in tables["measurement"]} == {14}
    assert len(tables["relation"]) == 120


@pytest.mark.slow
def test_all_stages_run_and_say_their_costs():
    rows = run("benchmarks.exchange", "--stones", 100, "--json")
    assert [row["stage"] for row in rows] == ["make", "export", "import", "export", "import"]
    for row in rows[1:]:
        assert row["rows"] == 502
        assert row["us_per_row"] > 0
        assert row["memory_mb"] >= row["before_mb"] > 0


@pytest.mark.slow
def test_memory_does_not_grow_with_the_building(tmp_path):
    """Ten times the stones: documents of 2 and 23 MB, and less than 10 MB between them."""
    peaks = {}
    for stones in (500, 5000):
        folder = tmp_path / str(stones)
        folder.mkdir()
        run("benchmarks.exchange_child", "make", folder, stones, "")
        for stage in ("export", "import"):
            found = run("benchmarks.exchange_child", stage, folder, stones, ".json")
            peaks[stage, stones] = found["memory"]
        assert found["bytes"] > 4000 * stones
    for stage in ("export", "import"):
        assert peaks[stage, 5000] - peaks[stage, 500] < 10e6
