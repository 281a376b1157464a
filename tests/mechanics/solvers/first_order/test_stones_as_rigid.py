"""Deformable stones solved as rigid ones whose joints yield: what opens, slides and sticks."""

import numpy as np
import pytest

from mechanics.problem.problem import ContactStart
from mechanics.problem.residual import natural_map
from mechanics.solvers.auto import Auto
from mechanics.solvers.first_order.body_admm import Stage
from mechanics.solvers.first_order.stones_as_rigid import StonesAsRigid
from moma.errors import SolverError
from tests.mechanics.shapes import posed
from tests.mechanics.solvers.problems import cold, few_deformable, leaning, yielding

STAGES = (Stage(0.2, 2000, extrapolated=True),)


@pytest.fixture(scope="module")
def problem():
    return yielding(few_deformable(), 1e-3)


@pytest.fixture(scope="module")
def exact(problem):
    found = Auto(1e-9, 1e-8)(problem, cold(problem))
    assert found.converged
    return found


def test_from_the_solution_it_finds_the_solution(problem, exact):
    """W r is that of the simple operator and of what it leaves out, taken from the start: both are exact there."""
    solver = StonesAsRigid(1e-7, 1e-6, 2000, STAGES)
    found = solver(problem, ContactStart(exact.impulse, exact.velocity))
    np.testing.assert_allclose(found.impulse, exact.impulse, atol=1e-3 * np.abs(exact.impulse).max())


def test_from_nothing_it_comes_near_and_again_from_there_nearer(problem):
    solver = StonesAsRigid(1e-8, 1e-7, 2000, STAGES)
    first = solver(problem, cold(problem))
    second = solver(problem, ContactStart(first.impulse, first.velocity))
    eta = [natural_map(problem, one.impulse) for one in (first, second)]
    assert eta[1] < eta[0] < 0.5


def test_rigid_stones_are_refused():
    rigid = posed(leaning(0.0, 3, 3), step=5e-3).problem
    with pytest.raises(SolverError, match="stones as rigid ones: no body deforms"):
        StonesAsRigid(1e-6, 1e-5, 100, STAGES)(rigid, cold(rigid))
