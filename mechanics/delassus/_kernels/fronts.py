"""Numba kernels of the multifrontal factors: assembly of fronts, and the solves forth and back."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["Layout", "add_into", "solve"]


class Layout(NamedTuple):
    """Order of elimination and places of the factors; the same for all matrices of one pattern.

    Attributes
    ----------
    order : (nf,) int64, fronts (groups of contacts) as they are eliminated
    width : (nf,) int64, pivots of each front, three for each contact of its group
    dptr, dof : int64, unknowns of each front, pivots first, the others in the order of their elimination
    fptr, pptr : (nf+1,) int64, where the factors and the row exchanges of each front begin
    """

    order: NDArray[np.int64]
    width: NDArray[np.int64]
    dptr: NDArray[np.int64]
    dof: NDArray[np.int64]
    fptr: NDArray[np.int64]
    pptr: NDArray[np.int64]


@njit(cache=True, nogil=True)
def add_into(pivot, below, update, runs, block):  # pragma: no cover - compiled
    """Add a block to a front.

    Inputs
    ------
    runs : (nr, 3) int64, of each run of neighbouring unknowns its place in the front, its place in the block, and its
        length; none reaches from the pivots into the rest
    block : (n, n) float64, by columns

    Outputs
    -------
    pivot, below, update : (k, k+m), (m, k) and (m, m) float64, by columns: the rows of the pivots, what is below the
        pivots, and the rest
    """
    k = pivot.shape[0]
    for s in range(runs.shape[0]):
        left, across, columns = runs[s, 0], runs[s, 1], runs[s, 2]
        for t in range(runs.shape[0]):
            top, down, rows = runs[t, 0], runs[t, 1], runs[t, 2]
            for j in range(columns):
                if top < k:
                    target = pivot[top : top + rows, left + j]
                elif left < k:
                    target = below[top - k : top - k + rows, left + j]
                else:
                    target = update[top - k : top - k + rows, left - k + j]
                source = block[down : down + rows, across + j]
                for i in range(rows):
                    target[i] += source[i]


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
        k, start = width[f], dptr[f]
        m = dptr[f + 1] - start - k
        for i in range(k + m):
            local[i] = b[dof[start + i]]
        at = fptr[f]
        for i in range(k):
            p = pivots[pptr[f] + i]
            if p != i:
                local[i], local[p] = local[p], local[i]
        for j in range(k):
            x = local[j]
            for i in range(j + 1, k):
                local[i] -= factor[at + j * k + i] * x
        for j in range(k - 1, -1, -1):
            local[j] /= factor[at + j * k + j]
            x = local[j]
            for i in range(j):
                local[i] -= factor[at + j * k + i] * x
        at += k * k + k * m
        for j in range(k):
            x = local[j]
            for i in range(m):
                local[k + i] -= factor[at + j * m + i] * x
        for i in range(k + m):
            b[dof[start + i]] = local[i]
    for n in range(order.shape[0] - 1, -1, -1):
        f = order[n]
        k, start = width[f], dptr[f]
        m = dptr[f + 1] - start - k
        at = fptr[f] + k * k
        for i in range(k):
            local[i] = b[dof[start + i]]
        for j in range(m):
            x = b[dof[start + k + j]]
            for i in range(k):
                local[i] -= factor[at + j * k + i] * x
        for i in range(k):
            b[dof[start + i]] = local[i]
