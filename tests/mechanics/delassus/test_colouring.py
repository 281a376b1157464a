"""Colours of contacts: proper, few, deterministic, and equal to a slow twin's."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanics.delassus.colouring import greedy_colours


def first_fit_twin(bodies, moving):
    """First fit, with sets."""
    used = {b: set() for b in range(len(moving))}
    colour = []
    for pair in bodies:
        mine = [b for b in pair if moving[b]]
        taken = set().union(*(used[b] for b in mine)) if mine else set()
        one = next(c for c in range(len(bodies) + 1) if c not in taken)
        colour.append(one)
        for b in mine:
            used[b].add(one)
    return np.array(colour, dtype=np.int64)


@st.composite
def graphs(draw):
    nb = draw(st.integers(2, 12))
    pair = st.tuples(st.integers(0, nb - 1), st.integers(0, nb - 1)).filter(lambda p: p[0] != p[1])
    bodies = draw(st.lists(pair, max_size=150))
    moving = draw(st.lists(st.booleans(), min_size=nb, max_size=nb))
    return np.array(bodies, dtype=np.int64).reshape(-1, 2), np.array(moving)


@settings(deadline=None)  # the first example compiles
@given(graphs())
def test_colours_are_those_of_the_slow_twin(graph):
    bodies, moving = graph
    np.testing.assert_array_equal(greedy_colours(bodies, moving), first_fit_twin(bodies, moving))


@settings(deadline=None)  # the first example compiles
@given(graphs())
def test_no_colour_holds_a_moving_body_twice(graph):
    bodies, moving = graph
    colour = greedy_colours(bodies, moving)
    for one in set(colour.tolist()):
        touched = bodies[colour == one].ravel()
        touched = touched[moving[touched]]
        assert len(touched) == len(set(touched.tolist()))


def test_a_hub_needs_as_many_colours_as_it_has_contacts_unless_it_is_fixed():
    # more than one word of 64 colours
    bodies = np.column_stack([np.zeros(300, dtype=np.int64), np.arange(1, 301)])
    moving = np.ones(301, dtype=bool)
    np.testing.assert_array_equal(greedy_colours(bodies, moving), np.arange(300))
    moving[0] = False
    assert not greedy_colours(bodies, moving).any()


def test_a_chain_has_two_colours():
    bodies = np.column_stack([np.arange(99), np.arange(1, 100)])
    np.testing.assert_array_equal(greedy_colours(bodies, np.ones(100, dtype=bool)), np.arange(99) % 2)


def test_no_contacts_have_no_colours():
    assert greedy_colours(np.zeros((0, 2), dtype=np.int64), np.ones(3, dtype=bool)).shape == (0,)
