"""Parts of the bodies that no factor couples."""

import numpy as np
import pytest

from mechanics.solvers._kernels.body_cholesky import backward, factorise, forward, panels_of, postorder, solve
from mechanics.solvers._kernels.body_parts import parts_of


def strip(length, width=3):
    """Return pairs of bodies of a strip that touch, in an order of elimination in which cuts come last."""
    at = np.arange(length * width).reshape(length, width)
    pairs = np.concatenate(
        [
            np.column_stack([at[1:].ravel(), at[:-1].ravel()]),
            np.column_stack([at[:, 1:].ravel(), at[:, :-1].ravel()]),
        ]
    )

    def halved(rows):
        if len(rows) < 4:
            return list(at[rows].ravel())
        middle = len(rows) // 2
        return halved(rows[:middle]) + halved(rows[middle + 1 :]) + list(at[rows[middle]])

    rank = np.empty(at.size, dtype=np.int64)
    rank[halved(np.arange(length))] = np.arange(at.size)
    pairs = rank[pairs]
    return postorder(np.ascontiguousarray(pairs), at.size)[pairs], at.size


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
    dense = np.zeros((6 * count, 6 * count))
    for i, j in pairs:
        block = rng.normal(size=(6, 6))
        dense[6 * i : 6 * i + 6, 6 * j : 6 * j + 6] = block
        dense[6 * j : 6 * j + 6, 6 * i : 6 * i + 6] = block.T
    dense += np.diag(1.0 + np.abs(dense).sum(axis=1))
    value = np.zeros(panels.start[-1])
    for s in range(len(panels.body) - 1):
        first, end = panels.body[s : s + 2]
        rows = panels.row[panels.first[s] : panels.first[s + 1]]
        columns = (6 * rows[:, None] + np.arange(6)).ravel()
        view = dense[6 * first : 6 * end][:, columns] * (columns >= 6 * first)
        lower = columns[None] // 6 >= np.repeat(np.arange(first, end), 6)[:, None]
        value[panels.start[s] : panels.start[s + 1]] = (view * lower).ravel()
    assert factorise(panels, value)
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
