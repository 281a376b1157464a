"""Corners of walls: stones that end flush are quoins where the wall is seen to end, and nowhere else."""

import itertools

import numpy as np

from survey.clouds.pictures.masonry import name_stones

HEIGHT = 0.3
FRONT = (0.55, 0.35)  # lengths of the first stone of every other course [m]


def wall(courses=5, ragged=0.0, joint=0.01):
    """Outlines of courses of which every other begins with a stretcher and ends with a header."""
    rings = []
    for k in range(courses):
        heads = np.cumsum([ragged * (k % 2), FRONT[k % 2], 0.5, 0.5, FRONT[(k + 1) % 2]])
        for left, right in itertools.pairwise(heads):
            low, high = k * HEIGHT, (k + 1) * HEIGHT - joint
            rings.append(np.array([[left, low], [right - joint, low], [right - joint, high], [left, high]]))
    return rings


def kinds(rings, cut=None):
    return [stone.kind for stone in name_stones(rings, [], coursed=True, cut=cut)]


def test_stones_at_both_ends_of_a_wall_are_quoins():
    found = kinds(wall())
    assert found[0::4] == found[3::4] == ["quoin"] * 5
    assert {kind for k, kind in enumerate(found) if k % 4 in (1, 2)} == {"stretcher"}


def test_the_edge_of_the_picture_is_no_corner():
    rings = wall()
    cut = [k % 4 == 0 for k in range(len(rings))]
    found = kinds(rings, cut)
    assert "quoin" not in found[0::4]
    assert found[3::4] == ["quoin"] * 5


def test_courses_that_end_ragged_or_are_few_make_no_corner():
    assert "quoin" not in kinds(wall(ragged=0.2))[0::4]
    assert "quoin" not in kinds(wall(courses=2))
