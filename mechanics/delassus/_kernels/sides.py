"""Sides of one contact between rigid bodies, in the geometry row (15,) of `RigidContacts`.

Vectors and velocities are tuples (`mechanics.contact._kernels.vectors`). Sums keep the order written here, so that all
kernels find the same bits.
"""

from numba import njit

from mechanics.contact._kernels.vectors import cross, dot, row


@njit(cache=True)
def add_dot(s, a, b):  # pragma: no cover - compiled
    """Return s + a·b, summed from s on."""
    return s + a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def less_dot(s, a, b):  # pragma: no cover - compiled
    """Return s - a·b, summed from s on."""
    return s - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]


@njit(cache=True)
def negative(a):  # pragma: no cover - compiled
    """Return -a."""
    return -a[0], -a[1], -a[2]


@njit(cache=True)
def times(m, x):  # pragma: no cover - compiled
    """Return m x for a matrix (3, 3)."""
    return dot(row(m, 0), x), dot(row(m, 1), x), dot(row(m, 2), x)


@njit(cache=True)
def inverse_columns(a, b, c):  # pragma: no cover - compiled
    """Return the columns of the inverse of the matrix with rows a, b, c, times its determinant, and the determinant."""
    first = cross(b, c)
    return first, cross(c, a), cross(a, b), dot(a, first)


@njit(cache=True)
def arm(g, s):  # pragma: no cover - compiled
    """Return the lever arm of side s, 0 candidate or 1 antagonist, world axes [m]."""
    return g[9 + 3 * s], g[10 + 3 * s], g[11 + 3 * s]


@njit(cache=True)
def to_world(g, r):  # pragma: no cover - compiled
    """Return Rᵀ r, from the local frame to world axes."""
    return dot((g[0], g[3], g[6]), r), dot((g[1], g[4], g[7]), r), dot((g[2], g[5], g[8]), r)


@njit(cache=True)
def side_jacobian(g, s, jacobian):  # pragma: no cover - compiled
    """Write the local velocity of side s by its body's velocity into `jacobian` (3, 6); the antagonist is negative."""
    sign, a = 1.0 if s == 0 else -1.0, arm(g, s)
    for k in range(3):
        n = sign * g[3 * k], sign * g[3 * k + 1], sign * g[3 * k + 2]
        jacobian[k, 0], jacobian[k, 1], jacobian[k, 2] = n
        jacobian[k, 3], jacobian[k, 4], jacobian[k, 5] = cross(a, n)
