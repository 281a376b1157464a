"""Tall, heavy and hyperstatic scenes from a cold start: solved soon, with the forces of statics."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from mechanics.problem.residual import residual
from mechanics.solvers.auto import Auto
from mechanics.solvers.chain import Chain
from mechanics.solvers.kinds import ENDED_PATH
from mechanics.stones.materials import Material
from tests.mechanics.shapes import brick, ground, posed, scene
from tests.mechanics.solvers.problems import STEP, G, carried, cold, column

STONE = 2400.0
# of one block of 0.5 × 0.5 × 0.25 m at 2,400 kg/m³
MASS = STONE * 0.5 * 0.5 * 0.25


def by_path(tolerance, velocity_tolerance, most=200):
    """The interior point, ended by Newton's method."""
    return Chain(tolerance, velocity_tolerance, most, ENDED_PATH)


def solved(problem, tolerance=1e-6, velocity_tolerance=1e-5, solver=Auto):
    """From nothing; judged from outside."""
    solution = solver(tolerance, velocity_tolerance)(problem, cold(problem))
    assert residual(problem, solution.impulse).within(tolerance, velocity_tolerance)
    assert solution.converged
    return solution


def thick_wall(bricks, courses, leaves=3):
    """Leaves of bricks of 0.3 × 0.15 × 0.1 m side by side, head joints staggered by course and by leaf."""
    stones, stone = [], Material("stone", STONE, 1e10, 0.2)
    for course in range(courses):
        for leaf in range(leaves):
            joints = np.arange(bricks + 1.0)
            if (course + leaf) % 2:
                joints = np.concatenate([[0.0], joints[:-1] + 0.5, [float(bricks)]])
            for n, (left, right) in enumerate(itertools.pairwise(joints)):
                low, high = (
                    (0.3 * left, 0.15 * leaf, 0.1 * course),
                    (0.3 * right, 0.15 * leaf + 0.15, 0.1 * course + 0.1),
                )
                stones.append(brick(f"{course}-{leaf}-{n}", low, high, material=stone))
    return posed(scene(ground(), *stones), STEP, theta=0.5).problem


@pytest.mark.parametrize("count", [10, 100, 200])
def test_a_column_is_solved_in_under_a_hundred_iterations(count):
    """Each joint carries what lies above it; what velocities lack adds up from joint to joint. Statics."""
    problem = column([STONE] * count)
    solution = solved(problem)
    assert solution.iterations < 100
    above = np.arange(count, 0, -1) * MASS * G
    np.testing.assert_allclose(carried(problem, solution.impulse), above, rtol=1e-5 * count)


@pytest.mark.parametrize("friction", [0.1, 10.0])
def test_friction_does_not_matter_to_a_column_that_stands(friction):
    problem = column([STONE] * 100, friction=friction)
    assert solved(problem).iterations < 100


def test_a_tilted_column_of_a_hundred_begins_to_topple():
    """2°, and 50 times as high as wide: joints open, and two solvers find the same motion."""
    problem = column([STONE] * 100, tilt=2.0)
    solution, other = solved(problem, 1e-8, 1e-6), solved(problem, 1e-10, 1e-8, by_path)
    # 1,500 of them by ADMM, a hundredth of a factorisation each: forces from nothing decide only if they are exact
    assert solved(problem).iterations < 1_700
    one, two = (problem.delassus.apply(found.impulse) + problem.u_free for found in (solution, other))
    np.testing.assert_allclose(one, two, atol=1e-5 * np.abs(problem.u_free).max())
    assert two[:, 0].max() > 1e-4 * G * STEP


HEAVY = {
    "1,000 t on 1 kg": [1.0, 1e6],
    "1 kg on 1,000 t": [1e6, 1.0],
    "heavy in the middle": [1.0] * 5 + [1e6] + [1.0] * 4,
    "light in the middle": [1e6] * 5 + [1.0] + [1e6] * 4,
    "in turns": [1.0, 1e6] * 5,
    "growing upwards": np.logspace(0, 6, 100),
    "growing downwards": np.logspace(6, 0, 100),
}


@pytest.mark.parametrize("solver", [Auto, by_path])
@pytest.mark.parametrize("ratio", HEAVY.values(), ids=HEAVY)
def test_masses_may_differ_by_a_million(ratio, solver):
    """η and velocities below 1e-8; each joint carries what lies above it, the light stones too. Statics."""
    problem = column(STONE * np.asarray(ratio))
    solution = solved(problem, 1e-8, 1e-8, solver)
    above = np.cumsum(np.asarray(ratio)[::-1])[::-1] * MASS * G
    np.testing.assert_allclose(carried(problem, solution.impulse), above, rtol=1e-7)


@pytest.mark.parametrize("seed", [None, *range(24)])
def test_a_heavy_block_that_slides_pulls_its_light_neighbours(seed):
    """20° and μ = 0.1, masses 1 and 10⁶ in turns: all slide as one, with g (sin θ - μ cos θ). Closed form.

    All joints but the lowest are at the edge between stick and slip, so the last digit of the geometry decides how
    solvers get on; another processor may round it in another way.
    """
    angle, friction = np.radians(20.0), 0.1
    problem = column([STONE, 1e6 * STONE] * 3, friction=friction, tilt=20.0)
    if seed is not None:
        geometry = problem.delassus.geometry
        rounding = 3e-16 * np.random.default_rng(seed).normal(size=geometry.shape)
        operator = replace(problem.delassus, geometry=geometry * (1.0 + rounding))
        problem = replace(problem, delassus=operator)
    solution = solved(problem, 1e-8, 1e-6)
    u = problem.delassus.apply(solution.impulse) + problem.u_free
    slip = np.linalg.norm(u[:, 1:], axis=1)
    lowest = problem.delassus.body.max(axis=1) == 1
    expected = G * (np.sin(angle) - friction * np.cos(angle)) * STEP
    np.testing.assert_allclose(slip[lowest], expected, rtol=1e-5)
    assert slip[~lowest].max() < 1e-5 * expected


def test_a_thick_wall_is_solved_in_under_two_hundred_iterations():
    """20 courses in three leaves that share no stone: far more contacts than balance needs. Statics."""
    problem = thick_wall(4, 20)
    solution = solved(problem)
    # a hundred of them by ADMM, each a hundredth of a factorisation
    assert solution.iterations < 200
    weight = STONE * 4 * 0.3 * 3 * 0.15 * 20 * 0.1 * G
    grounded = (problem.delassus.body == 0).any(axis=1)
    assert solution.impulse[grounded, 0].sum() / STEP == pytest.approx(weight, rel=1e-5)


@pytest.mark.slow
def test_a_thick_wall_of_150_courses_is_solved_in_a_few_hundred_iterations():
    problem = thick_wall(4, 150)
    solution = solved(problem)
    assert solution.iterations < 700
    weight = STONE * 4 * 0.3 * 3 * 0.15 * 150 * 0.1 * G
    grounded = (problem.delassus.body == 0).any(axis=1)
    assert solution.impulse[grounded, 0].sum() / STEP == pytest.approx(weight, rel=1e-5)
