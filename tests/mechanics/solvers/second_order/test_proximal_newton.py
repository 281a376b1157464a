"""Newton's method between rigid bodies: its equations against dense ones, and what others cannot solve."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mechanics.solvers.second_order.proximal_newton import ProximalNewton, _System

from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.scene.scene import Scene, SolverSettings
from mechanics.solvers._kernels import body_newton as bodies
from mechanics.solvers.choice import choose_solver
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.stones.materials import Material
from moma.errors import SolverError
from tests.mechanics.dense_operator import blocks_apart
from tests.mechanics.shapes import brick, ground


def column(heights, densities):
    """Cubes of these heights, one upon the other."""
    blocks, level = [ground()], 0.0
    for i, (height, density) in enumerate(zip(heights, densities, strict=True)):
        blocks.append(
            brick(
                f"b{i}",
                (0.0, 0.0, level),
                (0.5, 0.5, level + height),
                material=Material(f"m{i}", density, 1e10, 0.2),
            )
        )
        level += height
    return Scene("column", tuple(blocks))


def first_problem(scene):
    """The contact problem of the first step."""
    model, start = build_model(scene)
    seen = []

    def solver(problem, start):
        seen.append(problem)
        return NSGS(max_iterations=1)(problem, start)

    Simulation(model, start, solver=solver).step()
    return seen[0]


def nothing(problem):
    return ContactStart(np.zeros_like(problem.u_free), np.zeros_like(problem.u_free))


def dense_lift(problem):
    form = problem.delassus.form
    return form.inertia.toarray(), form.lift.toarray()


def test_equations_of_the_bodies_are_those_of_the_contacts():
    problem = first_problem(column([0.5, 0.3, 0.4], [2000.0, 1500.0, 2500.0]))
    rng, nc = np.random.default_rng(1), len(problem.friction)
    first, second = rng.normal(size=(2, nc, 3, 3)) + 3.0 * np.eye(3)
    error, alpha = rng.normal(size=(nc, 3)), 0.7
    step = _System(problem.delassus.rigid, None).step(first, second, error, alpha)
    inertia, lift = dense_lift(problem)
    compliance = lift.T @ np.linalg.solve(inertia, lift) + alpha * np.eye(3 * nc)
    big_first, big_second = np.zeros((2, nc, 3, nc, 3))
    big_first[np.arange(nc), :, np.arange(nc)], big_second[np.arange(nc), :, np.arange(nc)] = first, second
    size = 3 * nc
    matrix = big_first.reshape(size, size) + big_second.reshape(size, size) @ compliance
    wanted = np.linalg.solve(matrix, -error.ravel()).reshape(-1, 3)
    assert step == pytest.approx(wanted, rel=1e-9, abs=1e-9 * np.abs(wanted).max())


def test_blocks_are_inverted_one_by_one():
    rng = np.random.default_rng(2)
    first, second = rng.normal(size=(2, 20, 3, 3))
    inverse, gain = np.empty((2, 20, 3, 3))
    assert bodies.inverse_blocks(first, second, np.full((20, 3), 0.3), inverse, gain)
    assert inverse == pytest.approx(np.linalg.inv(first + 0.3 * second), rel=1e-9)
    assert gain == pytest.approx(inverse @ second, rel=1e-9)
    assert not bodies.inverse_blocks(0 * first, 0 * second, np.full((20, 3), 0.3), inverse, gain)


def test_a_column_of_100_takes_a_few_steps_from_nothing():
    problem = first_problem(column([0.25] * 100, [2000.0] * 100))
    solution = ProximalNewton(1e-9, 1e-7)(problem, nothing(problem))
    assert solution.converged
    assert solution.iterations <= 12
    weight = 2000.0 * 0.5 * 0.5 * 0.25 * 9.81 * 1e-3
    borne = np.sort([joint.sum() for joint in solution.impulse[:, 0].reshape(100, 4)])
    assert borne == pytest.approx(weight * np.arange(1, 101), rel=1e-7)


@pytest.mark.parametrize("heavy", [0, 4, 9])
def test_a_mass_ratio_of_a_million_is_solved_to_rounding(heavy):
    densities = [2.0] * 10
    densities[heavy] = 2e6
    problem = first_problem(column([0.5] * 10, densities))
    solution = ProximalNewton(1e-8, 1e-8)(problem, nothing(problem))
    assert solution.converged
    assert solution.iterations <= 20
    borne = np.array([joint.sum() for joint in solution.impulse[:, 0].reshape(10, 4)])
    above = np.cumsum(densities[::-1])[::-1] * 0.125 * 9.81e-3
    assert np.sort(borne) == pytest.approx(np.sort(above), rel=1e-6)


def test_other_operators_are_refused():
    none = np.zeros(1)
    problem = ContactProblem(blocks_apart(np.eye(3)), np.array([[-1.0, 0.0, 0.0]]), none, none, none)
    with pytest.raises(SolverError, match="not that of bodies"):
        ProximalNewton()(problem, nothing(problem))


def projected_form(r, u, mu, k, rho):
    """Alart and Curnier's F, as it is written."""
    pressed = np.maximum(r[0] - rho[0] * u[0], 0.0)
    point, radius = r[1:] - rho[1] * u[1:], mu * pressed + k
    size = np.linalg.norm(point)
    return r - np.append(pressed, point if size <= radius else radius * point / size)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.4, 5.0]), st.sampled_from([0.0, 0.7]))
def test_derivatives_of_alart_and_curniers_function(seed, mu, k):
    rng = np.random.default_rng(seed)
    r, u, rho = rng.normal(size=(1, 3)), rng.normal(size=(1, 3)), rng.uniform(0.5, 2.0, (1, 2))
    error, first, second = np.empty((1, 3)), np.empty((1, 3, 3)), np.empty((1, 3, 3))
    merit = bodies.alart_curnier(r, u, np.array([mu]), np.array([k]), rho, error, first, second)
    wanted = projected_form(r[0], u[0], mu, k, rho[0])
    assert error[0] == pytest.approx(wanted, abs=1e-14)
    assert merit == pytest.approx(0.5 * (wanted**2).sum())
    tiny = 1e-7
    for matrix, by_r in ((first[0], True), (second[0], False)):
        for j in range(3):
            step = np.zeros(3)
            step[j] = tiny
            change = (step, 0.0 * step) if by_r else (0.0 * step, step)
            ahead = projected_form(r[0] + change[0], u[0] + change[1], mu, k, rho[0])
            behind = projected_form(r[0] - change[0], u[0] - change[1], mu, k, rho[0])
            # kinks are met by chance alone
            assert matrix[:, j] == pytest.approx((ahead - behind) / (2 * tiny), abs=1e-5)


def test_a_scene_whose_factors_have_no_room_is_left_to_other_methods(monkeypatch):
    problem = first_problem(column([0.5, 0.3, 0.4], [2000.0, 1500.0, 2500.0]))
    assert ProximalNewton()(problem, nothing(problem)).converged
    monkeypatch.setattr("mechanics.solvers.second_order.proximal_newton._ROOM", 10)
    given_up = ProximalNewton()(problem, nothing(problem))
    assert not given_up.converged
    assert not given_up.impulse.any()
    solved = choose_solver(SolverSettings(), False)(problem, nothing(problem))
    assert solved.converged
