"""The benchmark of meshing runs on a handful of stones, and says what it should."""

import json
import subprocess
import sys

import pytest

from tests.paths import ROOT


def run(*options):
    command = [sys.executable, "-m", "benchmarks.meshing", "--shapes", "2", *options]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout


@pytest.mark.slow
def test_each_mesher_meshes_each_shape_with_about_as_many_nodes():
    rows = json.loads(run("--stones", "3", "--json"))
    assert len(rows) == 3 * 5 + 3
    for row in rows:
        assert row["ms"] > 0
        assert 90 < row["nodes"] < 320
        assert 0 < row["jacobian"] <= row["jacobian_median"] <= 1.0 + 1e-12
        assert 0 < row["angle"] <= row["angle_median"] <= 90.0 + 1e-9
    (grid,) = (row for row in rows if row["shape"] == "box" and row["mesher"] == "grid of hexahedra")
    assert grid["angle"] == pytest.approx(90.0)
    many = [row for row in rows if row["stones"] == 3]
    assert {row["mesher"] for row in many} == {"delaunay", "gmsh", "grid of hexahedra"}
    assert all(row["seconds"] == pytest.approx(3e-3 * row["ms"]) for row in many)
    assert all(row["machine"] for row in rows)


@pytest.mark.slow
def test_the_tables_have_a_row_for_each():
    lines = [line for line in run("--stones").splitlines() if line.startswith("|")]
    assert len(lines) == 2 + 3 * 5
    assert "dihedral angle" in lines[0]
