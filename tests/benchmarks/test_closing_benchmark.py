"""The benchmark of closed joints runs on small walls, and counts what it closed."""

import json
import subprocess
import sys

import pytest

from tests.paths import ROOT


def rows(*options):
    command = [sys.executable, "-m", "benchmarks.closing", *options, "--json"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_each_stage_of_each_wall_has_its_row():
    found = rows("--stones", "70", "140")
    assert [row["stage"] for row in found] == ["simplify", "close joints"] * 2
    small, large = found[:2], found[2:]
    assert 60 < small[0]["stones"] < large[0]["stones"] < 170
    for row in small:
        assert row["ratio"] == 1.0
        assert row["seconds"] > 0.0
    # a stone of a running bond touches six others or fewer
    assert 1.5 * large[1]["stones"] < large[1]["joints"] < 3.0 * large[1]["stones"]
    assert large[1]["open"] == 0
    assert large[1]["moved_mm"] < 80.0


@pytest.mark.slow
def test_stones_are_meshed_where_a_size_is_given():
    *_, row = rows("--stones", "70", "--mesh", "0.3")
    assert row["stage"] == "mesh"
    assert 30 < row["nodes"] < 400
