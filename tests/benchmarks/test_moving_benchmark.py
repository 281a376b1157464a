"""Moving walls: gravity in the axes of a shaking support, and the error of a motion against the finest run."""

import json
import subprocess
import sys

import numpy as np
import pytest

from benchmarks.generated import running_bond
from benchmarks.moving import gravity_of
from benchmarks.runs import moma_program, run_side
from benchmarks.scenes import BlockScene, write_scene
from tests.paths import ROOT

STEP, THETA = 1e-3, 0.5


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
    wall = running_bond(1, 1)
    lifted = (wall.vertices[0], wall.vertices[1] + [0.0, 0.0, 5.0])
    write_scene(
        BlockScene("flight", lifted, wall.faces, wall.support, 0.5, 2400.0, 9.81), tmp_path / "flight.npz"
    )
    gravity = np.random.default_rng(1).normal(size=(6, 3))
    np.save(tmp_path / "gravity.npy", gravity)
    options = ["--steps", "6", "--keep", "0", "--step", repr(STEP), "--theta", repr(THETA)]
    options += ["--tolerance", "1e-6", "--sweeps", "100", "--gravity", str(tmp_path / "gravity.npy")]
    trace = run_side("MOMA", moma_program(), tmp_path / "flight.npz", options)
    speed = STEP * np.concatenate([np.zeros((1, 3)), gravity.cumsum(axis=0)])
    way = (STEP * (speed[:-1] + speed[1:]) / 2).cumsum(axis=0)
    assert trace.centre[1:, 1] - trace.centre[0, 1] == pytest.approx(way, abs=1e-12)
    assert trace.solved.tolist() == [True] * 6
    assert trace.contacts.tolist() == [0] * 6


@pytest.mark.slow
def test_our_rows_are_measured_against_the_finest():
    options = ("--ours-only", "--json", "--sizes", "10", "--motions", "in plane", "--steps", "3")
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.moving", *options],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    finest, default, asked = json.loads(done.stdout)
    assert [row["run"] for row in (finest, default, asked)] == ["finest", "default", "motion_error = 0.001 m"]
    # 10 bricks on 10 below, shifted by half: 10 beds of the first course, 9 × 20 others, 5 × 9 and 5 × 10 head joints
    assert {row["contacts"] for row in (finest, default, asked)} == {4 * (10 + 9 * 20 + 95)}
    assert finest["error"] is None
    assert default["error"] < 1e-9
    assert asked["error"] < 1e-3
    assert default["unsolved"] == default["compliant"] == 0
    assert default["ratio_mean"] is None
