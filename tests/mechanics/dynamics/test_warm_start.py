"""Memory of contacts from step to step, by their keys."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanics.contact.contacts import PAIR_BIT
from mechanics.dynamics.warm_start import Memory
from mechanics.problem.problem import ContactSolution
from mechanics.scene.laws.law import BOND, ENERGY, SLIP, STATE


def solution(values):
    return ContactSolution(values, -10 * values, 1, 0.0, True)


def inner(values):
    """Internal variables, different for each contact; springs hold nothing."""
    return (values[:, :1] + 100.0 * np.arange(1, STATE + 1)) * (np.arange(STATE) != ENERGY)


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


def bonded_pairs():
    """Two contacts of the pair 5, one of the pair 6; the bond of the second is damaged."""
    state = np.zeros((3, STATE))
    state[:, BOND], state[:, SLIP] = [1.0, 0.5, 0.0], [1.0, 2.0, 3.0]
    key = np.array([(5 << PAIR_BIT) + 40, (5 << PAIR_BIT) + 2, (6 << PAIR_BIT) + 1])
    place = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.1]])
    return key, state, place


def test_a_new_contact_of_a_bonded_joint_takes_the_bond_of_the_nearest():
    """Pair 5 has lost its contact 2 and got 7 and 8; pair 9 is new, and its contact stays without a bond."""
    memory, (key, state, place) = Memory(), bonded_pairs()
    memory.store(key, solution(numbers(3)), state, place)
    asked = np.array(
        [
            (9 << PAIR_BIT) + 2,
            (5 << PAIR_BIT) + 7,
            (6 << PAIR_BIT) + 3,
            (5 << PAIR_BIT) + 40,
            (5 << PAIR_BIT) + 8,
        ]
    )
    where = np.array([[0.0, 0.0, 0.0], [0.9, 0.1, 0.0], [5.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.4, 0.0, 0.3]])
    start, found = memory.recall(asked, where)
    np.testing.assert_array_equal(found[:, BOND], [0.0, 0.5, 0.0, 1.0, 1.0])
    np.testing.assert_array_equal(found[:, SLIP], [0.0, 2.0, 3.0, 1.0, 1.0])
    # the impulses of others are not theirs
    np.testing.assert_array_equal(start.impulse, [[0, 0, 0], [0, 0, 0], [0, 0, 0], [1, 2, 3], [0, 0, 0]])


def test_without_places_or_bonds_new_contacts_start_from_zero():
    memory, (key, state, place) = Memory(), bonded_pairs()
    memory.store(key, solution(numbers(3)), state)
    assert not memory.recall(key + 1000, place)[1].any()
    state[:, BOND] = 0.0
    memory.store(key, solution(numbers(3)), state, place)
    assert not memory.recall(key + 1000, place)[1].any()


def test_the_contacts_of_a_pair_share_what_its_springs_held():
    """Pair 5 held 3 J in two contacts and has three, one of them new; pair 6 lost its only one, pair 9 is new."""
    memory, (key, state, place) = Memory(), bonded_pairs()
    state[:, ENERGY] = [1.0, 2.0, 4.0]
    memory.store(key, solution(numbers(3)), state, place)
    asked = np.array([(9 << PAIR_BIT) + 2, key[1], (5 << PAIR_BIT) + 7, key[0]])
    _, found = memory.recall(asked, np.zeros((4, 3)))
    np.testing.assert_allclose(found[:, ENERGY], [0.0, 1.0, 1.0, 1.0])
    _, same = memory.recall(key, place)
    np.testing.assert_array_equal(same[:, ENERGY], [1.0, 2.0, 4.0])
