"""Each benchmark runs on a tiny input of its own, and says what it should."""

import importlib.util
import json
import re
import subprocess
import sys
import time

import numpy as np
import pytest

from benchmarks import fc3d, geology, lmgc90, report
from benchmarks.lmgc90 import gravity_of, traced
from benchmarks.report import columns, commit, progress, table_lines, write_between
from benchmarks.scenes import BlockScene, rigid_scenes, running_bond, write_scene
from benchmarks.siconos_child import timed
from ground.errors import UsageError
from pipelines.geology.file import read_geology
from tests.paths import ROOT

SIDES = (
    *("step", "first", "total", "sweeps", "eta", "penetration", "drift", "displacement", "balance"),
    "reaction",
)


def run(name, *options):
    return subprocess.run(
        [sys.executable, "-m", f"benchmarks.{name}", *map(str, options)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


def rows(name, *options):
    done = run(name, *options, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def scenes(tmp_path):
    """A wall of two courses."""
    write_scene(running_bond(2, 2), tmp_path / "small.npz")
    return tmp_path


def test_a_scene_is_run_and_judged(scenes):
    (row,) = rows("lmgc90", "--scenes", scenes, "--ours-only", "--steps", 4, "--tolerance", 1e-8)
    assert row["scene"] == "small"
    # two bricks on the slab and their head joint; three on them and their two: 2·4 + 4 + 4·4 + 2·4
    assert row["contacts"] == 36
    assert row["ours_eta"] <= 1e-8
    assert row["ours_momentum"] <= 1e-6
    assert {f"ours_{key}" for key in SIDES} | {f"theirs_{key}" for key in SIDES} <= set(row)
    assert all(row[f"theirs_{key}"] is None for key in SIDES)
    assert row["ratio_step"] is row["ratio_first"] is None


def test_lmgc90_stands_beside_it(scenes):
    if importlib.util.find_spec("compas_lmgc90") is None:
        pytest.skip("compas_lmgc90 is not installed")
    (row,) = rows("lmgc90", "--scenes", scenes, "--steps", 4)
    assert row["contacts_theirs"] == row["contacts"] == 36
    assert row["ratio_step"] == pytest.approx(row["theirs_step"] / row["ours_step"])
    assert row["theirs_momentum"] <= 1e-3
    assert row["ours_eta"] <= row["theirs_eta"]


@pytest.mark.slow
def test_the_tables_have_one_line_for_each_setting(scenes):
    done = run("lmgc90", "--scenes", scenes, "--ours-only", "--steps", 3, "--accurate")
    assert done.returncode == 0, done.stderr
    lines = [line.split("|")[1].strip() for line in done.stdout.splitlines() if line.startswith("|")]
    assert lines == 2 * ["scene", "-" * len(lines[1]), "small", "small"]


def test_missing_things_are_named(scenes, tmp_path, monkeypatch):
    for module, options, said in (
        (lmgc90, ("--scenes", tmp_path / "nowhere", "--ours-only"), "nowhere: no such folder"),
        (lmgc90, ("--scenes", scenes, "--only", "large", "--ours-only"), "no scene large; it has small"),
        (lmgc90, ("--scenes", scenes, "--lmgc90-python", tmp_path / "python"), "no such interpreter"),
        (lmgc90, ("--scenes", scenes, "--ours-only", "--steps", 1), "--steps: 1 steps"),
        (fc3d, ("--problems", tmp_path / "nowhere"), "nowhere: no such folder"),
        (fc3d, ("--problems", tmp_path, "--only", "large"), "no .npz problems"),
        (fc3d, ("--problems", tmp_path), "small.npz: data is not a file in the archive"),
    ):
        monkeypatch.setattr(sys, "argv", ["benchmark", *map(str, options)])
        with pytest.raises(UsageError, match=re.escape(said)):
            module.main()


def test_a_failure_is_one_line_and_a_code(tmp_path):
    done = run("fc3d", "--problems", tmp_path / "nowhere")
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
    assert len(done.stderr.splitlines()) == 1
    assert not done.stdout


def test_a_missing_package_is_named_with_its_remedy(scenes):
    if importlib.util.find_spec("compas_lmgc90") is not None:
        pytest.skip("compas_lmgc90 is installed")
    done = run("lmgc90", "--scenes", scenes)
    assert done.returncode == 1
    assert "pip install compas_lmgc90" in done.stderr


def test_problems_are_solved_beside_the_figures_of_siconos(tmp_path):
    """One contact that slides, in closed form r = (1, -0.06, -0.08); and its row of a table like siconos.csv."""
    np.savez(
        tmp_path / "one.npz",
        data=np.eye(3)[None],
        indices=np.array([0]),
        indptr=np.array([0, 1]),
        q=np.array([-1.0, 0.6, 0.8]),
        mu=np.array([0.1]),
    )
    heading = "problem,nc,rank_W,mu,solver,tol,solved,error,iterations,cpu_s\n"
    lines = ["one,1,3,0.1,NSGS,1e-08,1,1e-9,3,0.5\n", "one,1,3,0.1,PROX,1e-08,1,1e-9,2,0.25\n"]
    (tmp_path / "siconos.csv").write_text(heading + "".join(lines))
    (row,) = rows("fc3d", "--problems", tmp_path)
    assert row["problem"] == "one"
    assert row["nc"] == 1
    assert row["solved"]
    assert row["error"] <= 1e-8
    assert row["eta_eta"] <= 1e-8
    assert row["iterations"] > 0
    assert row["cpu"] > 0
    # a file tells one cold call of each method, which is compared with our first
    assert (row["siconos_best"], row["siconos_best_cpu_first"]) == ("PROX", 0.25)
    assert (row["siconos_nsgs_cpu_first"], row["siconos_nsgs_iterations"]) == (0.5, 3)
    assert row["ratio_first"] == pytest.approx(0.25 / row["cpu_first"])
    assert row["siconos_best_cpu"] is row["ratio_best"] is None


def test_both_sides_of_a_comparison_are_called_as_often():
    calls = []
    _, first, later = timed(lambda: lambda: calls.append(time.process_time()))
    assert len(calls) == 6
    assert first >= 0 <= later
    # a solve that takes long is called once, and its only call counts
    busy = []

    def long():
        busy.append(0)
        end = time.process_time() + 0.6
        while time.process_time() < end:
            pass

    _, first, later = timed(lambda: long)
    assert len(busy) == 1
    assert first == later >= 0.6


def test_scenes_are_made_where_none_are_given():
    column, *_, wall = rigid_scenes()
    assert (column.name, len(column.vertices)) == ("column_10", 11)
    # 20 courses of 40 bricks and 20 of 41, of which two are halves; a slab
    assert (wall.name, len(wall.vertices)) == ("wall_40x40", 20 * 40 + 20 * 41 + 1)


def test_tables_are_written_between_their_marks_with_the_commit(tmp_path):
    page = tmp_path / "README.md"
    page.write_text("before\n<!-- t -->\nold\n<!-- /t -->\nafter\n", encoding="utf-8")
    lines = table_lines([{"a": 1.0}, {"a": None}], columns("a A :.1f"))
    write_between("t", [f"Measured at {commit()}.", "", *lines], page)
    text = page.read_text(encoding="utf-8")
    assert text.startswith("before\n<!-- t -->\n\nMeasured at ")
    assert text.endswith("| 1.0 |\n| –   |\n\n<!-- /t -->\nafter\n")
    assert "old" not in text
    with pytest.raises(UsageError, match="no place for the tables of u"):
        write_between("u", lines, page)


@pytest.mark.parametrize("name", ["lmgc90", "moving", "fc3d, own", "fc3d, stored"])
def test_the_page_has_a_place_for_each_table(name):
    text = (ROOT / "benchmarks" / "README.md").read_text(encoding="utf-8")
    assert text.count(f"<!-- {name} -->") == text.count(f"<!-- /{name} -->") == 1


@pytest.mark.parametrize(("options", "length", "share"), [(["--full"], 150.0, 1.0), ([], 47.43, 0.3162)])
def test_faults_have_the_cohesion_of_the_paper_for_the_weight_of_their_cover(
    tmp_path, monkeypatch, options, length, share
):
    made = []
    monkeypatch.setattr(
        geology, "run_geology", lambda path, kind, *_, **__: made.append(read_geology(path, kind))
    )
    monkeypatch.setattr(
        sys, "argv", ["geology", *options, "--only", "fault", "--seeds", "2", "--out", str(tmp_path)]
    )
    geology.main()
    assert [one.contact.cohesion for one in made[:4]] == [share * gamma for gamma in (0.0, 1e3, 1e4, 1e5)]
    assert {one.sample.seed for one in made} == {2}
    assert {one.experiment.length for one in made} == {length}
    # ten times the sweeps are run with a tenth of the disks alone
    assert len(made) == (4 if options else 5)


@pytest.mark.slow
def test_cost_is_given_for_each_size():
    first, *_ = found = rows("scaling", "--largest", 350, "--threads", 2)
    assert [row["kind"] for row in found] == ["wall", "disks", "disks"]
    for key in ("contacts", "detection_ms", "sweep_ns", "step_ms", "bytes_kept", "exponent_step_1"):
        assert key in first
    assert all(row["same_bits"] for row in found)
    assert 0 < first["bytes_kept"] < 10_000


@pytest.mark.slow
def test_a_wall_of_deformable_bricks_is_taken_to_its_rest():
    (row,) = rows("scaling", "--kinds", "deformable", "--largest", 1200, "--threads", 1)
    assert (row["bodies"], row["outcome"]) == (4 * 3 + 5 * 3, "equilibrium")
    assert row["eta"] <= 1e-6
    assert row["reaction"] < 1e-4


def test_cold_scenes_are_solved():
    found = rows("scaling", "--kinds", "cold", "--largest", 200)
    assert [row["scene"] for row in found][:2] == ["column of 10", "1,000 t on 1 kg"]
    assert {row["converged"] for row in found} == {"yes"}


def test_a_run_whose_output_is_redirected_says_now_and_then_how_far_it_is(capsys, monkeypatch):
    clock = iter([100.0, 109.0, 110.5, 111.0, 121.0])
    monkeypatch.setattr(report, "_said", [100.0])
    monkeypatch.setattr(report.time, "monotonic", lambda: next(clock))
    for step in range(5):
        progress(f"step {step}")
    assert capsys.readouterr().err.split("\n") == ["step 2", "step 4", ""]


def test_shaking_is_felt_as_gravity_the_other_way():
    """a(t) = 0.3 g sin(2π 5 t) peaks at t = 50 ms, between steps 50 and 51."""
    for motion, component in (("in plane", 0), ("out of plane", 1)):
        gravity = gravity_of(motion, 200)
        assert gravity[:, 2] == pytest.approx(-9.81)
        assert gravity[:, 1 - component] == pytest.approx(0.0)
        assert gravity[:, component].argmin() in (49, 50)
        assert gravity[49, component] == pytest.approx(-0.3 * 9.81, rel=1e-3)
        # a whole period leaves no momentum
        assert gravity[:, component].sum() == pytest.approx(0.0, abs=1e-9)
    assert gravity_of("tilted", 3) == pytest.approx(np.tile([-0.2 * 9.81, 0.0, -9.81], (3, 1)))


def test_each_step_has_the_gravity_of_its_own(tmp_path):
    """A brick far above its support flies: v_n = h Σ g_i, x_n = Σ h (v_n-1 + v_n) / 2 with θ = ½."""
    wall, step = running_bond(1, 1), 1e-3
    lifted = (wall.vertices[0], wall.vertices[1] + [0.0, 0.0, 5.0])
    write_scene(BlockScene("flight", lifted, wall.faces, wall.support), tmp_path / "flight.npz")
    gravity = np.random.default_rng(1).normal(size=(6, 3))
    np.save(tmp_path / "gravity.npy", gravity)
    trace = traced(
        tmp_path / "flight.npz", steps=6, tolerance=1e-6, sweeps=100, gravity=str(tmp_path / "gravity.npy")
    )
    speed = step * np.concatenate([np.zeros((1, 3)), gravity.cumsum(axis=0)])
    way = (step * (speed[:-1] + speed[1:]) / 2).cumsum(axis=0)
    assert trace.centre[1:, 1] - trace.centre[0, 1] == pytest.approx(way, abs=1e-12)
    assert trace.solved.tolist() == [True] * 6
    assert trace.contacts.tolist() == [0] * 6


@pytest.mark.slow
def test_our_rows_of_moving_walls_are_measured_against_the_finest():
    options = ("--moving", "--ours-only", "--only", "wall_10x10", "--motions", "in plane", "--steps", 3)
    finest, default, asked = rows("lmgc90", *options)
    assert [row["run"] for row in (finest, default, asked)] == ["finest", "default", "motion_error = 0.001 m"]
    # 10 bricks on 10 below, shifted by half: 10 beds of the first course, 9 × 20 others, 5 × 9 and 5 × 10 head joints
    assert {row["contacts"] for row in (finest, default, asked)} == {4 * (10 + 9 * 20 + 95)}
    assert finest["error"] is None
    assert default["error"] < 1e-9
    assert asked["error"] < 1e-3
    assert default["unsolved"] == default["compliant"] == 0
    assert default["ratio_mean"] is None
