"""Newton's method by way of softer joints: it arrives where the joints asked for lead."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.problem.problem import ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.second_order.newton import Newton
from mechanics.solvers.second_order.softer_joints import SofterJoints
from tests.mechanics.shapes import posed
from tests.mechanics.solvers.problems import by_path, cold, leaning, yielding


@pytest.fixture(scope="module")
def problem():
    """A wall pushed along its courses by half of its weight, on joints that hardly yield."""
    return yielding(posed(leaning(0.5, 5, 5), step=5e-3).problem, 1e-3)


def test_it_solves_the_joints_that_are_asked_for(problem):
    found = SofterJoints(1e-9, 1e-8)(problem, cold(problem))
    assert found.converged
    assert residual(problem, found.impulse).within(1e-9, 1e-8)
    other = by_path(problem, cold(problem))
    assert other.converged
    # W + E is regular: forces are determined, to what η leaves
    np.testing.assert_allclose(found.impulse, other.impulse, atol=1e-3 * np.abs(other.impulse).max())


def test_it_reaches_farther_than_newton_from_a_wrong_start(problem):
    """Impulses drawn at random, of the size of the weight."""
    rng = np.random.default_rng(3)
    size = np.abs(Newton()(problem, cold(problem)).impulse).max()
    far = ContactStart(size * rng.normal(size=problem.u_free.shape), np.zeros_like(problem.u_free))
    assert SofterJoints(1e-8, 1e-7)(problem, far).converged


@pytest.mark.parametrize("most", [1, 7, 40])
def test_its_steps_are_limited_and_counted(problem, most):
    found = SofterJoints(1e-16, 0.0, most)(problem, cold(problem))
    assert found.iterations <= most
    assert found.iterations == most or most > 30
    assert not found.converged


def test_an_unfinished_way_never_counts_as_solved(problem):
    """A solution of softer joints is none of those asked for."""
    found = SofterJoints(1e-4, 1e-3, 2)(problem, cold(problem))
    assert not found.converged
    assert found.natural_map == np.inf


def test_rigid_joints_are_solved_by_way_of_ones_that_hardly_yield(problem):
    rigid = replace(problem, delassus=problem.delassus.inner)
    found = SofterJoints()(rigid, cold(problem))
    assert found.converged
    assert residual(rigid, found.impulse).within(1e-6, 1e-5)
