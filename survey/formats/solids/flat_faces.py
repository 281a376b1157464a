"""Planar faces of a body, merged from triangles.

In a mesh the planes of a stone are cut into triangles that are an artefact; its faces are the planes. Triangles that
share edges and lie in the plane of the largest of them become one polygon where their common boundary is one loop.
"""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array
from survey.conventions import FLAT, TENTH

Polygon = tuple[int, ...]

_BULGE = FLAT  # warp of a plane polygon rounded to a few digits, over its size
_SAME_PLANE = 1e-5  # distance from a common plane, over the size of the body
_SAME_SIDE = (
    1.0 - TENTH
)  # cosine between normals, a coarse test: those of thin triangles are poor, and heights decide


def rounding(corners: Array, resolution: float) -> float:
    """Return how far rounding to a few digits can lift a corner of a plane polygon out of its plane [m].

    Parameters
    ----------
    corners : (n, 3) [m]
    resolution : of their coordinates [m]
    """
    return _BULGE * float(np.linalg.norm(np.ptp(corners, axis=0))) + resolution


def merge_flat(
    vertices: Array, polygons: Sequence[Polygon], used: NDArray[np.intp], resolution: float
) -> list[Polygon]:
    """Merge triangles that share edges and lie in one plane; other polygons stay as they are.

    Parameters
    ----------
    vertices : (nv, 3) [m]
    polygons : of a closed body, all counter-clockwise seen from outside
    used : indices of their vertices
    resolution : of the coordinates [m]
    """
    triangles = np.array([polygon for polygon in polygons if len(polygon) == 3], dtype=np.intp).reshape(-1, 3)
    large = [polygon for polygon in polygons if len(polygon) != 3]
    if not len(triangles):
        return large
    tolerance = _SAME_PLANE * float(np.linalg.norm(np.ptp(vertices[used], axis=0))) + resolution
    merged: list[Polygon] = []
    for region in _regions(vertices, triangles, tolerance):
        loop = _outline(triangles[region].tolist()) if len(region) > 1 else None
        if loop is None:
            large += [tuple(triangle) for triangle in triangles[region].tolist()]
        else:
            merged.append(loop)
    return _without_straight_corners(vertices, merged, large, tolerance)


def _regions(vertices: Array, triangles: NDArray[np.intp], tolerance: float) -> list[list[int]]:
    """Group triangles that lie in one plane and share edges, the largest first."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    normals /= np.maximum(areas, 1e-300)[:, None]
    owner = {edge: k for k, triangle in enumerate(triangles.tolist()) for edge in _edges(triangle)}
    regions, taken = [], np.zeros(len(triangles), dtype=bool)
    for seed in np.argsort(-areas, kind="stable").tolist():
        if taken[seed]:
            continue
        taken[seed] = True
        region, normal, origin = [seed], normals[seed], a[seed]
        for k in region:
            for p, q in _edges(triangles[k].tolist()):
                neighbour = owner.get((q, p))
                if neighbour is None or taken[neighbour] or normals[neighbour] @ normal < _SAME_SIDE:
                    continue
                if np.abs((vertices[triangles[neighbour]] - origin) @ normal).max() <= tolerance:
                    taken[neighbour] = True
                    region.append(neighbour)
        regions.append(region)
    return regions


def _edges(polygon: Sequence[int]) -> list[tuple[int, int]]:
    return [(polygon[k - 1], polygon[k]) for k in range(len(polygon))]


def _outline(triangles: list[list[int]]) -> Polygon | None:
    """Return the loop around a region; None if there are several, or it touches itself."""
    inside = {edge for triangle in triangles for edge in _edges(triangle)}
    after = {p: q for p, q in inside if (q, p) not in inside}
    if len(after) != sum((q, p) not in inside for p, q in inside):
        return None  # a corner from which two edges leave
    start = min(after)
    loop = [start]
    while (following := after[loop[-1]]) != start:
        loop.append(following)
    return tuple(loop) if len(loop) == len(after) else None


def _without_straight_corners(
    vertices: Array, merged: list[Polygon], polygons: list[Polygon], tolerance: float
) -> list[Polygon]:
    """Drop the corners that only divide an edge between two merged faces."""
    faces_at: dict[int, int] = defaultdict(int)
    for polygon in (*merged, *polygons):
        for i in polygon:
            faces_at[i] += 1
    turns: dict[int, int] = defaultdict(int)  # number of faces that need the corner
    for polygon in polygons:
        for i in polygon:
            turns[i] += 1
    for polygon in merged:
        for i in _corners(vertices, polygon, faces_at, tolerance):
            turns[i] += 1
    out = [tuple(i for i in polygon if turns[i]) for polygon in merged]
    return [*out, *polygons] if all(len(polygon) > 2 for polygon in out) else [*merged, *polygons]


def _corners(vertices: Array, polygon: Polygon, faces_at: dict[int, int], tolerance: float) -> list[int]:
    """Return the corners at which a polygon turns, or more than two faces meet."""
    n = len(polygon)
    fixed = [k for k in range(n) if faces_at[polygon[k]] != 2]
    if not fixed:
        return list(polygon)
    out = []
    for start, stop in zip(fixed, [*fixed[1:], fixed[0] + n], strict=True):
        chain = [polygon[k % n] for k in range(start, stop + 1)]
        line = vertices[chain[-1]] - vertices[chain[0]]
        length = float(np.linalg.norm(line))
        offsets = vertices[chain] - vertices[chain[0]]
        away = np.linalg.norm(np.cross(offsets, line), axis=1)
        straight = length > 0.0 and away.max() <= tolerance * length
        out += chain[:-1] if not straight else chain[:1]
    return out
