"""Strips of contacts: parts that share no moving body, shares of equal size, and little between them."""

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanics.delassus._kernels.strips import cut


@st.composite
def graphs(draw):
    nb = draw(st.integers(2, 12))
    pair = st.tuples(st.integers(0, nb - 1), st.integers(0, nb - 1)).filter(lambda p: p[0] != p[1])
    bodies = draw(st.lists(pair, max_size=150))
    moving = draw(st.lists(st.booleans(), min_size=nb, max_size=nb))
    return np.array(bodies, dtype=np.int64).reshape(-1, 2), np.array(moving)


def distances(bodies, moving, rank):
    """Number of contacts from each moving body to the first one of its assembly, by breadth-first search with sets."""
    neighbours = {b: set() for b in np.flatnonzero(moving)}
    for i, j in bodies:
        if moving[i] and moving[j]:
            neighbours[i].add(j)
            neighbours[j].add(i)
    found = {}
    for b in np.argsort(np.where(moving, rank, len(rank)), kind="stable")[: moving.sum()]:
        if b in found:
            continue
        front, far = {b}, 0
        while front:
            found |= dict.fromkeys(front, far)
            front = set().union(*(neighbours[one] for one in front)) - set(found)
            far += 1
    return found


@settings(deadline=None)  # the first example compiles
@given(graphs(), st.integers(1, 4), st.booleans())
def test_parts_share_no_moving_body_and_hold_every_contact_once(graph, parts, along):
    bodies, moving = graph
    order, start, _ = cut(bodies, moving, parts, along)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(bodies)))
    assert len(start) == parts + 2
    assert (start[0], start[-1]) == (0, len(bodies))
    touched = [
        set(bodies[order[a:b]].ravel()) & set(np.flatnonzero(moving))
        for a, b in itertools.pairwise(start[:-1])
    ]
    assert len(set().union(*touched)) == sum(map(len, touched))


@settings(deadline=None)
@given(graphs())
def test_the_numbers_run_breadth_first_through_each_assembly(graph):
    bodies, moving = graph
    _, _, rank = cut(bodies, moving, 1, True)
    np.testing.assert_array_equal(np.sort(rank[moving]), np.arange(moving.sum()))
    assert (rank[~moving] == -1).all()
    far = distances(bodies, moving, rank)
    by_rank = sorted(far, key=lambda b: rank[b])
    # one contact farther at most, or the next assembly
    assert all(far[b] in (far[a], far[a] + 1, 0) for a, b in itertools.pairwise(by_rank))


def test_a_long_bed_has_little_between_its_strips():
    # a lattice of 100 × 5, its bodies in any order
    place = np.random.default_rng(0).permutation(500).reshape(100, 5)
    pairs = [(place[:, :-1], place[:, 1:]), (place[:-1], place[1:])]
    bodies = np.concatenate([np.column_stack([a.ravel(), b.ravel()]) for a, b in pairs])
    _, start, _ = cut(bodies, np.ones(500, dtype=bool), 4, True)
    sizes = np.diff(start)
    # a front holds five bodies, and as many contacts lead on
    assert sizes[-1] <= 3 * 10
    assert sizes[:-1].max() <= 1.1 * sizes[:-1].min()


def test_contacts_keep_their_order_in_a_strip_unless_they_follow_the_bodies():
    chain = np.column_stack([np.arange(8), np.arange(1, 9)])[::-1].copy()
    moving = np.ones(9, dtype=bool)
    np.testing.assert_array_equal(cut(chain, moving, 1, False)[0], np.arange(8))
    along, _, rank = cut(chain, moving, 1, True)
    assert (np.diff(rank[chain[along]].max(axis=1)) > 0).all()


def test_no_contacts_have_no_order():
    order, start, rank = cut(np.zeros((0, 2), dtype=np.int64), np.ones(3, dtype=bool), 2, True)
    assert (len(order), start.tolist(), sorted(rank.tolist())) == (0, [0, 0, 0, 0], [0, 1, 2])
