"""Numba kernel that tells which convex solids lie in each other."""

import math

import numpy as np
from numba import njit

__all__ = ["deepest_overlaps"]


@njit(cache=True)
def deepest_overlaps(pairs, vertices, vertex_starts, planes, plane_starts, least):
    """By how much the solids of each pair (m, 2) would have to part along one of their faces' normals (m,) [m].

    Negative or zero where a face of one parts them. What lies deeper than `least` may still be parted by a plane along
    two edges.
    """
    out = np.empty(pairs.shape[0])
    for m in range(pairs.shape[0]):
        depth = math.inf
        for side in range(2):
            one, two = pairs[m, side], pairs[m, 1 - side]
            for p in range(plane_starts[one], plane_starts[one + 1]):
                low = math.inf
                for v in range(vertex_starts[two], vertex_starts[two + 1]):
                    height = -planes[p, 3]
                    for k in range(3):
                        height += planes[p, k] * vertices[v, k]
                    low = min(low, height)
                depth = min(depth, -low)
                if depth <= least:
                    break
            if depth <= least:
                break
        out[m] = depth
    return out
