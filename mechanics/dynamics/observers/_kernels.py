"""Numba kernels of the observers: displacement and speed of the corners of rigid bodies.

Corners of body b are first[b]:first[b + 1].
"""

import numpy as np
from numba import njit


@njit(cache=True)
def largest_displacement(
    first, corner, centre, rotation, centre_then, rotation_then
):  # pragma: no cover - compiled
    """Return the largest displacement of a corner of each body since an earlier configuration.

    Inputs
    ------
    first : (nb+1,) int64, first corner of each body
    corner : (nv, 3) float64, from the centre of mass, body axes [m]
    centre, centre_then : (nb, 3) float64 [m]
    rotation, rotation_then : (nb, 3, 3) float64, from body axes to world axes

    Outputs
    -------
    largest : (nb,) float64 [m]; NaN for a body whose place is not a number
    """
    largest, turn = np.zeros(centre.shape[0]), np.empty((3, 3))
    for b in range(centre.shape[0]):
        c0 = centre[b, 0] - centre_then[b, 0]
        c1 = centre[b, 1] - centre_then[b, 1]
        c2 = centre[b, 2] - centre_then[b, 2]
        for i in range(3):
            for j in range(3):
                turn[i, j] = rotation[b, i, j] - rotation_then[b, i, j]
        most = 0.0
        for k in range(first[b], first[b + 1]):
            x, y, z = corner[k, 0], corner[k, 1], corner[k, 2]
            d0 = c0 + turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z
            d1 = c1 + turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z
            d2 = c2 + turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z
            square = d0 * d0 + d1 * d1 + d2 * d2
            # a comparison that lets NaN through, so that a run that has diverged is seen
            if not square <= most:
                most = square
        largest[b] = np.sqrt(most)
    return largest


@njit(cache=True)
def largest_speed(first, corner, rotation, velocity):  # pragma: no cover - compiled
    """Return the largest speed of a corner of each body.

    Inputs
    ------
    first, corner : as above
    rotation : (nb, 3, 3) float64
    velocity : (nb, 6) float64, translation [m/s] and rotation [rad/s], world axes

    Outputs
    -------
    largest : (nb,) float64 [m/s]
    """
    largest = np.zeros(velocity.shape[0])
    for b in range(velocity.shape[0]):
        v, w, r = velocity[b, :3], velocity[b, 3:], rotation[b]
        if v[0] == 0.0 and v[1] == 0.0 and v[2] == 0.0 and w[0] == 0.0 and w[1] == 0.0 and w[2] == 0.0:
            continue
        most = 0.0
        for k in range(first[b], first[b + 1]):
            x, y, z = corner[k, 0], corner[k, 1], corner[k, 2]
            a0 = r[0, 0] * x + r[0, 1] * y + r[0, 2] * z
            a1 = r[1, 0] * x + r[1, 1] * y + r[1, 2] * z
            a2 = r[2, 0] * x + r[2, 1] * y + r[2, 2] * z
            s0 = v[0] + w[1] * a2 - w[2] * a1
            s1 = v[1] + w[2] * a0 - w[0] * a2
            s2 = v[2] + w[0] * a1 - w[1] * a0
            square = s0 * s0 + s1 * s1 + s2 * s2
            if not square <= most:
                most = square
        largest[b] = np.sqrt(most)
    return largest
