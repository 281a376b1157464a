"""Numba kernels of elastic bodies in flight: the rigid part of their motion, and the deformation that rides on it."""

import numpy as np
from numba import njit

__all__ = ["deform", "rigid_part"]


@njit(cache=True)
def rigid_part(start, reference, projector, rotation, node_velocity):  # pragma: no cover - compiled
    """Split the motion of elastic bodies into that of their frames and deformation rates.

    Parameters
    ----------
    start : (nb+1,) first node of each body; bodies without nodes are left out
    reference : (nn, 3) undeformed places, body axes [m]
    projector : (nn, 6, 3) (Rᵀ M R)⁻¹ Rᵀ M, column by column: rigid velocities from nodal ones, body axes
    rotation : (nb, 3, 3) of the frames
    node_velocity : (nn, 3) world axes [m/s]

    Returns
    -------
    motion : (nb, 6) velocities of the frames [m/s, rad/s], world axes
    rate : (nn, 3) what is left, body axes; it has no part in any rigid motion [m/s]
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
def deform(
    start, reference, centre, rotation, node, rate, duration, new_centre, new_rotation, motion
):  # pragma: no cover - compiled
    """Nodes and their velocities (nn, 3) after a flight in which the frames have moved and d has grown at its rate.

    `centre`, `rotation` of the frames before the flight, `new_centre`, `new_rotation` and `motion` (nb, 6) after it;
    `rate` as `rigid_part` gives it.
    """
    place, velocity = np.empty_like(node), np.empty_like(node)
    local, arm = np.empty(3), np.empty(3)
    for b in range(start.shape[0] - 1):
        old, new = rotation[b], new_rotation[b]
        w0, w1, w2 = motion[b, 3], motion[b, 4], motion[b, 5]
        for i in range(start[b], start[b + 1]):
            x, y, z = node[i, 0] - centre[b, 0], node[i, 1] - centre[b, 1], node[i, 2] - centre[b, 2]
            for k in range(3):
                # through d, so that a stone without strain keeps none whatever the rounding of its frame
                d = old[0, k] * x + old[1, k] * y + old[2, k] * z - reference[i, k]
                local[k] = reference[i, k] + (d + duration * rate[i, k])
            for k in range(3):
                place[i, k] = (
                    new_centre[b, k] + new[k, 0] * local[0] + new[k, 1] * local[1] + new[k, 2] * local[2]
                )
                # the spin acts on the undeformed arms, as it was read off them
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
