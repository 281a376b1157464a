"""Numba kernels of W where rigid and deformable bodies meet: products, and Gauss–Seidel sweeps."""

import numpy as np
from numba import njit

from mechanics.problem._kernels import solve_contact

__all__ = ["apply_delassus", "sweep"]

NONE, RIGID, ELASTIC = 0, 1, 2


@njit(cache=True)
def apply_delassus(r, body, kind, jacobian, response, slot, yptr, bptr, block):  # pragma: no cover - compiled
    """What the impulses r (nc, 3) do: u = W r (nc, 3), rigid velocities (nb, 6), elastic side velocities."""
    nc, nb = r.shape[0], yptr.shape[0] - 1
    v = np.zeros((nb, 6))
    p, y = np.zeros(yptr[nb]), np.zeros(yptr[nb])
    for c in range(nc):
        sign = 1.0
        for s in range(2):
            b = body[c, s]
            if kind[c, s] == RIGID:
                for i in range(6):
                    for k in range(3):
                        v[b, i] += sign * response[c, s, i, k] * r[c, k]
            elif kind[c, s] == ELASTIC:
                start = yptr[b] + 3 * slot[c, s]
                for k in range(3):
                    p[start + k] += sign * r[c, k]
            sign = -1.0
    for b in range(nb):
        n = yptr[b + 1] - yptr[b]
        for row in range(n):
            start = bptr[b] + row * n
            total = 0.0
            for col in range(n):
                total += block[start + col] * p[yptr[b] + col]
            y[yptr[b] + row] = total
    u = np.zeros((nc, 3))
    for c in range(nc):
        _relative_velocity(c, u[c], v, y, body, kind, jacobian, slot, yptr)
    return u, v, y


@njit(cache=True, inline="always")
def _relative_velocity(c, u, v, y, body, kind, jacobian, slot, yptr):
    """Add to u (3,) the local relative velocity at contact c."""
    sign = 1.0
    for s in range(2):
        b = body[c, s]
        if kind[c, s] == RIGID:
            for k in range(3):
                total = 0.0
                for i in range(6):
                    total += jacobian[c, s, k, i] * v[b, i]
                u[k] += sign * total
        elif kind[c, s] == ELASTIC:
            start = yptr[b] + 3 * slot[c, s]
            for k in range(3):
                u[k] += sign * y[start + k]
        sign = -1.0


@njit(cache=True)
def sweep(
    count,
    backward,
    r,
    v,
    y,
    shift,
    mu,
    cohesion,
    factors,
    diagonal,
    body,
    kind,
    jacobian,
    response,
    slot,
    yptr,
    bptr,
    block,
):  # pragma: no cover - compiled
    """`count` passes of non-smooth Gauss–Seidel; r, v and y are kept up to date in place.

    `shift` is u_free with the bias added to its normal part. With `backward`, every second pass runs the
    other way round.
    """
    nc = r.shape[0]
    u, b, new = np.empty(3), np.empty(3), np.empty(3)
    for n in range(count):
        for position in range(nc):
            c = nc - 1 - position if backward and n % 2 == 1 else position
            u[:] = shift[c]
            _relative_velocity(c, u, v, y, body, kind, jacobian, slot, yptr)
            w = diagonal[c]
            for k in range(3):
                b[k] = u[k] - w[k, 0] * r[c, 0] - w[k, 1] * r[c, 1] - w[k, 2] * r[c, 2]
            solve_contact(factors[c], b, mu[c], cohesion[c], new)
            d0, d1, d2 = new[0] - r[c, 0], new[1] - r[c, 1], new[2] - r[c, 2]
            if d0 == 0.0 and d1 == 0.0 and d2 == 0.0:
                continue
            r[c] = new
            for s in range(2):
                a = body[c, s]
                if kind[c, s] == RIGID:
                    for i in range(6):
                        v[a, i] += (
                            response[c, s, i, 0] * d0 + response[c, s, i, 1] * d1 + response[c, s, i, 2] * d2
                        )
                elif kind[c, s] == ELASTIC:
                    start, size = yptr[a], yptr[a + 1] - yptr[a]
                    # the block is symmetric: rows, which lie together in memory, serve as columns
                    row = bptr[a] + 3 * slot[c, s] * size
                    for k in range(size):
                        y[start + k] += (
                            block[row + k] * d0 + block[row + size + k] * d1 + block[row + 2 * size + k] * d2
                        )
                d0, d1, d2 = -d0, -d1, -d2
