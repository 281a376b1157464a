# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators, no-check-untyped-defs
"""Numba kernels of a stored W in block-sparse rows: products and Gauss–Seidel sweeps."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mechanics.contact._kernels.vectors import dot, row
from mechanics.delassus._kernels.sides import less_dot
from mechanics.problem._kernels import solve_contact

__all__ = ["Blocks", "add_block", "apply", "sweep"]


class Blocks(NamedTuple):
    """W in block-sparse rows.

    Attributes
    ----------
    block : (nnz, 3, 3) float64, row by row [1/kg]
    indices : (nnz,) int64, the column of each block, in contacts
    indptr : (nc+1,) int64, where each row begins
    """

    block: NDArray[np.float64]
    indices: NDArray[np.int64]
    indptr: NDArray[np.int64]


@njit(cache=True)
def add_block(u, w, r):  # pragma: no cover - compiled
    """Return u + w r, for a block w (3, 3)."""
    return u[0] + dot(row(w, 0), r), u[1] + dot(row(w, 1), r), u[2] + dot(row(w, 2), r)


@njit(cache=True)
def _add_row(c, r, w, u):
    """Return u plus row c of W r."""
    for p in range(w.indptr[c], w.indptr[c + 1]):
        u = add_block(u, w.block[p], row(r, w.indices[p]))
    return u


@njit(cache=True)
def apply(r, w):  # pragma: no cover - compiled
    """Return W r (nc, 3) [m/s], of impulses r (nc, 3) [N s] and W (`Blocks`)."""
    u = np.zeros(r.shape)
    for c in range(r.shape[0]):
        u[c, 0], u[c, 1], u[c, 2] = _add_row(c, r, w, (0.0, 0.0, 0.0))
    return u


@njit(cache=True)
def sweep(count, r, laws, local, w):  # pragma: no cover - compiled
    """Make `count` passes of non-smooth Gauss–Seidel.

    Inputs
    ------
    count : int64
    r : (nc, 3) float64 [N s]
    laws : Laws, factors of `local`
    local : (nc, 3, 3) float64, symmetric blocks with which each contact is solved [1/kg]; the rest of its row is frozen
    w : Blocks

    Outputs
    -------
    r : written
    """
    nc = r.shape[0]
    b, new = np.empty(3), np.empty(3)
    for _ in range(count):
        for c in range(nc):
            u = _add_row(c, r, w, row(laws.shift, c))
            old = row(r, c)
            for k in range(3):
                b[k] = less_dot(u[k], row(local[c], k), old)
            solve_contact(laws.factors[c], b, laws.friction[c], laws.cohesion[c], new)
            r[c, 0], r[c, 1], r[c, 2] = new[0], new[1], new[2]
