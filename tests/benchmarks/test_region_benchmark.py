"""A region beside rigid stones: what is told of it, and that a ring around everything is everything."""

import json
import subprocess
import sys

import pytest

from tests.paths import ROOT


@pytest.mark.slow
def test_a_ring_that_takes_in_the_whole_arch_has_no_error_and_none_has_one():
    options = ["--structures", "arch", "--regions", "keystone", "--rings", "0", "99", "--json"]
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.region", *options],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    whole, none, every = json.loads(done.stdout)
    assert [row["deformable"] for row in (whole, none, every)] == [15, 1, 15]
    assert [row["outcome"] for row in (whole, none, every)] == ["equilibrium"] * 3
    assert every["unknowns"] == whole["unknowns"] > none["unknowns"]
    for name in ("mean", "p99", "max", "each", "reactions", "forces", "moved"):
        assert every[name] == pytest.approx(0.0, abs=1e-6), name
    # the thrust of the arch is another one if it is rigid
    assert none["mean"] > 5.0
