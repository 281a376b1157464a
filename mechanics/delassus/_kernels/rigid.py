"""Numba kernels of W between rigid bodies: products, local factors and Gauss–Seidel sweeps, matrix-free.

A contact keeps its frame and its two lever arms; a body its inverse mass and inverse inertia (world axes):

    u = R [v_i + ω_i × a - v_j - ω_j × b],    Δv_i = Rᵀ Δr / m_i,    Δω_i = I_i⁻¹ (a × Rᵀ Δr)

`geometry` (nc, 15) holds R in rows, then a, then b; `inertia` (nb, 7) the inverse mass and the upper triangle of I⁻¹;
`factors` (nc, 13) the upper triangle of W_αα⁻¹, W_NN, W_NT (2), and axes and eigenvalues of the Schur complement.
Contacts with the same candidate and antagonist form a group; groups of one colour share no moving body.
"""

import numpy as np
from numba import njit, prange

from mechanics.problem._kernels import plane_axes, slip

__all__ = [
    "apply",
    "diagonals",
    "factors_of",
    "relative_velocity",
    "sweep",
    "sweep_parallel",
    "velocity_change",
]


@njit(cache=True)
def _add_block(w, g, a0, a1, a2, m, inertia):
    """Add one side's part of W_αα: R (1/m + [a]ᵀ I⁻¹ [a]) Rᵀ."""
    j = np.empty((3, 3))
    for k in range(3):
        n0, n1, n2 = g[3 * k], g[3 * k + 1], g[3 * k + 2]
        j[k, 0], j[k, 1], j[k, 2] = a1 * n2 - a2 * n1, a2 * n0 - a0 * n2, a0 * n1 - a1 * n0
    i0, i1, i2, i3, i4, i5 = inertia[1], inertia[2], inertia[3], inertia[4], inertia[5], inertia[6]
    for k in range(3):
        x, y, z = j[k]
        s0, s1, s2 = i0 * x + i1 * y + i2 * z, i1 * x + i3 * y + i4 * z, i2 * x + i4 * y + i5 * z
        for n in range(3):
            w[n, k] += j[n, 0] * s0 + j[n, 1] * s1 + j[n, 2] * s2
        w[k, k] += m


@njit(cache=True)
def diagonals(body, geometry, inertia):  # pragma: no cover - compiled
    """W_αα (nc, 3, 3)."""
    nc = body.shape[0]
    w = np.zeros((nc, 3, 3))
    for c in range(nc):
        g = geometry[c]
        i, j = body[c, 0], body[c, 1]
        _add_block(w[c], g, g[9], g[10], g[11], inertia[i, 0], inertia[i])
        _add_block(w[c], g, g[12], g[13], g[14], inertia[j, 0], inertia[j])
    return w


@njit(cache=True)
def factors_of(diagonal):  # pragma: no cover - compiled
    """What the local solves need (nc, 13)."""
    nc = diagonal.shape[0]
    f = np.empty((nc, 13))
    for c in range(nc):
        w = diagonal[c]
        a, b, d, e, g, h = w[0, 0], w[0, 1], w[0, 2], w[1, 1], w[1, 2], w[2, 2]
        c0, c1, c2 = e * h - g * g, d * g - b * h, b * g - d * e
        det = a * c0 + b * c1 + d * c2
        f[c, 0], f[c, 1], f[c, 2] = c0 / det, c1 / det, c2 / det
        f[c, 3], f[c, 4], f[c, 5] = (a * h - d * d) / det, (b * d - a * g) / det, (a * e - b * b) / det
        f[c, 6], f[c, 7], f[c, 8] = a, b, d
        f[c, 9], f[c, 10], f[c, 11], f[c, 12] = plane_axes(e - b * b / a, g - b * d / a, h - d * d / a)
    return f


@njit(cache=True)
def velocity_change(r, body, geometry, inertia):  # pragma: no cover - compiled
    """ŵ H r: what the impulses (nc, 3) do to the bodies (nb, 6)."""
    nc, nb = r.shape[0], inertia.shape[0]
    p = np.zeros((nb, 6))
    for c in range(nc):
        g = geometry[c]
        r0, r1, r2 = r[c, 0], r[c, 1], r[c, 2]
        x = g[0] * r0 + g[3] * r1 + g[6] * r2
        y = g[1] * r0 + g[4] * r1 + g[7] * r2
        z = g[2] * r0 + g[5] * r1 + g[8] * r2
        q = p[body[c, 0]]
        q[0] += x
        q[1] += y
        q[2] += z
        q[3] += g[10] * z - g[11] * y
        q[4] += g[11] * x - g[9] * z
        q[5] += g[9] * y - g[10] * x
        q = p[body[c, 1]]
        q[0] -= x
        q[1] -= y
        q[2] -= z
        q[3] -= g[13] * z - g[14] * y
        q[4] -= g[14] * x - g[12] * z
        q[5] -= g[12] * y - g[13] * x
    for b in range(nb):
        m, q = inertia[b], p[b]
        x, y, z = q[3], q[4], q[5]
        q[0] *= m[0]
        q[1] *= m[0]
        q[2] *= m[0]
        q[3] = m[1] * x + m[2] * y + m[3] * z
        q[4] = m[2] * x + m[4] * y + m[5] * z
        q[5] = m[3] * x + m[5] * y + m[6] * z
    return p


@njit(cache=True)
def relative_velocity(v, body, geometry):  # pragma: no cover - compiled
    """Hᵀ v: local relative velocities (nc, 3) of the bodies' velocities (nb, 6)."""
    nc = body.shape[0]
    u = np.empty((nc, 3))
    for c in range(nc):
        g, a, b = geometry[c], v[body[c, 0]], v[body[c, 1]]
        x = a[0] + a[4] * g[11] - a[5] * g[10] - b[0] - b[4] * g[14] + b[5] * g[13]
        y = a[1] + a[5] * g[9] - a[3] * g[11] - b[1] - b[5] * g[12] + b[3] * g[14]
        z = a[2] + a[3] * g[10] - a[4] * g[9] - b[2] - b[3] * g[13] + b[4] * g[12]
        u[c, 0] = g[0] * x + g[1] * y + g[2] * z
        u[c, 1] = g[3] * x + g[4] * y + g[5] * z
        u[c, 2] = g[6] * x + g[7] * y + g[8] * z
    return u


@njit(cache=True)
def apply(r, body, geometry, inertia):  # pragma: no cover - compiled
    """W r (nc, 3)."""
    return relative_velocity(velocity_change(r, body, geometry, inertia), body, geometry)


@njit(cache=True)
def _solve_group(first, last, r, v, shift, mu, cohesion, factors, body, geometry, inertia):
    """Solve the contacts first:last, those of one pair of bodies, one after the other.

    Returns how much the velocities of the two bodies, at the first contact, have changed.
    """
    i, j = body[first, 0], body[first, 1]
    p0, p1, p2, p3, p4, p5 = v[i, 0], v[i, 1], v[i, 2], v[i, 3], v[i, 4], v[i, 5]
    q0, q1, q2, q3, q4, q5 = v[j, 0], v[j, 1], v[j, 2], v[j, 3], v[j, 4], v[j, 5]
    m, n = inertia[i], inertia[j]
    changed = False
    for c in range(first, last):
        g, f = geometry[c], factors[c]
        g0, g1, g2, g3, g4, g5, g6, g7, g8 = g[0], g[1], g[2], g[3], g[4], g[5], g[6], g[7], g[8]
        a0, a1, a2, b0, b1, b2 = g[9], g[10], g[11], g[12], g[13], g[14]
        x = p0 + p4 * a2 - p5 * a1 - q0 - q4 * b2 + q5 * b1
        y = p1 + p5 * a0 - p3 * a2 - q1 - q5 * b0 + q3 * b2
        z = p2 + p3 * a1 - p4 * a0 - q2 - q3 * b1 + q4 * b0
        un = shift[c, 0] + g0 * x + g1 * y + g2 * z
        u1 = shift[c, 1] + g3 * x + g4 * y + g5 * z
        u2 = shift[c, 2] + g6 * x + g7 * y + g8 * z
        r0, r1, r2, k = r[c, 0], r[c, 1], r[c, 2], cohesion[c]
        bn = un - f[6] * r0 - f[7] * r1 - f[8] * r2
        if bn >= 0.0 and k == 0.0:
            s0 = s1 = s2 = 0.0
        else:
            s0 = r0 - f[0] * un - f[1] * u1 - f[2] * u2
            s1 = r1 - f[1] * un - f[3] * u1 - f[4] * u2
            s2 = r2 - f[2] * un - f[4] * u1 - f[5] * u2
            limit = mu[c] * s0 + k
            if s0 < 0.0 or s1 * s1 + s2 * s2 > limit * limit:
                co, si, l1, l2 = f[9], f[10], f[11], f[12]
                w, d, e = f[6], f[7], f[8]
                h0, h1, h2 = co * co * l1 + si * si * l2, co * si * (l1 - l2), si * si * l1 + co * co * l2
                # b_T = u_T - W_TN r_N - W_TT r_T, with W_TT = A + W_TN W_NT / W_NN
                along = r0 + (d * r1 + e * r2) / w
                t1 = u1 - d * along - h0 * r1 - h1 * r2
                t2 = u2 - e * along - h1 * r1 - h2 * r2
                held = r1 * r1 + r2 * r2
                # λ = ‖u_T‖/‖r_T‖ where it slid before
                guess = np.sqrt((u1 * u1 + u2 * u2) / held) if held > 0.0 else 0.0
                s0, s1, s2 = slip(w, d, e, co, si, l1, l2, bn, t1, t2, mu[c], k, guess)
        r0, r1, r2 = s0 - r0, s1 - r1, s2 - r2
        if r0 == 0.0 and r1 == 0.0 and r2 == 0.0:
            continue
        changed = True
        r[c, 0], r[c, 1], r[c, 2] = s0, s1, s2
        x = g0 * r0 + g3 * r1 + g6 * r2
        y = g1 * r0 + g4 * r1 + g7 * r2
        z = g2 * r0 + g5 * r1 + g8 * r2
        p0 += m[0] * x
        p1 += m[0] * y
        p2 += m[0] * z
        t0, t1, t2 = a1 * z - a2 * y, a2 * x - a0 * z, a0 * y - a1 * x
        p3 += m[1] * t0 + m[2] * t1 + m[3] * t2
        p4 += m[2] * t0 + m[4] * t1 + m[5] * t2
        p5 += m[3] * t0 + m[5] * t1 + m[6] * t2
        q0 -= n[0] * x
        q1 -= n[0] * y
        q2 -= n[0] * z
        t0, t1, t2 = b1 * z - b2 * y, b2 * x - b0 * z, b0 * y - b1 * x
        q3 -= n[1] * t0 + n[2] * t1 + n[3] * t2
        q4 -= n[2] * t0 + n[4] * t1 + n[5] * t2
        q5 -= n[3] * t0 + n[5] * t1 + n[6] * t2
    if not changed:
        return 0.0, 0.0
    g = geometry[first]
    moved_i = moved_j = 0.0
    # bodies that do not move are shared between groups of one colour: they are only read
    if m[0] > 0.0:
        moved_i = abs(p0 - v[i, 0]) + abs(p1 - v[i, 1]) + abs(p2 - v[i, 2])
        size = abs(g[9]) + abs(g[10]) + abs(g[11])
        moved_i += size * (abs(p3 - v[i, 3]) + abs(p4 - v[i, 4]) + abs(p5 - v[i, 5]))
        v[i, 0], v[i, 1], v[i, 2], v[i, 3], v[i, 4], v[i, 5] = p0, p1, p2, p3, p4, p5
    if n[0] > 0.0:
        moved_j = abs(q0 - v[j, 0]) + abs(q1 - v[j, 1]) + abs(q2 - v[j, 2])
        size = abs(g[12]) + abs(g[13]) + abs(g[14])
        moved_j += size * (abs(q3 - v[j, 3]) + abs(q4 - v[j, 4]) + abs(q5 - v[j, 5]))
        v[j, 0], v[j, 1], v[j, 2], v[j, 3], v[j, 4], v[j, 5] = q0, q1, q2, q3, q4, q5
    return moved_i, moved_j


@njit(cache=True)
def _visit(g, path, seen, calm, r, v, shift, mu, cohesion, factors, body, geometry, inertia, group):
    """Solve a group unless it sleeps: its bodies have hardly changed since it was last solved.

    `path` (nb,) adds up the changes of each body, `seen` (ng, 2) is where the paths were after the last solution. Any
    change of a body beyond `calm` wakes all its groups.
    """
    start, stop = group[g], group[g + 1]
    i, j = body[start, 0], body[start, 1]
    if path[i] - seen[g, 0] + path[j] - seen[g, 1] <= calm:
        return
    moved_i, moved_j = _solve_group(start, stop, r, v, shift, mu, cohesion, factors, body, geometry, inertia)
    # bodies that do not move have no path: groups of one colour may share them
    if moved_i > 0.0:
        path[i] += moved_i
    if moved_j > 0.0:
        path[j] += moved_j
    # more than one contact: solved once more, the group would change again
    seen[g, 0] = path[i] - (moved_i if stop - start > 1 else 0.0)
    seen[g, 1] = path[j] - (moved_j if stop - start > 1 else 0.0)


@njit(cache=True)
def sweep(
    count, calm, r, v, shift, mu, cohesion, factors, body, geometry, inertia, group
):  # pragma: no cover - compiled
    """`count` passes over all groups; r and v are kept up to date in place.

    The first pass visits every group; in the others, groups sleep whose bodies changed by no more than `calm` [m/s].
    """
    groups = group.shape[0] - 1
    path, seen = np.zeros(inertia.shape[0]), np.full((groups, 2), -np.inf)
    for _ in range(count):
        for g in range(groups):
            _visit(g, path, seen, calm, r, v, shift, mu, cohesion, factors, body, geometry, inertia, group)


@njit(cache=True, parallel=True)
def sweep_parallel(
    count, calm, r, v, shift, mu, cohesion, factors, body, geometry, inertia, group, colour
):  # pragma: no cover - compiled
    """As `sweep`, with the groups of each colour (`colour` points into the groups) in parallel.

    Groups of one colour share no moving body, so the result has the same bits as that of `sweep`.
    """
    groups, colours = group.shape[0] - 1, colour.shape[0] - 1
    path, seen = np.zeros(inertia.shape[0]), np.full((groups, 2), -np.inf)
    for _ in range(count):
        for k in range(colours):
            for g in prange(colour[k], colour[k + 1]):
                _visit(
                    g, path, seen, calm, r, v, shift, mu, cohesion, factors, body, geometry, inertia, group
                )
