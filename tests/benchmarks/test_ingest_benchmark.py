"""The benchmark of surveys runs on a small wall, and what it counts is what it wrote."""

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


def test_a_stage_counts_the_stones_and_finds_the_blunders(tmp_path):
    path = tmp_path / "1.moma"
    run("benchmarks.ingest_child", "write", "moma", path, 400)
    found = run("benchmarks.ingest_child", "read, fit, extrude", "moma", path, 400)
    assert (found["stones"], found["points"]) == (400, 5600)
    # 2 points of every tenth stone and a corner of every twentieth are wrong: 100; and 0.1 % of the others are lost
    assert 97 <= found["rejected"] <= 100 + 20
    assert found["seconds"] > 0


@pytest.mark.slow
def test_all_stages_run_and_say_their_costs():
    rows = run("benchmarks.ingest", "--stones", 400, "--json")
    assert len(rows) == 7
    assert {row["stones"] for row in rows} == {400, 800}
    for row in rows:
        assert row["us_per_stone"] > 0
        assert row["points"] == 14 * row["stones"]
