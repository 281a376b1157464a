"""Accelerated projected gradients: kernels against plain numpy, closed forms, and how the count grows with height."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mechanics.solvers.first_order.apgd import APGD

from mechanics.problem.problem import ContactStart
from mechanics.problem.residual import natural_map, project_on_cone
from mechanics.solvers._kernels.apgd import Pair, Terms, curvature, momentum, project_step
from tests.mechanics.shapes import brick, ground, posed, scene


def cold(problem):
    zero = np.zeros_like(problem.u_free)
    return ContactStart(zero, zero.copy())


def column(count, friction=0.5, **more):
    stones = [brick(f"b{n}", (0, 0, 0.25 * n), (0.5, 0.5, 0.25 * (n + 1)), **more) for n in range(count)]
    return posed(scene(ground(), *stones, friction=friction))


seeds = given(st.integers(0, 2**32 - 1), st.sampled_from([2, 3]))


@seeds
@settings(max_examples=30, deadline=None)
def test_a_step_is_the_projected_gradient(seed, d):
    rng = np.random.default_rng(seed)
    y, wy, shift = rng.normal(size=(3, 20, d))
    slide, mu, k, weight = rng.random((4, 20))
    new = np.empty_like(y)
    project_step(Pair(y, wy), slide, 0.7, Terms(shift, shift, mu, k, weight + 0.1), new)
    gradient = wy + shift
    gradient[:, 0] += slide
    exact = project_on_cone(y - 0.7 / (weight + 0.1)[:, None] * gradient, mu, k)
    np.testing.assert_allclose(new, exact, atol=1e-13)


@seeds
@settings(max_examples=30, deadline=None)
def test_curvature_is_the_quotient_of_rayleigh(seed, d):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(8 * d, 8 * d))
    w = root @ root.T
    new, y = rng.normal(size=(2, 8, d))
    weight = rng.random(8) + 0.1
    step = (new - y).ravel()
    exact = step @ w @ step / (step @ (np.repeat(weight, d) * step))
    wide = [(w @ x.ravel()).reshape(8, d) for x in (new, y)]
    ahead = Pair(y, wide[1])
    assert curvature(Pair(new, wide[0]), ahead, weight) == pytest.approx(exact, rel=1e-10)
    assert curvature(ahead, ahead, weight) == 0.0


@seeds
@settings(max_examples=50, deadline=None)
def test_momentum_is_that_of_nesterov_unless_it_leads_astray(seed, d):
    rng = np.random.default_rng(seed)
    new, r, wnew, wr, y, wy, u_free = rng.normal(size=(7, 9, d))
    mu, weight = rng.random((2, 9))
    theta, before = rng.uniform(0.05, 1.0), y.copy()
    slide = np.empty(9)
    terms = Terms(u_free, u_free, mu, mu, weight)
    after = momentum(Pair(new, wnew), Pair(r, wr), Pair(y, wy), terms, theta, slide)
    if (weight[:, None] * (before - new) * (new - r)).sum() > 0:
        expected, beta = 1.0, 0.0
    else:
        expected = (-(theta**2) + theta * np.sqrt(theta**2 + 4)) / 2
        assert expected**2 == pytest.approx((1 - expected) * theta**2)
        beta = theta * (1 - theta) / (theta**2 + expected)
    assert after == pytest.approx(expected)
    np.testing.assert_allclose(y, new + beta * (new - r), atol=1e-13)
    np.testing.assert_allclose(wy, wnew + beta * (wnew - wr), atol=1e-13)
    np.testing.assert_allclose(slide, mu * np.linalg.norm((wnew + u_free)[:, 1:], axis=1), atol=1e-13)


@pytest.mark.parametrize("push", [(0.0, 0.0), (0.6, 0.8), (0.01, 0.0)])
def test_a_block_on_the_ground_sticks_or_slides(push):
    """m g h μ is the most that friction takes from a block that moves at `push`, in one step."""
    one = posed(
        scene(ground(), brick("a", (0, 0, 0), (2, 2, 0.5), velocity=(*push, 0, 0, 0, 0)), friction=0.4), 2e-3
    )
    answer = APGD(1e-10, 1.0)(one.problem, cold(one.problem))
    assert answer.converged
    total = np.einsum("cij,ci->j", one.contacts.frame, answer.impulse)
    mass, speed = 2.0 * 2000.0, np.hypot(*push)
    weight = mass * 9.81 * 2e-3
    taken = min(mass * speed, 0.4 * weight)
    along = -taken * np.array(push) / speed if speed > 0 else np.zeros(2)
    np.testing.assert_allclose(total, [*along, weight], atol=1e-8 * weight)


def test_iterations_grow_with_the_height_and_not_with_its_square():
    """Sweeps of Gauss–Seidel need four times as many for twice as many blocks."""
    counts = []
    for blocks in (8, 16, 32):
        problem = column(blocks).problem
        answer = APGD(1e-8, 1.0, 5000)(problem, cold(problem))
        assert answer.converged
        counts.append(answer.iterations)
    assert counts[2] < 3.0 * counts[1]
    assert counts[2] < 5.0 * counts[0]


def test_a_start_is_kept_where_it_is_the_solution_and_used_where_it_is_near():
    problem = column(6).problem
    first = APGD(1e-9, 1.0)(problem, cold(problem))
    again = APGD(1e-9, 1.0)(problem, ContactStart(first.impulse, first.velocity))
    assert again.iterations == 0
    near = APGD(1e-9, 1.0)(problem, ContactStart(1.0001 * first.impulse, first.velocity))
    assert near.converged
    assert 0 < near.iterations < first.iterations


def test_what_is_left_unsolved_is_reported_with_its_true_residual():
    problem = column(20).problem
    start = ContactStart(np.full_like(problem.u_free, 0.1), np.full_like(problem.u_free, 0.2))
    answer = APGD(1e-12, 1e-12, 25)(problem, start)
    assert not answer.converged
    assert answer.iterations == 25
    assert answer.natural_map == natural_map(problem, answer.impulse)
    np.testing.assert_array_equal(start.impulse, 0.1)
    np.testing.assert_array_equal(start.velocity, 0.2)


def test_no_contacts_are_no_work():
    problem = posed(scene(ground(), brick("a", (0, 0, 5), (1, 1, 6)))).problem
    answer = APGD()(problem, cold(problem))
    assert answer.converged
    assert answer.iterations == 0
