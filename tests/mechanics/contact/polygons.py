"""Slow, readable geometry of plane polygons, against which the kernels are held."""

import numpy as np


def clip(polygon, origin, normal):
    """What lies below the plane through `origin` of a polygon (n, 3), edge after edge (Sutherland & Hodgman 1974)."""
    kept = []
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        da, db = normal @ (a - origin), normal @ (b - origin)
        if da <= 0:
            kept.append(a)
        if da * db < 0:
            kept.append(a + da / (da - db) * (b - a))
    return np.array(kept).reshape(-1, 3)


def overlap(reference, incident, normal):
    """The part of a polygon (n, 3) that lies above, or below, a convex polygon (m, 3), counter-clockwise about n."""
    result = incident
    for a, b in zip(reference, np.roll(reference, -1, axis=0), strict=True):
        if len(result):
            result = clip(result, a, np.cross(b - a, normal))
    return result


def moments(polygon):
    """∫1, ∫x (2,) and ∫x xᵀ (2, 2) over a convex polygon (n, 2), by the midpoints of triangles: exact to degree 2."""
    area, first, second = 0.0, np.zeros(2), np.zeros((2, 2))
    for k in range(1, len(polygon) - 1):
        a, b, c = polygon[0], polygon[k], polygon[k + 1]
        part = 0.5 * abs(np.linalg.det([b - a, c - a]))
        for x in ((a + b) / 2, (b + c) / 2, (c + a) / 2):
            area += part / 3
            first = first + part / 3 * x
            second = second + part / 3 * np.outer(x, x)
    return area, first, second
