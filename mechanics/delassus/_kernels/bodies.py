"""Numba kernels of W + Θ between rigid bodies, written with the velocities of the bodies.

`side` (nc, 2) int64 holds the places of the two bodies of a contact in elimination order, -1 for a body that
does not move; `geometry` (nc, 15) float64 is that of `RigidContacts`. Velocities (nm, 6) are those of the nm bodies
that move.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mechanics.contact._kernels.vectors import cross, dot, minus, row, write_row
from mechanics.delassus._kernels.sides import arm, inverse_columns, negative, side_jacobian, times, to_world


class Pattern(NamedTuple):
    """Blocks (6, 6) of M + H Θ⁻¹ Hᵀ, bodies in elimination order.

    Attributes
    ----------
    mass : (nm, 6, 6) float64, M [kg], [kg m²]
    side : (nc, 2) int64, rank of each contact's bodies, -1: fixed
    indptr, indices : int32, of the matrix by columns
    own : (nm,) int64, the block of each body on the diagonal
    block : (nc, 2, 2) int64, the blocks of each contact
    start, stride : int64, offset of each block among the values, and stride between its columns
    """

    mass: NDArray[np.float64]
    side: NDArray[np.int64]
    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    own: NDArray[np.int64]
    block: NDArray[np.int64]
    start: NDArray[np.int64]
    stride: NDArray[np.int64]


@njit(cache=True)
def inverses(blocks):  # pragma: no cover - compiled
    """Return the inverses of blocks.

    Inputs
    ------
    blocks : (nc, 3, 3) float64, not always symmetric

    Outputs
    -------
    (nc, 3, 3) float64, infinite where a block is singular
    """
    result = np.empty_like(blocks)
    for c in range(blocks.shape[0]):
        b, r = blocks[c], result[c]
        first, second, third, determinant = inverse_columns(row(b, 0), row(b, 1), row(b, 2))
        for i in range(3):
            r[i, 0], r[i, 1], r[i, 2] = first[i], second[i], third[i]
            for k in range(3):
                r[i, k] = r[i, k] / determinant if determinant != 0.0 else np.inf
    return result


@njit(cache=True)
def assemble(pattern, geometry, soft):  # pragma: no cover - compiled
    """Assemble M + H Θ⁻¹ Hᵀ.

    Inputs
    ------
    pattern : Pattern; entry (a, b) of a block is at start + stride b + a
    geometry : (nc, 15) float64
    soft : (nc, 3, 3) float64, Θ⁻¹ [kg]

    Outputs
    -------
    float64, the values of the matrix by columns
    """
    values = np.zeros(pattern.indices.shape[0])
    for n in range(pattern.mass.shape[0]):
        at, step = pattern.start[pattern.own[n]], pattern.stride[pattern.own[n]]
        for b in range(6):
            for a in range(6):
                values[at + step * b + a] += pattern.mass[n, a, b]
    j, p = np.empty((2, 3, 6)), np.empty((3, 6))
    for c in range(pattern.side.shape[0]):
        side_jacobian(geometry[c], 0, j[0])
        side_jacobian(geometry[c], 1, j[1])
        for t in range(2):
            if pattern.side[c, t] < 0:
                continue
            for b in range(6):
                p[0, b], p[1, b], p[2, b] = times(soft[c], (j[t, 0, b], j[t, 1, b], j[t, 2, b]))
            for s in range(2):
                if pattern.side[c, s] < 0:
                    continue
                at, step = pattern.start[pattern.block[c, s, t]], pattern.stride[pattern.block[c, s, t]]
                for b in range(6):
                    column, to = (p[0, b], p[1, b], p[2, b]), at + step * b
                    for a in range(6):
                        values[to + a] += dot((j[s, 0, a], j[s, 1, a], j[s, 2, a]), column)
    return values


@njit(cache=True)
def lift(r, side, geometry, bodies):  # pragma: no cover - compiled
    """Return H r (nm, 6): impulses and moments on `bodies` bodies, of impulses r (nc, 3) [N s]."""
    result = np.zeros((bodies, 6))
    for c in range(side.shape[0]):
        g = geometry[c]
        x = to_world(g, row(r, c))
        for s in range(2):
            n = side[c, s]
            if n < 0:
                continue
            push = x if s == 0 else negative(x)
            moment = cross(arm(g, s), push)
            for k in range(3):
                result[n, k] += push[k]
                result[n, 3 + k] += moment[k]
    return result


@njit(cache=True)
def pushed(soft, b, side, geometry, bodies):  # pragma: no cover - compiled
    """Return H Θ⁻¹ b (nm, 6), of `soft` (nc, 3, 3) Θ⁻¹ [kg] and b (nc, 3) [m/s]."""
    r = np.empty_like(b)
    for c in range(side.shape[0]):
        write_row(r, c, times(soft[c], row(b, c)))
    return lift(r, side, geometry, bodies)


@njit(cache=True)
def across(v, side, geometry):  # pragma: no cover - compiled
    """Return Hᵀ v (nc, 3), relative velocities of the bodies' velocities (nm, 6) [m/s, rad/s]."""
    result = np.zeros((side.shape[0], 3))
    for c in range(side.shape[0]):
        g = geometry[c]
        x = y = z = 0.0
        for s in range(2):
            n = side[c, s]
            if n < 0:
                continue
            sign = 1.0 if s == 0 else -1.0
            a = arm(g, s)
            x += sign * (v[n, 0] + v[n, 4] * a[2] - v[n, 5] * a[1])
            y += sign * (v[n, 1] + v[n, 5] * a[0] - v[n, 3] * a[2])
            z += sign * (v[n, 2] + v[n, 3] * a[1] - v[n, 4] * a[0])
        for k in range(3):
            result[c, k] = dot((g[3 * k], g[3 * k + 1], g[3 * k + 2]), (x, y, z))
    return result


@njit(cache=True)
def softened(soft, b, v, side, geometry):  # pragma: no cover - compiled
    """Return Θ⁻¹ (b - Hᵀ v) (nc, 3) [N s]; the inputs are those of `pushed` and `across`."""
    result = across(v, side, geometry)
    for c in range(side.shape[0]):
        write_row(result, c, times(soft[c], minus(row(b, c), row(result, c))))
    return result


@njit(cache=True)
def corrected(theta, b, v, r, mass, side, geometry):  # pragma: no cover - compiled
    """Compute the residuals of Hᵀ v + Θ r = b and M v - H r = 0.

    Inputs
    ------
    theta : (nc, 3, 3) float64, Θ [1/kg]
    b, r : (nc, 3) float64 [m/s], [N s]
    v : (nm, 6) float64 [m/s, rad/s]
    mass : (nm, 6, 6) float64 [kg, kg m²]
    side, geometry : as above

    Outputs
    -------
    first : (nc, 3) float64 [m/s]
    second : (nm, 6) float64 [N s, N m s]
    """
    first = across(v, side, geometry)
    for c in range(side.shape[0]):
        held = times(theta[c], row(r, c))
        for k in range(3):
            first[c, k] = b[c, k] - first[c, k] - held[k]
    second = lift(r, side, geometry, mass.shape[0])
    for n in range(mass.shape[0]):
        for a in range(6):
            for d in range(6):
                second[n, a] -= mass[n, a, d] * v[n, d]
    return first, second
