"""Numba kernels of Newton's method between rigid bodies: its equations in the velocities of the bodies.

With W = Hᵀ M⁻¹ H, the step A Δr + B (W + α) Δr = -F is, for v = M⁻¹ H Δr and D = A + α B,

    (M + H D⁻¹ B Hᵀ) v = -H D⁻¹ F,     Δr = -D⁻¹ (F + B Hᵀ v)

six unknowns for each body, whatever the number of its contacts.
"""

import numpy as np
from numba import njit

__all__ = ["body_load", "body_matrix", "contact_step", "inverse_blocks"]


@njit(cache=True)
def inverse_blocks(first, second, alpha, inverse, gain):  # pragma: no cover - compiled
    """D⁻¹ and D⁻¹ B of each contact, D = A + α B, written; whether all D can be inverted."""
    for c in range(len(first)):
        a, b = first[c], second[c]
        d00, d01, d02 = a[0, 0] + alpha * b[0, 0], a[0, 1] + alpha * b[0, 1], a[0, 2] + alpha * b[0, 2]
        d10, d11, d12 = a[1, 0] + alpha * b[1, 0], a[1, 1] + alpha * b[1, 1], a[1, 2] + alpha * b[1, 2]
        d20, d21, d22 = a[2, 0] + alpha * b[2, 0], a[2, 1] + alpha * b[2, 1], a[2, 2] + alpha * b[2, 2]
        c00, c01, c02 = d11 * d22 - d12 * d21, d12 * d20 - d10 * d22, d10 * d21 - d11 * d20
        det = d00 * c00 + d01 * c01 + d02 * c02
        if det == 0.0:
            return False
        v, g = inverse[c], gain[c]
        v[0, 0], v[1, 0], v[2, 0] = c00 / det, c01 / det, c02 / det
        v[0, 1], v[1, 1] = (d02 * d21 - d01 * d22) / det, (d00 * d22 - d02 * d20) / det
        v[2, 1] = (d01 * d20 - d00 * d21) / det
        v[0, 2], v[1, 2] = (d01 * d12 - d02 * d11) / det, (d02 * d10 - d00 * d12) / det
        v[2, 2] = (d00 * d11 - d01 * d10) / det
        for i in range(3):
            for j in range(3):
                g[i, j] = v[i, 0] * b[0, j] + v[i, 1] * b[1, j] + v[i, 2] * b[2, j]
    return True


@njit(cache=True)
def _jacobian(g, jacobian):
    """Local velocity (3, 12) of the velocities of candidate and antagonist, from a row of the contacts' geometry."""
    for k in range(3):
        x, y, z = g[3 * k], g[3 * k + 1], g[3 * k + 2]
        a0, a1, a2, b0, b1, b2 = g[9], g[10], g[11], g[12], g[13], g[14]
        jacobian[k, 0], jacobian[k, 1], jacobian[k, 2] = x, y, z
        jacobian[k, 3], jacobian[k, 4], jacobian[k, 5] = a1 * z - a2 * y, a2 * x - a0 * z, a0 * y - a1 * x
        jacobian[k, 6], jacobian[k, 7], jacobian[k, 8] = -x, -y, -z
        jacobian[k, 9], jacobian[k, 10], jacobian[k, 11] = b2 * y - b1 * z, b0 * z - b2 * x, b1 * x - b0 * y


@njit(cache=True)
def body_matrix(body, geometry, gain, place, blocks, own, width, value):  # pragma: no cover - compiled
    """M + H D⁻¹ B Hᵀ into `value` (nnz, 3, 3).

    Parameters
    ----------
    gain : (nc, 3, 3) D⁻¹ B
    place : (nb,) number of each body that moves, else -1
    blocks : (nc, 4) where the four 3 × 3 blocks of candidate–candidate, candidate–antagonist, antagonist–candidate and
        antagonist–antagonist begin
    own : (nm, 2, 3, 3) mass and inertia of the bodies that move, at their place `width[:, 1]`
    width : (nm, 2) blocks in a row of each body, and where its own begin
    """
    value[:] = 0.0
    for m in range(len(own)):
        at, w = width[m, 1], width[m, 0]
        value[at] += own[m, 0]
        value[at + w + 1] += own[m, 1]
    jacobian, product = np.empty((3, 12)), np.empty((3, 12))
    for c in range(len(body)):
        _jacobian(geometry[c], jacobian)
        g = gain[c]
        for i in range(3):
            for j in range(12):
                product[i, j] = g[i, 0] * jacobian[0, j] + g[i, 1] * jacobian[1, j] + g[i, 2] * jacobian[2, j]
        for s in range(2):
            if place[body[c, s]] < 0:
                continue
            w = width[place[body[c, s]], 0]
            for t in range(2):
                if place[body[c, t]] < 0:
                    continue
                at = blocks[c, 2 * s + t]
                for i in range(6):
                    row, x = at + (w if i >= 3 else 0), 6 * s + i
                    j0, j1, j2 = jacobian[0, x], jacobian[1, x], jacobian[2, x]
                    for j in range(6):
                        y = 6 * t + j
                        value[row + (1 if j >= 3 else 0), i % 3, j % 3] += (
                            j0 * product[0, y] + j1 * product[1, y] + j2 * product[2, y]
                        )


@njit(cache=True)
def body_load(body, geometry, inverse, error, place, load):  # pragma: no cover - compiled
    """-H D⁻¹ F into `load` (2 nm, 3)."""
    load[:] = 0.0
    jacobian = np.empty((3, 12))
    for c in range(len(body)):
        _jacobian(geometry[c], jacobian)
        v, e = inverse[c], error[c]
        x = v[0, 0] * e[0] + v[0, 1] * e[1] + v[0, 2] * e[2]
        y = v[1, 0] * e[0] + v[1, 1] * e[1] + v[1, 2] * e[2]
        z = v[2, 0] * e[0] + v[2, 1] * e[1] + v[2, 2] * e[2]
        for s in range(2):
            m = place[body[c, s]]
            if m < 0:
                continue
            for i in range(6):
                k = 6 * s + i
                load[2 * m + i // 3, i % 3] -= jacobian[0, k] * x + jacobian[1, k] * y + jacobian[2, k] * z


@njit(cache=True)
def contact_step(body, geometry, inverse, second, error, place, v, step):  # pragma: no cover - compiled
    """Δr = -D⁻¹ (F + B Hᵀ v) into `step` (nc, 3), for v (2 nm, 3)."""
    jacobian = np.empty((3, 12))
    u, left = np.empty(3), np.empty(3)
    for c in range(len(body)):
        _jacobian(geometry[c], jacobian)
        u[:] = 0.0
        for s in range(2):
            m = place[body[c, s]]
            if m < 0:
                continue
            for k in range(3):
                for i in range(6):
                    u[k] += jacobian[k, 6 * s + i] * v[2 * m + i // 3, i % 3]
        b, d = second[c], inverse[c]
        for k in range(3):
            left[k] = error[c, k] + b[k, 0] * u[0] + b[k, 1] * u[1] + b[k, 2] * u[2]
        for k in range(3):
            step[c, k] = -(d[k, 0] * left[0] + d[k, 1] * left[1] + d[k, 2] * left[2])
