"""Patches of faces and cubes of space by hand: what is divided, joined again, and looked up."""

from types import SimpleNamespace

import numpy as np
import pytest

from survey.clouds import collecting
from survey.clouds.collecting import divide


def outline(width=2.0, height=0.5, origin=(10.0, 20.0, 30.0), turned=False):
    """A rectangle about its origin, level along x and upright, or lying."""
    ring = 0.5 * np.array([[-width, -height], [width, -height], [width, height], [-width, height]])
    axes = (
        np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
        if not turned
        else np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    )
    return SimpleNamespace(ring=ring, origin=np.array(origin), axes=axes, area=width * height)


def test_a_face_is_divided_within_its_margins_into_about_as_many_squares_as_stated():
    found = divide([outline(), outline(4.0, 1.0)], np.array([0.05, 0.1]))
    assert found.low.tolist() == [pytest.approx([-0.95, -0.2]), pytest.approx([-1.9, -0.4])]
    assert found.high.tolist() == [pytest.approx([0.95, 0.2]), pytest.approx([1.9, 0.4])]
    # squares of a side whose number fills the inner area
    assert found.side == pytest.approx(np.sqrt(np.array([1.9 * 0.4, 3.8 * 0.8]) / collecting._PATCHES))
    columns = np.ceil(np.array([1.9, 3.8]) / found.side)
    rows = np.ceil(np.array([0.4, 0.8]) / found.side)
    assert found.columns.tolist() == columns.tolist()
    assert np.diff(found.first).tolist() == (columns * rows).tolist()


def test_a_tiny_face_has_patches_no_finer_than_a_limit_and_a_slanting_one_not_too_many():
    tiny = divide([outline(0.01, 0.01)], np.array([0.0]))
    assert tiny.side[0] >= collecting._SMALLEST
    slanting = outline(4.0, 4.0)
    slanting.area = 0.01  # it fills little of its box
    found = divide([slanting], np.array([0.0]))
    assert found.side[0] == pytest.approx(np.sqrt(16.0 / collecting._MAX_PATCHES))


def test_two_by_two_patches_become_one_with_all_of_their_points():
    # three columns and two rows; patch p holds p + 1 points, of which three are kept
    counts = np.array([1, 2, 3, 2, 0, 5])
    places = np.zeros((6, 3, 3), np.float32)
    for patch in range(6):
        places[patch, :, 0] = 10 * patch + np.arange(3)
    joined, together, columns = collecting._coarser(counts, places, 3)
    assert (columns, joined.tolist()) == (2, [5, 6])
    assert together[0, :5, 0].tolist() == [0.0, 10.0, 11.0, 30.0, 31.0]
    assert together[1, :6, 0].tolist() == [20.0, 21.0, 22.0, 50.0, 51.0, 52.0]


@pytest.mark.parametrize("turned", [False, True])
def test_the_box_of_a_slab_reaches_to_both_sides_of_its_plane(turned):
    low, high = collecting._box(outline(turned=turned), 0.2)
    reach = [0.25, 1.0, 0.2] if turned else [1.0, 0.2, 0.25]
    assert high - [10.0, 20.0, 30.0] == pytest.approx(reach)
    assert [10.0, 20.0, 30.0] - low == pytest.approx(reach)


def test_every_cube_of_space_lists_the_outlines_whose_slab_reaches_into_it():
    placed = [outline(), outline(origin=(13.0, 20.0, 30.0)), outline(origin=(10.0, 20.0, 33.0), turned=True)]
    origin = np.array([10.0, 20.0, 30.0])
    grid = collecting._grid(placed, origin, 0.2)
    rng = np.random.default_rng(3)
    boxes = [collecting._box(one, 0.2) - origin for one in placed]
    seen = 0
    for place in rng.uniform([-1.0, -1.0, -0.25], [4.0, 1.0, 3.2], (4000, 3)):
        within = {k for k, (low, high) in enumerate(boxes) if ((place > low) & (place < high)).all()}
        cell = np.floor((place - grid.low) / grid.side).astype(int)
        if (cell < 0).any() or (cell >= grid.shape).any():
            assert not within
            continue
        number = int((cell[0] * grid.shape[1] + cell[1]) * grid.shape[2] + cell[2])
        listed = set(grid.members[grid.start[number] : grid.start[number + 1]].tolist())
        assert within <= listed
        seen += len(within)
    assert seen > 50
