"""Numba kernels of W between rigid bodies: products, local factors and Gauss–Seidel sweeps, matrix-free.

A contact keeps its frame R and its two lever arms a and b; a body its inverse mass and inverse inertia (world axes):

    u = R [v_i + ω_i × a - v_j - ω_j × b],    Δv_i = Rᵀ Δr / m_i,    Δω_i = I_i⁻¹ (a × Rᵀ Δr)

`contacts` are `RigidContacts` (mechanics/problem/problem.py). `factors` (nc, 13) hold the upper triangle of W_αα⁻¹,
W_NN, W_NT (2), and axes and eigenvalues of the Schur complement. Contacts with the same candidate and antagonist form a
group; parts of them share no moving body.
"""

from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from mechanics.contact._kernels.vectors import cross, dot, minus, row, write_row
from mechanics.delassus._kernels.sides import add_dot, arm, less_dot, negative, to_world
from mechanics.problem._kernels import LocalCompliance, plane_axes, slip


class Running(NamedTuple):
    """State of the sweeps, kept up to date in place.

    Attributes
    ----------
    impulse : (nc, 3) float64, r [N s]
    velocity : (nb, 6) float64, velocities that r gives to the bodies [m/s, rad/s]
    path : (nb,) float64, accumulated change of each body, 0 at first [m/s]
    seen : (ng, 2) float64, path of a group's two bodies at its last solution, -∞ at first [m/s]
    """

    impulse: NDArray[np.float64]
    velocity: NDArray[np.float64]
    path: NDArray[np.float64]
    seen: NDArray[np.float64]


@njit(cache=True)
def _turned(inertia, moment):
    """Return I⁻¹ times a moment, from a body's row (7,)."""
    return (
        dot((inertia[1], inertia[2], inertia[3]), moment),
        dot((inertia[2], inertia[4], inertia[5]), moment),
        dot((inertia[3], inertia[5], inertia[6]), moment),
    )


@njit(cache=True)
def _pushed(v, inertia, a, x):
    """Return the velocity v (6) of a body after an impulse x at the arm a."""
    t = _turned(inertia, cross(a, x))
    m = inertia[0]
    return v[0] + m * x[0], v[1] + m * x[1], v[2] + m * x[2], v[3] + t[0], v[4] + t[1], v[5] + t[2]


@njit(cache=True)
def _apart(p, q, a, b):
    """Return the relative velocity of two contact points, of velocities p and q (6) and arms a and b of the bodies."""
    return (
        p[0] + p[4] * a[2] - p[5] * a[1] - q[0] - q[4] * b[2] + q[5] * b[1],
        p[1] + p[5] * a[0] - p[3] * a[2] - q[1] - q[5] * b[0] + q[3] * b[2],
        p[2] + p[3] * a[1] - p[4] * a[0] - q[2] - q[3] * b[1] + q[4] * b[0],
    )


@njit(cache=True)
def _add_block(w, g, s, inertia):
    """Add one side's part of W_αα: R (1/m + [a]ᵀ I⁻¹ [a]) Rᵀ."""
    a = arm(g, s)
    j = cross(a, (g[0], g[1], g[2])), cross(a, (g[3], g[4], g[5])), cross(a, (g[6], g[7], g[8]))
    for k in range(3):
        turned = _turned(inertia, j[k])
        for n in range(3):
            w[n, k] += dot(j[n], turned)
        w[k, k] += inertia[0]


@njit(cache=True)
def diagonals(contacts):  # pragma: no cover - compiled
    """Return W_αα.

    Inputs
    ------
    contacts : RigidContacts

    Outputs
    -------
    (nc, 3, 3) float64 [1/kg]
    """
    nc = contacts.body.shape[0]
    w = np.zeros((nc, 3, 3))
    for c in range(nc):
        for s in range(2):
            _add_block(w[c], contacts.geometry[c], s, contacts.inertia[contacts.body[c, s]])
    return w


@njit(cache=True)
def factors_of(diagonal):  # pragma: no cover - compiled
    """Return the factors of the local solves.

    Inputs
    ------
    diagonal : (nc, 3, 3) float64, symmetric W_αα [1/kg]

    Outputs
    -------
    (nc, 13) float64
    """
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
def velocity_change(r, contacts):  # pragma: no cover - compiled
    """Return ŵ H r.

    Inputs
    ------
    r : (nc, 3) float64, impulses, local frames [N s]
    contacts : RigidContacts

    Outputs
    -------
    (nb, 6) float64, velocities that the impulses give to the bodies [m/s, rad/s]
    """
    nb = contacts.inertia.shape[0]
    p = np.zeros((nb, 6))
    for c in range(r.shape[0]):
        g = contacts.geometry[c]
        x = to_world(g, row(r, c))
        for s in range(2):
            q, moment = p[contacts.body[c, s]], cross(arm(g, s), x)
            for k in range(3):
                q[k] += x[k]
                q[3 + k] += moment[k]
            x = negative(x)
    for b in range(nb):
        m, q = contacts.inertia[b], p[b]
        for k in range(3):
            q[k] *= m[0]
        q[3], q[4], q[5] = _turned(m, (q[3], q[4], q[5]))
    return p


@njit(cache=True)
def relative_velocity(v, contacts):  # pragma: no cover - compiled
    """Return Hᵀ v.

    Inputs
    ------
    v : (nb, 6) float64, velocities of the bodies [m/s, rad/s]
    contacts : RigidContacts

    Outputs
    -------
    (nc, 3) float64, relative velocities, local frames [m/s]
    """
    nc = contacts.body.shape[0]
    u = np.empty((nc, 3))
    for c in range(nc):
        g = contacts.geometry[c]
        x = _apart(v[contacts.body[c, 0]], v[contacts.body[c, 1]], arm(g, 0), arm(g, 1))
        for k in range(3):
            u[c, k] = dot((g[3 * k], g[3 * k + 1], g[3 * k + 2]), x)
    return u


@njit(cache=True)
def apply(r, contacts):  # pragma: no cover - compiled
    """Return W r (nc, 3) [m/s]; the inputs are those of `velocity_change`."""
    return relative_velocity(velocity_change(r, contacts), contacts)


@njit(cache=True, inline="always")
def _slide(f, u, bn, r, mu, k):
    """Return the impulse of a contact that slips, from its velocity u at the impulse r; bn is b_N."""
    w = LocalCompliance(f[6], f[7], f[8], f[9], f[10], f[11], f[12])
    co, si = w.cos, w.sin
    h0, h1 = co * co * w.first + si * si * w.second, co * si * (w.first - w.second)
    h2 = si * si * w.first + co * co * w.second
    # b_T = u_T - W_TN r_N - W_TT r_T, with W_TT = A + W_TN W_NT / W_NN
    along = r[0] + (w.n1 * r[1] + w.n2 * r[2]) / w.nn
    t1 = u[1] - w.n1 * along - h0 * r[1] - h1 * r[2]
    t2 = u[2] - w.n2 * along - h1 * r[1] - h2 * r[2]
    held = r[1] * r[1] + r[2] * r[2]
    # λ = ‖u_T‖/‖r_T‖ of the previous slip
    guess = np.sqrt((u[1] * u[1] + u[2] * u[2]) / held) if held > 0.0 else 0.0
    return slip(w, (bn, t1, t2), mu, k, guess)


@njit(cache=True)
def _moved(v, p, a):
    """Return the change of a body's velocity from v (6,) to p (6), at the arm a [m/s]."""
    moved = abs(p[0] - v[0]) + abs(p[1] - v[1]) + abs(p[2] - v[2])
    size = abs(a[0]) + abs(a[1]) + abs(a[2])
    return moved + size * (abs(p[3] - v[3]) + abs(p[4] - v[4]) + abs(p[5] - v[5]))


@njit(cache=True)
def _solve_group(first, last, running, laws, contacts):
    """Solve the contacts first:last of one pair of bodies, in order.

    Returns the changes of the velocities of both bodies at the first contact.
    """
    r, v, geometry = running.impulse, running.velocity, contacts.geometry
    shift, friction, cohesion, factors = laws
    i, j = contacts.body[first, 0], contacts.body[first, 1]
    p = v[i, 0], v[i, 1], v[i, 2], v[i, 3], v[i, 4], v[i, 5]
    q = v[j, 0], v[j, 1], v[j, 2], v[j, 3], v[j, 4], v[j, 5]
    inertia_i, inertia_j = contacts.inertia[i], contacts.inertia[j]
    changed = False
    for c in range(first, last):
        g, f, old, k = geometry[c], factors[c], row(r, c), cohesion[c]
        # read before r is written, so that they stay in registers
        n, t, s = (g[0], g[1], g[2]), (g[3], g[4], g[5]), (g[6], g[7], g[8])
        a, b = arm(g, 0), arm(g, 1)
        x = _apart(p, q, a, b)
        u = add_dot(shift[c, 0], n, x), add_dot(shift[c, 1], t, x), add_dot(shift[c, 2], s, x)
        bn = less_dot(u[0], (f[6], f[7], f[8]), old)
        if bn >= 0.0 and k == 0.0:
            new = 0.0, 0.0, 0.0
        else:
            new = (
                less_dot(old[0], (f[0], f[1], f[2]), u),
                less_dot(old[1], (f[1], f[3], f[4]), u),
                less_dot(old[2], (f[2], f[4], f[5]), u),
            )
            limit = friction[c] * new[0] + k
            if new[0] < 0.0 or new[1] * new[1] + new[2] * new[2] > limit * limit:
                new = _slide(f, u, bn, old, friction[c], k)
        step = minus(new, old)
        if step[0] == 0.0 and step[1] == 0.0 and step[2] == 0.0:
            continue
        changed = True
        write_row(r, c, new)
        x = dot((n[0], t[0], s[0]), step), dot((n[1], t[1], s[1]), step), dot((n[2], t[2], s[2]), step)
        p = _pushed(p, inertia_i, a, x)
        q = _pushed(q, inertia_j, b, negative(x))
    if not changed:
        return 0.0, 0.0
    g = geometry[first]
    moved_i = moved_j = 0.0
    # fixed bodies are shared between parts: they are only read
    if inertia_i[0] > 0.0:
        moved_i = _moved(v[i], p, arm(g, 0))
        v[i, 0], v[i, 1], v[i, 2], v[i, 3], v[i, 4], v[i, 5] = p
    if inertia_j[0] > 0.0:
        moved_j = _moved(v[j], q, arm(g, 1))
        v[j, 0], v[j, 1], v[j, 2], v[j, 3], v[j, 4], v[j, 5] = q
    return moved_i, moved_j


@njit(cache=True)
def _visit(g, calm, running, laws, contacts, group):
    """Solve a group unless it sleeps, its bodies having hardly changed since its last solution.

    Any change of a body beyond `calm` wakes all its groups.
    """
    start, stop = group[g], group[g + 1]
    path, seen = running.path, running.seen
    i, j = contacts.body[start, 0], contacts.body[start, 1]
    if path[i] - seen[g, 0] + path[j] - seen[g, 1] <= calm:
        return
    moved_i, moved_j = _solve_group(start, stop, running, laws, contacts)
    # fixed bodies have no path: parts may share them
    if moved_i > 0.0:
        path[i] += moved_i
    if moved_j > 0.0:
        path[j] += moved_j
    # with more than one contact, solving the group again would change it
    seen[g, 0] = path[i] - (moved_i if stop - start > 1 else 0.0)
    seen[g, 1] = path[j] - (moved_j if stop - start > 1 else 0.0)


@njit(cache=True)
def _pass(first, last, calm, running, laws, contacts, group):
    """Visit the groups first:last in order."""
    for g in range(first, last):
        _visit(g, calm, running, laws, contacts, group)


@njit(cache=True)
def sweep(count, calm, running, laws, contacts, group):  # pragma: no cover - compiled
    """Make `count` passes over all groups.

    The first pass visits every group; in the others, groups sleep whose bodies have hardly changed.

    Inputs
    ------
    count : int64
    calm : float64, change of velocity that lets a group sleep [m/s]
    running : Running
    laws : Laws
    contacts : RigidContacts
    group : (ng+1,) int64, where each group begins

    Outputs
    -------
    `running`, written
    """
    for _ in range(count):
        _pass(0, group.shape[0] - 1, calm, running, laws, contacts, group)


@njit(cache=True, parallel=True)
def sweep_parallel(count, calm, running, laws, contacts, group, part):  # pragma: no cover - compiled
    """Make the passes of `sweep`, with all parts but the last in parallel.

    These share no moving body, so the result has the same bits as that of `sweep`.

    Inputs
    ------
    part : (k+1,) int64, where each part begins among the groups; the others as in `sweep`

    Outputs
    -------
    `running`, written
    """
    last = part.shape[0] - 2
    for _ in range(count):
        for k in prange(last):
            _pass(part[k], part[k + 1], calm, running, laws, contacts, group)
        _pass(part[last], part[last + 1], calm, running, laws, contacts, group)
