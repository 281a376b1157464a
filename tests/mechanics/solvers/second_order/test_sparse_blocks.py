"""Sparse factors of block matrices: the solution of the dense system, whatever the order of elimination."""

import numpy as np
import pytest

from mechanics.solvers.second_order.newton_equations import SparseBlocks


def matrix(seed, count=12):
    """Blocks of a structurally symmetric matrix that is not symmetric, as block rows, and the whole."""
    rng = np.random.default_rng(seed)
    near = rng.random((count, count)) < 0.25
    near |= near.T | np.eye(count, dtype=bool)
    row, column_ = np.nonzero(near)
    value = rng.normal(size=(len(row), 3, 3)) + 8.0 * (row == column_)[:, None, None] * np.eye(3)
    whole = np.zeros((count, 3, count, 3))
    whole[row, :, column_] = value
    indptr = np.searchsorted(row, np.arange(count + 1))
    return column_, indptr, value, whole.reshape(3 * count, 3 * count)


@pytest.mark.parametrize("seed", range(5))
def test_solutions_are_those_of_the_dense_matrix(seed):
    indices, indptr, value, whole = matrix(seed)
    rng = np.random.default_rng(seed)
    factors = SparseBlocks(indices, indptr, rng.permutation(len(indptr) - 1))
    for scale in (1.0, 3.0):
        right = rng.normal(size=(len(indptr) - 1, 3))
        x = right.copy()
        assert factors.factorise(scale * value)
        factors.solve(x)
        assert np.abs(scale * whole @ x.ravel() - right.ravel()).max() < 1e-11


def test_a_matrix_that_is_singular_or_no_matrix_has_no_factors():
    indices, indptr, value, _ = matrix(0)
    factors = SparseBlocks(indices, indptr, np.arange(len(indptr) - 1))
    assert not factors.factorise(0.0 * value)
    assert not factors.factorise(np.nan * value)
    assert factors.factorise(value)
