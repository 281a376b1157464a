"""The order of the stones of a course, as one sees them who stands before the wall."""

import numpy as np
import pytest

from archmodel.relations.zones_and_courses import along_the_wall, course_code


def order(centres, normals):
    return along_the_wall(np.asarray(centres, dtype=float), np.asarray(normals, dtype=float)).tolist()


@pytest.mark.parametrize("degrees", [0.0, 35.0, 90.0, 180.0, 271.0])
def test_a_wall_is_read_from_left_to_right_whichever_way_it_looks(degrees):
    # seen from -y, x goes to the right
    turn = np.radians(degrees)
    about = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    places = [2.0, 0.0, 3.0, 1.0]
    centres = np.array([[x, 0.2, 1.0] for x in places]) @ about.T + [4e5, 7e6, 300]
    looks = np.tile(about @ [0, -1, 0], (4, 1))
    assert order(centres, looks) == [1, 3, 0, 2]


def test_a_tower_is_read_to_the_right_from_behind_its_widest_gap():
    # seen from outside, to the right is counter-clockwise from above; the door is at 200°
    angles = np.radians([10, 50, 90, 130, 170, 230, 260, 300, 330])
    centres = np.column_stack([4 * np.cos(angles), 4 * np.sin(angles), np.zeros(9)])
    shuffled = np.random.default_rng(3).permutation(9)
    found = order(centres[shuffled], centres[shuffled] / 4)
    assert [int(shuffled[i]) for i in found] == [5, 6, 7, 8, 0, 1, 2, 3, 4]


def test_two_facings_are_read_along_the_wall_together():
    centres = [[0, 0, 0], [2, 0.5, 0], [1, 0, 0], [3, 0, 0], [0.5, 0.5, 0], [4, 0.5, 0]]
    looks = [[0, -1, 0], [0, 1, 0], [0, -1, 0], [0, -1, 0], [0, 1, 0], [0, 1, 0]]
    assert order(centres, looks) == [0, 4, 2, 1, 3, 5]


def test_stones_of_which_nothing_is_known_come_last():
    unknown = [np.nan] * 3
    assert order([unknown, [1, 0, 0], [0, 0, 0]], [unknown, [0, -1, 0], unknown]) == [2, 1, 0]
    assert order([unknown, unknown], [unknown, unknown]) == [0, 1]
    assert order([[1, 2, 3]], [unknown]) == [0]


def test_codes_of_courses_name_their_zones():
    assert course_code(None, 3) == "course 3"
    assert course_code("north wall", 12) == "north wall/course 12"
