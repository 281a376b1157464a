"""Numba kernels of the multifrontal factors: assembly of fronts, and forward and backward substitution."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Layout(NamedTuple):
    """Order of elimination and places of the factors; the same for all matrices of one pattern.

    Attributes
    ----------
    order : (nf,) int64, fronts (groups of contacts) in elimination order
    width : (nf,) int64, pivots of each front, three for each contact of its group
    dptr, dof : int64, unknowns of each front, pivots first, the others in elimination order
    fptr, pptr : (nf+1,) int64, where the factors and the row exchanges of each front begin
    """

    order: NDArray[np.int64]
    width: NDArray[np.int64]
    dptr: NDArray[np.int64]
    dof: NDArray[np.int64]
    fptr: NDArray[np.int64]
    pptr: NDArray[np.int64]


@njit(cache=True, nogil=True)
def add_into(pivot, below, update, runs, columns, block):  # pragma: no cover - compiled
    """Add a block to a front.

    Inputs
    ------
    runs : (nr, 3) int64, for each run of consecutive unknowns its offset in the front, its offset in the block, and
        its length; none crosses from the pivots into the rest
    columns : (nc, 3) int64, those of the runs whose columns are added
    block : (n, n) float64, by columns

    Outputs
    -------
    pivot, below, update : (k, k+m), (m, k) and (m, m) float64, by columns: pivot rows, rows below the
        pivots, and the rest
    """
    k = pivot.shape[0]
    for s in range(columns.shape[0]):
        left, across, wide = columns[s, 0], columns[s, 1], columns[s, 2]
        for t in range(runs.shape[0]):
            top, down, rows = runs[t, 0], runs[t, 1], runs[t, 2]
            for j in range(wide):
                if top < k:
                    target = pivot[top : top + rows, left + j]
                elif left < k:
                    target = below[top - k : top - k + rows, left + j]
                else:
                    target = update[top - k : top - k + rows, left - k + j]
                source = block[down : down + rows, across + j]
                for i in range(rows):
                    target[i] += source[i]


@njit(cache=True, fastmath={"contract"})
def _subtract(target, columns, x):
    """Subtract Σ x[j] columns[j] from target, four columns for each pass over it."""
    whole = len(x) - len(x) % 4
    for j in range(0, whole, 4):
        x0, x1, x2, x3 = x[j], x[j + 1], x[j + 2], x[j + 3]
        c0, c1, c2, c3 = columns[j], columns[j + 1], columns[j + 2], columns[j + 3]
        for i in range(len(target)):
            target[i] -= x0 * c0[i] + x1 * c1[i] + x2 * c2[i] + x3 * c3[i]
    for j in range(whole, len(x)):
        x0, c0 = x[j], columns[j]
        for i in range(len(target)):
            target[i] -= x0 * c0[i]


@njit(cache=True, fastmath={"contract"})
def _triangles(x, lu):
    """Solve L U x = x in place, `lu` (k, k) by columns; L has ones on its diagonal."""
    k = len(x)
    for j in range(k):
        own, column = x[j], lu[j]
        for i in range(j + 1, k):
            x[i] -= column[i] * own
    for j in range(k - 1, -1, -1):
        column = lu[j]
        x[j] /= column[j]
        own = x[j]
        for i in range(j):
            x[i] -= column[i] * own


@njit(cache=True)
def solve(b, layout, pivots, factor):  # pragma: no cover - compiled
    """Solve (W + Θ) x = b.

    Inputs
    ------
    b : (n,) float64, overwritten
    layout : Layout
    pivots : (n,) int32, row exchanges
    factor : float64, of each front the LU factors (k, k) of its pivot block, F11⁻¹ F12 (k, m) and F21 (m, k), all by
        columns

    Outputs
    -------
    b : x
    """
    order, width, dptr, dof, fptr, pptr = layout
    longest = 0
    for f in range(order.shape[0]):
        longest = max(longest, dptr[f + 1] - dptr[f])
    local = np.empty(longest)
    for n in range(order.shape[0]):
        f = order[n]
        k, at, unknown = width[f], fptr[f], dof[dptr[f] : dptr[f + 1]]
        m = len(unknown) - k
        own, rest = local[:k], local[k : k + m]
        for i in range(k + m):
            local[i] = b[unknown[i]]
        for i in range(k):
            p = pivots[pptr[f] + i]
            if p != i:
                own[i], own[p] = own[p], own[i]
        _triangles(own, factor[at : at + k * k].reshape((k, k)))
        at += k * k + k * m
        _subtract(rest, factor[at : at + k * m].reshape((k, m)), own)
        for i in range(k + m):
            b[unknown[i]] = local[i]
    for n in range(order.shape[0] - 1, -1, -1):
        f = order[n]
        k, at, unknown = width[f], fptr[f] + width[f] * width[f], dof[dptr[f] : dptr[f + 1]]
        m = len(unknown) - k
        own, rest = local[:k], local[k : k + m]
        for i in range(k + m):
            local[i] = b[unknown[i]]
        _subtract(own, factor[at : at + k * m].reshape((m, k)), rest)
        for i in range(k):
            b[unknown[i]] = own[i]
