"""Numba kernels of W between rigid and deformable bodies: products and Gauss–Seidel sweeps."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mechanics.contact._kernels.vectors import dot, minus, row
from mechanics.delassus._kernels.sides import less_dot, negative
from mechanics.problem._kernels import solve_contact

NONE, RIGID, ELASTIC = 0, 1, 2


class Sides(NamedTuple):
    """Sides of the contacts and the responses of their bodies; candidates count positive, antagonists negative.

    Attributes
    ----------
    body : (nc, 2) int64
    kind : (nc, 2) int64, NONE, RIGID or ELASTIC
    jacobian : (nc, 2, 3, 6) float64, local velocity of a rigid side by its body's velocity
    response : (nc, 2, 6, 3) float64, body velocity by the local impulse
    slot : (nc, 2) int64, index of an elastic side among those of its body
    yptr, bptr : (nb+1,) int64, first elastic velocity and first compliance entry of each body
    block : float64, flat symmetric compliance blocks [1/kg]
    """

    body: NDArray[np.int64]
    kind: NDArray[np.int64]
    jacobian: NDArray[np.float64]
    response: NDArray[np.float64]
    slot: NDArray[np.int64]
    yptr: NDArray[np.int64]
    bptr: NDArray[np.int64]
    block: NDArray[np.float64]


@njit(cache=True)
def apply_delassus(r, sides):  # pragma: no cover - compiled
    """Compute the effects of impulses.

    Inputs
    ------
    r : (nc, 3) float64, impulses, local frames [N s]
    sides : Sides

    Outputs
    -------
    u : (nc, 3) float64, W r [m/s]
    v : (nb, 6) float64, velocities of the rigid bodies [m/s, rad/s]
    y : float64, velocities of the elastic sides, three for each [m/s]
    """
    nc, nb = r.shape[0], sides.yptr.shape[0] - 1
    yptr, bptr, block = sides.yptr, sides.bptr, sides.block
    v = np.zeros((nb, 6))
    p, y = np.zeros(yptr[nb]), np.zeros(yptr[nb])
    for c in range(nc):
        sign = 1.0
        for s in range(2):
            b = sides.body[c, s]
            if sides.kind[c, s] == RIGID:
                for i in range(6):
                    for k in range(3):
                        v[b, i] += sign * sides.response[c, s, i, k] * r[c, k]
            elif sides.kind[c, s] == ELASTIC:
                start = yptr[b] + 3 * sides.slot[c, s]
                for k in range(3):
                    p[start + k] += sign * r[c, k]
            sign = -1.0
    for b in range(nb):
        first, n = yptr[b], yptr[b + 1] - yptr[b]
        # by columns, equal to the rows of a symmetric block: contiguous sums take half the time
        for k in range(n):
            push = p[first + k]
            if push != 0.0:
                for i in range(n):
                    y[first + i] += block[bptr[b] + k * n + i] * push
    u = np.zeros((nc, 3))
    for c in range(nc):
        _relative_velocity(c, u[c], v, y, sides)
    return u, v, y


@njit(cache=True, inline="always")
def _relative_velocity(c, u, v, y, sides):
    """Add to u (3,) the local relative velocity at contact c."""
    sign = 1.0
    for s in range(2):
        b = sides.body[c, s]
        if sides.kind[c, s] == RIGID:
            for k in range(3):
                total = 0.0
                for i in range(6):
                    total += sides.jacobian[c, s, k, i] * v[b, i]
                u[k] += sign * total
        elif sides.kind[c, s] == ELASTIC:
            start = sides.yptr[b] + 3 * sides.slot[c, s]
            for k in range(3):
                u[k] += sign * y[start + k]
        sign = -1.0


@njit(cache=True)
def _give_way(c, step, v, y, sides):
    """Add to v and y the effects of a change of the impulse (3) at contact c."""
    yptr, block = sides.yptr, sides.block
    for s in range(2):
        a = sides.body[c, s]
        if sides.kind[c, s] == RIGID:
            for i in range(6):
                v[a, i] += dot(row(sides.response[c, s], i), step)
        elif sides.kind[c, s] == ELASTIC:
            start, size = yptr[a], yptr[a + 1] - yptr[a]
            # the block is symmetric: rows, which are contiguous, serve as columns
            at = sides.bptr[a] + 3 * sides.slot[c, s] * size
            for k in range(size):
                y[start + k] += dot((block[at + k], block[at + size + k], block[at + 2 * size + k]), step)
        step = negative(step)


@njit(cache=True)
def sweep(count, r, v, y, laws, diagonal, sides):  # pragma: no cover - compiled
    """Make `count` passes of non-smooth Gauss–Seidel, every second one backwards.

    Inputs
    ------
    count : int64
    r, v, y : consistent, as in `apply_delassus`
    laws : Laws
    diagonal : (nc, 3, 3) float64, W_αα [1/kg]
    sides : Sides

    Outputs
    -------
    r, v, y : written
    """
    nc = r.shape[0]
    u, b, new = np.empty(3), np.empty(3), np.empty(3)
    for n in range(count):
        for position in range(nc):
            c = nc - 1 - position if n % 2 == 1 else position
            u[:] = laws.shift[c]
            _relative_velocity(c, u, v, y, sides)
            old = row(r, c)
            for k in range(3):
                b[k] = less_dot(u[k], row(diagonal[c], k), old)
            solve_contact(laws.factors[c], b, laws.friction[c], laws.cohesion[c], new)
            step = minus(new, old)
            if step[0] == 0.0 and step[1] == 0.0 and step[2] == 0.0:
                continue
            r[c] = new
            _give_way(c, step, v, y, sides)
