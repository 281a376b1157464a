"""ADMM first, the interior point where that does not get there, cone programmes at last; the best of all counts."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from mechanics.solvers.first_order.admm import ADMM
from mechanics.solvers.strategies import elastic
from mechanics.solvers.strategies.elastic import Elastic

from mechanics.problem.problem import ContactSolution, ContactStart
from mechanics.problem.residual import natural_map
from mechanics.scene.scene import Fidelity, Method, SolverSettings
from mechanics.solvers.choice import choose_solver
from tests.mechanics.shapes import brick, ground, posed, scene

SOFT = Fidelity.DEFORMABLE


def stack(below, above):
    """Two elastic stones, one on the other, at two speeds along the ground."""
    return posed(
        scene(
            ground(),
            brick("lower", (0, 0, 0), (0.6, 0.4, 0.3), SOFT, velocity=(*below, 0, 0, 0, 0), mesh_size=0.3),
            brick(
                "upper", (0.1, 0, 0.3), (0.7, 0.4, 0.6), SOFT, velocity=(*above, 0, 0, 0, 0), mesh_size=0.3
            ),
            friction=0.4,
        )
    ).problem


@cache
def sliding():
    """ADMM takes thousands of iterations."""
    return stack((0.3, 0.1), (-1.0, 0.0))


@cache
def resting():
    """ADMM takes few."""
    return stack((0.0, 0.0), (0.0, 0.0))


def cold(problem):
    zero = np.zeros_like(problem.u_free)
    return ContactStart(zero, zero.copy())


def test_where_admm_is_done_soon_it_alone_works():
    problem = resting()
    alone = ADMM(1e-6, 1e-4, 400)(problem, cold(problem))
    answer = Elastic(1e-6, 1e-4)(problem, cold(problem))
    assert alone.converged
    assert answer.iterations == alone.iterations
    np.testing.assert_array_equal(answer.impulse, alone.impulse)


def test_where_admm_is_not_done_the_interior_point_method_goes_on(monkeypatch):
    problem = sliding()
    monkeypatch.setattr(elastic, "_ADMM", 10)
    assert not ADMM(1e-11, 1e-9, 10)(problem, cold(problem)).converged
    answer = Elastic(1e-11, 1e-9)(problem, cold(problem))
    assert answer.converged
    assert answer.natural_map <= 1e-11
    assert answer.natural_map == natural_map(problem, answer.impulse)
    assert 10 < answer.iterations < 110


def test_from_nearly_a_solution_newtons_method_ends_what_admm_creeps_to():
    problem = sliding()
    exact = Elastic(1e-11, 1e-9)(problem, cold(problem))
    rng = np.random.default_rng(0)
    near = exact.impulse * (1.0 + 1e-5 * rng.normal(size=exact.impulse.shape))
    start = ContactStart(near, exact.velocity)
    assert 1e-9 < natural_map(problem, near) < 1e-4
    assert not ADMM(1e-11, 1e-9, 200)(problem, start).converged
    answer = Elastic(1e-11, 1e-9)(problem, start)
    assert answer.converged
    assert answer.iterations < 80


def test_the_iterations_asked_for_bound_both_together():
    problem = sliding()
    few = Elastic(1e-14, 0.0, 5)(problem, cold(problem))
    assert not few.converged
    assert few.iterations == 5
    assert few.natural_map == natural_map(problem, few.impulse)


class Fake:
    """A method that gives back what it was told to, and counts how often it was asked."""

    def __init__(self, eta, converged=False, iterations=3):
        self.eta, self.converged, self.iterations, self.starts = eta, converged, iterations, []

    def __call__(self, *settings):
        self.settings = settings
        return self.solve

    def solve(self, problem, start):
        self.starts.append(start)
        impulse = np.full_like(start.impulse, self.eta)
        return ContactSolution(impulse, 2.0 * impulse, self.iterations, self.eta, self.converged)


@pytest.mark.parametrize(
    ("first", "second", "third", "expected"),
    [(1e-3, 1e-5, 1e-4, 1e-5), (1e-5, 1e-3, 1e-4, 1e-5), (1e-7, 1e-3, 1e-4, 1e-7), (1e-4, 1e-5, 1e-6, 1e-6)],
)
def test_of_three_failures_the_best_counts(monkeypatch, first, second, third, expected):
    one, other, last = Fake(first), Fake(second, iterations=4), Fake(third, iterations=5)
    monkeypatch.setattr(elastic, "ADMM", one)
    monkeypatch.setattr(elastic, "InteriorPoint", other)
    monkeypatch.setattr(elastic, "ConeProgram", last)
    problem = sliding()
    answer = Elastic(1e-9, 1e-8, 90)(problem, cold(problem))
    assert answer.natural_map == expected
    assert not answer.converged
    assert answer.iterations == 12
    # it goes on from where ADMM ended, with what is left of the iterations
    np.testing.assert_array_equal(other.starts[0].impulse, first)
    assert one.settings == (1e-9, 1e-8, 90)
    assert other.settings == (1e-9, 1e-8, 87)
    assert last.settings == (1e-9, 1e-8, 83)


def test_cone_programmes_are_for_few_contacts(monkeypatch):
    last = Fake(1e-12, converged=True)
    monkeypatch.setattr(elastic, "ADMM", Fake(1e-3))
    monkeypatch.setattr(elastic, "InteriorPoint", Fake(1e-4))
    monkeypatch.setattr(elastic, "ConeProgram", last)
    problem = sliding()
    assert Elastic(1e-9, 1e-8)(problem, cold(problem)).converged
    monkeypatch.setattr(elastic, "_FEW", len(problem.u_free) - 1)
    assert not Elastic(1e-9, 1e-8)(problem, cold(problem)).converged
    assert len(last.starts) == 1


def test_what_converged_goes_before_what_has_the_smaller_natural_map(monkeypatch):
    """η is not all: velocities count too."""
    monkeypatch.setattr(elastic, "ADMM", Fake(1e-9))
    monkeypatch.setattr(elastic, "InteriorPoint", Fake(1e-8, converged=True))
    problem = sliding()
    answer = Elastic(1e-7, 1e-8)(problem, cold(problem))
    assert answer.converged
    assert answer.natural_map == 1e-8


def test_where_admm_converged_nothing_else_is_asked(monkeypatch):
    other = Fake(0.0, converged=True)
    monkeypatch.setattr(elastic, "ADMM", Fake(1e-8, converged=True))
    monkeypatch.setattr(elastic, "InteriorPoint", other)
    problem = sliding()
    assert Elastic(1e-7, 1e-8)(problem, cold(problem)).iterations == 3
    assert not other.starts


def test_from_the_solution_nothing_is_done():
    problem = sliding()
    first = Elastic(1e-8, 1e-6)(problem, cold(problem))
    again = Elastic(1e-8, 1e-6)(problem, ContactStart(first.impulse, first.velocity))
    assert first.converged
    assert again.iterations == 0


@pytest.mark.parametrize("seed", range(3))
def test_it_is_never_worse_than_admm_alone(monkeypatch, seed):
    problem = sliding()
    rng = np.random.default_rng(seed)
    monkeypatch.setattr(elastic, "_ADMM", 20)
    size = np.abs(problem.u_free).max() / np.abs(problem.delassus.diagonal).mean()
    start = replace(cold(problem), impulse=size * rng.normal(size=problem.u_free.shape))
    alone = ADMM(1e-15, 0.0, 20)(problem, start)
    for count in (21, 25, 60):
        answer = Elastic(1e-15, 0.0, count)(problem, start)
        assert answer.natural_map <= alone.natural_map


def test_scenes_with_elastic_stones_get_it_unless_they_ask_for_another():
    problem = sliding()
    own = Elastic(1e-8, 1e-6, 500)(problem, cold(problem))
    for method, same in ((Method.AUTO, True), (Method.ADMM, False)):
        solver = choose_solver(SolverSettings(method, 1e-8, 1e-6, 500), True)
        assert isinstance(solver, ADMM) != same
        answer = solver(problem, cold(problem))
        assert np.array_equal(answer.impulse, own.impulse) or not same
