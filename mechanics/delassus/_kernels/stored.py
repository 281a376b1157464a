"""Numba kernels of a stored W in block-sparse rows: products, and Gauss–Seidel sweeps."""

import numpy as np
from numba import njit

from mechanics.problem._kernels import solve_contact

__all__ = ["apply", "sweep"]


@njit(cache=True, inline="always")
def _row(c, r, block, indices, indptr, u):
    """Add row c of W r to u (3,)."""
    u0, u1, u2 = u[0], u[1], u[2]
    for p in range(indptr[c], indptr[c + 1]):
        w, j = block[p], indices[p]
        r0, r1, r2 = r[j, 0], r[j, 1], r[j, 2]
        u0 += w[0, 0] * r0 + w[0, 1] * r1 + w[0, 2] * r2
        u1 += w[1, 0] * r0 + w[1, 1] * r1 + w[1, 2] * r2
        u2 += w[2, 0] * r0 + w[2, 1] * r1 + w[2, 2] * r2
    u[0], u[1], u[2] = u0, u1, u2


@njit(cache=True)
def apply(r, block, indices, indptr):  # pragma: no cover - compiled
    """W r (nc, 3)."""
    u = np.zeros(r.shape)
    for c in range(r.shape[0]):
        _row(c, r, block, indices, indptr, u[c])
    return u


@njit(cache=True)
def sweep(
    count, r, shift, mu, cohesion, factors, local, block, indices, indptr
):  # pragma: no cover - compiled
    """`count` passes of non-smooth Gauss–Seidel; r (nc, 3) is kept up to date in place.

    `shift` is u_free with the bias added to its normal part; `local` (nc, 3, 3) the symmetric blocks that each
    contact is solved with, and `factors` theirs. What the row of W has besides stays frozen in b.
    """
    nc = r.shape[0]
    u, b, new = np.empty(3), np.empty(3), np.empty(3)
    for _ in range(count):
        for c in range(nc):
            u[:] = shift[c]
            _row(c, r, block, indices, indptr, u)
            w = local[c]
            for k in range(3):
                b[k] = u[k] - w[k, 0] * r[c, 0] - w[k, 1] * r[c, 1] - w[k, 2] * r[c, 2]
            solve_contact(factors[c], b, mu[c], cohesion[c], new)
            r[c, 0], r[c, 1], r[c, 2] = new[0], new[1], new[2]
