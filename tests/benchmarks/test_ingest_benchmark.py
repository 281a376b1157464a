"""The benchmark of surveys runs on a small wall, and what it counts is what it wrote."""

import json
import subprocess
import sys

import pytest

from benchmarks.ingest import measured, write
from tests.paths import ROOT


def test_a_stage_counts_the_stones_and_finds_the_blunders(tmp_path):
    write(tmp_path / "1.moma", 400)
    found = measured("read, fit, extrude", "moma", str(tmp_path / "1.moma"))
    assert (found["stones"], found["points"]) == (400, 5600)
    # 2 points of every tenth stone and a corner of every twentieth are wrong: 100; and 0.1 % of the others are lost
    assert 97 <= found["rejected"] <= 100 + 20
    assert found["seconds"] > 0


def rows(*options):
    command = [sys.executable, "-m", "benchmarks.ingest", *map(str, options), "--json"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_all_stages_run_and_say_their_costs():
    found = rows("--stones", 700)
    wall = [row for row in found if row["stage"] not in ("simplify", "close joints")]
    assert len(wall) == 11
    assert {row["stones"] for row in wall} == {700, 1400}
    for row in found:
        assert row["us_per_stone"] > 0
    for row in wall[:7]:
        assert row["points"] == 14 * row["stones"]
    last = found[-1]
    assert last["stage"] == "close joints"
    # a stone of a running bond touches six others or fewer
    assert 1.5 * last["stones"] < last["joints"] < 3.0 * last["stones"]
    assert last["open"] == 0
    assert last["moved_mm"] < 80.0


@pytest.mark.slow
def test_memory_of_a_document_does_not_grow_with_the_building():
    """Ten times the stones: documents of 2 and 20 MB, and less than 10 MB between them."""
    stages = ("--only", "ingest into SQLite", "export")
    small, large = (rows("--stones", stones, *stages)[-1] for stones in (500, 5000))
    assert large["file_mb"] > 8 * small["file_mb"]
    assert large["memory_mb"] - small["memory_mb"] < 10
