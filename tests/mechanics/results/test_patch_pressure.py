"""Pressures of patches: a uniform pressure stays, slivers do not matter, joints do not mix."""

import numpy as np
import pytest

from mechanics.results.patch_pressure import patch_pressure


def grid(n=8):
    """Points of an n × n grid of cells on the unit square, and their areas."""
    middle = (np.arange(n) + 0.5) / n
    x, y = np.meshgrid(middle, middle)
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(n * n)]), np.full(n * n, 1.0 / n**2)


def test_a_uniform_pressure_stays_what_it_is():
    point, area = grid()
    assert patch_pressure(point, 3e5 * area, area, np.zeros(64, dtype=int)) == pytest.approx(3e5)


def test_a_linear_pressure_is_kept_but_for_its_ends():
    """A patch in the middle is symmetric; at the edge it averages over 1.5 cells."""
    point, area = grid(40)
    pressure = 1e5 * point[:, 0]
    found = patch_pressure(point, pressure * area, area, np.zeros(1600, dtype=int))
    inner = np.all(np.abs(point[:, :2] - 0.5) < 0.45, axis=1)
    np.testing.assert_allclose(found[inner], pressure[inner], rtol=1e-9)
    assert found.max() == pytest.approx(1e5, rel=0.04)


def test_a_force_on_a_sliver_counts_with_its_neighbours():
    point, area = grid()
    area = area.copy()
    sliver = 0
    area[sliver] *= 1e-3
    force = 2e5 * area
    force[sliver] = 2e5 / 64  # what a whole cell would bear
    found = patch_pressure(point, force, area, np.zeros(64, dtype=int))
    assert force[sliver] / area[sliver] == pytest.approx(2e8)
    assert found.max() < 4e5


def test_joints_in_one_place_do_not_mix():
    point, area = grid()
    joint = np.repeat([0, 2], 64)  # and one without contacts
    force = np.concatenate([1e5 * area, 4e5 * area])
    found = patch_pressure(np.vstack([point, point]), force, np.concatenate([area, area]), joint)
    assert found[:64] == pytest.approx(1e5)
    assert found[64:] == pytest.approx(4e5)


def test_the_corners_of_a_square_are_patches_of_their_own():
    point = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    found = patch_pressure(point, np.array([1.0, 2.0, 3.0, 4.0]), np.full(4, 0.25), np.zeros(4, dtype=int))
    assert found == pytest.approx([4.0, 8.0, 12.0, 16.0])


def test_no_contacts_have_no_pressure():
    assert len(patch_pressure(np.zeros((0, 3)), np.zeros(0), np.zeros(0), np.zeros(0, dtype=int))) == 0
