"""Factors by fronts against dense linear algebra, for random stones, contacts and blocks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import block_diag, lu_solve
from scipy.linalg.lapack import dgetrs
from threadpoolctl import ThreadpoolController

from ground.errors import SolverError
from mechanics.delassus import elimination, multifrontal
from mechanics.delassus._kernels.fronts import add_into, solve
from mechanics.delassus._kernels.mixed import ELASTIC
from mechanics.delassus.mixed_form import mixed_fronts
from mechanics.delassus.multifrontal import Cliques, fronts
from mechanics.scene.scene import Fidelity
from tests.mechanics.shapes import TURN, brick, dense_operator, ground, moved, posed, scene

SOFT = Fidelity.DEFORMABLE


def random_pairs(rng, bodies, contacts):
    """Pairs of different bodies; body 0 is fixed. Few bodies meet in many contacts, many bodies in few."""
    first = rng.integers(0, bodies, contacts)
    second = (first + rng.integers(1, bodies, contacts)) % bodies
    return np.column_stack([first, second]).astype(np.int64)


def cliques_of(rng, pairs, rank=None):
    """A random semi-definite block for each body that moves, its contacts in any order."""
    contacts, blocks = [], []
    for body in range(1, int(pairs.max(initial=0)) + 1):
        own = rng.permutation(np.flatnonzero((pairs == body).any(axis=1)))
        if len(own):
            half = rng.normal(size=(3 * len(own), rank or 3 * len(own)))
            contacts.append(own)
            blocks.append(half @ half.T)
    return Cliques(contacts, blocks)


def dense(count, cliques, theta):
    """W + Θ, entry by entry."""
    matrix = np.zeros((3 * count, 3 * count))
    for contacts, block in zip(cliques.contacts, cliques.blocks, strict=True):
        rows = (3 * contacts[:, None] + np.arange(3)).ravel()
        matrix[np.ix_(rows, rows)] += block
    for c in range(count):
        matrix[3 * c : 3 * c + 3, 3 * c : 3 * c + 3] += theta[c]
    return matrix


def case(seed, bodies=6, contacts=20, rank=None):
    rng = np.random.default_rng(seed)
    pairs = random_pairs(rng, bodies, contacts)
    # not symmetric, its symmetric part positive
    theta = rng.normal(size=(contacts, 3, 3)) + 6.0 * np.eye(3)
    return rng, pairs, cliques_of(rng, pairs, rank), theta


def chain(stones, joint):
    """A column of stones on the ground, with so many contacts in each joint."""
    pairs = np.repeat(np.column_stack([np.arange(stones), np.arange(1, stones + 1)]), joint, axis=0)
    return pairs.astype(np.int64)


@given(
    seed=st.integers(0, 2**32 - 1),
    bodies=st.integers(2, 12),
    contacts=st.integers(1, 40),
    rank=st.sampled_from([None, 6]),
)
@settings(max_examples=80, deadline=None)
def test_the_solution_is_that_of_the_dense_system(seed, bodies, contacts, rank):
    rng, pairs, cliques, theta = case(seed, bodies, contacts, rank)
    matrix, b = dense(contacts, cliques, theta), rng.normal(size=3 * contacts)
    kept = b.copy()
    x = fronts(pairs, cliques.contacts).factorise(cliques, theta).solve(b)
    np.testing.assert_array_equal(b, kept)
    # a backward error of rounding, whatever the conditioning
    size = np.abs(matrix).sum(axis=1).max() * np.abs(x).max() + np.abs(b).max()
    assert np.abs(matrix @ x - b).max() < 1e-11 * size
    if np.linalg.cond(matrix) < 1e6:
        np.testing.assert_allclose(x, np.linalg.solve(matrix, b), atol=1e-9 * np.abs(x).max())


def test_one_contact_is_one_small_system():
    theta = np.array([[[1.0, 2.0, 0.0], [0.0, 1.0, 3.0], [4.0, 0.0, 1.0]]])
    cliques = Cliques([np.array([0])], [np.diag([1.0, 2.0, 3.0])])
    x = (
        fronts(np.array([[0, 1]]), cliques.contacts)
        .factorise(cliques, theta)
        .solve(np.array([1.0, 2.0, 3.0]))
    )
    np.testing.assert_allclose(x, np.linalg.solve(theta[0] + cliques.blocks[0], [1.0, 2.0, 3.0]), rtol=1e-14)


def test_rows_are_exchanged_where_a_pivot_is_zero():
    """W + Θ with a zero diagonal: without exchanges the first pivot would be 0."""
    theta = np.array([[[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]])
    cliques = Cliques([np.array([0])], [np.zeros((3, 3))])
    x = (
        fronts(np.array([[0, 1]]), cliques.contacts)
        .factorise(cliques, theta)
        .solve(np.array([1.0, 2.0, 3.0]))
    )
    np.testing.assert_array_equal(x, [3.0, 1.0, 2.0])


def test_no_contact_is_no_system():
    none = fronts(np.zeros((0, 2), dtype=np.int64), [])
    factors = none.factorise(Cliques([], []), np.zeros((0, 3, 3)))
    assert none.size == 0
    assert factors.solve(np.zeros(0)).shape == (0,)


def test_stones_that_touch_only_the_ground_are_solved_apart():
    """No front holds more than the contacts of one stone: the factors are the squares of their sizes."""
    count = np.array([1, 4, 2, 7])
    pairs = np.column_stack([np.zeros(count.sum(), dtype=np.int64), np.repeat(np.arange(1, 5), count)])
    rng = np.random.default_rng(1)
    pairs = pairs[rng.permutation(len(pairs))]
    pairs[::2] = pairs[::2, ::-1]
    cliques, theta = cliques_of(rng, pairs, 6), rng.normal(size=(len(pairs), 3, 3)) + 5 * np.eye(3)
    own = fronts(pairs, cliques.contacts)
    assert own.size == 9 * (count**2).sum()
    b = rng.normal(size=3 * len(pairs))
    x = own.factorise(cliques, theta).solve(b)
    np.testing.assert_allclose(dense(len(pairs), cliques, theta) @ x, b, atol=1e-9)


@pytest.mark.parametrize(("stones", "joint"), [(2, 1), (5, 3), (40, 4)])
def test_a_column_fills_nothing_in(stones, joint):
    """From one end to the other: each front holds its joint and the next, k² + 2k² numbers; the last one k²."""
    pairs = chain(stones, joint)
    cliques = cliques_of(np.random.default_rng(0), pairs)
    k = 3 * joint
    assert fronts(pairs, cliques.contacts).size == 3 * k**2 * (stones - 1) + k**2


@pytest.mark.parametrize("seed", range(5))
def test_each_unknown_is_a_pivot_exactly_once_and_fronts_hold_what_comes_later(seed):
    _, pairs, cliques, _ = case(seed, 9, 60)
    own = fronts(pairs, cliques.contacts)
    fronts_of = [
        own.layout.dof[own.layout.dptr[f] : own.layout.dptr[f + 1]] for f in range(len(own.layout.width))
    ]
    pivots = [unknown[:width] for unknown, width in zip(fronts_of, own.layout.width, strict=True)]
    np.testing.assert_array_equal(np.sort(np.concatenate(pivots)), np.arange(3 * len(pairs)))
    np.testing.assert_array_equal(np.sort(own.layout.order), np.arange(len(own.layout.width)))
    when = np.empty(3 * len(pairs), dtype=int)
    for rank, f in enumerate(own.layout.order):
        when[pivots[f]] = rank
    for f, unknown in enumerate(fronts_of):
        assert len(np.unique(unknown)) == len(unknown)
        later = when[unknown[own.layout.width[f] :]]
        assert (np.diff(later) >= 0).all()
        assert (later > when[pivots[f][0]]).all()
    # contacts of the same two stones go together
    _, joint = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
    front_of = np.empty(len(pairs), dtype=int)
    for f, pivot in enumerate(pivots):
        front_of[pivot // 3] = f
    assert all(len(np.unique(front_of[joint == j])) == 1 for j in range(joint.max() + 1))
    assert sum(len(parts) for parts in own.cliques) == len(cliques.contacts)


def test_one_analysis_serves_all_matrices_of_a_pattern():
    rng, pairs, cliques, theta = case(3, 8, 50)
    own, b = fronts(pairs, cliques.contacts), rng.normal(size=150)
    first = own.factorise(cliques, theta)
    other = Cliques(cliques.contacts, [2.0 * block for block in cliques.blocks])
    for changed, factor in ((cliques, 1.0), (cliques, -30.0), (other, 0.2)):
        x = own.factorise(changed, factor * theta).solve(b)
        matrix = dense(50, changed, factor * theta)
        np.testing.assert_allclose(x, np.linalg.solve(matrix, b), atol=1e-9 * np.abs(x).max())
    # earlier factors are still what they were
    x = first.solve(b)
    np.testing.assert_allclose(dense(50, cliques, theta) @ x, b, atol=1e-9)


def test_a_result_repeats_bit_for_bit():
    rng, pairs, cliques, theta = case(4, 8, 50)
    b = rng.normal(size=150)
    one, other = (fronts(pairs, cliques.contacts).factorise(cliques, theta).solve(b) for _ in range(2))
    np.testing.assert_array_equal(one, other)


def wall_of_joints():
    """A wall of 6 × 6 stones with joints of one size: its fronts, W and Θ."""
    at = np.arange(1, 37).reshape(6, 6)
    below, left = np.vstack([np.zeros(6, dtype=np.int64), at[:-1]]), at[:, :-1]
    joints = np.vstack(
        [np.column_stack([below.ravel(), at.ravel()]), np.column_stack([left.ravel(), at[:, 1:].ravel()])]
    )
    rng, pairs = np.random.default_rng(9), np.repeat(joints, 3, axis=0)
    cliques = cliques_of(rng, pairs)
    theta = rng.normal(size=(len(pairs), 3, 3)) + 6.0 * np.eye(3)
    return fronts(pairs, cliques.contacts), cliques, theta


@pytest.mark.parametrize("threads", [2, 3])
def test_factors_do_not_depend_on_the_threads(monkeypatch, threads):
    """Subtrees apart, then fronts of several panels together."""
    monkeypatch.setattr(multifrontal, "_PANEL", 24)
    own, cliques, theta = wall_of_joints()
    trees, top = own._split
    assert len(trees) > threads
    assert len(top) > threads
    assert sorted([*top, *(f for tree in trees for f in tree)]) == sorted(own.layout.order)
    # as in a run: products of BLAS depend on the number of its own threads
    with ThreadpoolController().limit(limits=1, user_api="blas"):
        one, several = (own.factorise(cliques, theta, count) for count in (1, threads))
    np.testing.assert_array_equal(one.factor, several.factor)
    np.testing.assert_array_equal(one.pivots, several.pivots)


def test_panels_of_a_front_have_row_exchanges_of_their_own(monkeypatch):
    """SciPy's `dgetrs` counts them from 1 within the array while it runs: shared ones went wrong once in 40 runs."""
    kept = []

    def recorded(lu, exchanged, right, **settings):
        assert all(not np.shares_memory(one, exchanged) for one in kept)
        kept.append(exchanged)
        return dgetrs(lu, exchanged, right, **settings)

    monkeypatch.setattr(multifrontal, "_PANEL", 24)
    monkeypatch.setattr(multifrontal, "dgetrs", recorded)
    own, cliques, theta = wall_of_joints()
    own.factorise(cliques, theta)
    # more panels than fronts
    assert len(kept) > len(own.layout.order)


@pytest.mark.parametrize("contacts", [1, 7])
def test_a_singular_matrix_is_refused(contacts):
    pairs = np.tile(np.array([[0, 1]]), (contacts, 1))
    cliques = Cliques([np.arange(contacts)], [np.zeros((3 * contacts, 3 * contacts))])
    theta = np.tile(np.eye(3), (contacts, 1, 1))
    theta[-1] = np.diag([1.0, 0.0, 1.0])
    with pytest.raises(SolverError, match=r"W \+ Θ is singular"):
        fronts(pairs, cliques.contacts).factorise(cliques, theta)


@pytest.mark.parametrize("many", [1000, 1])
def test_systems_of_fixed_rigid_and_deformable_stones_are_those_of_w(monkeypatch, many):
    """Fixed, rigid and deformable stones, each with each, some of them candidate here and antagonist there.

    By least degree, and by dissection.
    """
    monkeypatch.setattr(elimination, "_MANY", many)
    stones = (
        ground((-1, -1, -0.4), (2, 2, 0)),
        brick("soft", (0, 0, 0), (0.7, 0.5, 0.4), SOFT, mesh_size=0.5),
        brick("hard", (0.2, 0.1, 0.4), (0.9, 0.5, 0.7)),
        brick("beside", (0.7, 0, 0), (1.2, 0.5, 0.4)),
        brick("upper", (0.1, 0, 0.7), (0.7, 0.4, 1.0), SOFT, mesh_size=0.5),
    )
    one = posed(scene(*(moved(stone, TURN) for stone in stones)))
    w_hat, transpose = dense_operator(one.model, one.state, one.contacts, one.compliance)
    expected, count = transpose @ w_hat @ transpose.T, len(one.contacts)
    form = one.operator.form
    np.testing.assert_allclose(form.matrix.toarray(), expected, atol=1e-9 * np.abs(expected).max())
    rng = np.random.default_rng(0)
    b = rng.normal(size=3 * count)
    for size in (1.0, 1e-6):
        theta = size * np.abs(expected).max() * (rng.normal(size=(count, 3, 3)) + 6.0 * np.eye(3))
        x = form.shifted(theta)(b)
        matrix = expected + block_diag(*theta)
        # that of the dense system as far as its conditioning allows
        np.testing.assert_allclose(matrix @ x, b, atol=1e-9)


def test_rigid_stones_have_six_unknowns_whatever_touches_them():
    """A deformable stone on a column of rigid ones: four contacts a joint, of which one joint is soft."""
    kinds = [Fidelity.FIXED, *3 * [Fidelity.RIGID], SOFT]
    stones = (
        brick(str(k), (0, 0, 0.3 * k), (0.5, 0.4, 0.3 * k + 0.3), kind, mesh_size=0.5)
        for k, kind in enumerate(kinds)
    )
    one = posed(scene(*stones))
    operator = one.operator
    own = mixed_fronts(operator.body, operator.kind, operator.centre)
    soft = int((operator.kind == ELASTIC).any(axis=1).sum())
    assert own.layout.width.sum() == 3 * soft + 6 * 3
    assert soft < len(one.contacts)


# --- the kernels ---


def add_twin(front, runs, block):
    result = front.copy()
    place = np.concatenate([np.arange(there, there + length) for there, _, length in runs])
    own = np.concatenate([np.arange(here, here + length) for _, here, length in runs])
    for i, row in enumerate(place):
        for j, column in enumerate(place):
            result[row, column] += block[own[i], own[j]]
    return result


def solve_twin(b, own, factors):
    """Front by front with dense LU: eliminate, then substitute back."""
    x = b.copy()
    parts = {}
    for f in own.layout.order:
        unknown, k = own.layout.dof[own.layout.dptr[f] : own.layout.dptr[f + 1]], int(own.layout.width[f])
        m, numbers = len(unknown) - k, factors.factor[own.layout.fptr[f] : own.layout.fptr[f + 1]]
        lu = numbers[: k * k].reshape(k, k).T
        across = numbers[k * k : k * (k + m)].reshape(m, k).T
        below = numbers[k * (k + m) :].reshape(k, m).T
        pivots = factors.pivots[own.layout.pptr[f] : own.layout.pptr[f + 1]]
        parts[f] = unknown[:k], unknown[k:], across
        x[unknown[:k]] = lu_solve((lu, pivots), x[unknown[:k]])
        x[unknown[k:]] -= below @ x[unknown[:k]]
    for f in own.layout.order[::-1]:
        pivot, later, across = parts[f]
        x[pivot] -= across @ x[later]
    return x


def test_assembly_of_a_front_is_that_of_the_slow_twin():
    """Four pivots and five others: runs among either, in the order of neither front nor block."""
    rng = np.random.default_rng(2)
    front = np.asfortranarray(rng.normal(size=(9, 9)))
    block = np.asfortranarray(rng.normal(size=(6, 6)))
    runs = np.array([[5, 0, 2], [1, 2, 3], [8, 5, 1]])
    expected = add_twin(front, runs, block)
    pivot, below, update = (np.asfortranarray(part) for part in (front[:4], front[4:, :4], front[4:, 4:]))
    for part in (runs[1:], runs[:1]):
        add_into(pivot, below, update, runs, part, block)
    np.testing.assert_allclose(
        np.vstack([pivot, np.hstack([below, update])]), expected, rtol=1e-15, atol=1e-15
    )


@pytest.mark.parametrize("joint", [1, 4])
def test_fronts_that_hold_the_same_unknowns_are_one(joint):
    """A stone on three others on the ground: the joints of the lower ones first, then all of the upper one at once."""
    pairs = np.repeat([[0, 1], [0, 2], [0, 3], [1, 4], [2, 4], [3, 4]], joint, axis=0)
    cliques = cliques_of(np.random.default_rng(0), pairs)
    own = fronts(pairs, cliques.contacts)
    assert sorted(own.layout.width // (3 * joint)) == [1, 1, 1, 3]


@pytest.mark.parametrize("seed", range(4))
def test_substitution_is_that_of_the_slow_twin(seed):
    rng, pairs, cliques, theta = case(seed, 7, 40)
    own = fronts(pairs, cliques.contacts)
    factors, b = own.factorise(cliques, theta), rng.normal(size=120)
    x = b.copy()
    solve(x, own.layout, factors.pivots, factors.factor)
    np.testing.assert_allclose(x, solve_twin(b, own, factors), atol=1e-11 * np.abs(x).max())
