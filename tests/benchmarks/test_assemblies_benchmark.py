"""The benchmark of rounded assemblies runs on a small one of its own, and says what it should."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.paths import ROOT
from tests.survey.joints.assemblies import groin, obj


@pytest.mark.slow
def test_it_tells_what_snapping_and_the_run_made_of_a_file(tmp_path: Path) -> None:
    """Two courses of a groin, each a stone with two arms and two straight ones; beds slant by 0.3 rad at most."""
    path = tmp_path / "groin.obj"
    path.write_text(obj(groin(2, (0.02, 0.3)), 3))
    options = ["--case", str(path), "0.003", "0.07", "--json"]
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.assemblies", *options],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    (row,) = json.loads(done.stdout)
    assert (row["stones"], row["not_convex"], row["parts"], row["supports"]) == (6, 2, 8, 3)
    assert (row["left_open"], row["outcome"]) == (0, "equilibrium")
    assert 0.05 < row["before"] < 1.8  # mm, of rounding to a millimetre
    assert row["after"] < 1e-12
    assert row["moved"] < 1.0
    assert row["area"] == pytest.approx(1.0, abs=0.01)
    assert row["overlap"] < 1e-12
    assert row["displacement"] < 1e-6
