"""Anderson's extrapolation of fixed-point iterations."""

import numpy as np

from mechanics.solvers.first_order.nsgs import NSGS, Anderson
from tests.mechanics.solvers.problems import cold, column


def test_it_solves_a_linear_fixed_point_in_as_many_steps_as_it_has_directions():
    """x ← A x + b with four eigenvalues: exact after four differences (Walker & Ni 2011)."""
    rng = np.random.default_rng(0)
    basis = np.linalg.qr(rng.normal(size=(12, 12)))[0]
    a = basis @ np.diag(np.repeat([0.99, 0.9, 0.7, -0.5], 3)) @ basis.T
    b = rng.normal(size=12)
    exact = np.linalg.solve(np.eye(12) - a, b)
    anderson, x = Anderson(6), np.zeros(12)
    errors = []
    for _ in range(9):
        image = a @ x + b
        extrapolated = anderson(x, image)
        x = image if extrapolated is None else extrapolated
        errors.append(np.linalg.norm(x - exact) / np.linalg.norm(exact))
    assert errors[3] > 1e-3
    assert errors[-1] < 1e-5  # plain: 0.99⁹ is still 0.9


def test_it_needs_two_steps_and_keeps_still_at_a_fixed_point():
    anderson, x = Anderson(3), np.ones(3)
    assert anderson(x, x) is None
    assert anderson(x, x) is None
    anderson.forget()
    assert anderson(x, 0.5 * x) is not None


def test_sweeps_over_a_column_take_a_few_hundred():
    """140 with 20 iterates; plain ones do not suffice, two iterates take 605, and 200 take 965."""
    problem = column([2400.0] * 10)
    assert NSGS(max_iterations=300)(problem, cold(problem)).converged
