"""Intersection of half-spaces as a convex polyhedron: planes cut one after another from a box.

The corners of all polyhedra cut from one box share one list, and each cut edge gets its new corner once, so the
result stays closed whatever the rounding.
"""

from collections.abc import Iterable

import numpy as np

from survey.arrays import Array
from survey.geometry.solids import BOX, Solid

Place = tuple[float, float, float]
Plane = tuple[float, float, float, float]
Polygon = tuple[int, ...]


def intersection(
    code: str, planes: Iterable[Plane], low: Array, high: Array, tolerance: float
) -> Solid | None:
    """Cut half-spaces n·x ≤ d from a box.

    Parameters
    ----------
    code : of the solid
    planes : (nx, ny, nz, d) of each, n a unit vector
    low, high : (3,) corners of the box [m]
    tolerance : distance within which corners lie on a plane [m]

    Returns
    -------
    Solid of at least four faces, in the order of its planes (those of the box first); None if it is empty
    """
    bounds = (low.tolist(), high.tolist())
    corners: list[Place] = [
        (bounds[k >> 2 & 1][0], bounds[k >> 1 & 1][1], bounds[k & 1][2]) for k in range(8)
    ]
    faces: list[Polygon] = list(BOX)
    for plane in planes:
        faces = _cut(corners, faces, plane, tolerance)
        if len(faces) < 4:
            return None
    used = sorted({i for face in faces for i in face})
    new = {old: k for k, old in enumerate(used)}
    return Solid(
        code, np.array([corners[i] for i in used]), tuple(tuple(new[i] for i in face) for face in faces)
    )


def _cut(corners: list[Place], faces: list[Polygon], plane: Plane, tolerance: float) -> list[Polygon]:
    """Return the faces of the part behind a plane; append new corners to the list."""
    a, b, c, d = plane
    heights = {
        i: a * corners[i][0] + b * corners[i][1] + c * corners[i][2] - d for face in faces for i in face
    }
    side = {i: 0 if abs(h) <= tolerance else 1 if h > 0.0 else -1 for i, h in heights.items()}
    if max(side.values()) <= 0:
        return faces
    if min(side.values()) >= 0:
        return []
    cut: dict[tuple[int, int], int] = {}
    after: dict[int, int] = {}
    pieces = []
    for face in faces:
        polygon = _behind(corners, face, heights, side, cut)
        if len(polygon) > 2 and any(side.get(i, 0) < 0 for i in polygon):
            pieces.append(tuple(polygon))
            edges = zip(polygon, (*polygon[1:], polygon[0]), strict=True)
            after.update({j: i for i, j in edges if side.get(i, 0) == 0 and side.get(j, 0) == 0})
    lid = _loop(after)
    return [*pieces, lid] if len(lid) > 2 else pieces


def _behind(
    corners: list[Place],
    face: Polygon,
    heights: dict[int, float],
    side: dict[int, int],
    cut: dict[tuple[int, int], int],
) -> list[int]:
    """Return the part of a face behind the plane."""
    polygon = []
    for i, j in zip(face, (*face[1:], face[0]), strict=True):
        if side[i] <= 0:
            polygon.append(i)
        if side[i] * side[j] < 0:
            edge = (i, j) if i < j else (j, i)
            if edge not in cut:
                cut[edge] = len(corners)
                p, q = corners[edge[0]], corners[edge[1]]
                t = heights[edge[0]] / (heights[edge[0]] - heights[edge[1]])
                corners.append((p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), p[2] + t * (q[2] - p[2])))
            polygon.append(cut[edge])
    return polygon


def _loop(after: dict[int, int]) -> Polygon:
    """Return the face that closes the cut."""
    if not after:
        return ()
    start = min(after)
    loop = [start]
    while (following := after.get(loop[-1], start)) != start and len(loop) <= len(after):
        loop.append(following)
    return tuple(loop)
