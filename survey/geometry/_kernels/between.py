"""Numba kernels of joints that hold a third stone: thin slabs and tiles between thicker ones."""

import math

import numpy as np
from numba import njit

from survey.geometry._kernels.adjacency import thickness

__all__ = ["hidden", "thinnest_of"]


@njit(cache=True)
def hidden(pairs, rows, near, solid, planes, thinnest, reach):
    """Which contacts of two solids have a third one in the joint between them, as thin slabs and tiles are.

    Parameters
    ----------
    pairs, rows : as from `touching_faces`
    near : where the solids that each one touches begin, (n + 1,), and these
    solid, planes : as for `touching_faces`
    thinnest : (n,) thickness of each solid, seen square to one of its faces [m]
    reach : how far beside the third solid the middle of the joint may lie [m]
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
    """Whether a place is in a convex solid, or as near as that to it."""
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
    """Least extent (n,) of each solid square to one of its faces."""
    solid_starts = solid[3]
    out = np.full(solid_starts.shape[0] - 1, math.inf)
    for one in range(out.shape[0]):
        for f in range(solid_starts[one], solid_starts[one + 1]):
            if normals[f].any():
                out[one] = min(out[one], thickness(one, solid, normals[f]))
    return out
