"""What is remembered of contacts from step to step, by their keys."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanics.laws.law import STATE
from mechanics.memory import Memory
from mechanics.problem import ContactSolution


def solution(values):
    return ContactSolution(values, -10 * values, 1, 0.0, True)


def inner(values):
    """Internal variables, different for each contact."""
    return values[:, :1] + 100.0 * np.arange(1, STATE + 1)


def numbers(count, dimension=3):
    return np.arange(1.0, count * dimension + 1).reshape(count, dimension)


@pytest.mark.parametrize("dimension", [2, 3])
def test_nothing_is_recalled_at_first(dimension):
    start, state = Memory(dimension).recall(np.array([7, 3, 5, 1]))
    np.testing.assert_array_equal(start.impulse, np.zeros((4, dimension)))
    np.testing.assert_array_equal(start.velocity, np.zeros((4, dimension)))
    np.testing.assert_array_equal(state, np.zeros((4, STATE)))


@pytest.mark.parametrize("dimension", [2, 3])
def test_contacts_are_recalled_by_key_in_any_order_and_new_ones_start_from_zero(dimension):
    memory, values = Memory(dimension), numbers(4, dimension)
    memory.store(np.array([7, 3, 5, 1]), solution(values), inner(values))
    start, state = memory.recall(np.array([1, 4, 7, 99, 5, 0, 3, 2]))
    known, source = [0, 2, 4, 6], [3, 0, 2, 1]
    expected, variables = np.zeros((8, dimension)), np.zeros((8, STATE))
    expected[known], variables[known] = values[source], inner(values)[source]
    np.testing.assert_array_equal(start.impulse, expected)
    np.testing.assert_array_equal(start.velocity, -10 * expected)
    np.testing.assert_array_equal(state, variables)


def test_only_the_last_step_is_remembered():
    memory, values = Memory(), np.ones((4, 3))
    memory.store(np.array([7, 3, 5, 1]), solution(values), inner(values))
    memory.store(np.array([7, 3, 5, 2]), solution(2 * values), inner(2 * values))
    start, state = memory.recall(np.array([1, 2, 3, 4]))
    np.testing.assert_array_equal(start.impulse[:, 0], [0, 2, 2, 0])
    np.testing.assert_array_equal(state[:, 0], [0, 102, 102, 0])


def test_the_same_contacts_are_recalled_as_they_were_stored():
    memory, values, key = Memory(), numbers(4), np.array([7, 3, 5, 1])
    memory.store(key, solution(values), inner(values))
    start, state = memory.recall(key)
    np.testing.assert_array_equal(start.impulse, values)
    np.testing.assert_array_equal(start.velocity, -10 * values)
    np.testing.assert_array_equal(state, inner(values))


def test_nothing_is_recalled_after_a_step_without_contacts():
    memory, values = Memory(), numbers(2)
    memory.store(np.array([4, 9]), solution(values), inner(values))
    empty = np.zeros((0, 3))
    memory.store(np.zeros(0, dtype=np.int64), solution(empty), np.zeros((0, STATE)))
    start, _ = memory.recall(np.array([4, 9]))
    assert not start.impulse.any()


keys = st.lists(st.integers(0, 2**62), unique=True, max_size=30)


@settings(max_examples=60, deadline=None)
@given(keys, keys, st.data())
def test_recall_is_that_of_a_dictionary(stored, fresh, data):
    asked = data.draw(st.permutations(sorted({*stored[::2], *fresh})))
    memory, values = Memory(), numbers(len(stored))
    memory.store(np.array(stored, dtype=np.int64), solution(values), inner(values))
    start, state = memory.recall(np.array(asked, dtype=np.int64))
    book = dict(zip(stored, zip(values, inner(values), strict=True), strict=True))
    for row, key in enumerate(asked):
        impulse, variables = book.get(key, (np.zeros(3), np.zeros(STATE)))
        np.testing.assert_array_equal(start.impulse[row], impulse)
        np.testing.assert_array_equal(state[row], variables)
