"""Contacts of balls, against a quadratic program for the nearest point of a polyhedron."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from ground.errors import SceneError
from mechanics.model.balls import ball
from mechanics.scene.scene import Fidelity
from mechanics.stones.materials import Material
from tests.mechanics.shapes import brick, detected, moved, scene

STONE = Material("stone", density=2000.0, young=1e9, poisson=0.2)


def nearest_point(corners, c):
    """Nearest point of a convex hull to c: least squares over convex combinations, their sum weighted heavily."""
    heavy = 1e6
    matrix = np.vstack([corners.T - c[:, None], heavy * np.ones(len(corners))])
    weights, _ = nnls(matrix, np.append(np.zeros(3), heavy))
    return (weights / weights.sum()) @ corners


@settings(deadline=None)
@given(
    st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    st.floats(0.02, 0.3),
    st.tuples(*[st.floats(-3.0, 3.0)] * 3),
)
def test_a_ball_meets_a_box_in_its_nearest_point(direction, gap, turn):
    box = brick("box", (-0.5, -0.4, -0.3), (0.5, 0.4, 0.3), Fidelity.FIXED)
    box = moved(box, Rotation.from_rotvec(turn).as_matrix())
    away = np.array(direction) / np.linalg.norm(direction)
    centre = 1.5 * away
    expected = nearest_point(box.vertices, centre)
    far = np.linalg.norm(centre - expected)
    one = scene(box, ball("ball", centre, far - gap, STONE), alert=1.0)
    _, state, contacts = detected(one)
    assert len(contacts) == 1
    n = contacts.frame[0, 0]
    np.testing.assert_allclose(n, (centre - expected) / far, atol=1e-5)
    arm = contacts.arm[0, list(contacts.bodies[0]).index(0)]
    np.testing.assert_allclose(state.rotation[0] @ arm + state.centre[0], expected, atol=1e-5)
    np.testing.assert_allclose(contacts.frame[0] @ contacts.frame[0].T, np.eye(3), atol=1e-14)


def test_a_ball_inside_a_box_is_pushed_out_through_the_nearest_face():
    box = brick("box", (-1, -1, -1), (1, 1, 1), Fidelity.FIXED)
    _, _, contacts = detected(scene(box, ball("ball", (0.1, 0.2, 0.8), 0.1, STONE)))
    np.testing.assert_allclose(contacts.frame[0, 0], [0, 0, 1], atol=1e-12)


def test_two_balls_meet_on_the_line_of_their_centres():
    one = scene(ball("a", (0, 0, 0), 0.1, STONE), ball("b", (0.0, 0.3, 0.0), 0.199, STONE))
    _, _, contacts = detected(one)
    np.testing.assert_allclose(contacts.frame[0, 0], [0, -1, 0], atol=1e-12)
    np.testing.assert_allclose(contacts.arm[0], [[0, 0.1, 0], [0, -0.199, 0]], atol=1e-12)


def test_a_ball_beyond_the_alert_distance_makes_no_contact():
    one = scene(ball("a", (0, 0, 0), 0.1, STONE), ball("b", (0.0, 0.32, 0.0), 0.199, STONE))
    assert len(detected(one)[2]) == 0


def test_a_ball_weighs_as_a_sphere():
    model, _, _ = detected(scene(ball("a", (1, 2, 3), 0.2, STONE)))
    mass = 2000.0 * 4 / 3 * np.pi * 0.2**3
    assert model.mass[0] == pytest.approx(mass)
    np.testing.assert_allclose(model.inertia.inertia[0], 0.4 * mass * 0.2**2 * np.eye(3))


def test_balls_are_rigid_and_have_a_size():
    with pytest.raises(SceneError, match="radius = 0"):
        ball("a", (0, 0, 0), 0.0, STONE)
    with pytest.raises(SceneError, match="a ball is deformable"):
        detected(scene(ball("a", (0, 0, 0), 0.1, STONE, Fidelity.DEFORMABLE)))
