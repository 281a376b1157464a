"""Few deformable stones among many rigid ones: the central path to its end, begun near the last step."""

from functools import cache

import numpy as np
import pytest
from mechanics.solvers.strategies.elastic import Elastic
from mechanics.solvers.strategies.mixed import Mixed

from mechanics.problem.problem import ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.second_order.central_path import CentralPath
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.scaling import equilibrated
from tests.mechanics.shapes import partly_deformable_wall, posed


@cache
def problem():
    return posed(partly_deformable_wall(), step=5e-3).problem


def cold():
    zero = np.zeros_like(problem().u_free)
    return ContactStart(zero, zero.copy())


@cache
def solved():
    return Mixed()(problem(), cold())


def test_most_stones_are_rigid():
    assert problem().delassus.mostly_rigid
    assert equilibrated(problem())[0].delassus.mostly_rigid


def test_a_cold_start_is_solved():
    left = residual(problem(), solved().impulse)
    assert solved().converged
    assert left.within(1e-6, 1e-5)
    assert solved().natural_map == left.natural_map


def test_velocities_are_those_of_an_independent_method():
    # forces between rigid stones are one state of many, and so is what slides between them, by a little: solutions to
    # η = 1e-10 by cone programmes, and by the interior point with and without corrections, differ by 2e-4 to 6e-4 here
    one, other = (method(1e-7, 1e-6)(problem(), cold()) for method in (Mixed, InteriorPoint))
    assert one.converged
    assert other.converged
    w, fastest = problem().delassus, np.abs(problem().u_free).max()
    np.testing.assert_allclose(w.apply(one.impulse), w.apply(other.impulse), atol=1e-3 * fastest)


def test_the_automatic_choice_is_this_one():
    answer = Elastic()(problem(), cold())
    assert answer.why.startswith("central path")
    np.testing.assert_array_equal(answer.impulse, solved().impulse)


def test_impulses_of_the_last_step_save_a_third_of_the_factorisations():
    rng = np.random.default_rng(1)
    near = solved().impulse * (1.0 + 1e-4 * rng.normal(size=solved().impulse.shape))
    assert not residual(problem(), near).within(1e-6, 1e-5)
    answer = Mixed()(problem(), ContactStart(near, np.zeros_like(near)))
    assert answer.converged
    assert answer.iterations <= 2 * solved().iterations / 3


def test_a_solution_costs_nothing():
    start = ContactStart(solved().impulse, solved().velocity)
    assert Mixed()(problem(), start).iterations == 0


@pytest.mark.parametrize("level", [1e-2, 1e-6])
def test_a_path_that_begins_near_impulses_begins_on_its_centre(level):
    even, unit = equilibrated(problem())
    path = CentralPath(even, solved().impulse / unit[:, None], level)
    assert path.complementarity == pytest.approx(level, rel=1e-9)
    cone = path._cone
    # s ∘ z is a multiple of the unit element
    turned = cone.slack[:, :1] * cone.dual[:, 1:] + cone.dual[:, :1] * cone.slack[:, 1:]
    assert np.abs(turned).max() <= 1e-9 * np.abs(cone.slack).max() * np.abs(cone.dual).max()


def test_it_stops_at_the_iterations_that_are_allowed():
    answer = Mixed(max_iterations=3)(problem(), cold())
    assert not answer.converged
    assert answer.iterations == 3
