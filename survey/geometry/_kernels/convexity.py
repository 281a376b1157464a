"""Numba kernels of the overlap of convex solids, and of the convexity of solids."""

import math

import numpy as np
from numba import njit

from survey.geometry._kernels.vectors import height_over


@njit(cache=True)
def deepest_overlaps(pairs, vertices, vertex_starts, planes, plane_starts, least):
    """Compute the depth of overlap of pairs of convex solids along their faces' normals.

    Negative or zero where a face of one separates them. A pair deeper than `least` may still be separated by a plane
    along two edges.

    Inputs
    ------
    pairs : (m, 2) int64, solids
    vertices, vertex_starts : (nv, 3) float64 [m], (n + 1,) int64
    planes, plane_starts : (np, 4) float64, n·x = d, (n + 1,) int64
    least : float, depth below which the search stops [m]

    Outputs
    -------
    depths : (m,) float64 [m]; returned
    """
    out = np.empty(pairs.shape[0])
    for m in range(pairs.shape[0]):
        depth = math.inf
        for side in range(2):
            one, two = pairs[m, side], pairs[m, 1 - side]
            for p in range(plane_starts[one], plane_starts[one + 1]):
                low = math.inf
                for v in range(vertex_starts[two], vertex_starts[two + 1]):
                    low = min(low, height_over(planes[p], planes[p, 3], vertices[v]))
                depth = min(depth, -low)
                if depth <= least:
                    break
            if depth <= least:
                break
        out[m] = depth
    return out


@njit(cache=True)
def highest_corners(vertices, corners, face_starts, solid_starts, normals, offsets):
    """Compute the greatest height of a corner above a face of its solid, and the solid's extent.

    Inputs
    ------
    vertices, corners, face_starts, solid_starts : as in `SolidArrays`
    normals, offsets : (nf, 3) float64 unit [-], (nf,) float64 [m]

    Outputs
    -------
    height, extent : (n,) float64 each [m]; returned
    """
    count = solid_starts.shape[0] - 1
    height, extent = np.zeros(count), np.zeros(count)
    for one in range(count):
        first, last = face_starts[solid_starts[one]], face_starts[solid_starts[one + 1]]
        for k in range(3):
            low, high = math.inf, -math.inf
            for c in range(first, last):
                low, high = min(low, vertices[corners[c], k]), max(high, vertices[corners[c], k])
            extent[one] = max(extent[one], high - low)
        for f in range(solid_starts[one], solid_starts[one + 1]):
            for c in range(first, last):
                height[one] = max(height[one], height_over(normals[f], offsets[f], vertices[corners[c]]))
    return height, extent
