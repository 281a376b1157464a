"""Small contact problems from Siconos' test data (case S02): every solver finds their solution.

Source: numerics/src/FrictionContact/test/data of Siconos (Apache-2.0), FC3D_Example1 and Rover4396; W row by row, axes
(n, t1, t2). The first has a closed form. The second, of two contacts on one rover, is ill-conditioned and its W is
slightly asymmetric; its solution is that of another Gauss–Seidel code, trusted to 1e-4.
"""

import numpy as np
import pytest

from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import natural_map
from mechanics.solvers.auto import Auto
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.second_order.newton import Newton
from tests.mechanics.dense_operator import DenseDelassus

SOLVERS = {"nsgs": NSGS, "newton": Newton, "auto": Auto}

ROVER4396_W = np.array(
    [
        [1.20626544e-02, -1.54335101e-04, -4.82714063e-03, -5.19259212e-04, 7.28691886e-06, -2.10561956e-05],
        [-1.51598804e-04, 1.06012937e-01, 1.43450436e-03, -4.51651816e-04, 2.37388286e-04, -3.89271172e-04],
        [-4.82567848e-03, 1.43510462e-03, 5.58497987e-03, 3.10055510e-04, -8.33131861e-04, 1.01298070e-03],
        [-5.20683244e-04, -4.52595964e-04, 3.09497337e-04, 9.33184520e-03, 2.19190783e-03, 3.64886264e-03],
        [6.48309661e-06, 2.37694969e-04, -8.33011704e-04, 2.19189958e-03, 1.06819580e-01, 1.11391504e-03],
        [-2.24749174e-05, -3.89894234e-04, 1.01266254e-03, 3.64870949e-03, 1.11403986e-03, 2.98485144e-03],
    ]
)
ROVER4396_Q = np.array([[-0.07993437, -0.69041815, 3.02199189], [-2.30875206, -6.97616583, -2.33975015]])
ROVER4396_R = np.array([[11.7276808, 1.6905629, -8.0334215], [188.578354, 54.8149103, 120.0858253]])


def problem(w, q, mu):
    none = np.zeros(len(q))
    return ContactProblem(DenseDelassus(w), q, none, np.full(len(q), mu), none)


def solve(name, posed):
    solver = SOLVERS[name](tolerance=1e-11, velocity_tolerance=np.inf, max_iterations=20_000)
    none = np.zeros_like(posed.u_free)
    solution = solver(posed, ContactStart(none, none))
    assert solution.converged
    assert natural_map(posed, solution.impulse) <= 1e-11
    return solution.impulse


@pytest.mark.parametrize("name", SOLVERS)
def test_example1_is_solved_as_in_closed_form(name):
    """W = 1 and q = (-1, 1, 3) at each of three contacts, μ = 0.1: they slide.

    r_N = 1, and r_T = -μ r_N u_T/‖u_T‖ with u_T = q_T + r_T along q_T, so r_T = -0.1 (1, 3)/√10 = (-0.0316227766,
    -0.0948683298). Tolerance 1e-9, for η = 1e-11.
    """
    impulse = solve(name, problem(np.eye(9), np.tile([-1.0, 1.0, 3.0], (3, 1)), 0.1))
    expected = np.tile([1.0, -0.1 / np.sqrt(10), -0.3 / np.sqrt(10)], (3, 1))
    np.testing.assert_allclose(impulse, expected, rtol=1e-9)


@pytest.mark.parametrize("name", SOLVERS)
def test_rover4396_is_solved_as_by_another_code(name):
    """Tolerance 1e-4, as given for the Rover problems."""
    impulse = solve(name, problem(ROVER4396_W, ROVER4396_Q, 0.7))
    np.testing.assert_allclose(impulse, ROVER4396_R, rtol=1e-4)


def test_rover4396_read_by_columns_is_another_problem():
    """Siconos stores blocks by columns; its W is asymmetric enough to tell which way it was read (0.3 % and more)."""
    transposed = ROVER4396_W.reshape(2, 3, 2, 3).transpose(0, 3, 2, 1).reshape(6, 6)
    impulse = solve("nsgs", problem(transposed, ROVER4396_Q, 0.7))
    assert np.abs(impulse - ROVER4396_R).max() > 1e-3 * np.abs(ROVER4396_R).max()
