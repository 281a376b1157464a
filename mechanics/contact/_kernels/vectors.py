"""Vectors of three components, as tuples of float64, for compiled loops.

`row` and `column` read a vector from an array. Tuples live in registers, so the loops cost what they would cost
component by component, and sums run from the first component to the last, so that they give the same bits.
"""

import numpy as np
from numba import njit


@njit(cache=True)
def row(matrix, k):  # pragma: no cover - compiled
    """Return row k of a matrix (n, 3)."""
    return matrix[k, 0], matrix[k, 1], matrix[k, 2]


@njit(cache=True)
def column(matrix, k):  # pragma: no cover - compiled
    """Return column k of a matrix (3, n)."""
    return matrix[0, k], matrix[1, k], matrix[2, k]


@njit(cache=True)
def dot(a, b):  # pragma: no cover - compiled
    """Return a·b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def cross(a, b):  # pragma: no cover - compiled
    """Return a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def minus(a, b):  # pragma: no cover - compiled
    """Return a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(cache=True)
def over(a, s):  # pragma: no cover - compiled
    """Return a / s."""
    return a[0] / s, a[1] / s, a[2] / s


@njit(cache=True)
def along(a, s, b):  # pragma: no cover - compiled
    """Return a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


@njit(cache=True)
def norm(a):  # pragma: no cover - compiled
    """Return |a|."""
    return np.sqrt(dot(a, a))


@njit(cache=True)
def write_row(matrix, k, a):  # pragma: no cover - compiled
    """Set row k of a matrix (n, 3)."""
    matrix[k, 0], matrix[k, 1], matrix[k, 2] = a


@njit(cache=True)
def write_frame(frame, n, direction):  # pragma: no cover - compiled
    """Set the rows n, t1, t2 = n × t1 of a frame (3, 3), t1 along a direction orthogonal to the unit vector n."""
    t1 = over(direction, norm(direction))
    t2 = cross(n, t1)
    frame[0, 0], frame[0, 1], frame[0, 2] = n
    frame[1, 0], frame[1, 1], frame[1, 2] = t1
    frame[2, 0], frame[2, 1], frame[2, 2] = t2
