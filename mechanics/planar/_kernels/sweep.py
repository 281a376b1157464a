"""W in the plane: products, exact local solves, Gauss–Seidel sweeps, matrix-free.

With t = n turned by +90°, and the lever ℓ_n = a × n, ℓ_t = a × t of the contact point on each side,

    u_N = n·(v_i - v_j) + ℓ_n,i ω_i - ℓ_n,j ω_j,   u_T likewise,   Δv_i = (n Δr_N + t Δr_T)/m_i,   Δω_i = ℓ·Δr/J_i

`inertia` (nb, 2) holds 1/m and 1/J, zero for a body that impulses do not move. A sweep works on groups of eight
contacts that share no body, one in each lane: `record` (ng, 12, 8), what is known of them, and `v` (ns, 4), a row of
each body: vx, vy, ω/κ and 1/m with κ = √(m/J), so that with the levers κ ℓ a body has no more than one inertia. There
the bodies that move come in the order of the sweep. The others are at rest in it: each part has one row of zeros that
stands for them all, and for those of the lanes that stay empty.
"""

from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from mechanics.planar._kernels.lanes import LANES, solve_disks

# columns of a record: n (2), κ ℓ_t of both sides, shift (2), μ, k, r (2), 1/W_NN, 1/W_TT
_LT_I, _LT_J, _SHIFT, _MU, _K, _R, _INV_NN, _INV_TT, _COLUMNS = 2, 3, 4, 6, 7, 8, 10, 11, 12
# contacts searched for those of a group
_AHEAD = 64
# preceding groups whose bodies a group avoids if it can: a gap that hides store latency
_RECENT = 2


class SweepOrder(NamedTuple):
    """Order of the contacts and bodies in a sweep.

    Attributes
    ----------
    place : (ng, 8) int64, contacts in the order of the sweep, group by group; -1 where a lane stays empty
    start : (np+2,) int64, group with which each part begins there, and the contacts between parts
    body : (ng, 2, 8) uint32, rows of `inertia` of their bodies
    inertia : (ns, 2) float64, inverse masses and moments of inertia of the bodies that move, then zeros, one row for
        each part and one for the contacts between them
    """

    place: NDArray[np.int64]
    start: NDArray[np.int64]
    body: NDArray[np.uint32]
    inertia: NDArray[np.float64]


@njit(cache=True)
def _groups(order, start, row, moving):
    """Deal the contacts of each part, nearly in their order, to groups of eight that share no body.

    A group takes contacts whose bodies have been in none of the last groups, then those whose bodies are not in itself.

    Inputs
    ------
    order : (nc,) int64
    start : (np+2,) int64, where each part begins in it
    row : (nc, 2) int64, rows of the bodies
    moving : int64, rows of bodies that move; later ones stand for those that do not

    Outputs
    -------
    place : (ng, 8) int64
    begin : (np+2,) int64, group with which each part begins
    """
    nc, parts = order.shape[0], start.shape[0] - 1
    place = np.full((nc, LANES), -1)
    begin = np.zeros(parts + 1, dtype=np.int64)
    last = np.full(moving + parts, -1 - _RECENT)
    waiting = np.empty(_AHEAD, dtype=np.int64)
    group = 0
    for part in range(parts):
        count, ahead = 0, start[part]
        while True:
            while count < _AHEAD and ahead < start[part + 1]:
                waiting[count] = order[ahead]
                count += 1
                ahead += 1
            if count == 0:
                break
            lane = 0
            for latest in (group - _RECENT, group):
                kept = 0
                for w in range(count):
                    c = waiting[w]
                    i, j = row[c, 0], row[c, 1]
                    if lane == LANES or last[i] >= latest or last[j] >= latest:
                        waiting[kept] = c
                        kept += 1
                        continue
                    place[group, lane] = c
                    lane += 1
                    last[i], last[j] = group if i < moving else last[i], group if j < moving else last[j]
                count = kept
            group += 1
        begin[part + 1] = group
    return place[:group].copy(), begin


@njit(cache=True)
def layout_of(order, start, rank, body, inertia):  # pragma: no cover - compiled
    """Build the layout of a sweep.

    Inputs
    ------
    order : (nc,) int64, contacts part by part
    start : (np+2,) int64, where each part begins there
    rank : (nb,) int64, row of each moving body; -1 of the others
    body : (nc, 2) int64, in the order of the contacts
    inertia : (nb, 2) float64

    Outputs
    -------
    SweepOrder
    """
    moving = rank.max() + 1 if len(rank) else 0
    parts = len(start) - 1
    own = np.zeros((moving + parts, 2))
    for b in range(len(rank)):
        if rank[b] >= 0:
            own[rank[b]] = inertia[b]
    row = np.empty((len(order), 2), dtype=np.int64)
    for part in range(parts):
        for p in range(start[part], start[part + 1]):
            for s in range(2):
                at = rank[body[order[p], s]]
                row[order[p], s] = at if at >= 0 else moving + part
    place, begin = _groups(order, start, row, moving)
    rows = np.empty((place.shape[0], 2, LANES), dtype=np.uint32)
    for part in range(parts):
        for g in range(begin[part], begin[part + 1]):
            for lane in range(LANES):
                c = place[g, lane]
                for s in range(2):
                    rows[g, s, lane] = row[c, s] if c >= 0 else moving + part
    return SweepOrder(place, begin, rows, own)


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
def _kappa(inertia):
    """Return κ = √(m/J) (ns,) of the rows; zero of a body that does not move."""
    found = np.zeros(inertia.shape[0])
    for b in range(inertia.shape[0]):
        if inertia[b, 0] > 0.0:
            found[b] = np.sqrt(inertia[b, 1] / inertia[b, 0])
    return found


@njit(cache=True)
def records(layout, shift, friction, cohesion, lever, normal, diagonal):  # pragma: no cover - compiled
    """Build the records of the contacts.

    Inputs
    ------
    layout : Layout
    shift : (nc, 2) float64 [m/s]
    friction, cohesion : (nc,) float64
    lever : (nc, 4) float64 [m]
    normal : (nc, 2) float64
    diagonal : (nc, 2, 2) float64, W_αα

    Outputs
    -------
    record : (ng, 12, 8) float64
    other : (ng, 3, 8) float64, κ ℓ_n of both sides and W_NT of groups in which one of them is not zero; (0, 3, 8)
        without such groups
    """
    place, kappa = layout.place, _kappa(layout.inertia)
    record = np.zeros((place.shape[0], _COLUMNS, LANES))
    uneven = False
    for g in range(place.shape[0]):
        for lane in range(LANES):
            c = place[g, lane]
            # of a body that does not move no lever is needed
            for s in range(2):
                moves = layout.inertia[layout.body[g, s, lane], 0] > 0.0
                uneven = uneven or (c >= 0 and moves and lever[c, 2 * s] != 0.0)
    other = np.zeros((place.shape[0] if uneven else 0, 3, LANES))
    for g in range(place.shape[0]):
        one = record[g]
        for lane in range(LANES):
            c = place[g, lane]
            if c < 0:
                continue
            ki, kj = kappa[layout.body[g, 0, lane]], kappa[layout.body[g, 1, lane]]
            one[0, lane], one[1, lane] = normal[c, 0], normal[c, 1]
            one[_LT_I, lane], one[_LT_J, lane] = ki * lever[c, 1], kj * lever[c, 3]
            one[_SHIFT, lane], one[_SHIFT + 1, lane] = shift[c, 0], shift[c, 1]
            one[_MU, lane], one[_K, lane] = friction[c], cohesion[c]
            one[_INV_NN, lane], one[_INV_TT, lane] = 1.0 / diagonal[c, 0, 0], 1.0 / diagonal[c, 1, 1]
            if uneven:
                other[g, 0, lane], other[g, 1, lane] = ki * lever[c, 0], kj * lever[c, 2]
                other[g, 2, lane] = diagonal[c, 0, 1]
    return record, other


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
def _solve_any(group, lane, record, other, body, v):
    """Solve one contact with its neighbours frozen, and pass what has changed on to its bodies."""
    one, more, vi, vj = record[group], other[group], v[body[group, 0, lane]], v[body[group, 1, lane]]
    nx, ny = one[0, lane], one[1, lane]
    ln_i, lt_i, ln_j, lt_j = more[0, lane], one[_LT_I, lane], more[1, lane], one[_LT_J, lane]
    x, y = vi[0] - vj[0], vi[1] - vj[1]
    un = one[_SHIFT, lane] + nx * x + ny * y + ln_i * vi[2] - ln_j * vj[2]
    ut = one[_SHIFT + 1, lane] + nx * y - ny * x + lt_i * vi[2] - lt_j * vj[2]
    old_n, old_t, nt = one[_R, lane], one[_R + 1, lane], more[2, lane]
    nn, tt = 1.0 / one[_INV_NN, lane], 1.0 / one[_INV_TT, lane]
    bn, bt = un - nn * old_n - nt * old_t, ut - nt * old_n - tt * old_t
    n, t = solve_local(nn, nt, tt, bn, bt, one[_MU, lane], one[_K, lane])
    one[_R, lane], one[_R + 1, lane] = n, t
    dn, dt = n - old_n, t - old_t
    fx, fy = nx * dn - ny * dt, ny * dn + nx * dt
    vi[0] += vi[3] * fx
    vi[1] += vi[3] * fy
    vi[2] += vi[3] * (ln_i * dn + lt_i * dt)
    vj[0] -= vj[3] * fx
    vj[1] -= vj[3] * fy
    vj[2] -= vj[3] * (ln_j * dn + lt_j * dt)


@njit(cache=True)
def _pass(first, last, record, other, layout, v):
    """Solve the groups first:last one after the other."""
    body = layout.body
    if other.shape[0] == 0:
        for g in range(first, last):
            solve_disks(record, v, body, g)
        return
    for g in range(first, last):
        for lane in range(LANES):
            if layout.place[g, lane] >= 0:
                _solve_any(g, lane, record, other, body, v)


@njit(cache=True)
def _begin(impulse, record, other, layout):
    """Put the impulses (nc, 2) into the records, and make the bodies' velocities (ns, 4) that they cause."""
    place, body, inertia = layout.place, layout.body, layout.inertia
    v = np.zeros((inertia.shape[0], 4))
    for g in range(place.shape[0]):
        one = record[g]
        for lane in range(LANES):
            c = place[g, lane]
            if c < 0:
                continue
            i, j, n, t = body[g, 0, lane], body[g, 1, lane], impulse[c, 0], impulse[c, 1]
            one[_R, lane], one[_R + 1, lane] = n, t
            x, y = one[0, lane] * n - one[1, lane] * t, one[1, lane] * n + one[0, lane] * t
            v[i, 0] += x
            v[i, 1] += y
            v[i, 2] += one[_LT_I, lane] * t
            v[j, 0] -= x
            v[j, 1] -= y
            v[j, 2] -= one[_LT_J, lane] * t
            if other.shape[0]:
                v[i, 2] += other[g, 0, lane] * n
                v[j, 2] -= other[g, 1, lane] * n
    for b in range(v.shape[0]):
        v[b, 3] = inertia[b, 0]
        for k in range(3):
            v[b, k] *= v[b, 3]
    return v


@njit(cache=True)
def _end(impulse, record, layout):
    for g in range(record.shape[0]):
        for lane in range(LANES):
            c = layout.place[g, lane]
            if c >= 0:
                impulse[c, 0], impulse[c, 1] = record[g, _R, lane], record[g, _R + 1, lane]


@njit(cache=True)
def sweep(count, impulse, record, other, layout):  # pragma: no cover - compiled
    """Make `count` passes over the groups in their order; change `impulse` (nc, 2) in place.

    Always forwards: a pass that comes back begins with the contact that the one before has just solved, and so takes
    two passes for what one forward pass gains.
    """
    v = _begin(impulse, record, other, layout)
    for _ in range(count):
        _pass(0, record.shape[0], record, other, layout, v)
    _end(impulse, record, layout)


@njit(cache=True, parallel=True)
def sweep_parallel(count, impulse, record, other, layout):  # pragma: no cover - compiled
    """Make the passes of `sweep` with all parts at a time, then the contacts between them.

    Parts share no row of `v`, so the result has the same bits as that of `sweep`.
    """
    v = _begin(impulse, record, other, layout)
    start, last = layout.start, layout.start.shape[0] - 2
    for _ in range(count):
        for k in prange(last):
            _pass(start[k], start[k + 1], record, other, layout, v)
        _pass(start[last], start[last + 1], record, other, layout, v)
    _end(impulse, record, layout)
