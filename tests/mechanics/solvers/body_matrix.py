"""Strips of bodies, and matrices between them in panels."""

import numpy as np

from mechanics.solvers._kernels.body_cholesky import postorder


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


def dense_and_panels(pairs, panels, rng):
    """Return a positive definite matrix (6 n, 6 n) with random blocks at the pairs, and its panels."""
    count = panels.body[-1]
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
    return dense, value
