"""Numba kernels of W + Θ between rigid bodies, written with the velocities of the bodies.

`side` (nc, 2) names the places of the two bodies of a contact in the order of elimination, -1 where one does not move;
`geometry` (nc, 15) is that of `_kernels_rigid`: rows n, t1, t2 of the frame, then the two lever arms.
"""

import numpy as np
from numba import njit

__all__ = ["across", "assemble", "corrected", "inverses", "lift", "pushed", "softened"]


@njit(cache=True)
def _jacobian(j, g, s):
    """The local velocity of one side by its body's velocity, into `j` (3, 6): the antagonist counts negative."""
    at = 9 + 3 * s
    sign = 1.0 if s == 0 else -1.0
    a0, a1, a2 = g[at], g[at + 1], g[at + 2]
    for k in range(3):
        x, y, z = sign * g[3 * k], sign * g[3 * k + 1], sign * g[3 * k + 2]
        j[k, 0], j[k, 1], j[k, 2] = x, y, z
        j[k, 3], j[k, 4], j[k, 5] = a1 * z - a2 * y, a2 * x - a0 * z, a0 * y - a1 * x


@njit(cache=True)
def inverses(blocks):  # pragma: no cover - compiled
    """Inverses (nc, 3, 3) of blocks, not always symmetric."""
    result = np.empty_like(blocks)
    for c in range(blocks.shape[0]):
        b, r = blocks[c], result[c]
        r[0, 0] = b[1, 1] * b[2, 2] - b[1, 2] * b[2, 1]
        r[0, 1] = b[0, 2] * b[2, 1] - b[0, 1] * b[2, 2]
        r[0, 2] = b[0, 1] * b[1, 2] - b[0, 2] * b[1, 1]
        r[1, 0] = b[1, 2] * b[2, 0] - b[1, 0] * b[2, 2]
        r[1, 1] = b[0, 0] * b[2, 2] - b[0, 2] * b[2, 0]
        r[1, 2] = b[0, 2] * b[1, 0] - b[0, 0] * b[1, 2]
        r[2, 0] = b[1, 0] * b[2, 1] - b[1, 1] * b[2, 0]
        r[2, 1] = b[0, 1] * b[2, 0] - b[0, 0] * b[2, 1]
        r[2, 2] = b[0, 0] * b[1, 1] - b[0, 1] * b[1, 0]
        determinant = b[0, 0] * r[0, 0] + b[0, 1] * r[1, 0] + b[0, 2] * r[2, 0]
        for i in range(3):
            for k in range(3):
                r[i, k] = r[i, k] / determinant if determinant != 0.0 else np.inf
    return result


@njit(cache=True)
def assemble(side, geometry, soft, mass, own, block, start, stride, size):  # pragma: no cover - compiled
    """M + H Θ⁻¹ Hᵀ, the values (size,) of its columns.

    `soft` (nc, 3, 3) Θ⁻¹; `mass` (nm, 6, 6); `own` (nm,) and `block` (nc, 2, 2) name the 6 × 6 blocks of bodies and
    contacts, whose entry (a, b) is at start + stride b + a.
    """
    values = np.zeros(size)
    for n in range(mass.shape[0]):
        at, step = start[own[n]], stride[own[n]]
        for b in range(6):
            for a in range(6):
                values[at + step * b + a] += mass[n, a, b]
    j, p = np.empty((2, 3, 6)), np.empty((3, 6))
    for c in range(side.shape[0]):
        _jacobian(j[0], geometry[c], 0)
        _jacobian(j[1], geometry[c], 1)
        f = soft[c]
        for t in range(2):
            if side[c, t] < 0:
                continue
            for k in range(3):
                for b in range(6):
                    p[k, b] = f[k, 0] * j[t, 0, b] + f[k, 1] * j[t, 1, b] + f[k, 2] * j[t, 2, b]
            for s in range(2):
                if side[c, s] < 0:
                    continue
                at, step = start[block[c, s, t]], stride[block[c, s, t]]
                for b in range(6):
                    p0, p1, p2 = p[0, b], p[1, b], p[2, b]
                    to = at + step * b
                    for a in range(6):
                        values[to + a] += j[s, 0, a] * p0 + j[s, 1, a] * p1 + j[s, 2, a] * p2
    return values


@njit(cache=True)
def lift(r, side, geometry, bodies):  # pragma: no cover - compiled
    """H r (nm, 6): what impulses (nc, 3) bring to the bodies."""
    result = np.zeros((bodies, 6))
    for c in range(side.shape[0]):
        g = geometry[c]
        x = g[0] * r[c, 0] + g[3] * r[c, 1] + g[6] * r[c, 2]
        y = g[1] * r[c, 0] + g[4] * r[c, 1] + g[7] * r[c, 2]
        z = g[2] * r[c, 0] + g[5] * r[c, 1] + g[8] * r[c, 2]
        for s in range(2):
            n = side[c, s]
            if n < 0:
                continue
            if s == 1:
                x, y, z = -x, -y, -z
            a0, a1, a2 = g[9 + 3 * s], g[10 + 3 * s], g[11 + 3 * s]
            result[n, 0] += x
            result[n, 1] += y
            result[n, 2] += z
            result[n, 3] += a1 * z - a2 * y
            result[n, 4] += a2 * x - a0 * z
            result[n, 5] += a0 * y - a1 * x
    return result


@njit(cache=True)
def pushed(soft, b, side, geometry, bodies):  # pragma: no cover - compiled
    """H Θ⁻¹ b (nm, 6)."""
    r = np.empty_like(b)
    for c in range(side.shape[0]):
        for k in range(3):
            r[c, k] = soft[c, k, 0] * b[c, 0] + soft[c, k, 1] * b[c, 1] + soft[c, k, 2] * b[c, 2]
    return lift(r, side, geometry, bodies)


@njit(cache=True)
def across(v, side, geometry):  # pragma: no cover - compiled
    """Hᵀ v (nc, 3) of the bodies' velocities (nm, 6)."""
    result = np.zeros((side.shape[0], 3))
    for c in range(side.shape[0]):
        g = geometry[c]
        x = y = z = 0.0
        for s in range(2):
            n = side[c, s]
            if n < 0:
                continue
            sign = 1.0 if s == 0 else -1.0
            a0, a1, a2 = g[9 + 3 * s], g[10 + 3 * s], g[11 + 3 * s]
            x += sign * (v[n, 0] + v[n, 4] * a2 - v[n, 5] * a1)
            y += sign * (v[n, 1] + v[n, 5] * a0 - v[n, 3] * a2)
            z += sign * (v[n, 2] + v[n, 3] * a1 - v[n, 4] * a0)
        for k in range(3):
            result[c, k] = g[3 * k] * x + g[3 * k + 1] * y + g[3 * k + 2] * z
    return result


@njit(cache=True)
def softened(soft, b, v, side, geometry):  # pragma: no cover - compiled
    """Θ⁻¹ (b - Hᵀ v) (nc, 3)."""
    result = across(v, side, geometry)
    for c in range(side.shape[0]):
        x, y, z = b[c, 0] - result[c, 0], b[c, 1] - result[c, 1], b[c, 2] - result[c, 2]
        for k in range(3):
            result[c, k] = soft[c, k, 0] * x + soft[c, k, 1] * y + soft[c, k, 2] * z
    return result


@njit(cache=True)
def corrected(theta, b, v, r, mass, side, geometry):  # pragma: no cover - compiled
    """What is left of Hᵀ v + Θ r = b (nc, 3), and of M v - H r = 0 (nm, 6)."""
    first = across(v, side, geometry)
    for c in range(side.shape[0]):
        for k in range(3):
            held = theta[c, k, 0] * r[c, 0] + theta[c, k, 1] * r[c, 1] + theta[c, k, 2] * r[c, 2]
            first[c, k] = b[c, k] - first[c, k] - held
    second = lift(r, side, geometry, mass.shape[0])
    for n in range(mass.shape[0]):
        for a in range(6):
            for d in range(6):
                second[n, a] -= mass[n, a, d] * v[n, d]
    return first, second
