"""Displacement and speed of corners: the kernels beside readable numpy."""

import itertools

import numpy as np
from scipy.spatial.transform import Rotation

from mechanics.dynamics.observers._kernels import largest_displacement, largest_speed

FIRST = np.array([0, 8, 12, 18])


def bodies(seed):
    rng = np.random.default_rng(seed)
    turns = [Rotation.random(3, random_state=rng).as_matrix() for _ in range(2)]
    return rng.normal(size=(18, 3)), rng.normal(size=(3, 3)), turns[0], rng.normal(size=(3, 3)), turns[1]


def test_displacement_is_that_of_the_corner_that_went_farthest():
    corner, centre, turn, centre_then, turn_then = bodies(1)
    expected = [
        np.linalg.norm(corner[a:b] @ (turn[k] - turn_then[k]).T + centre[k] - centre_then[k], axis=1).max()
        for k, (a, b) in enumerate(itertools.pairwise(FIRST))
    ]
    found = largest_displacement(FIRST, corner, centre, turn, centre_then, turn_then)
    np.testing.assert_allclose(found, expected, rtol=1e-13)


def test_speed_is_that_of_the_fastest_corner():
    corner, centre, turn, spin, _ = bodies(2)
    velocity = np.hstack([centre, spin])
    velocity[1] = 0.0
    expected = [
        np.linalg.norm(velocity[k, :3] + np.cross(velocity[k, 3:], corner[a:b] @ turn[k].T), axis=1).max()
        for k, (a, b) in enumerate(itertools.pairwise(FIRST))
    ]
    found = largest_speed(FIRST, corner, turn, velocity)
    np.testing.assert_allclose(found, expected, rtol=1e-13)
    assert found[1] == 0.0


def test_what_is_not_a_number_is_told():
    corner, centre, turn, spin, _ = bodies(3)
    centre[2, 1] = np.nan
    assert np.isnan(largest_speed(FIRST, corner, turn, np.hstack([centre, spin]))[2])
    assert np.isnan(largest_displacement(FIRST, corner, centre, turn, spin, turn)[2])
