"""Common areas of two stones at their joint, against an independent intersection of half-planes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, HalfspaceIntersection
from scipy.spatial.transform import Rotation

from mechanics.scene.shapes import BOX_FACES
from pipelines.draw.elevations.closing_shapes import joint_polygon
from survey.geometry.solids import Solid, area_vector
from tests.pipelines.results_by_hand import box

UP = np.array([0.0, 0.0, 1.0])


def brick(code, low, high, turn=None):
    corners = np.array(box(low, high), dtype=float)
    return Solid(code, corners if turn is None else corners @ turn.T, BOX_FACES)


def test_a_stone_on_two_others_shares_with_each_what_lies_under_it():
    upper = brick("U", (0.0, 0.0, 1.0), (1.0, 0.4, 1.5))
    lower = brick("L", (-0.5, 0.1, 0.0), (0.3, 0.4, 0.99))
    polygon = joint_polygon(upper, lower, UP, np.array([0.2, 0.2, 0.995]))
    assert polygon is not None
    np.testing.assert_allclose(area_vector(polygon), 0.3 * 0.3 * UP, atol=1e-12)
    np.testing.assert_allclose(polygon[:, 2], 0.995, atol=1e-12)  # on the joint's plane, amid the gap
    np.testing.assert_allclose(polygon.min(axis=0)[:2], [0.0, 0.1], atol=1e-12)
    np.testing.assert_allclose(polygon.max(axis=0)[:2], [0.3, 0.4], atol=1e-12)


def test_the_normal_tells_which_sides_face_each_other():
    upper, lower = brick("U", (0, 0, 1), (1, 1, 2)), brick("L", (0, 0, 0), (1, 1, 1))
    assert joint_polygon(upper, lower, UP, UP) is not None
    far = brick("F", (1.0, 0.0, 0.0), (2.0, 1.0, 1.0))
    assert joint_polygon(far, upper, UP, UP) is None  # side by side: above one another nothing


@settings(max_examples=60, deadline=None)
@given(
    st.floats(-180.0, 180.0),
    st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4)),
    st.tuples(st.floats(0.2, 1.0), st.floats(0.2, 1.0)),
    st.integers(0, 5),
)
def test_turned_stones_share_what_half_planes_leave(angle, shift, size, seed):
    turn = Rotation.random(random_state=seed).as_matrix()  # of all of it in space
    about = Rotation.from_euler("z", angle, degrees=True).as_matrix()
    lower = brick("L", (-0.5, -0.3, -1.0), (0.5, 0.3, 0.0), turn)
    half = np.array([*size, 0.0]) / 2
    place = np.array([*shift, 0.0])
    upper = Solid(
        "U", (np.array(box(-half, half + np.array([0, 0, 1.0]))) @ about.T + place) @ turn.T, BOX_FACES
    )
    found = joint_polygon(upper, lower, turn @ UP, turn @ place)
    # x ≤ 0.5 …: and the four sides of the turned one
    normals = np.array([[1.0, 0], [-1, 0], [0, 1], [0, -1]])
    first = np.column_stack([normals, [-0.5, -0.5, -0.3, -0.3]])
    turned = normals @ about[:2, :2].T
    second = np.column_stack([turned, -(turned @ place[:2] + np.repeat(half[:2], 2))])
    inside = np.zeros(
        2
    )  # the middle of the lower one is within the upper one, or there is nothing to compare
    if ((second[:, :2] @ inside + second[:, 2]) > -1e-6).any():
        return
    truth = ConvexHull(HalfspaceIntersection(np.vstack([first, second]), inside).intersections).volume
    assert found is not None
    assert np.linalg.norm(area_vector(found)) == pytest.approx(truth, rel=1e-9)
    assert area_vector(found) @ (turn @ UP) > 0.0
