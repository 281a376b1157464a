"""Numba kernels of Newton's method between rigid bodies: the function of Alart and Curnier, and the bodies' equations.

With W = Hᵀ M⁻¹ H, the step A Δr + B (W + α) Δr = -F is, for v = M⁻¹ H Δr and D = A + B α,

    (M + H D⁻¹ B Hᵀ) v = -H D⁻¹ F,     Δr = -D⁻¹ (F + B Hᵀ v)

six unknowns for each body, whatever the number of its contacts.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mechanics.contact._kernels.vectors import dot, row, write_row
from mechanics.delassus._kernels.sides import add_dot, inverse_columns, negative, side_jacobian, times


class BodyBlocks(NamedTuple):
    """Blocks of the bodies' equations, 3 × 3 in rows of translation and rotation of each body that moves.

    Attributes
    ----------
    place : (nb,) int64, number of each body that moves, -1 for the others
    blocks : (nc, 4) int64, where the four 3 × 3 blocks of candidate–candidate, candidate–antagonist,
        antagonist–candidate and antagonist–antagonist begin
    own : (nm, 2, 3, 3) float64, mass and inertia of the bodies that move [kg], [kg m²]
    width : (nm, 2) int64, blocks in a row of each body, and where its own begin
    """

    place: NDArray[np.int64]
    blocks: NDArray[np.int64]
    own: NDArray[np.float64]
    width: NDArray[np.int64]


@njit(cache=True)
def alart_curnier(r, u, mu, k, rho, error, first, second):  # pragma: no cover - compiled
    """Compute F(r, u) of Alart & Curnier (1991), its derivatives A by r and B by u, and return ½‖F‖².

    F_N = r_N - (r_N - ρ_N u_N)⁺, F_T = r_T - P(r_T - ρ_T u_T), P onto a disk of radius μ (r_N - ρ_N u_N)⁺ + k.

    Inputs
    ------
    r, u : (nc, 3) float64 [N s], [m/s]
    mu, k : (nc,) float64, friction [-] and cohesion [N s]
    rho : (nc, 2) float64, ρ_N and ρ_T [kg]

    Outputs
    -------
    error : (nc, 3) float64, F, written [N s]
    first, second : (nc, 3, 3) float64, A [-] and B [kg], written
    """
    total = 0.0
    for c in range(len(r)):
        a, b = first[c], second[c]
        a[:], b[:] = 0.0, 0.0
        rn, rt = rho[c, 0], rho[c, 1]
        n = r[c, 0] - rn * u[c, 0]
        t1, t2 = r[c, 1] - rt * u[c, 1], r[c, 2] - rt * u[c, 2]
        if n > 0.0:
            error[c, 0] = rn * u[c, 0]
            b[0, 0] = rn
            radius = mu[c] * n + k[c]
        else:
            error[c, 0] = r[c, 0]
            a[0, 0] = 1.0
            radius = k[c]
        size = np.sqrt(t1 * t1 + t2 * t2)
        if radius <= 0.0:
            error[c, 1], error[c, 2] = r[c, 1], r[c, 2]
            a[1, 1], a[2, 2] = 1.0, 1.0
        elif size <= radius:
            error[c, 1], error[c, 2] = rt * u[c, 1], rt * u[c, 2]
            b[1, 1], b[2, 2] = rt, rt
        else:
            d1, d2, s = t1 / size, t2 / size, radius / size
            error[c, 1], error[c, 2] = r[c, 1] - radius * d1, r[c, 2] - radius * d2
            g11, g12, g22 = s * (1.0 - d1 * d1), -s * d1 * d2, s * (1.0 - d2 * d2)
            a[1, 1], a[1, 2], a[2, 1], a[2, 2] = 1.0 - g11, -g12, -g12, 1.0 - g22
            b[1, 1], b[1, 2], b[2, 1], b[2, 2] = rt * g11, rt * g12, rt * g12, rt * g22
            if n > 0.0:
                a[1, 0], a[2, 0] = -mu[c] * d1, -mu[c] * d2
                b[1, 0], b[2, 0] = mu[c] * rn * d1, mu[c] * rn * d2
        total += error[c, 0] ** 2 + error[c, 1] ** 2 + error[c, 2] ** 2
    return 0.5 * total


@njit(cache=True)
def inverse_blocks(first, second, alpha, inverse, gain):  # pragma: no cover - compiled
    """Invert D = A + B α of each contact; return whether all can be inverted.

    Inputs
    ------
    first, second : (nc, 3, 3) float64, A [-] and B [kg]
    alpha : (nc, 3) float64, diagonal of α, compliance of the joint included [1/kg]

    Outputs
    -------
    inverse : (nc, 3, 3) float64, D⁻¹, written [-]
    gain : (nc, 3, 3) float64, D⁻¹ B, written [kg]
    """
    d = np.empty((3, 3))
    for c in range(len(first)):
        a, b = first[c], second[c]
        for i in range(3):
            for j in range(3):
                d[i, j] = a[i, j] + alpha[c, j] * b[i, j]
        x, y, z, det = inverse_columns(row(d, 0), row(d, 1), row(d, 2))
        if det == 0.0:
            return False
        v, g = inverse[c], gain[c]
        for i in range(3):
            write_row(v, i, (x[i] / det, y[i] / det, z[i] / det))
        for i in range(3):
            for j in range(3):
                g[i, j] = dot(row(v, i), (b[0, j], b[1, j], b[2, j]))
    return True


@njit(cache=True)
def body_matrix(contacts, gain, blocks, value):  # pragma: no cover - compiled
    """Assemble M + H D⁻¹ B Hᵀ.

    Inputs
    ------
    contacts : RigidContacts
    gain : (nc, 3, 3) float64, D⁻¹ B [kg]
    blocks : BodyBlocks

    Outputs
    -------
    value : (nnz, 3, 3) float64, written
    """
    place, width = blocks.place, blocks.width
    value[:] = 0.0
    for m in range(len(blocks.own)):
        at, w = width[m, 1], width[m, 0]
        value[at] += blocks.own[m, 0]
        value[at + w + 1] += blocks.own[m, 1]
    jacobian, product = np.empty((2, 3, 6)), np.empty((3, 6))
    for c in range(len(contacts.body)):
        body = contacts.body[c]
        side_jacobian(contacts.geometry[c], 0, jacobian[0])
        side_jacobian(contacts.geometry[c], 1, jacobian[1])
        for t in range(2):
            if place[body[t]] < 0:
                continue
            for j in range(6):
                by_body = jacobian[t, 0, j], jacobian[t, 1, j], jacobian[t, 2, j]
                product[0, j], product[1, j], product[2, j] = times(gain[c], by_body)
            for s in range(2):
                if place[body[s]] < 0:
                    continue
                w, at = width[place[body[s]], 0], blocks.blocks[c, 2 * s + t]
                for i in range(6):
                    to = at + (w if i >= 3 else 0)
                    from_body = jacobian[s, 0, i], jacobian[s, 1, i], jacobian[s, 2, i]
                    for j in range(6):
                        value[to + (1 if j >= 3 else 0), i % 3, j % 3] += dot(
                            from_body, (product[0, j], product[1, j], product[2, j])
                        )


@njit(cache=True)
def body_load(contacts, inverse, error, place, load):  # pragma: no cover - compiled
    """Compute the right side -H D⁻¹ F.

    Inputs
    ------
    contacts : RigidContacts
    inverse : (nc, 3, 3) float64, D⁻¹
    error : (nc, 3) float64, F [N s]
    place : (nb,) int64, of `BodyBlocks`

    Outputs
    -------
    load : (2 nm, 3) float64, written [N s], [N m s]
    """
    load[:] = 0.0
    jacobian = np.empty((3, 6))
    for c in range(len(contacts.body)):
        x = times(inverse[c], row(error, c))
        for s in range(2):
            m = place[contacts.body[c, s]]
            if m < 0:
                continue
            side_jacobian(contacts.geometry[c], s, jacobian)
            for i in range(6):
                load[2 * m + i // 3, i % 3] -= dot((jacobian[0, i], jacobian[1, i], jacobian[2, i]), x)


@njit(cache=True)
def contact_step(contacts, inverse, second, error, place, v, step):  # pragma: no cover - compiled
    """Compute Δr = -D⁻¹ (F + B Hᵀ v).

    Inputs
    ------
    contacts, inverse, error, place : as in `body_load`
    second : (nc, 3, 3) float64, B [kg]
    v : (2 nm, 3) float64 [m/s], [rad/s]

    Outputs
    -------
    step : (nc, 3) float64, Δr, written [N s]
    """
    jacobian, u = np.empty((3, 6)), np.empty(3)
    for c in range(len(contacts.body)):
        u[:] = 0.0
        for s in range(2):
            m = place[contacts.body[c, s]]
            if m < 0:
                continue
            side_jacobian(contacts.geometry[c], s, jacobian)
            for k in range(3):
                for i in range(6):
                    u[k] += jacobian[k, i] * v[2 * m + i // 3, i % 3]
        b, e, w = second[c], row(error, c), (u[0], u[1], u[2])
        left = add_dot(e[0], row(b, 0), w), add_dot(e[1], row(b, 1), w), add_dot(e[2], row(b, 2), w)
        write_row(step, c, negative(times(inverse[c], left)))
