"""Factors of matrices of 6 × 6 blocks, and of 3 × 3 blocks in the plane, against numpy."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanics.solvers._kernels.body_cholesky import (
    divide,
    eliminate,
    forward,
    panels_of,
    postorder,
    solve,
)


def blocks_of(panels, value):
    """Return views of the blocks by (column's body, row's body)."""
    views, size = {}, panels.size
    for s in range(len(panels.body) - 1):
        rows = panels.row[panels.first[s] : panels.first[s + 1]]
        shape = size * (panels.body[s + 1] - panels.body[s]), size * len(rows)
        panel = value[panels.start[s] : panels.start[s + 1]].reshape(shape)
        for i, k in enumerate(range(panels.body[s], panels.body[s + 1])):
            for p, r in enumerate(rows):
                views[k, int(r)] = panel[size * i : size * (i + 1), size * p : size * (p + 1)]
    return views


def random_matrix(pairs, count, rng, size=6):
    """Return a dense, positive definite matrix (size count, size count) with blocks at the pairs."""
    dense = np.zeros((size * count, size * count))
    for i, j in pairs:
        block = rng.normal(size=(size, size))
        dense[size * i : size * (i + 1), size * j : size * (j + 1)] = block
        dense[size * j : size * (j + 1), size * i : size * (i + 1)] = block.T
    return dense + np.diag(1.0 + np.abs(dense).sum(axis=1))


def factors(dense, pairs, count, spare, size=6, precision=np.float64):
    """Return panels and factors of a dense matrix, and whether it was positive definite."""
    panels = panels_of(pairs, count, spare, size)
    value = np.zeros(panels.start[-1], dtype=precision)
    for (k, r), view in blocks_of(panels, value).items():
        if r >= k:
            view[:] = dense[size * k : size * (k + 1), size * r : size * (r + 1)]
    every = 0, len(panels.body) - 1
    regular = eliminate(panels, value, *every)
    if regular:
        divide(panels, value, *every)
    return panels, value, regular


@settings(max_examples=40, deadline=None)
@given(
    count=st.integers(1, 14),
    density=st.floats(0, 1),
    spare=st.sampled_from([0.0, 0.3, 5.0]),
    seed=st.integers(0, 99),
    size=st.sampled_from([3, 6]),
    precision=st.sampled_from([np.float64, np.float32]),
)
def test_solutions_are_those_of_numpy_whatever_the_pattern_and_the_panels(
    count, density, spare, seed, size, precision
):
    rng = np.random.default_rng(seed)
    every = np.array([(i, j) for i in range(count) for j in range(i)], dtype=np.int64).reshape(-1, 2)
    pairs = every[rng.random(len(every)) < density]
    rank = postorder(pairs, count)
    np.testing.assert_array_equal(np.sort(rank), np.arange(count))
    pairs = rank[pairs].reshape(-1, 2)
    dense = random_matrix(pairs, count, rng, size)
    panels, value, regular = factors(dense, pairs, count, spare, size, precision)
    assert regular
    right = rng.normal(size=size * count)
    found = right.astype(precision)
    solve(panels, value, found, np.empty(size * count, dtype=precision))
    # the diagonal exceeds its row: solutions are smaller than one, and rounding is that of single numbers
    near = {"rtol": 1e-9, "atol": 1e-12} if precision is np.float64 else {"rtol": 0.0, "atol": 1e-6}
    np.testing.assert_allclose(found, np.linalg.solve(dense, right), **near)


def test_a_chain_of_bodies_fills_nothing_in():
    count = 30
    pairs = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    panels = panels_of(pairs, count, 0.0, 6)
    # two blocks a column, but one in the last
    assert sum(r >= k for k, r in blocks_of(panels, np.zeros(panels.start[-1]))) == 2 * count - 1


@pytest.mark.parametrize("bad", [-1.0, np.nan])
def test_a_matrix_that_is_not_positive_definite_is_refused(bad):
    pairs = np.array([[0, 1]])
    dense = random_matrix(pairs, 2, np.random.default_rng(1))
    dense[7, 7] = bad
    assert not factors(dense, pairs, 2, 0.2)[2]


@pytest.mark.parametrize("size", [3, 6])
def test_no_product_of_a_solution_is_subnormal_as_they_take_ten_times_as_long(size):
    # what a load at one end does fades by 1e-3 from body to body, across the chain as well as along it
    count, tiny = 60, float(np.finfo(np.float32).tiny)
    pairs = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    dense = np.eye(size * count)
    for i, j in pairs:
        block = 1e-3 * np.geomspace(1.0, 1e-36, size * size).reshape(size, size)
        dense[size * i : size * (i + 1), size * j : size * (j + 1)] = block
        dense[size * j : size * (j + 1), size * i : size * (i + 1)] = block.T
    panels, value, _ = factors(dense, pairs, count, 0.0, size, np.float32)
    # each body but the last two has a panel of its own, of which all is read
    read = value[: panels.start[count - 2]]
    assert len(panels.body) == count
    for end in (0, -1):
        load = np.zeros(size * count)
        load[end] = 1.0
        found = load.astype(np.float32)
        solve(panels, value, found, np.empty(size * count, np.float32))
        np.testing.assert_allclose(found, np.linalg.solve(dense, load), rtol=0.0, atol=1e-6)
        downwards = load.astype(np.float32)
        forward(panels, value, downwards, np.empty(size * count, np.float32), 0, count - 1, panels.row)
        for numbers in (downwards, found):
            least = np.abs(read[read != 0]).min() * np.abs(numbers[numbers != 0]).min()
            assert least >= 0.999 * tiny


def test_what_is_too_small_to_count_does_not_depend_on_units():
    rng, count = np.random.default_rng(5), 8
    pairs = np.column_stack([np.arange(count - 1), np.arange(1, count)])
    dense, load = random_matrix(pairs, count, rng), rng.normal(size=6 * count)
    # of heavy stones, and of so large ones that an absolute limit would take all of D⁻¹ for nothing
    unit = np.tile([1e2, 1e2, 1e2, 1e6, 1e6, 1e6], count)
    panels, value, _ = factors(unit[:, None] * dense * unit, pairs, count, 0.2, 6, np.float32)
    found = (unit * load).astype(np.float32)
    solve(panels, value, found, np.empty(6 * count, np.float32))
    np.testing.assert_allclose(unit * found, np.linalg.solve(dense, load), rtol=0.0, atol=1e-6)
