"""Jordan algebra, steps to the boundary and scalings of second-order cones, from their definitions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanics.solvers.second_order.second_order_cones import (
    divide,
    product,
    reach,
    scaling,
    to_bounds,
)

seeds = st.integers(0, 2**32 - 1)
IDENTITY = np.array([1.0, 0.0, 0.0])


def inside(rng, count, margin=1e-3):
    """Points in the cone, some deep, some near its surface, of sizes that range over six decades."""
    tangent = rng.normal(size=(count, 2))
    depth = 10.0 ** rng.uniform(np.log10(margin), 1.0, count)
    points = np.column_stack([np.linalg.norm(tangent, axis=1) * (1.0 + depth) + 1e-3 * depth, tangent])
    return points * 10.0 ** rng.uniform(-3, 3, (count, 1))


def height(x):
    """x₀ - ‖x_T‖, positive inside."""
    return x[..., 0] - np.linalg.norm(x[..., 1:], axis=-1)


def arrow(x):
    """The matrix of the product with x."""
    return np.array([[x[0], x[1], x[2]], [x[1], x[0], 0], [x[2], 0, x[0]]])


def farthest(x, step, limit=1e9):
    """Largest a with x + a · step in the cone, by bisection: the cone is convex, so it is left once."""
    if height(x + limit * step) >= 0:
        return np.inf
    low, high = 0.0, limit
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if height(x + middle * step) >= 0 else (low, middle)
    return low


@given(seeds)
@settings(max_examples=50, deadline=None)
def test_dividing_undoes_a_product(seed):
    rng = np.random.default_rng(seed)
    x, y = inside(rng, 20), rng.normal(size=(20, 3))
    for there, back in ((product(x, divide(x, y)), y), (divide(x, product(x, y)), y)):
        np.testing.assert_allclose(there, back, atol=1e-10 * np.abs(y).max())


@given(seeds)
@settings(max_examples=30, deadline=None)
def test_the_product_is_that_of_arrow_matrices_and_commutes(seed):
    rng = np.random.default_rng(seed)
    x, y = rng.normal(size=(2, 10, 3))
    expected = np.array([arrow(a) @ b for a, b in zip(x, y, strict=True)])
    np.testing.assert_allclose(product(x, y), expected, atol=1e-13)
    np.testing.assert_array_equal(product(x, y), product(y, x))
    np.testing.assert_allclose(product(x, np.tile(IDENTITY, (10, 1))), x, atol=0)


@given(seeds)
@settings(max_examples=100, deadline=None)
def test_a_step_leaves_the_cone_exactly_at_its_reach(seed):
    rng = np.random.default_rng(seed)
    x = inside(rng, 1)
    step = rng.normal(size=(1, 3)) * 10.0 ** rng.uniform(-2, 2) * np.abs(x).max()
    expected = farthest(x[0], step[0])
    assert reach(x, step) == pytest.approx(expected, rel=1e-7)


@given(seeds)
@settings(max_examples=50, deadline=None)
def test_of_many_cones_the_first_that_is_left_counts(seed):
    rng = np.random.default_rng(seed)
    x, step = inside(rng, 8), rng.normal(size=(8, 3))
    alone = min(reach(x[k : k + 1], step[k : k + 1]) for k in range(8))
    assert reach(x, step) == alone


@pytest.mark.parametrize(
    ("x", "step", "expected"),
    [
        ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), 1.0),  # through the apex
        ((2.0, 0.0, 0.0), (-1.0, 1.0, 0.0), 1.0),  # along the surface of the backward cone
        ((2.0, 0.0, 0.0), (0.0, 0.0, -4.0), 0.5),
        ((2.0, 1.0, 0.0), (-4.0, -2.0, 0.0), 0.5),  # straight back
        ((2.0, 1.0, 0.0), (0.0, 0.0, 0.0), np.inf),
        ((2.0, 1.0, 0.0), (1.0, 0.2, 0.1), np.inf),
        ((2.0, 1.0, 0.0), (1.0, 1.0, 0.0), np.inf),  # along the surface, for ever
        ((2.0, 1.0, 0.0), (3.0, 5.0, 0.0), 0.5),  # up, but not steeply enough
    ],
)
def test_steps_of_every_kind(x, step, expected):
    assert reach(np.array([x]), np.array([step])) == pytest.approx(expected, rel=1e-14)


def test_without_cones_nothing_is_left():
    assert reach(np.zeros((0, 3)), np.zeros((0, 3))) == np.inf


@given(seeds)
@settings(max_examples=50, deadline=None)
def test_the_scaling_takes_dual_and_slack_to_one_point(seed):
    rng = np.random.default_rng(seed)
    s, z = inside(rng, 20), inside(rng, 20)
    t = scaling(s, z)
    one, other = t(z), t.inverse(s)
    np.testing.assert_allclose(one, other, atol=1e-8 * np.abs(one).max(axis=1).min(), rtol=1e-8)
    # s · z is what it was
    np.testing.assert_allclose((one**2).sum(axis=1), (s * z).sum(axis=1), rtol=1e-8)


@given(seeds)
@settings(max_examples=50, deadline=None)
def test_the_scaling_is_symmetric_keeps_the_cone_and_has_an_inverse(seed):
    rng = np.random.default_rng(seed)
    s, z, x = (inside(rng, 6) for _ in range(3))
    t = scaling(s, z)
    columns = np.stack([t(np.tile(unit, (6, 1))) for unit in np.eye(3)], axis=-1)
    np.testing.assert_allclose(columns, columns.transpose(0, 2, 1), rtol=1e-10, atol=1e-300)
    back = np.stack([t.inverse(np.tile(unit, (6, 1))) for unit in np.eye(3)], axis=-1)
    size = np.abs(columns).max(axis=(1, 2)) * np.abs(back).max(axis=(1, 2))
    assert (np.abs(columns @ back - np.eye(3)).max(axis=(1, 2)) < 1e-12 * size).all()
    square = t.inverse_squared
    assert (np.abs(back @ back - square).max(axis=(1, 2)) < 1e-12 * np.abs(back).max(axis=(1, 2)) ** 2).all()
    # T takes the cone onto itself: it multiplies x₀² - ‖x_T‖² by one factor
    mirror = np.diag([1.0, -1.0, -1.0])
    kept = columns @ mirror @ columns / t.size[:, None, None] ** 2
    norm = (np.abs(columns).max(axis=(1, 2)) / t.size) ** 2
    assert (np.abs(kept - mirror).max(axis=(1, 2)) < 1e-12 * norm).all()
    assert (height(t(x)) > 0).all()
    assert (height(t.inverse(x)) > 0).all()


def test_where_slack_and_dual_agree_nothing_is_scaled():
    s = np.array([[2.0, 1.0, -0.5]])
    t = scaling(s, s)
    np.testing.assert_allclose(t.inverse_squared[0], np.eye(3), atol=1e-14)
    np.testing.assert_allclose(t(s), s, rtol=1e-14)


@given(seeds, st.floats(0.01, 1.0), st.floats(1.0, 10.0))
def test_eigenvalues_are_brought_between_bounds_and_none_falls_by_more_than_the_larger(seed, low, high):
    x = 10.0 * np.random.default_rng(seed).normal(size=(20, 3))

    def values(of):
        size = np.linalg.norm(of[:, 1:], axis=1)
        return np.array([of[:, 0] + size, of[:, 0] - size])

    before = values(x)
    wanted = np.maximum(np.clip(before, low, high), before - high)
    np.testing.assert_allclose(values(x + to_bounds(x, low, high)), wanted, rtol=1e-9, atol=1e-9)
