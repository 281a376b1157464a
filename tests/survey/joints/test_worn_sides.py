"""Free sides with worn corners: the sources of their plane, in order, and the planes that stay as measured."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from survey.geometry.adjacency import SolidArrays
from survey.geometry.solids import Solid
from survey.joints.contact_planes import StoneFaces
from survey.joints.facing import planes_of
from survey.joints.worn_sides import mended_planes
from tests.survey.plain_blocks import drawn, moved

REACH = 0.08
# seen from the front: the upper right corner is worn, 20 mm along and 30 mm down
WORN = drawn("W", [(0, 0), (1, 0), (0.98, 0.27), (0, 0.3)])
BOTTOM, RIGHT, TOP = 2, 3, 4  # of `drawn`: front, back, then the sides
LOST = (2, 6)  # the corner, in front and behind


def faces_of(solids, lost=LOST, kept=()):
    """Return all faces; of the first solid some corners are not sound."""
    gathered = SolidArrays.gather((solid.vertices, solid.faces) for solid in solids)
    planes = planes_of(gathered)
    sound = np.ones(len(gathered.vertices), np.bool_)
    sound[list(lost)] = False
    stays = np.zeros(len(planes.areas), np.bool_)
    stays[list(kept)] = True
    return StoneFaces(gathered, planes, sound, stays, np.zeros_like(stays), np.zeros(len(stays)))


def mended(solids, lost=LOST, free=None, kept=(), beside=True, reach=REACH):
    """Return planes (nf, 4) before and after."""
    faces = faces_of(solids, lost, kept)
    rows = np.column_stack([faces.planes.normals, faces.planes.offsets])
    neighbours = np.array([(0, k) for k in range(1, len(solids))] if beside else [], np.int64).reshape(-1, 2)
    all_free = np.ones(len(rows), np.bool_) if free is None else free
    return rows, mended_planes(faces, rows, all_free, neighbours, solids, reach)


def assert_through(row, points):
    np.testing.assert_allclose(np.asarray(points) @ row[:3], row[3], atol=1e-12)
    assert np.linalg.norm(row[:3]) == pytest.approx(1.0)


def test_without_neighbours_a_side_is_made_parallel_to_the_opposite_one():
    rows, out = mended([WORN])
    np.testing.assert_allclose(out[TOP], [0, 0, 1, 0.3], atol=1e-12)
    np.testing.assert_allclose(out[RIGHT], [1, 0, 0, 1.0], atol=1e-12)
    others = [k for k in range(6) if k not in (TOP, RIGHT)]
    np.testing.assert_array_equal(out[others], rows[others])


def test_unless_the_opposite_side_is_turned_by_more_than_ten_degrees():
    wedge = drawn("W", [(0, 0), (1, 0), (0.98, 0.45), (0, 0.3)])  # the top rises by 8.7°, then by 17°
    rows, out = mended([wedge])
    np.testing.assert_allclose(out[TOP], [0, 0, 1, 0.3], atol=1e-12)
    steep = drawn("W", [(0, 0), (1, 0), (0.98, 0.6), (0, 0.3)])
    rows, out = mended([steep])
    np.testing.assert_array_equal(out[TOP], rows[TOP])


def test_a_side_is_led_to_the_nearest_corner_of_a_neighbour():
    # the neighbour's top, as an arch's extrados, goes on from a place 10 mm beside where the corner was
    beside = drawn("B", [(1.01, 0), (1.5, 0), (1.5, 0.4), (1.01, 0.31)])
    _, out = mended([WORN, beside])
    assert_through(out[TOP], [(0, 0, 0.3), (0, 0.4, 0.3), (1.01, 0, 0.31), (1.01, 0.4, 0.31)])
    assert out[TOP][2] > 0.9


def test_a_corner_beyond_the_reach_is_none():
    beside = drawn(
        "B", [(1.01, 0), (1.5, 0), (1.5, 0.7), (1.01, 0.31)]
    )  # its top rises by 38°: nothing continues
    away = np.hypot(1.01 - 0.98, 0.31 - 0.27)
    _, near = mended([WORN, beside], reach=away + 1e-6)
    assert_through(near[TOP], [(0, 0, 0.3), (1.01, 0, 0.31)])
    _, far = mended([WORN, beside], reach=away - 1e-6)
    np.testing.assert_allclose(far[TOP], [0, 0, 1, 0.3], atol=1e-12)


def test_a_stone_that_shares_no_joint_leads_nothing():
    beside = drawn("B", [(1.01, 0), (1.5, 0), (1.5, 0.4), (1.01, 0.31)])
    _, out = mended([WORN, beside], beside=False)
    np.testing.assert_allclose(out[TOP], [0, 0, 1, 0.3], atol=1e-12)


def continuing():
    """Return a neighbour whose top is in the plane z = 0.3 + 0.02 x of the sound end of W's top."""
    return drawn("B", [(1.01, 0), (1.5, 0), (1.5, 0.33), (1.01, 0.3 + 0.02 * 1.01)])


def test_neighbours_that_continue_a_side_tell_its_plane():
    _, out = mended([WORN, continuing()], reach=0.01)
    assert_through(out[TOP], [(0, 0, 0.3), (0, 0.4, 0.3), (1.5, 0, 0.33), (1.5, 0.4, 0.33)])


def test_but_only_with_sides_that_are_free_and_only_with_sound_corners():
    solids = [WORN, continuing()]
    free = np.ones(12, np.bool_)
    free[6 + TOP] = False
    _, out = mended(solids, free=free, reach=0.01)
    np.testing.assert_allclose(out[TOP], [0, 0, 1, 0.3], atol=1e-12)
    # B's own corner at the joint is worn: the plane goes through the others
    low = continuing()
    low.vertices[[3, 7], 2] -= 0.005
    _, out = mended([WORN, low], lost=(*LOST, 8 + 3, 8 + 7), reach=0.01)
    assert_through(out[TOP], [(0, 0, 0.3), (1.5, 0, 0.33)])


def test_a_side_that_lies_apart_by_more_than_30_mm_does_not_continue():
    for up, continues in ((0.028, True), (0.032, False)):
        above = Solid("B", continuing().vertices + np.array([0, 0, up]), continuing().faces)
        _, out = mended([WORN, above], reach=0.01)
        assert (abs(out[TOP][0]) > 1e-6) == continues


def test_three_sound_corners_tell_the_plane_as_it_is_and_none_tell_nothing():
    # a corner in front only: the sides have three sound corners left, the front has too
    rows, out = mended([WORN], lost=(2,))
    np.testing.assert_array_equal(out, rows)
    rows, out = mended([WORN], lost=range(8))
    np.testing.assert_array_equal(out, rows)


def test_sides_in_joints_and_stones_that_keep_their_shape_stay():
    free = np.ones(6, np.bool_)
    free[TOP] = False
    rows, out = mended([WORN], free=free)
    np.testing.assert_array_equal(out[TOP], rows[TOP])
    assert np.abs(out[RIGHT] - rows[RIGHT]).max() > 0.01
    rows, out = mended([WORN], kept=range(6))
    np.testing.assert_array_equal(out, rows)
    rows, out = mended([WORN], lost=())
    np.testing.assert_array_equal(out, rows)


@settings(max_examples=30, deadline=None)
@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3), st.tuples(*[st.floats(-50.0, 50.0)] * 3))
def test_sides_are_mended_alike_wherever_the_stones_stand(turned, shift):
    turn = Rotation.from_rotvec(turned).as_matrix()
    for solids, reach in (([WORN], REACH), ([WORN, continuing()], REACH), ([WORN, continuing()], 0.01)):
        _, here = mended(solids, reach=reach)
        _, there = mended([moved(one, turn, np.array(shift)) for one in solids], reach=reach)
        np.testing.assert_allclose(there[:, :3], here[:, :3] @ turn.T, atol=1e-9)
        np.testing.assert_allclose(there[:, 3], here[:, 3] + there[:, :3] @ np.array(shift), atol=1e-9)
