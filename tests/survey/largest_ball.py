"""Convex bodies given by planes (n, 4), n·x ≤ d, by linear programming and qhull."""

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection

from survey.arrays import Array


def largest_ball(planes: Array) -> tuple[Array, float]:
    """Return centre and radius of the largest ball within planes, at most 1 m; a negative radius if there is none."""
    found = linprog(
        [0, 0, 0, -1],
        A_ub=np.column_stack([planes[:, :3], np.ones(len(planes))]),
        b_ub=planes[:, 3],
        bounds=[(None, None)] * 3 + [(None, 1.0)],
    )
    return (found.x[:3], float(found.x[3])) if found.status == 0 else (np.zeros(3), -np.inf)


def volume_within(planes: Array, least: float) -> float:
    """Return the volume between planes; 0 if no ball of radius `least` fits."""
    centre, radius = largest_ball(planes)
    if radius < least:
        return 0.0
    halves = np.column_stack([planes[:, :3], -planes[:, 3]])
    return float(ConvexHull(HalfspaceIntersection(halves, centre).intersections).volume)
