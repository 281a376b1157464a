"""Rigid-block statics by linear programming, for the tests: existence of forces that hold every stone."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_array

from survey.arrays import Array
from survey.geometry.solids import Solid
from tests.survey.largest_ball import largest_ball

FACETS = 8  # of the friction cone; a pyramid inside the cone, so that what it allows Coulomb allows


def side_planes(solid: Solid) -> Array:
    """Return (nf, 4) outward unit normals and offsets."""
    rows = []
    for face in solid.faces:
        p = solid.vertices[list(face)]
        arms = p - p[0]
        normal = np.cross(arms[1:-1], arms[2:]).sum(axis=0)
        normal /= np.linalg.norm(normal)
        rows.append([*normal, normal @ p.mean(axis=0)])
    return np.array(rows)


def near_pairs(solids: Sequence[Solid], reach: float = 1e-6) -> list[tuple[int, int]]:
    low = np.array([s.vertices.min(axis=0) for s in solids]) - reach
    high = np.array([s.vertices.max(axis=0) for s in solids]) + reach
    pairs = combinations(range(len(solids)), 2)
    return [(i, j) for i, j in pairs if (low[i] <= high[j]).all() and (low[j] <= high[i]).all()]


def overlap_depth(a: Solid, b: Solid) -> float:
    """Return the radius of the largest ball inside both; negative if they are apart [m]."""
    centre = a.vertices.mean(axis=0)
    planes = np.vstack([side_planes(a), side_planes(b)])
    planes[:, 3] -= planes[:, :3] @ centre
    radius = largest_ball(planes)[1]
    assert np.isfinite(radius)
    return radius


def contacts(a: Solid, b: Solid, tolerance: float = 1e-7) -> list[tuple[Array, Array]]:
    """Return shared polygons: (normal from b to a, corners (n, 3))."""
    out = []
    for ka, (*na, da) in enumerate(side_planes(a)):
        for kb, (*nb, db) in enumerate(side_planes(b)):
            if np.dot(na, nb) < -1 + 1e-10 and abs(da + db) < tolerance * 10:
                polygon = _common(a, ka, b, kb)
                if polygon is not None:
                    out.append((np.array(nb), polygon))
    return out


def _common(a: Solid, ka: int, b: Solid, kb: int) -> Array | None:
    """Return corners of face ka of a cut by the edges of face kb of b (Sutherland and Hodgman)."""
    polygon = list(a.vertices[list(a.faces[ka])])
    cutter = b.vertices[list(b.faces[kb])]
    outward = side_planes(b)[kb, :3]
    for start, stop in zip(cutter, np.roll(cutter, -1, axis=0), strict=True):
        inward = np.cross(outward, stop - start)
        inward /= np.linalg.norm(inward)
        heights = [float((p - start) @ inward) for p in polygon]
        cut = []
        for k, (p, h) in enumerate(zip(polygon, heights, strict=True)):
            q, g = polygon[k - 1], heights[k - 1]
            if (h > 0) != (g > 0):
                cut.append(q + g / (g - h) * (p - q))
            if h > 0:
                cut.append(p)
        polygon = cut
    if len(polygon) < 3 or area_of(np.array(polygon)) < 1e-4:
        return None
    return np.array(polygon)


def area_of(polygon: Array) -> float:
    arms = polygon - polygon[0]
    return 0.5 * float(np.linalg.norm(np.cross(arms, np.roll(arms, -1, axis=0)).sum(axis=0)))


def contact_area(a: Solid, b: Solid) -> float:
    return sum(area_of(polygon) for _, polygon in contacts(a, b))


def centroid(solid: Solid) -> tuple[float, Array]:
    """Return volume and centroid by tetrahedra from a corner."""
    base, volume, moment = solid.vertices[0], 0.0, np.zeros(3)
    for face in solid.faces:
        p = solid.vertices[list(face)] - base
        for k in range(1, len(p) - 1):
            part = float(p[0] @ np.cross(p[k], p[k + 1])) / 6.0
            volume += part
            moment += part * (p[0] + p[k] + p[k + 1]) / 4.0
    return volume, base + moment / volume


def can_stand(solids: Sequence[Solid], fixed: Sequence[bool], friction: float) -> bool:
    """Return whether contact forces exist that balance the weight of every stone that is not fixed."""
    gravity_centres = [centroid(s) for s in solids]
    rows, columns, values, column = [], [], [], 0
    for i, j in near_pairs(solids):
        for normal, polygon in contacts(solids[i], solids[j]):
            t1 = np.linalg.svd(normal[None])[2][1]
            t2 = np.cross(normal, t1)
            for point in polygon:
                for angle in np.arange(FACETS) * 2 * np.pi / FACETS:
                    force = normal + friction * (np.cos(angle) * t1 + np.sin(angle) * t2)
                    for body, sign in ((i, 1.0), (j, -1.0)):
                        if not fixed[body]:
                            wrench = [*force, *np.cross(point - gravity_centres[body][1], force)]
                            rows += [6 * body + k for k in range(6)]
                            columns += [column] * 6
                            values += [sign * w for w in wrench]
                    column += 1
    load = np.zeros(6 * len(solids))
    load[2::6] = [volume / 0.05 for volume, _ in gravity_centres]  # weights in units of a usual stone's
    free = np.repeat(~np.array(fixed), 6)
    matrix = coo_array((values, (rows, columns)), shape=(6 * len(solids), column)).tocsr()[free]
    found = linprog(np.zeros(column), A_eq=matrix, b_eq=load[free], method="highs-ipm")
    return bool(found.status == 0)
