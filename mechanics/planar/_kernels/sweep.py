"""W in the plane: products, exact local solves, Gauss–Seidel sweeps, matrix-free.

With t = n turned by +90°, and the lever ℓ_n = a × n, ℓ_t = a × t of the contact point on each side,

    u_N = n·(v_i - v_j) + ℓ_n,i ω_i - ℓ_n,j ω_j,   u_T likewise,   Δv_i = (n Δr_N + t Δr_T)/m_i,   Δω_i = ℓ·Δr/J_i

`inertia` (nb, 2) holds 1/m and 1/J, zero for a body that impulses do not move. A sweep works on `record` (nc, 16), two
cache lines of a contact, and on `v` (ns, 8), one cache line of a body: vx, vy, ω, 1/m, 1/J. There the bodies that move
come in the order of the sweep. The others are at rest in it: each part has one row of zeros that stands for them all.
"""

from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

__all__ = [
    "Layout",
    "apply",
    "diagonals",
    "layout_of",
    "records",
    "relative_velocity",
    "solve_local",
    "sweep",
    "sweep_parallel",
    "velocity_change",
]

# columns of a record: n (2), ℓ_n and ℓ_t of both sides (4), shift (2), μ, k, r (2), 1/W_NN, 1/W_TT, W_NT, and whether
# the contact is not that of two disks
_LN_I, _LT_I, _LN_J, _LT_J, _SHIFT, _MU, _K, _R, _INV_NN, _INV_TT, _NT, _OTHER = (
    2,
    3,
    4,
    5,
    6,
    8,
    9,
    10,
    12,
    13,
    14,
    15,
)


class Layout(NamedTuple):
    """Order of the contacts and bodies in a sweep.

    Attributes
    ----------
    order : (nc,) int64, contacts in the order of the sweep
    start : (np+2,) int64, where each part begins there, and the contacts between parts
    body : (nc, 2) uint32, rows of `inertia` of their bodies, in that order
    inertia : (ns, 2) float64, inverse masses and moments of inertia of the bodies that move, then zeros, one row for
        each part and one for the contacts between them
    """

    order: NDArray[np.int64]
    start: NDArray[np.int64]
    body: NDArray[np.uint32]
    inertia: NDArray[np.float64]


@njit(cache=True)
def layout_of(order, start, rank, body, inertia):  # pragma: no cover - compiled
    """Build the layout of a sweep.

    Inputs
    ------
    order : (nc,) int64
    start : (np+2,) int64
    rank : (nb,) int64, row of each moving body; -1 of the others
    body : (nc, 2) int64, in the order of the contacts
    inertia : (nb, 2) float64

    Outputs
    -------
    Layout
    """
    moving = rank.max() + 1 if len(rank) else 0
    own = np.zeros((moving + len(start) - 1, 2))
    for b in range(len(rank)):
        if rank[b] >= 0:
            own[rank[b]] = inertia[b]
    row = np.empty((len(order), 2), dtype=np.uint32)
    for part in range(len(start) - 1):
        for p in range(start[part], start[part + 1]):
            for s in range(2):
                place = rank[body[order[p], s]]
                row[p, s] = place if place >= 0 else moving + part
    return Layout(order, start, row, own)


@njit(cache=True)
def velocity_change(r, body, normal, lever, inertia):  # pragma: no cover - compiled
    """Compute ŵ H r.

    Inputs
    ------
    r : (nc, 2) float64, impulses [N s]
    body : (nc, 2) int64
    normal : (nc, 2) float64 [-]
    lever : (nc, 4) float64 [m]
    inertia : (nb, 2) float64 [1/kg, 1/(kg m²)]

    Outputs
    -------
    (nb, 3) float64, change of vx, vy [m/s] and ω [rad/s]
    """
    v = np.zeros((inertia.shape[0], 3))
    for c in range(r.shape[0]):
        nx, ny, r0, r1 = normal[c, 0], normal[c, 1], r[c, 0], r[c, 1]
        x, y = nx * r0 - ny * r1, ny * r0 + nx * r1
        i, j = body[c, 0], body[c, 1]
        v[i, 0] += x
        v[i, 1] += y
        v[i, 2] += lever[c, 0] * r0 + lever[c, 1] * r1
        v[j, 0] -= x
        v[j, 1] -= y
        v[j, 2] -= lever[c, 2] * r0 + lever[c, 3] * r1
    for b in range(v.shape[0]):
        v[b, 0] *= inertia[b, 0]
        v[b, 1] *= inertia[b, 0]
        v[b, 2] *= inertia[b, 1]
    return v


@njit(cache=True)
def relative_velocity(v, body, normal, lever):  # pragma: no cover - compiled
    """Compute Hᵀ v: local relative velocities (nc, 2) [m/s] of the bodies' velocities (nb, 3)."""
    nc = body.shape[0]
    u = np.empty((nc, 2))
    for c in range(nc):
        i, j = body[c, 0], body[c, 1]
        nx, ny = normal[c, 0], normal[c, 1]
        x, y = v[i, 0] - v[j, 0], v[i, 1] - v[j, 1]
        u[c, 0] = nx * x + ny * y + lever[c, 0] * v[i, 2] - lever[c, 2] * v[j, 2]
        u[c, 1] = nx * y - ny * x + lever[c, 1] * v[i, 2] - lever[c, 3] * v[j, 2]
    return u


@njit(cache=True)
def apply(r, body, normal, lever, inertia):  # pragma: no cover - compiled
    """Compute W r (nc, 2) [m/s]."""
    return relative_velocity(velocity_change(r, body, normal, lever, inertia), body, normal, lever)


@njit(cache=True)
def diagonals(body, lever, inertia):  # pragma: no cover - compiled
    """Compute W_αα (nc, 2, 2) [1/kg]."""
    nc = body.shape[0]
    w = np.empty((nc, 2, 2))
    for c in range(nc):
        i, j = body[c, 0], body[c, 1]
        m, p, q = inertia[i, 0] + inertia[j, 0], inertia[i, 1], inertia[j, 1]
        a, b, d, e = lever[c, 0], lever[c, 1], lever[c, 2], lever[c, 3]
        w[c, 0, 0] = m + p * a * a + q * d * d
        w[c, 1, 1] = m + p * b * b + q * e * e
        w[c, 0, 1] = w[c, 1, 0] = p * a * b + q * d * e
    return w


@njit(cache=True)
def records(layout, shift, friction, cohesion, normal, lever, diagonal):  # pragma: no cover - compiled
    """Build the records (nc, 16) of the contacts, in the order of the sweep."""
    order = layout.order
    record = np.zeros((len(order), 16))
    for p in range(len(order)):
        c, one = order[p], record[p]
        one[0], one[1] = normal[c, 0], normal[c, 1]
        for k in range(4):
            # of a body that does not move none is needed
            one[_LN_I + k] = lever[c, k] if layout.inertia[layout.body[p, k // 2], 0] > 0.0 else 0.0
        one[_SHIFT], one[_SHIFT + 1] = shift[c, 0], shift[c, 1]
        one[_MU], one[_K] = friction[c], cohesion[c]
        one[_INV_NN], one[_INV_TT] = 1.0 / diagonal[c, 0, 0], 1.0 / diagonal[c, 1, 1]
        one[_NT] = diagonal[c, 0, 1]
        one[_OTHER] = one[_LN_I] != 0.0 or one[_LN_J] != 0.0 or one[_NT] != 0.0
    return record


@njit(cache=True)
def solve_local(nn, nt, tt, bn, bt, mu, k):  # pragma: no cover - compiled
    """Solve one contact for its impulse (r_N, r_T), exactly: u = W r + b, 0 ≤ u_N ⊥ r_N ≥ 0, |r_T| ≤ μ r_N + k.

    Open, stick and both slips are tried in this order. With μ |W_NT| ≥ W_NN (Painlevé) a contact that departs may stay
    open or jam: one that can stay open stays open, one that can stick sticks, and of two slips the smaller one holds.
    """
    t = min(max(-bt / tt, -k), k)
    if bn + nt * t >= 0.0:
        return 0.0, t
    det = nn * tt - nt * nt
    if det > 0.0:
        n, t = (nt * bt - tt * bn) / det, (nt * bn - nn * bt) / det
        if n >= 0.0 and abs(t) <= mu * n + k:
            return n, t
    # closed and not sticking: r_T = s (μ r_N + k) against u_T; what breaks s u_T ≤ 0 least, beyond rounding, holds
    best_n, best_t, best = 0.0, 0.0, np.inf
    for s in (1.0, -1.0):
        slope = nn + s * mu * nt
        n = -(bn + s * k * nt) / slope if slope != 0.0 else -1.0
        if n < 0.0:
            continue
        t = s * (mu * n + k)
        wrong = max(s * (bt + nt * n + tt * t), 0.0)
        wrong = 0.0 if wrong <= 1e-14 * (abs(bt) + abs(nt) * n + tt * abs(t)) else wrong
        if wrong < best or (wrong == best and n < best_n):
            best_n, best_t, best = n, t, wrong
    return best_n, best_t


@njit(cache=True)
def _solve_disks(c, record, body, v):
    """Solve one contact of disks, whose arms run along n, and pass what has changed on to its bodies.

    W_αα is diagonal, so the normal does not feel the tangent.
    """
    one, vi, vj = record[c], v[body[c, 0]], v[body[c, 1]]
    nx, ny, lt_i, lt_j = one[0], one[1], one[_LT_I], one[_LT_J]
    x, y = vi[0] - vj[0], vi[1] - vj[1]
    un = one[_SHIFT] + nx * x + ny * y
    ut = one[_SHIFT + 1] + nx * y - ny * x + lt_i * vi[2] - lt_j * vj[2]
    old_n, old_t = one[_R], one[_R + 1]
    n = max(old_n - un * one[_INV_NN], 0.0)
    limit = one[_MU] * n + one[_K]
    t = min(max(old_t - ut * one[_INV_TT], -limit), limit)
    one[_R], one[_R + 1] = n, t
    dn, dt = n - old_n, t - old_t
    fx, fy = nx * dn - ny * dt, ny * dn + nx * dt
    vi[0] += vi[3] * fx
    vi[1] += vi[3] * fy
    vi[2] += vi[4] * lt_i * dt
    vj[0] -= vj[3] * fx
    vj[1] -= vj[3] * fy
    vj[2] -= vj[4] * lt_j * dt


@njit(cache=True)
def _solve_any(c, record, body, v):
    """Solve one contact with its neighbours frozen, and pass what has changed on to its bodies."""
    one, vi, vj = record[c], v[body[c, 0]], v[body[c, 1]]
    nx, ny = one[0], one[1]
    ln_i, lt_i, ln_j, lt_j = one[_LN_I], one[_LT_I], one[_LN_J], one[_LT_J]
    x, y = vi[0] - vj[0], vi[1] - vj[1]
    un = one[_SHIFT] + nx * x + ny * y + ln_i * vi[2] - ln_j * vj[2]
    ut = one[_SHIFT + 1] + nx * y - ny * x + lt_i * vi[2] - lt_j * vj[2]
    old_n, old_t, nt = one[_R], one[_R + 1], one[_NT]
    nn, tt = 1.0 / one[_INV_NN], 1.0 / one[_INV_TT]
    bn, bt = un - nn * old_n - nt * old_t, ut - nt * old_n - tt * old_t
    n, t = solve_local(nn, nt, tt, bn, bt, one[_MU], one[_K])
    one[_R], one[_R + 1] = n, t
    dn, dt = n - old_n, t - old_t
    fx, fy = nx * dn - ny * dt, ny * dn + nx * dt
    vi[0] += vi[3] * fx
    vi[1] += vi[3] * fy
    vi[2] += vi[4] * (ln_i * dn + lt_i * dt)
    vj[0] -= vj[3] * fx
    vj[1] -= vj[3] * fy
    vj[2] -= vj[4] * (ln_j * dn + lt_j * dt)


@njit(cache=True)
def _pass(first, last, record, body, v):
    """Solve the contacts first:last one after the other."""
    # unsigned, so that no index is taken to count from the end
    for c in range(np.uint64(first), np.uint64(last)):
        if record[c, _OTHER] == 0.0:
            _solve_disks(c, record, body, v)
        else:
            _solve_any(c, record, body, v)


@njit(cache=True)
def _begin(impulse, record, layout):
    """Put the impulses (nc, 2) into the records, and make the bodies' velocities (ns, 8) that they cause."""
    body, inertia = layout.body, layout.inertia
    v = np.zeros((inertia.shape[0], 8))
    for p in range(record.shape[0]):
        one, i, j = record[p], body[p, 0], body[p, 1]
        n, t = impulse[layout.order[p], 0], impulse[layout.order[p], 1]
        one[_R], one[_R + 1] = n, t
        x, y = one[0] * n - one[1] * t, one[1] * n + one[0] * t
        v[i, 0] += x
        v[i, 1] += y
        v[i, 2] += one[_LN_I] * n + one[_LT_I] * t
        v[j, 0] -= x
        v[j, 1] -= y
        v[j, 2] -= one[_LN_J] * n + one[_LT_J] * t
    for b in range(v.shape[0]):
        v[b, 3], v[b, 4] = inertia[b, 0], inertia[b, 1]
        v[b, 0] *= v[b, 3]
        v[b, 1] *= v[b, 3]
        v[b, 2] *= v[b, 4]
    return v


@njit(cache=True)
def _end(impulse, record, layout):
    for p in range(record.shape[0]):
        impulse[layout.order[p], 0], impulse[layout.order[p], 1] = record[p, _R], record[p, _R + 1]


@njit(cache=True)
def sweep(count, impulse, record, layout):  # pragma: no cover - compiled
    """Make `count` passes over the records in their order; change `impulse` (nc, 2) in place.

    Always forwards: a pass that comes back begins with the contact that the one before has just solved, and so takes
    two passes for what one forward pass gains.
    """
    v = _begin(impulse, record, layout)
    for _ in range(count):
        _pass(0, record.shape[0], record, layout.body, v)
    _end(impulse, record, layout)


@njit(cache=True, parallel=True)
def sweep_parallel(count, impulse, record, layout):  # pragma: no cover - compiled
    """Make the passes of `sweep` with all parts at a time, then the contacts between them.

    Parts share no row of `v`, so the result has the same bits as that of `sweep`.
    """
    v = _begin(impulse, record, layout)
    start, last = layout.start, layout.start.shape[0] - 2
    for _ in range(count):
        for k in prange(last):
            _pass(start[k], start[k + 1], record, layout.body, v)
        _pass(start[last], start[last + 1], record, layout.body, v)
    _end(impulse, record, layout)
