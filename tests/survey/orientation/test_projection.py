"""Collinearity, distortion, rotations: against each other and against plain differences."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from survey.orientation._kernels.camera import PARAMETERS, ray
from survey.orientation.bundle.resection import intersect_many, intersect_rays
from survey.orientation.network import Camera
from survey.orientation.projection import corrected, directions, project
from survey.orientation.rotations import angle_slopes, angles, from_angles, turned
from tests.survey.orientation.synthetic_block import INNER, SIZE, looking

STATION, POINT = np.array([1.0, -6.0, 2.0]), np.array([2.3, 0.4, 1.1])
TURN = looking(STATION, [1.5, 0.0, 1.8], 0.3)


def camera(forward):
    return Camera("c", INNER, SIZE, 24.0 / SIZE[1], forward=forward)


def computed(forward, inner, rotation, station, point, measured):
    work = np.zeros((5, PARAMETERS))
    ray(measured, np.ones(2), forward, inner, rotation, station, point, work)
    return -work[4, :2]


@pytest.mark.parametrize("forward", [False, True])
def test_derivatives_of_a_ray_agree_with_differences(forward):
    measured = project(camera(forward), TURN, STATION, POINT[None])[0] * 0.006 * (1.0, -1.0) + 0.02
    work = np.zeros((5, PARAMETERS))
    ray(measured, np.ones(2), forward, INNER, TURN, STATION, POINT, work)
    size = np.array([1e-5] * 3 + [1e-4] * 3 + [1e-4] * 3 + [1e-6] * 2 + [1e-7, 1e-9, 1e-11, 1e-7, 1e-7])
    for k in range(PARAMETERS):
        off = []
        for sign in (1.0, -1.0):
            step = np.zeros(PARAMETERS)
            step[k] = sign * size[k]
            rotation = turned(TURN[None], step[None, :3])[0]
            off.append(computed(forward, INNER + step[6:], rotation, STATION + step[3:6], POINT, measured))
        slope = (off[0] - off[1]) / (2 * size[k])
        np.testing.assert_allclose(work[:2, k], slope, rtol=2e-6, atol=1e-6 * np.abs(slope).max())
    for k in range(3):
        step = 1e-4 * np.eye(3)[k]
        slope = (
            computed(forward, INNER, TURN, STATION, POINT + step, measured)
            - computed(forward, INNER, TURN, STATION, POINT - step, measured)
        ) / 2e-4
        np.testing.assert_allclose(work[2:4, k], slope, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("forward", [False, True])
def test_a_projected_point_lies_on_its_ray(forward):
    rng = np.random.default_rng(1)
    points = rng.uniform([-1, -0.5, 0], [4, 0.5, 4], (50, 3))
    image = project(camera(forward), TURN, STATION, points)
    rays = directions(camera(forward), image) @ TURN.T
    arms = points - STATION
    assert np.abs(np.cross(rays, arms)).max() / np.abs(arms).max() < 1e-9 * INNER[0]


def test_both_models_agree_without_distortion_and_differ_with_it():
    plain = np.array([24.0, 18.0, 12.0, *[0.0] * 7])
    points = np.random.default_rng(2).uniform([-1, -0.5, 0], [4, 0.5, 4], (20, 3))
    images = [
        project(Camera("c", plain, SIZE, 0.006, forward=one), TURN, STATION, points) for one in (False, True)
    ]
    np.testing.assert_allclose(*images, atol=1e-9)
    images = [project(camera(one), TURN, STATION, points) for one in (False, True)]
    assert np.abs(images[0] - images[1]).max() > 1.0


def test_backward_distortion_is_a_polynomial_of_what_was_measured():
    x, y = (np.array([[5000.0, 700.0]]) * 0.006 * (1.0, -1.0))[0] - (18.05, -11.97)
    x = x * (1.0 + 2e-4)
    r2 = x * x + y * y
    radial = 1.0 + 1.2e-4 * r2 - 1.5e-7 * r2**2 + 1e-10 * r2**3
    expected_y = y * radial - 0.7e-5 * (r2 + 2 * y * y) + 2 * 1.1e-5 * x * y
    expected_x = x * radial + 1.1e-5 * (r2 + 2 * x * x) - 2 * 0.7e-5 * x * y + 1e-4 * expected_y
    found = corrected(camera(False), np.array([[5000.0, 700.0]]))[0]
    np.testing.assert_allclose(found, [expected_x, expected_y], rtol=1e-12)


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_angles_come_back(omega, phi, kappa):
    rotation = from_angles(omega, phi, kappa)
    np.testing.assert_allclose(angles(rotation), [omega, phi, kappa], atol=1e-7)


def test_angles_follow_small_rotations():
    rotation, step = from_angles(0.4, -0.7, 2.1), 1e-6
    for k in range(3):
        moved = turned(rotation[None], step * np.eye(3)[k][None])[0]
        np.testing.assert_allclose(
            angle_slopes(rotation)[:, k], (angles(moved) - angles(rotation)) / step, atol=1e-5
        )


def test_many_points_are_intersected_as_each_alone():
    rng = np.random.default_rng(4)
    points = np.sort(rng.integers(0, 20, 60))
    stations = rng.normal(size=(60, 3)) * 3.0
    rays = rng.normal(size=(60, 3))
    rays[points == 3] = [0.0, 1.0, 0.0]  # parallel
    numbers, places, angles = intersect_many(points, stations, rays)
    assert numbers.tolist() == sorted(set(points.tolist()))
    for i, place, angle in zip(numbers, places, angles, strict=True):
        alone, between = intersect_rays(stations[points == i], rays[points == i])
        np.testing.assert_allclose(place, alone, rtol=1e-9, atol=1e-9)
        assert angle == pytest.approx(between, abs=1e-9)
    assert np.isnan(places[numbers.tolist().index(3)]).all()
