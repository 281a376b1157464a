"""Hidden sides beside a core: one plane where depths are inferred and sides continue each other, else their own."""

import numpy as np
import pytest

from survey.joints.hidden_sides import HiddenSides, common_planes


def sides(depths, slack=0.03, width=0.5, tilts=None):
    """Sides in a row along x, 0.3 m high, that face along y at these depths; `tilts` are slopes along x."""
    tilts = np.zeros(len(depths)) if tilts is None else np.array(tilts)
    corners, planes = [], []
    for k, (depth, tilt) in enumerate(zip(depths, tilts, strict=True)):
        x = np.array([k * width, (k + 1) * width, (k + 1) * width, k * width])
        y = depth + tilt * (x - (k + 0.5) * width)
        corners.append(np.column_stack([x, y, [0.0, 0.0, 0.3, 0.3]]))
        normal = np.array([-tilt, 1.0, 0.0]) / np.hypot(1.0, tilt)
        planes.append([*normal, normal @ corners[-1].mean(axis=0)])
    starts = 4 * np.arange(len(depths) + 1)
    slack = np.broadcast_to(slack, len(depths))
    return HiddenSides(np.concatenate(corners), starts, np.array(planes), np.array(slack))


def row(count):
    return np.column_stack([np.arange(count - 1), np.arange(1, count)])


def test_sides_that_differ_by_the_relief_of_their_faces_get_their_least_squares_plane():
    depths = np.array([0.262, 0.258, 0.261, 0.259])
    some = sides(depths, tilts=[0.002, -0.001, 0.0, -0.003])
    planes, number = common_planes(some, row(4))
    assert number.tolist() == [0, 0, 0, 0]
    x, y = some.corners[:, 0], some.corners[:, 1]
    slope, level = np.polyfit(x, y, 1)
    # total least squares across the wall: the same line up to the square of these slopes
    assert planes[0, 0] / -planes[0, 1] == pytest.approx(slope, abs=1e-8)
    assert planes[0, 3] / planes[0, 1] == pytest.approx(level, abs=1e-8)


def test_a_side_that_is_deeper_than_its_depth_may_be_wrong_keeps_its_plane_to_the_last_bit():
    some = sides([0.26, 0.45, 0.26], slack=0.03)
    planes, number = common_planes(some, row(3))
    assert len(set(number.tolist())) == 3
    assert np.array_equal(planes[number], some.planes)
    # though one that continues both joins them
    planes, number = common_planes(some, np.array([[0, 1], [1, 2], [0, 2]]))
    assert number[0] == number[2] != number[1]


def test_the_precision_of_each_depth_counts():
    depths = [0.26, 0.268, 0.26]
    assert len(common_planes(sides(depths, slack=0.03), row(3))[0]) == 1
    planes, number = common_planes(sides(depths, slack=[0.03, 0.001, 0.03]), row(3))
    assert np.array_equal(planes[number[1]], sides(depths).planes[1])


def test_sides_that_do_not_continue_each_other_keep_their_planes():
    some = sides([0.26, 0.261, 0.262])
    planes, number = common_planes(some, np.zeros((0, 2), np.int64))
    assert np.array_equal(planes[number], some.planes)


def test_depths_that_drift_along_a_wall_make_several_planes_none_of_which_moves_a_side_too_far():
    # a bulge: neighbours differ by 4 mm, the ends by 80 mm from the middle
    depths = 0.26 + 0.004 * np.minimum(np.arange(40), np.arange(40)[::-1])
    some = sides(depths, slack=0.02)
    planes, number = common_planes(some, row(40))
    assert 2 <= len(planes) < 10
    off = np.abs(
        (some.corners * planes[np.repeat(number, 4), :3]).sum(axis=1) - planes[np.repeat(number, 4), 3]
    )
    assert off.max() <= 0.02


def test_sides_of_the_two_facings_are_never_one():
    one = sides([0.0, 0.0])
    planes = one.planes * [[1.0], [-1.0]]
    _, number = common_planes(one._replace(planes=planes), row(2))
    assert number[0] != number[1]
