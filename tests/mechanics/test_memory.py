"""Warm starts by contact key."""

from dataclasses import replace

import numpy as np

from mechanics.memory import Memory
from mechanics.problem import ContactSolution
from tests.mechanics.shapes import brick, detected, ground, scene


def contacts_with(keys):
    stones = [brick(str(k), (2 * k, 0, 0), (2 * k + 1, 1, 1)) for k in range(len(keys) // 4)]
    _, _, contacts = detected(scene(ground((-9, -9, -1), (99, 9, 0)), *stones))
    return replace(contacts, key=np.array(keys))


def solution(values):
    return ContactSolution(values, -10 * values, 1, 0.0, True)


def test_nothing_is_recalled_at_first():
    start = Memory().recall(contacts_with([7, 3, 5, 1]))
    np.testing.assert_array_equal(start.impulse, np.zeros((4, 3)))
    np.testing.assert_array_equal(start.velocity, np.zeros((4, 3)))


def test_contacts_are_recalled_by_key_in_any_order_and_new_ones_start_from_zero():
    memory, values = Memory(), np.arange(12.0).reshape(4, 3) + 1
    memory.store(contacts_with([7, 3, 5, 1]), solution(values))
    start = memory.recall(contacts_with([1, 4, 7, 99, 5, 0, 3, 2]))
    expected = np.array([values[3], [0] * 3, values[0], [0] * 3, values[2], [0] * 3, values[1], [0] * 3])
    np.testing.assert_array_equal(start.impulse, expected)
    np.testing.assert_array_equal(start.velocity, -10 * expected)


def test_only_the_last_step_is_remembered():
    memory, values = Memory(), np.ones((4, 3))
    memory.store(contacts_with([7, 3, 5, 1]), solution(values))
    memory.store(contacts_with([7, 3, 5, 2]), solution(2 * values))
    start = memory.recall(contacts_with([1, 2, 3, 4]))
    np.testing.assert_array_equal(start.impulse[:, 0], [0, 2, 2, 0])
