"""Numba kernel of the precision of a stone's corners: a dozen products of small arrays for each stone."""

import math

import numpy as np
from numba import njit

__all__ = ["corner_deviations"]


@njit(cache=True)
def corner_deviations(
    outline, hidden, shift, square_to_face, deviations, normal, centroid, axes, covariance, own, others,
    depth_variance, depth, direction,
):  # fmt: skip
    """Standard deviations (2 nv, 3) of visible and hidden corners along x, y, z.

    See ``extrusion._vertex_sigma`` for the model. `shift` (3,) leads from the place on the face to the hidden
    corner behind it, `deviations` (nv,) are of the measured corners, `own` and `others` say how much a hidden
    corner moves with its own and with each other visible one.
    """
    count = len(outline)
    out = np.empty((2 * count, 3))
    for c in range(3):
        spread = axes[0, c] ** 2 + axes[1, c] ** 2
        total = 0.0
        for i in range(count):
            total += deviations[i] ** 2 * spread
        for i in range(count):
            measured = deviations[i] ** 2 * spread
            out[i, c] = measured
            out[count + i, c] = own**2 * measured + others**2 * (total - measured)
    for i in range(2 * count):
        front = i < count
        turned = depth if square_to_face and not front else 0.0
        for k in range(2):
            place = 0.0
            for c in range(3):
                at = outline[i, c] if front else hidden[i - count, c] - shift[c]
                place += (at - centroid[c]) * axes[k, c]
            for c in range(3):
                out[i, c] += covariance[k, k] * (place * normal[c] + turned * axes[k, c]) ** 2
        for c in range(3):
            out[i, c] += covariance[2, 2] * normal[c] ** 2
            if not front:
                out[i, c] += depth_variance * direction[c] ** 2
            out[i, c] = math.sqrt(out[i, c])
    return out
