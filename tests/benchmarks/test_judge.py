"""The judge of the benchmarks, on runs whose measures follow from statics."""

import numpy as np
import pytest

from benchmarks.fc3d import siconos_error
from benchmarks.judge import Judge, Touch, Trace
from benchmarks.report import arrays_bytes
from benchmarks.scenes import read_scene, running_bond, write_scene
from mechanics.problem.problem import ContactProblem
from tests.mechanics.dense_operator import blocks_apart

STEP, THETA = 1e-3, 0.5
# one brick of 0.30 × 0.15 × 0.10 m on a slab
SCENE = running_bond(1, 1)
WEIGHT = 2400.0 * 9.81 * 0.30 * 0.15 * 0.10


def at_rest(share=0.25, gap=0.0, sunk=0.0):
    """The brick on its four lower corners, each with a share of the weight; it sinks by `sunk` in the last step."""
    corners = SCENE.vertices[1][SCENE.vertices[1][:, 2] < 1e-9]
    frame = np.tile(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), (4, 1, 1))
    force = np.array([[share * WEIGHT, 0.0, 0.0]] + [[0.25 * WEIGHT, 0.0, 0.0]] * 3)
    touch = Touch(np.tile([1, 0], (4, 1)), corners, frame, np.full(4, gap), force)
    centre = np.tile([vertices.mean(axis=0) for vertices in SCENE.vertices], (4, 1, 1))
    centre[-1, 1, 2] -= sunk
    frames = np.tile(np.eye(3), (4, 2, 1, 1))
    return Trace(
        np.full(3, 1e-3), np.zeros(3, dtype=np.int64), centre, frames, {1: touch, 3: touch}, "statics"
    )


def test_a_brick_in_balance_has_no_error():
    verdict = Judge(SCENE, STEP, THETA)(at_rest())
    assert verdict.contacts == 4
    for measure in (
        *("eta", "eta_first", "penetration", "drift", "displacement", "balance", "reaction"),
        "momentum",
    ):
        assert getattr(verdict, measure) == pytest.approx(0.0, abs=1e-12), measure


def test_a_corner_that_carries_too_much_shows_in_every_measure():
    """One corner with 26 % of the weight instead of 25 %: force and reaction are off by 0.01, the moment about the
    long axis by 0.01 × 0.075 / 0.10 and about the other by 0.01 × 0.15 / 0.10 of weight × size.
    """
    verdict = Judge(SCENE, STEP, THETA)(at_rest(share=0.26))
    assert verdict.reaction == pytest.approx(0.01, rel=1e-9)
    assert verdict.balance == pytest.approx(0.01 * np.hypot(0.075, 0.15) / 0.10, rel=1e-9)
    assert verdict.eta > 1e-3
    assert verdict.momentum > 0.01


def test_what_moves_in_the_last_step_is_drift():
    sunk = at_rest(gap=-1e-9, sunk=2e-9)
    verdict = Judge(SCENE, STEP, THETA)(sunk)
    assert verdict.drift == pytest.approx(2e-9 / STEP, rel=1e-6)
    assert verdict.displacement == pytest.approx(2e-9, rel=1e-6)
    assert verdict.penetration == pytest.approx(1e-9 / 0.10, rel=1e-6)


def test_a_gap_that_is_open_may_not_press():
    """Pressure needs u_N = -gap/h, that is contact at the next kick; a brick at rest 1 µm above its slab lacks that.

    Then û_N = 1e-3 m/s, and η = ρ û_N √4 / ‖r‖ = 1e-3 / (mean diagonal of W) / (h WEIGHT / 4), as long as
    ρ û_N < r_N.
    """
    verdict = Judge(SCENE, STEP, THETA)(at_rest(gap=1e-6))
    mass, (a, b, c) = WEIGHT / 9.81, (0.15, 0.075, 0.05)
    inverse = 3.0 / mass / np.array([b * b + c * c, a * a + c * c, a * a + b * b])
    diagonal = 1.0 / mass + np.array([(b * b + c * c), (a * a + c * c), (a * a + b * b)]) @ inverse / 3.0
    assert verdict.eta == pytest.approx(1e-3 / diagonal / (STEP * WEIGHT / 4), rel=1e-6)


def test_scenes_come_back_as_they_were_written(tmp_path):
    scene = running_bond(2, 3)
    write_scene(scene, tmp_path / f"{scene.name}.npz")
    again = read_scene(tmp_path / f"{scene.name}.npz")
    np.testing.assert_array_equal(np.concatenate(again.vertices), np.concatenate(scene.vertices))
    assert again.faces == scene.faces
    np.testing.assert_array_equal(again.support, scene.support)
    assert (again.name, again.friction, again.density, again.gravity) == ("wall_2x3", 0.5, 2400.0, 9.81)


def test_the_error_of_siconos_without_impulses():
    """W = 1, q = (-1, 0.3, 0.4), μ = 0.5, r = 0: û = (-0.75, 0.3, 0.4), and P_K(-û) has height 0.8, radius 0.4.

    P_K of (n, t) = (0.75, 0.5) beyond the cone: n' = (n + μ t) / (1 + μ²) = 0.8, t' = μ n'.
    """
    w = blocks_apart(np.eye(3))
    q, none = np.array([[-1.0, 0.3, 0.4]]), np.zeros(1)
    problem = ContactProblem(w, q, none, np.array([0.5]), none)
    expected = np.hypot(0.8, 0.4) / np.linalg.norm(q)
    assert siconos_error(problem, np.zeros((1, 3))) == pytest.approx(expected, rel=1e-12)


def test_each_buffer_is_counted_once():
    whole = np.zeros(1000)
    assert (
        arrays_bytes({"a": whole, "b": [whole[:10], whole.reshape(10, 100)], "c": (np.zeros(5),)})
        == 8000 + 40
    )
