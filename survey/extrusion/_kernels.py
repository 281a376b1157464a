"""Numba kernel of the precision of a stone's corners: a dozen products of small arrays for each stone."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from survey.arrays import Array


class FacePlane(NamedTuple):
    """Plane of a face and its precision.

    Attributes
    ----------
    normal, centroid : (3,) float64 [-], [m]
    axes : (2, 3) float64 [-]
    covariance : (3, 3) float64 of two tilts [rad] and the height at the centroid [m], diagonal
    """

    normal: Array
    centroid: Array
    axes: Array
    covariance: Array


class HiddenSide(NamedTuple):
    """Hidden corners of a stone, and how they follow from the visible ones.

    Attributes
    ----------
    corners : (nv, 3) float64 [m]
    direction : (3,) float64, unit vector from the face into the wall [-]
    square_to_face : bool, whether the direction follows the normal of the face
    tail : float, size of the hidden face over that of the visible one [-]
    depth, depth_variance : float [m], [m²]; the variance is nan if not known
    """

    corners: Array
    direction: Array
    square_to_face: bool
    tail: float
    depth: float
    depth_variance: float


@njit(cache=True)
def corner_deviations(outline, deviations, plane, hidden):
    """Compute the standard deviations of visible and hidden corners by the model of ``extrusion._vertex_sigma``.

    Inputs
    ------
    outline : (nv, 3) float64, visible corners [m]
    deviations : (nv,) float64, standard deviation of a coordinate of each measured corner [m]
    plane : FacePlane
    hidden : HiddenSide

    Outputs
    -------
    (2 nv, 3) float64 of the visible corners, then of the hidden ones, along x, y, z [m]
    """
    count = len(outline)
    normal, centroid, axes, covariance = plane
    direction, depth = hidden.direction, hidden.depth
    others = (1.0 - hidden.tail) / count  # the tail of a corner also moves with the mean of all of them
    own = hidden.tail + others
    # a slanting tail has the height of the visible place that it lies behind
    shift = 0.0 if hidden.square_to_face else depth
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
        turned = depth if hidden.square_to_face and not front else 0.0
        for k in range(2):
            place = 0.0
            for c in range(3):
                at = outline[i, c] if front else hidden.corners[i - count, c] - shift * direction[c]
                place += (at - centroid[c]) * axes[k, c]
            for c in range(3):
                out[i, c] += covariance[k, k] * (place * normal[c] + turned * axes[k, c]) ** 2
        for c in range(3):
            out[i, c] += covariance[2, 2] * normal[c] ** 2
            if not front:
                out[i, c] += hidden.depth_variance * direction[c] ** 2
            out[i, c] = math.sqrt(out[i, c])
    return out
