"""Neighbours without a joint between them, in a wall whose joints are wider."""

from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from survey.geometry.polygons import seamless

Array = NDArray[np.float64]


def wall(joint: float, touching: int | None = None, noise: float = 0.0005) -> list[Array]:
    """Return three courses of eight stones; those before and after the fourth joint of one course touch."""
    rng = np.random.default_rng(1)
    rings = []
    for course in range(3):
        for k in range(8):
            start, stop = 0.5 * k, 0.5 * (k + 1) - joint
            rest = rng.normal(0.0, noise, (4, 2))
            if course == touching and k == 3:
                stop += joint
            ring = np.array([[start, 0.0], [stop, 0.0], [stop, 0.3 - joint], [start, 0.3 - joint]])
            rings.append(ring + np.array([0.2 * course, 0.3 * course]) + rest)
    return rings


def found(rings: list[Array]) -> list[tuple[int, int]]:
    return [(one.first, one.second) for one in seamless(rings, combinations(range(len(rings)), 2))]


@pytest.mark.parametrize("course", [0, 1, 2])
def test_two_stones_that_touch_are_named(course: int) -> None:
    assert found(wall(0.01, course)) == [(8 * course + 3, 8 * course + 4)]


@pytest.mark.parametrize("joint", [0.0, 0.004, 0.01])
def test_a_wall_of_even_joints_and_one_without_mortar_are_not(joint: float) -> None:
    assert found(wall(joint)) == []


def test_the_widths_are_told() -> None:
    rings = wall(0.01, 1, noise=0.0)
    (pair,) = seamless(rings, combinations(range(len(rings)), 2))
    assert (pair.gap, pair.usual) == pytest.approx((0.0, 0.01), abs=1e-9)


def test_sides_with_the_same_corners_are_named_in_a_drawing_as_coarse_as_its_joints() -> None:
    rings = wall(0.01, noise=0.006)
    rings[11][[1, 2]] = rings[12][[0, 3]]
    assert found(rings) == [(11, 12)]
