"""Polygons whose corners make one simple ring, from those that files contain."""

from collections.abc import Sequence

import numpy as np

from survey.arrays import Array
from survey.conventions import VANISHING
from survey.geometry.solids import Solid, area_vector
from survey.geometry.watertight import triangulate

Polygon = tuple[int, ...]


def without_repeats(polygon: Sequence[int]) -> Polygon:
    """Drop corners that repeat the one before, and spikes: a corner between two that are the same."""
    ring = list(polygon)
    k = 0
    while len(ring) > 2 and k < len(ring):
        if ring[k] == ring[k - 1]:
            del ring[k]
            k = max(0, k - 2)
        elif ring[k - 1] == ring[(k + 1) % len(ring)]:
            following = (k + 1) % len(ring)
            for at in sorted((k, following), reverse=True):
                del ring[at]
            k = max(0, k - 2)
        else:
            k += 1
    return tuple(ring)


def is_flat_line(vertices: Array, polygon: Polygon) -> bool:
    """Return whether a polygon has no area: its corners lie on a line."""
    corners = vertices[list(polygon)]
    length = float(np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1).max())
    if not np.isfinite(length):
        return False
    return float(np.linalg.norm(area_vector(corners))) <= VANISHING * length * length


def simple_polygons(vertices: Array, polygon: Polygon) -> list[Polygon]:
    """Cut a polygon that visits a corner twice into simple ones.

    A bridge between an outline and a hole in it, traversed to and fro, makes triangles; a pinched polygon is split at
    the corner that it visits twice.

    Parameters
    ----------
    vertices : (nv, 3) [m]
    polygon : without corners that repeat the one before
    """
    if len(set(polygon)) == len(polygon):
        return [polygon]
    sides = set(zip(polygon, polygon[1:] + polygon[:1], strict=True))
    if any((b, a) in sides for a, b in sides):
        triangles = triangulate(Solid("", vertices, (polygon,))).tolist()
        return [tuple(triangle) for triangle in triangles if len(set(triangle)) == 3]
    seen: dict[int, int] = {}
    for k, corner in enumerate(polygon):
        if corner in seen:
            start = seen[corner]
            parts = (polygon[start:k], polygon[:start] + polygon[k:])
            return [
                polygon for piece in parts if len(piece) > 2 for polygon in simple_polygons(vertices, piece)
            ]
        seen[corner] = k
    return [polygon]
