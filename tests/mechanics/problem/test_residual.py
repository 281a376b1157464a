"""Contacts that contradict each other never count as solved, however large impulses have grown."""

import numpy as np
import pytest

from mechanics.problem.problem import ContactProblem
from mechanics.problem.residual import residual
from tests.mechanics.dense_operator import DenseDelassus, blocks_apart


def contradiction(u_free, bias):
    """Two contacts of one body along the same line, from both sides: u_1 = -u_2 whatever the impulses.

    Between them W_NN = ±1, and W_TT = 1 each; no impulse can open both.
    """
    across = np.diag([-1.0, 0, 0])
    operator = DenseDelassus(np.block([[np.eye(3), across], [across, np.eye(3)]]))
    free = np.zeros((2, 3))
    free[:, 0] = u_free
    none = np.zeros(2)
    return ContactProblem(operator, free, np.full(2, float(bias)), none, none)


@pytest.mark.parametrize(("u_free", "bias"), [(-1.0, 0.0), (0.0, -1.0), (-1e-3, -1.0)])
@pytest.mark.parametrize("size", [0.0, 1.0, 1e6, 1e12, 1e17, 1e30, 1e70])
def test_no_impulse_solves_a_contradiction(u_free, bias, size):
    """Beyond 10¹⁶ rounding of W r hides u_free; then u reads zero, η is zero, and both would seem right."""
    impulse = np.zeros((2, 3))
    impulse[:, 0] = size
    left = residual(contradiction(u_free, bias), impulse)
    assert not left.within(1e-6, 1e-2)


def test_large_impulses_that_are_needed_count():
    """Pushed out at 10⁹ m/s while it moves at 10⁻³: W r is as large as what it is for."""
    operator = blocks_apart(np.eye(3))
    free, none = np.array([[-1e-3, 0.0, 0.0]]), np.zeros(1)
    problem = ContactProblem(operator, free, none - 1e9, none + 0.5, none)
    assert residual(problem, np.array([[1e9 + 1e-3, 0.0, 0.0]])).within(1e-6, 1e-5)


def test_a_heavy_contact_does_not_hide_a_light_one_that_it_does_not_touch():
    """1 mg beside 10⁹ t: the bound from the largest W and the largest r would be 100 m/s, though none is lost."""
    operator = blocks_apart(1e6 * np.eye(3), 1e-12 * np.eye(3))
    free, none = np.array([[-1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]), np.zeros(2)
    problem = ContactProblem(operator, free, none, none, none)
    impulse = np.array([[1e-6, 0, 0], [1e12, 0, 0]])
    assert residual(problem, impulse).within(1e-6, 1e-5)
