"""Numba kernels of ADMM between rigid bodies of the plane, in local frames, with the bodies' velocities as unknowns.

The iteration of `body_admm`, with a penalty σ of each contact's own and factors of M + H Σ⁻¹ Hᵀ in blocks of 3 × 3. As
a pair of bodies has few contacts, one pass over the contacts ends an iteration and begins the next.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mechanics.problem._kernels import onto_cone
from mechanics.solvers._kernels.body_cholesky import Panels, solve


class DiskTouching(NamedTuple):
    """Contacts of the plane as the iteration sees them.

    Attributes
    ----------
    side : (nc, 2) int64, place of the two bodies in the order of elimination, -1: does not move
    normal : (nc, 2) float64 [-]
    lever : (nc, 4) float64, a × n and a × t of the candidate, then of the antagonist [m]
    shift : (nc, 2) float64, u_free + bias n [m/s]
    friction, cohesion : (nc,) float64, μ [-] and k [N s]
    soft : (nc,) float64, 1/σ [kg]
    """

    side: NDArray[np.int64]
    normal: NDArray[np.float64]
    lever: NDArray[np.float64]
    shift: NDArray[np.float64]
    friction: NDArray[np.float64]
    cohesion: NDArray[np.float64]
    soft: NDArray[np.float64]


class DiskIterate(NamedTuple):
    """Iterate of the bodies and contacts, overwritten by the next one.

    Attributes
    ----------
    x, z, q : (nc, 2) float64, z = P_K(x) [N s]
    velocity : (3 nm,) float64, v in the order of elimination [m/s], [rad/s]
    """

    x: NDArray[np.float64]
    z: NDArray[np.float64]
    q: NDArray[np.float64]
    velocity: NDArray[np.float64]


class DiskFactors(NamedTuple):
    """Factors of M + H Σ⁻¹ Hᵀ: their pattern, and their values as `divide` leaves them."""

    panels: Panels
    value: NDArray[np.float64]


@njit(cache=True)
def assemble_disks(touching, mass, panels):  # pragma: no cover - compiled
    """Return the panels of M + H Σ⁻¹ Hᵀ.

    Inputs
    ------
    touching : DiskTouching
    mass : (nm, 2) float64, mass and moment of inertia in the order of elimination [kg, kg m²]
    panels : Panels

    Outputs
    -------
    float64, as `eliminate` takes them
    """
    body, first, rows, start = panels.body, panels.first, panels.row, panels.start
    value, count = np.zeros(start[-1]), mass.shape[0]
    owner = np.empty(count, dtype=np.int64)
    for s in range(body.shape[0] - 1):
        owner[body[s] : body[s + 1]] = s
    own = np.zeros((count, 3, 3))
    for k in range(count):
        own[k, 0, 0] = own[k, 1, 1] = mass[k, 0]
        own[k, 2, 2] = mass[k, 1]
    for c in range(touching.side.shape[0]):
        weight, lever = touching.soft[c], touching.lever[c]
        nx, ny = touching.normal[c, 0], touching.normal[c, 1]
        for s in range(2):
            k = touching.side[c, s]
            if k < 0:
                continue
            a, b = lever[2 * s], lever[2 * s + 1]
            x, y, m = weight * (a * nx - b * ny), weight * (a * ny + b * nx), own[k]
            m[0, 0] += weight
            m[1, 1] += weight
            m[0, 2] += x
            m[2, 0] += x
            m[1, 2] += y
            m[2, 1] += y
            m[2, 2] += weight * (a * a + b * b)
        i, j = touching.side[c, 0], touching.side[c, 1]
        if i < 0 or j < 0:
            continue
        # rows of the panel belong to the earlier body
        early, late, p, q = (i, j, 0, 2) if i < j else (j, i, 2, 0)
        s = owner[early]
        reach = rows[first[s] : first[s + 1]]
        line, at = 3 * (early - body[s]), 3 * np.searchsorted(reach, late)
        panel = value[start[s] : start[s + 1]].reshape((3 * (body[s + 1] - body[s]), 3 * reach.shape[0]))
        panel[line, at] -= weight
        panel[line + 1, at + 1] -= weight
        panel[line, at + 2] -= weight * (lever[q] * nx - lever[q + 1] * ny)
        panel[line + 1, at + 2] -= weight * (lever[q] * ny + lever[q + 1] * nx)
        panel[line + 2, at] -= weight * (lever[p] * nx - lever[p + 1] * ny)
        panel[line + 2, at + 1] -= weight * (lever[p] * ny + lever[p + 1] * nx)
        panel[line + 2, at + 2] -= weight * (lever[p] * lever[q] + lever[p + 1] * lever[q + 1])
    for k in range(count):
        s = owner[k]
        at, height = 3 * (k - body[s]), first[s + 1] - first[s]
        panel = value[start[s] : start[s + 1]].reshape((3 * (body[s + 1] - body[s]), 3 * height))
        for p in range(3):
            for q in range(3):
                panel[at + p, at + q] = own[k, p, q]
    return value


@njit(cache=True)
def _pass(iterate, v, load, over, touching):
    """Write the next x from the velocities v (3 nm,), then its z and q, and H q into `load` (3 nm,).

    With ω = `over` of zero x stays as it is.
    """
    x, kept, q = iterate.x, iterate.z, iterate.q
    side, normal, lever, shift = touching.side, touching.normal, touching.lever, touching.shift
    friction, cohesion, inverse = touching.friction, touching.cohesion, touching.soft
    load[:] = 0.0
    for c in range(side.shape[0]):
        i, j, soft = side[c, 0], side[c, 1], inverse[c]
        nx, ny = normal[c, 0], normal[c, 1]
        la, lb, lc, ld = lever[c, 0], lever[c, 1], lever[c, 2], lever[c, 3]
        xn, xt = x[c, 0], x[c, 1]
        if over > 0.0:
            vx = vy = un = ut = 0.0
            if i >= 0:
                vx, vy, w = v[3 * i], v[3 * i + 1], v[3 * i + 2]
                un, ut = la * w, lb * w
            if j >= 0:
                w = v[3 * j + 2]
                vx, vy = vx - v[3 * j], vy - v[3 * j + 1]
                un, ut = un - lc * w, ut - ld * w
            un += nx * vx + ny * vy
            ut += nx * vy - ny * vx
            xn += over * (q[c, 0] - soft * un - kept[c, 0])
            xt += over * (q[c, 1] - soft * ut - kept[c, 1])
            x[c, 0], x[c, 1] = xn, xt
        zn, size = onto_cone(xn, abs(xt), friction[c], cohesion[c])
        zt = size if xt >= 0.0 else -size
        kept[c, 0], kept[c, 1] = zn, zt
        yn, yt = xn - zn, xt - zt
        qn = zn - yn - shift[c, 0] * soft - friction[c] * abs(yt)
        qt = zt - yt - shift[c, 1] * soft
        q[c, 0], q[c, 1] = qn, qt
        fx, fy = nx * qn - ny * qt, ny * qn + nx * qt
        if i >= 0:
            load[3 * i] += fx
            load[3 * i + 1] += fy
            load[3 * i + 2] += la * qn + lb * qt
        if j >= 0:
            load[3 * j] -= fx
            load[3 * j + 1] -= fy
            load[3 * j + 2] -= lc * qn + ld * qt


@njit(cache=True)
def advance_disks(iterate, count, over, touching, factors):  # pragma: no cover - compiled
    """Make iterations.

    Inputs
    ------
    iterate : DiskIterate
    count : int64
    over : float64, ω [-]
    touching : DiskTouching
    factors : DiskFactors

    Outputs
    -------
    iterate : written; z and q belong to x
    """
    panels, velocity = factors.panels, iterate.velocity
    highest = 0
    for s in range(panels.body.shape[0] - 1):
        highest = max(highest, panels.first[s + 1] - panels.first[s])
    load, work = np.empty_like(velocity), np.empty(3 * highest)
    _pass(iterate, velocity, load, 0.0, touching)
    for _ in range(count):
        velocity[:] = load
        solve(panels, factors.value, velocity, work)
        _pass(iterate, velocity, load, over, touching)
