"""Factors of block-sparse matrices against dense ones."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanics.solvers._kernels import block_fronts as fronts


def pattern_of(bodies, count):
    """Block rows of contacts (n, 2) between bodies: those that share one couple; body 0 does not move."""
    side = np.zeros((len(bodies), count), dtype=bool)
    side[np.arange(len(bodies))[:, None], bodies] = True
    side[:, 0] = False
    couple = side @ side.T | np.eye(len(bodies), dtype=bool)
    indptr = np.concatenate([[0], np.cumsum(couple.sum(axis=1))]).astype(np.int64)
    return np.nonzero(couple)[1].astype(np.int64), indptr


def dense(value, indices, indptr):
    """The same matrix with all its zeros."""
    n = len(indptr) - 1
    matrix = np.zeros((n, 3, n, 3))
    for c in range(n):
        for p in range(indptr[c], indptr[c + 1]):
            matrix[c, :, indices[p]] += value[p]
    return matrix.reshape(3 * n, 3 * n)


def factors(value, indices, indptr, symmetric):
    """Analyse, factorise, and give a function that solves; None if there are no factors."""
    plan = fronts.analyse(indices, indptr)
    factor, pivot = np.empty(plan.aptr[-1]), np.empty(3 * (len(indptr) - 1), dtype=np.int64)
    if not fronts.factorise(value, symmetric, plan, factor, pivot):
        return None

    def solve(right):
        x = right.copy()
        fronts.solve(x, plan, factor, pivot, np.empty(plan.whole.max()))
        return x

    return solve


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 40), st.integers(2, 15), st.integers(0, 2**32 - 1), st.booleans())
def test_solutions_are_those_of_the_dense_matrix(contacts, bodies, seed, symmetric):
    rng = np.random.default_rng(seed)
    indices, indptr = pattern_of(rng.integers(0, bodies, (contacts, 2)), bodies)
    value = rng.normal(size=(len(indices), 3, 3))
    matrix = dense(value, indices, indptr)
    if symmetric:
        value = 0.5 * (matrix + matrix.T).reshape(contacts, 3, contacts, 3).transpose(0, 2, 1, 3)
        value = value[np.repeat(np.arange(contacts), np.diff(indptr)), indices]
    own = np.repeat(np.arange(contacts), np.diff(indptr)) == indices
    # diagonally dominant: no pivot is small
    value[own] += 3.0 * np.diff(indptr).max() * 3.0 * np.eye(3)
    matrix, right = dense(value, indices, indptr), rng.normal(size=(contacts, 3))
    solve = factors(np.ascontiguousarray(value), indices, indptr, symmetric)
    assert solve is not None
    wanted = np.linalg.solve(matrix, right.ravel()).reshape(-1, 3)
    assert solve(right) == pytest.approx(wanted, abs=1e-12 * np.abs(wanted).max())


def test_pivots_are_sought_within_a_group():
    # four contacts of one pair of bodies: zeros on the diagonal are no obstacle
    indices, indptr = pattern_of(np.array([[0, 1]] * 4), 2)
    rng = np.random.default_rng(3)
    value = rng.normal(size=(16, 3, 3))
    value[::5] = 0.0
    right = rng.normal(size=(4, 3))
    solve = factors(value, indices, indptr, symmetric=False)
    wanted = np.linalg.solve(dense(value, indices, indptr), right.ravel()).reshape(-1, 3)
    assert solve(right) == pytest.approx(wanted, rel=1e-9)


def test_a_singular_matrix_has_no_factors():
    indices, indptr = pattern_of(np.array([[0, 1], [1, 2]]), 3)
    assert factors(np.zeros((4, 3, 3)), indices, indptr, symmetric=False) is None
    value = np.full((4, 3, 3), np.nan)
    assert factors(value, indices, indptr, symmetric=False) is None


def test_contacts_of_one_pair_are_one_group():
    # a stack: four contacts in each of six joints; fill-in is none but that of the next joint
    bodies = np.repeat(np.column_stack([np.arange(6), np.arange(1, 7)]), 4, axis=0)
    indices, indptr = pattern_of(bodies, 7)
    plan = fronts.analyse(indices, indptr)
    assert len(plan.width) == 6
    assert (plan.width == 12).all()
    assert plan.whole.max() == 24
