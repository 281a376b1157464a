"""Numba kernels of joints that hold a third stone: thin slabs and tiles between thicker ones."""

import math

import numpy as np
from numba import njit

from survey.geometry._kernels.adjacency import thickness


@njit(cache=True)
def hidden(pairs, rows, near, solid, planes, thinnest, reach):
    """Find the contacts of two solids that have a third one in the joint, as with thin slabs and tiles.

    Inputs
    ------
    pairs, rows : (m, 2) int64, (m, 8) float64, as from `touching_faces`
    near : (n + 1,) int64, first neighbour of each solid, and (k,) int64, the neighbours
    solid, planes : as for `touching_faces`
    thinnest : (n,) float64, thickness of each solid square to one of its faces [m]
    reach : float, distance beside the third solid within which the middle of the joint may lie [m]

    Outputs
    -------
    hidden : (m,) bool; returned
    """
    starts, touched = near
    out = np.zeros(pairs.shape[0], np.bool_)
    for c in range(pairs.shape[0]):
        for side in range(2):
            for other in touched[starts[pairs[c, side]] : starts[pairs[c, side] + 1]]:
                if other != pairs[c, 1 - side] and thinnest[other] <= rows[c, 1]:
                    out[c] = out[c] or _contains(other, solid, planes[0], rows[c, 2:5], reach)
    return out


@njit(cache=True)
def _contains(one, solid, normals, place, reach):
    """Return whether a place is in a convex solid or within `reach` of it."""
    vertices, corners, face_starts, solid_starts = solid
    for f in range(solid_starts[one], solid_starts[one + 1]):
        corner, outside = vertices[corners[face_starts[f]]], 0.0
        for k in range(3):
            outside += normals[f, k] * (place[k] - corner[k])
        if outside > reach:
            return False
    return True


@njit(cache=True)
def thinnest_of(solid, normals):
    """Compute the least extent of each solid square to one of its faces.

    Inputs
    ------
    solid : vertices, corners, face_starts, solid_starts of `SolidArrays`
    normals : (nf, 3) float64, outward unit normals of its faces [-]

    Outputs
    -------
    extents : (n,) float64 [m]; returned
    """
    solid_starts = solid[3]
    out = np.full(solid_starts.shape[0] - 1, math.inf)
    for one in range(out.shape[0]):
        for f in range(solid_starts[one], solid_starts[one + 1]):
            if normals[f, 0] != 0.0 or normals[f, 1] != 0.0 or normals[f, 2] != 0.0:
                out[one] = min(out[one], thickness(one, solid, normals[f]))
    return out
