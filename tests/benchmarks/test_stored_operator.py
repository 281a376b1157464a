"""A stored W against dense numpy, and its sweeps against a slow twin."""

import numpy as np
import pytest
from scipy.sparse import bsr_array

from benchmarks.stored import StoredDelassus
from ground.errors import SolverError
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import natural_map
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.second_order.newton import Newton
from tests.mechanics.dense_operator import slow_sweep


def dense_problem(nc=7, skew=0.0, seed=3):
    """A positive definite W (3 nc, 3 nc) with a third of its blocks, its skew part `skew` times its symmetric one."""
    rng = np.random.default_rng(seed)
    lift = rng.normal(size=(nc, 3, 3 * nc)) * (rng.random((nc, 1, nc)) < 0.3).repeat(3, axis=2)
    lift = lift.reshape(3 * nc, 3 * nc)
    w = lift @ lift.T + 0.5 * np.eye(3 * nc)
    turn = rng.normal(size=w.shape)
    w += skew * np.abs(w).max() * np.where(w != 0, turn - turn.T, 0.0)
    u_free = rng.normal(size=(nc, 3)) - [0.5, 0.0, 0.0]
    return w, u_free, rng.uniform(0.1, 0.9, nc), rng.uniform(0.0, 0.2, nc) * (rng.random(nc) < 0.5)


def stored(w):
    rows = bsr_array(w, blocksize=(3, 3))
    return StoredDelassus(rows.data, rows.indices, rows.indptr)


@pytest.mark.parametrize("skew", [0.0, 0.01])
def test_products_and_diagonal_are_those_of_the_dense_matrix(skew):
    w, u_free, _, _ = dense_problem(skew=skew)
    operator = stored(w)
    np.testing.assert_allclose(
        operator.apply(u_free), (w @ u_free.ravel()).reshape(-1, 3), rtol=1e-13, atol=1e-13
    )
    np.testing.assert_array_equal(
        operator.diagonal, [w[3 * c : 3 * c + 3, 3 * c : 3 * c + 3] for c in range(len(u_free))]
    )


@pytest.mark.parametrize("skew", [0.0, 0.01])
def test_sweeps_are_those_of_the_slow_twin(skew):
    w, u_free, mu, cohesion = dense_problem(skew=skew)
    fast, slow = np.zeros_like(u_free), np.zeros_like(u_free)
    stored(w).gauss_seidel(u_free, mu, cohesion)(fast, 5)
    for _ in range(5):
        slow_sweep(w, slow, u_free, mu, cohesion)
    assert np.abs(slow).max() > 0.1
    np.testing.assert_allclose(fast, slow, rtol=1e-11, atol=1e-13)


def test_where_the_sweeps_rest_the_laws_hold_for_the_asymmetric_matrix_itself():
    """Symmetrised, this problem has another solution; the natural map is that of W as it is given."""
    w, u_free, mu, cohesion = dense_problem(skew=0.02)
    impulse = np.zeros_like(u_free)
    operator = stored(w)
    operator.gauss_seidel(u_free, mu, cohesion)(impulse, 500)
    zero = np.zeros(len(u_free))
    assert natural_map(ContactProblem(operator, u_free, zero, mu, cohesion), impulse) < 1e-12
    symmetrised = ContactProblem(stored(0.5 * (w + w.T)), u_free, zero, mu, cohesion)
    assert natural_map(symmetrised, impulse) > 1e-4


def test_rows_that_do_not_fit_are_refused():
    block = np.eye(3)[None]
    with pytest.raises(SolverError, match="one 3 × 3 block for each index"):
        StoredDelassus(block, np.array([0, 0]), np.array([0, 2]))
    with pytest.raises(SolverError, match="columns 1 to 1 for 1 contacts"):
        StoredDelassus(block, np.array([1]), np.array([0, 1]))


def test_a_contact_without_its_own_block_is_refused():
    with pytest.raises(SolverError, match="contact 1 is not positive definite"):
        StoredDelassus(np.stack([np.eye(3)] * 2), np.array([0, 0]), np.array([0, 1, 2]))


@pytest.mark.parametrize("skew", [0.0, 0.02])
def test_factors_solve_the_dense_system(skew):
    """r = (W + σ)⁻¹ b."""
    w, b, _, _ = dense_problem(skew=skew)
    sigma = 0.3
    theta = np.tile(sigma * np.eye(3), (len(b), 1, 1))
    found = stored(w).form.shifted(theta)(b.ravel())
    np.testing.assert_allclose(found, np.linalg.solve(w + sigma * np.eye(len(w)), b.ravel()), rtol=1e-10)


@pytest.mark.parametrize("skew", [0.0, 0.02])
def test_newton_and_the_sweeps_find_one_solution(skew):
    """Two methods that share no code; with W positive definite and little friction the solution is unique."""
    w, u_free, mu, cohesion = dense_problem(skew=skew)
    operator = stored(w)
    problem = ContactProblem(operator, u_free, np.zeros(len(u_free)), 0.3 * mu, cohesion)
    none = ContactStart(np.zeros_like(u_free), np.zeros_like(u_free))
    swept = NSGS(tolerance=1e-12, velocity_tolerance=np.inf)(problem, none)
    split = Newton(tolerance=1e-12, velocity_tolerance=np.inf)(problem, none)
    assert swept.converged
    assert split.converged
    np.testing.assert_allclose(split.impulse, swept.impulse, atol=1e-9)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_stored_w_with_what_is_no_number_is_refused(value):
    block = np.tile(np.eye(3), (2, 1, 1))
    block[1, 0, 2] = value
    with pytest.raises(SolverError, match="block 1, in the column of contact 1, is not finite"):
        StoredDelassus(block, np.arange(2), np.arange(3))
