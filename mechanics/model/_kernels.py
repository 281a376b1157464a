"""Numba kernels of flight: free rotation of rigid bodies, and elastic bodies in axes that move with them."""

from typing import NamedTuple

import numpy as np
from numba import njit

_SUBSTEP = 0.1  # largest angle of one substep [rad]: the attitude is accurate to the second order in it


class Frames(NamedTuple):
    """Axes of all bodies at one instant.

    Attributes
    ----------
    centre : (nb, 3) float64 [m]
    rotation : (nb, 3, 3) float64, from body axes to world axes
    """

    centre: np.ndarray
    rotation: np.ndarray


@njit(cache=True)
def _series(x, y, z):
    """Return sin(a)/a and (1 - cos(a))/a² of a rotation vector of length a (Rodrigues)."""
    angle = np.sqrt(x * x + y * y + z * z)
    if angle < 1e-8:
        return 1.0 - angle * angle / 6.0, 0.5 - angle * angle / 24.0
    half = np.sin(0.5 * angle) / (0.5 * angle)
    return np.sin(angle) / angle, 0.5 * half * half


@njit(cache=True)
def _row_turned(a, b, c, x, y, z, s, v):
    """Return the row (a, b, c) times the exponential of a rotation vector, given its series."""
    p, q, r = b * z - c * y, c * x - a * z, a * y - b * x
    return a + s * p + v * (q * z - r * y), b + s * q + v * (r * x - p * z), c + s * r + v * (p * y - q * x)


@njit(cache=True)
def _turn(rotation, x, y, z):
    """Multiply a rotation by exp(vector) in place; the vector is given in body axes [rad]."""
    s, v = _series(x, y, z)
    for i in range(3):
        rotation[i, 0], rotation[i, 1], rotation[i, 2] = _row_turned(
            rotation[i, 0], rotation[i, 1], rotation[i, 2], x, y, z, s, v
        )


@njit(cache=True)
def _straighten(rotation):
    """Remove rounding from a rotation in place, by a Newton step towards the nearest one: R (3 - Rᵀ R)/2."""
    a, b, c = rotation[:, 0], rotation[:, 1], rotation[:, 2]
    aa = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    ab = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    ac = a[0] * c[0] + a[1] * c[1] + a[2] * c[2]
    bb = b[0] * b[0] + b[1] * b[1] + b[2] * b[2]
    bc = b[0] * c[0] + b[1] * c[1] + b[2] * c[2]
    cc = c[0] * c[0] + c[1] * c[1] + c[2] * c[2]
    for i in range(3):
        x, y, z = a[i], b[i], c[i]
        a[i] += 0.5 * (x - x * aa - y * ab - z * ac)
        b[i] += 0.5 * (y - x * ab - y * bb - z * bc)
        c[i] += 0.5 * (z - x * ac - y * bc - z * cc)


@njit(cache=True)
def _product(m, x, y, z):
    """Return m (x, y, z)ᵀ."""
    return (
        m[0, 0] * x + m[0, 1] * y + m[0, 2] * z,
        m[1, 0] * x + m[1, 1] * y + m[1, 2] * z,
        m[2, 0] * x + m[2, 1] * y + m[2, 2] * z,
    )


@njit(cache=True)
def _transposed(m, x, y, z):
    """Return mᵀ (x, y, z)ᵀ."""
    return (
        m[0, 0] * x + m[1, 0] * y + m[2, 0] * z,
        m[0, 1] * x + m[1, 1] * y + m[2, 1] * z,
        m[0, 2] * x + m[1, 2] * y + m[2, 2] * z,
    )


@njit(cache=True)
def fly(rotation, omega, inertia, inverse, moving, duration):  # pragma: no cover - compiled
    """Rotate rigid bodies freely for some time.

    With Π the angular momentum in body axes, each substep turns the body by exp(τ Ω), Ω = I⁻¹ (Π + Π')/2, and
    Π' = exp(-τ Ω) Π. So R Π, the momentum in space, stays, and ½ Π I⁻¹ Π as well, since Π' - Π is normal to Ω: the
    midpoint rule keeps quadratic invariants (Cooper 1987), here with the exponential map.

    Inputs
    ------
    rotation : (nb, 3, 3) float64, from body axes to world axes
    omega : (nb, 3) float64, world axes [rad/s]
    inertia, inverse : (nb, 3, 3) float64, body axes [kg m²], [1/(kg m²)]
    moving : (nb,) bool
    duration : float [s]

    Outputs
    -------
    rotation, omega : as above, after that time
    """
    new, spin = rotation.copy(), omega.copy()
    for b in range(rotation.shape[0]):
        if not moving[b]:
            continue
        r, i, v = new[b], inertia[b], inverse[b]
        w0, w1, w2 = omega[b, 0], omega[b, 1], omega[b, 2]
        angle = np.sqrt(w0 * w0 + w1 * w1 + w2 * w2) * duration
        if angle == 0.0 or not np.isfinite(angle):
            continue
        steps = min(int(angle / _SUBSTEP) + 1, 1000)
        tau = duration / steps
        o0, o1, o2 = _transposed(r, w0, w1, w2)
        # rounding makes R Rᵀ ω differ from ω, by an error that would accumulate over the steps
        d0, d1, d2 = _product(r, o0, o1, o2)
        d0, d1, d2 = _transposed(r, w0 - d0, w1 - d1, w2 - d2)
        o0, o1, o2 = o0 + d0, o1 + d1, o2 + d2
        p0, p1, p2 = _product(i, o0, o1, o2)
        for _ in range(steps):
            e0, e1, e2 = o0, o1, o2
            n0, n1, n2 = p0, p1, p2
            size = np.sqrt(p0 * p0 + p1 * p1 + p2 * p2)
            for _ in range(60):
                x, y, z = tau * e0, tau * e1, tau * e2
                s, c = _series(x, y, z)
                c0, c1, c2 = _row_turned(p0, p1, p2, x, y, z, s, c)
                change = abs(c0 - n0) + abs(c1 - n1) + abs(c2 - n2)
                n0, n1, n2 = c0, c1, c2
                if change <= 1e-16 * size:
                    break
                # from the change of Π: rounding of I⁻¹ I would otherwise scale the spin in every step
                d0, d1, d2 = _product(v, n0 - p0, n1 - p1, n2 - p2)
                e0, e1, e2 = o0 + 0.5 * d0, o1 + 0.5 * d1, o2 + 0.5 * d2
            _turn(r, tau * e0, tau * e1, tau * e2)
            d0, d1, d2 = _product(v, n0 - p0, n1 - p1, n2 - p2)
            o0, o1, o2 = o0 + d0, o1 + d1, o2 + d2
            p0, p1, p2 = n0, n1, n2
        _straighten(r)
        spin[b, 0], spin[b, 1], spin[b, 2] = _product(r, o0, o1, o2)
    return new, spin


@njit(cache=True)
def rigid_part(start, reference, projector, rotation, node_velocity):  # pragma: no cover - compiled
    """Split the motion of elastic bodies into that of their frames and deformation rates.

    Inputs
    ------
    start : (nb+1,) int64, first node of each body; bodies without nodes are skipped
    reference : (nn, 3) float64, undeformed places, body axes [m]
    projector : (nn, 6, 3) float64, (Rᵀ M R)⁻¹ Rᵀ M, column by column: rigid velocities from nodal ones, body axes
    rotation : (nb, 3, 3) float64, of the frames
    node_velocity : (nn, 3) float64, world axes [m/s]

    Outputs
    -------
    motion : (nb, 6) float64, velocities of the frames [m/s, rad/s], world axes
    rate : (nn, 3) float64, the remainder, body axes; it has no part in any rigid motion [m/s]
    """
    bodies = start.shape[0] - 1
    motion, rate = np.zeros((bodies, 6)), np.empty_like(node_velocity)
    s = np.empty(6)
    for b in range(bodies):
        if start[b] == start[b + 1]:
            continue
        turn = rotation[b]
        s[:] = 0.0
        for i in range(start[b], start[b + 1]):
            for k in range(3):
                rate[i, k] = (
                    turn[0, k] * node_velocity[i, 0]
                    + turn[1, k] * node_velocity[i, 1]
                    + turn[2, k] * node_velocity[i, 2]
                )
            for m in range(6):
                for k in range(3):
                    s[m] += projector[i, m, k] * rate[i, k]
        for i in range(start[b], start[b + 1]):
            x, y, z = reference[i]
            rate[i, 0] -= s[0] + s[4] * z - s[5] * y
            rate[i, 1] -= s[1] + s[5] * x - s[3] * z
            rate[i, 2] -= s[2] + s[3] * y - s[4] * x
        for k in range(3):
            for m in range(3):
                motion[b, k] += turn[k, m] * s[m]
                motion[b, 3 + k] += turn[k, m] * s[3 + m]
    return motion, rate


@njit(cache=True)
def deform(start, reference, before, after, motion, node, rate, duration):  # pragma: no cover - compiled
    """Move the nodes of elastic bodies in a flight in which their frames move and d grows at its rate.

    Inputs
    ------
    start, reference : as `rigid_part` takes them
    before, after : Frames before and after the flight
    motion : (nb, 6) float64, velocities of the frames after the flight [m/s, rad/s], world axes
    node : (nn, 3) float64, before the flight, world axes [m]
    rate : (nn, 3) float64, as `rigid_part` gives it, body axes [m/s]
    duration : float [s]

    Outputs
    -------
    node, velocity : (nn, 3) float64, after the flight, world axes [m], [m/s]
    """
    centre, new_centre = before.centre, after.centre
    place, velocity = np.empty_like(node), np.empty_like(node)
    local, arm = np.empty(3), np.empty(3)
    for b in range(start.shape[0] - 1):
        old, new = before.rotation[b], after.rotation[b]
        w0, w1, w2 = motion[b, 3], motion[b, 4], motion[b, 5]
        for i in range(start[b], start[b + 1]):
            x, y, z = node[i, 0] - centre[b, 0], node[i, 1] - centre[b, 1], node[i, 2] - centre[b, 2]
            for k in range(3):
                # by way of d, so that rounding of the frame strains no stone
                d = old[0, k] * x + old[1, k] * y + old[2, k] * z - reference[i, k]
                local[k] = reference[i, k] + (d + duration * rate[i, k])
            for k in range(3):
                place[i, k] = (
                    new_centre[b, k] + new[k, 0] * local[0] + new[k, 1] * local[1] + new[k, 2] * local[2]
                )
                # the spin acts on the undeformed arms, from which it was computed
                arm[k] = (
                    new[k, 0] * reference[i, 0] + new[k, 1] * reference[i, 1] + new[k, 2] * reference[i, 2]
                )
                velocity[i, k] = (
                    motion[b, k] + new[k, 0] * rate[i, 0] + new[k, 1] * rate[i, 1] + new[k, 2] * rate[i, 2]
                )
            velocity[i, 0] += w1 * arm[2] - w2 * arm[1]
            velocity[i, 1] += w2 * arm[0] - w0 * arm[2]
            velocity[i, 2] += w0 * arm[1] - w1 * arm[0]
    return place, velocity
