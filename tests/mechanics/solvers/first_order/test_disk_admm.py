"""ADMM between bodies of the plane, against sweeps, in flows and for any place of the bodies."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SolverError
from mechanics.dynamics.progress import Clock
from mechanics.planar.delassus import PlanarDelassus
from mechanics.planar.model import build_planar_model
from mechanics.planar.simulation import PlanarSimulation
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.choice import choose_planar_solver
from mechanics.solvers.first_order.disk_admm import DiskADMM
from mechanics.solvers.first_order.nsgs import NSGS
from tests.mechanics.dense_operator import blocks_apart
from tests.mechanics.planar.shapes import random_problem
from tests.mechanics.planar.test_overlaps import pushed_bed


def stated(seed, contacts=14):
    """Return a problem of bodies with levers of all kinds, and a start from nothing."""
    bodies, normal, lever, inertia = random_problem(seed, 12, contacts)
    rng = np.random.default_rng(seed)
    operator = PlanarDelassus(bodies, normal, lever, inertia)
    free = rng.normal(size=(contacts, 2))
    friction, cohesion = rng.uniform(0.0, 0.8, contacts), rng.uniform(0.0, 0.2, contacts)
    problem = ContactProblem(operator, free, rng.uniform(-0.1, 0.1, contacts), friction, cohesion)
    return problem, ContactStart(np.zeros((contacts, 2)), np.zeros((contacts, 2)))


@pytest.mark.parametrize("seed", range(4))
def test_its_solutions_obey_the_laws_and_are_those_of_the_other_methods(seed):
    problem, start = stated(seed)
    found = DiskADMM(1e-10, 1e-9, 20000)(problem, start)
    assert found.converged
    assert residual(problem, found.impulse).natural_map <= 1e-10
    other = NSGS(1e-10, 1e-9, 20000)(problem, start)
    assert other.converged
    np.testing.assert_allclose(
        problem.delassus.velocity_change(found.impulse),
        problem.delassus.velocity_change(other.impulse),
        atol=1e-6,
    )
    again = DiskADMM(1e-9, 1e-8, 20000)(problem, ContactStart(found.impulse, found.velocity))
    assert again.iterations == 0


@pytest.fixture(scope="module")
def flowing():
    """The problem of a step of a slow flow that sweeps do not solve."""
    model, state = build_planar_model(pushed_bed(24, 10, 300, 100))
    kept, solver = [], choose_planar_solver(model.scene.solver, model.scene.min_sweeps)

    def spy(problem, start):
        kept[:] = [(problem, start)]
        return solver(problem, start)

    simulation = PlanarSimulation(model, state, Clock(), spy)
    for _ in range(160):
        simulation.step()
    return kept[0]


def test_an_iteration_gets_farther_in_a_slow_flow_than_a_sweep(flowing):
    problem, start = flowing
    swept = NSGS(1e-9, 1e-9, 1000, 20, 0)(problem, start)
    found = DiskADMM(1e-9, 1e-9, 1000)(problem, start)
    assert not swept.converged
    assert found.natural_map < 0.2 * swept.natural_map


def test_known_places_order_the_factors_and_change_nothing_else(flowing):
    problem, start = flowing
    operator = problem.delassus
    assert operator.plane.centre.shape == (len(operator.inertia), 2)
    unplaced = replace(problem, delassus=replace(operator, centre=None))
    found, other = (DiskADMM(1e-9, 1e-9, 40)(one, start) for one in (problem, unplaced))
    np.testing.assert_allclose(found.impulse, other.impulse, atol=1e-6 * np.abs(found.impulse).max())


def test_other_bodies_are_refused():
    none = np.zeros(1)
    problem = ContactProblem(blocks_apart(np.eye(3)), np.ones((1, 3)), none, none, none)
    with pytest.raises(SolverError, match='not those of the plane; use the method "auto"'):
        DiskADMM()(problem, ContactStart(np.zeros((1, 3)), np.zeros((1, 3))))
