"""Numba kernel of free rigid rotation."""

import numpy as np
from numba import njit

__all__ = ["fly"]

# largest angle of one substep [rad]: the attitude is accurate to the second order in it
_SUBSTEP = 0.1


@njit(cache=True)
def _turn(rotation, x, y, z):
    """rotation · exp(vector) in place (Rodrigues); the vector is given in body axes [rad]."""
    angle = np.sqrt(x * x + y * y + z * z)
    if angle < 1e-8:
        s, c = 1.0 - angle * angle / 6.0, 0.5 - angle * angle / 24.0
    else:
        half = np.sin(0.5 * angle) / (0.5 * angle)
        s, c = np.sin(angle) / angle, 0.5 * half * half
    for i in range(3):
        a, b, d = rotation[i, 0], rotation[i, 1], rotation[i, 2]
        # row × vector, and once more
        p, q, r = b * z - d * y, d * x - a * z, a * y - b * x
        pp, qq, rr = q * z - r * y, r * x - p * z, p * y - q * x
        rotation[i, 0] = a + s * p + c * pp
        rotation[i, 1] = b + s * q + c * qq
        rotation[i, 2] = d + s * r + c * rr


@njit(cache=True)
def _product(m, x, y, z):
    return (
        m[0, 0] * x + m[0, 1] * y + m[0, 2] * z,
        m[1, 0] * x + m[1, 1] * y + m[1, 2] * z,
        m[2, 0] * x + m[2, 1] * y + m[2, 2] * z,
    )


@njit(cache=True)
def _transposed(m, x, y, z):
    return (
        m[0, 0] * x + m[1, 0] * y + m[2, 0] * z,
        m[0, 1] * x + m[1, 1] * y + m[2, 1] * z,
        m[0, 2] * x + m[1, 2] * y + m[2, 2] * z,
    )


@njit(cache=True)
def fly(rotation, omega, inertia, inverse, moving, duration):  # pragma: no cover - compiled
    """Free rotation of rigid bodies: new rotations (nb, 3, 3) and angular velocities (nb, 3), world axes.

    With Π the angular momentum in body axes, each substep turns the body by exp(τ Ω), Ω = I⁻¹ (Π + Π')/2, and
    Π' = exp(-τ Ω) Π. So R Π, the momentum in space, stays, and ½ Π I⁻¹ Π as well, since Π' - Π is normal to Ω: the
    midpoint rule keeps quadratic invariants (Cooper 1987), here with the exponential map.
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
        p0, p1, p2 = _product(i, o0, o1, o2)
        for _ in range(steps):
            e0, e1, e2 = o0, o1, o2
            n0, n1, n2 = p0, p1, p2
            size = np.sqrt(p0 * p0 + p1 * p1 + p2 * p2)
            for _ in range(60):
                t = np.eye(3)
                _turn(t, tau * e0, tau * e1, tau * e2)
                c0, c1, c2 = _transposed(t, p0, p1, p2)
                change = abs(c0 - n0) + abs(c1 - n1) + abs(c2 - n2)
                n0, n1, n2 = c0, c1, c2
                if change <= 1e-16 * size:
                    break
                e0, e1, e2 = _product(v, 0.5 * (p0 + n0), 0.5 * (p1 + n1), 0.5 * (p2 + n2))
            _turn(r, tau * e0, tau * e1, tau * e2)
            p0, p1, p2 = n0, n1, n2
            o0, o1, o2 = _product(v, p0, p1, p2)
        spin[b, 0], spin[b, 1], spin[b, 2] = _product(r, o0, o1, o2)
    return new, spin
