"""Deformable stones solved as rigid ones whose joints yield: what opens, slides and sticks."""

from functools import partial

import numpy as np
import pytest

from ground.errors import SolverError
from mechanics.problem.problem import ContactStart
from mechanics.problem.residual import natural_map
from mechanics.solvers.auto import Auto
from mechanics.solvers.first_order.body_admm import BodyADMM, Stage
from mechanics.solvers.first_order.stones_as_rigid import StonesAsRigid
from mechanics.solvers.second_order.newton import Newton
from tests.mechanics.shapes import posed
from tests.mechanics.solvers.problems import cold, few_deformable, leaning, yielding

ONE = partial(BodyADMM, stages=(Stage(0.2, 2000, extrapolated=True),))


@pytest.fixture(scope="module")
def problem():
    return yielding(few_deformable(), 1e-3)


@pytest.fixture(scope="module")
def exact(problem):
    found = Auto(1e-9, 1e-8)(problem, cold(problem))
    assert found.converged
    return found


def test_from_the_solution_it_stays_near(problem, exact):
    """What the simple operator lacks is taken from the start, and exact there, but compliances along joints."""
    solver = StonesAsRigid(1e-7, 1e-6, 2000, ONE)
    found = solver(problem, ContactStart(exact.impulse, exact.velocity))
    np.testing.assert_allclose(found.impulse, exact.impulse, atol=0.2 * np.abs(exact.impulse).max())
    assert natural_map(problem, found.impulse) < 3e-3


def test_from_nothing_it_comes_near_enough_for_newton(problem):
    first = StonesAsRigid(1e-4, 1e-3, 500, ONE)(problem, cold(problem))
    assert natural_map(problem, first.impulse) < 0.1
    assert 0 < first.iterations <= 500
    ended = Newton(1e-8, 1e-7, 30)(problem, ContactStart(first.impulse, first.velocity))
    assert ended.converged


def test_rigid_stones_are_refused():
    rigid = posed(leaning(0.0, 3, 3), step=5e-3).problem
    with pytest.raises(SolverError, match="stones as rigid ones: no body deforms"):
        StonesAsRigid(1e-6, 1e-5, 100, ONE)(rigid, cold(rigid))
