"""Parts of the bodies that no factor couples."""

import numpy as np
import pytest

from mechanics.solvers._kernels.body_cholesky import (
    backward,
    divide,
    eliminate,
    forward,
    panels_of,
    solve,
)
from mechanics.solvers._kernels.body_parts import parts_of
from tests.mechanics.solvers.body_matrix import dense_and_panels, strip


@pytest.fixture(scope="module")
def cut():
    pairs, count = strip(120)
    panels = panels_of(np.ascontiguousarray(pairs), count, 0.2, 6)
    return pairs, panels, parts_of(panels, True)


def test_every_panel_is_in_one_part_or_between_parts_which_hold_a_tenth_of_the_numbers(cut):
    _, panels, parts = cut
    every = [*parts.rest, *(s for first, end in parts.panel for s in range(first, end))]
    assert sorted(every) == list(range(len(panels.body) - 1))
    assert 3 < len(parts.panel) <= 16
    sizes = np.diff(panels.start)
    assert 0 < sizes[parts.rest].sum() <= 0.1 * sizes.sum()


def test_bodies_of_two_parts_never_touch(cut):
    pairs, panels, parts = cut
    part = np.full(panels.body[-1], -1)
    for k, (first, end) in enumerate(parts.body):
        part[first:end] = k
    assert set(np.flatnonzero(part < 0)) == set(parts.shared)
    one, other = part[pairs].T
    assert (one[(one >= 0) & (other >= 0)] == other[(one >= 0) & (other >= 0)]).all()


def test_a_panel_adds_to_its_own_part_or_to_the_copies_of_that_part(cut):
    _, panels, parts = cut
    bodies, shared = panels.body[-1], len(parts.shared)
    for k, ((first, end), (low, high)) in enumerate(zip(parts.panel, parts.body, strict=True)):
        rows = slice(panels.first[first], panels.first[end])
        place, row = parts.row[rows], panels.row[rows]
        own = (low <= row) & (row < high)
        np.testing.assert_array_equal(place[own], row[own])
        np.testing.assert_array_equal(parts.shared[place[~own] - bodies - k * shared], row[~own])


def test_parts_solve_in_whatever_order(cut):
    pairs, panels, parts = cut
    rng = np.random.default_rng(5)
    count, shared = panels.body[-1], len(parts.shared)
    dense, value = dense_and_panels(pairs, panels, rng)
    assert eliminate(panels, value, 0, len(panels.body) - 1)
    divide(panels, value, 0, len(panels.body) - 1)
    load = rng.normal(size=6 * count)
    work = np.empty(6 * np.diff(panels.first).max())
    whole = load.copy()
    solve(panels, value, whole, work)
    np.testing.assert_allclose(dense @ whole, load, atol=1e-12 * np.abs(load).max())
    for order in (range(len(parts.panel)), reversed(range(len(parts.panel)))):
        order = list(order)
        x = np.concatenate([load, np.zeros(6 * shared * len(parts.panel))])
        for k in order:
            forward(panels, value, x, work, *parts.panel[k], parts.row)
        copies = x[6 * count :].reshape(-1, shared, 6).sum(axis=0)
        x[: 6 * count].reshape(-1, 6)[parts.shared] += copies
        for s in parts.rest:
            forward(panels, value, x, work, s, s + 1, panels.row)
        for s in parts.rest[::-1]:
            backward(panels, value, x, work, s, s + 1)
        for k in order:
            backward(panels, value, x, work, *parts.panel[k])
        np.testing.assert_allclose(x[: 6 * count], whole, rtol=1e-10, atol=1e-13)


def test_one_part_holds_all_where_bodies_are_few():
    pairs, count = strip(10)
    panels = panels_of(np.ascontiguousarray(pairs), count, 0.2, 6)
    parts = parts_of(panels, False)
    assert parts.panel.tolist() == [[0, len(panels.body) - 1]]
    assert len(parts.rest) == len(parts.shared) == 0
    np.testing.assert_array_equal(parts.row, panels.row)
