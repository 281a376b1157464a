"""Slow reference of touching faces: every pair of faces, intersected as the hull of their common points."""

from itertools import combinations

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

from survey.geometry.solids import area_vector


def touching(solids, width=0.04, angle=12.0, overlap=0.02, share=0.03):
    """Return {(first, second): [(area, gap, normal, place) of each two faces]} of convex solids (vertices, faces)."""
    found = {}
    for (i, one), (j, two) in combinations(enumerate(solids), 2):
        contacts = [
            contact
            for first in _polygons(*one)
            for second in _polygons(*two)
            if (contact := _contact(first, second, width, angle, overlap, share)) is not None
            and abs(contact[1])
            <= 0.5 * min(np.ptp(np.asarray(solid[0]) @ contact[2]) for solid in (one, two))
        ]
        if contacts:
            found[i, j] = contacts
    return found


def _polygons(vertices, faces):
    return [np.asarray(vertices)[list(face)] for face in faces]


def _unit(vector):
    return vector / np.linalg.norm(vector)


def _contact(first, second, width, angle, overlap, share):
    down, up = _unit(area_vector(first)), _unit(area_vector(second))
    if down @ -up < np.cos(np.radians(angle)):
        return None
    normal = _unit(up - down)
    axes = np.linalg.svd(normal[None])[2][1:]
    common = _common_points(first @ axes.T, second @ axes.T)
    if len(common) < 3 or np.linalg.matrix_rank(common - common[0], tol=1e-9) < 2:
        return None
    hull = common[ConvexHull(common).vertices]
    triangles = hull[Delaunay(hull).simplices]
    sides = triangles[:, 1:] - triangles[:, :1]
    sizes = np.abs(np.linalg.det(sides)) / 2.0
    middle = sizes @ triangles.mean(axis=1) / sizes.sum()
    smaller = min(np.linalg.norm(area_vector(first)), np.linalg.norm(area_vector(second)))
    # height over the plane through the origin square to the normal, of each face's plane at that place
    place = middle @ axes
    high, low = (
        face_normal @ (polygon.mean(axis=0) - place) / (face_normal @ normal)
        for polygon, face_normal in ((first, down), (second, up))
    )
    if sizes.sum() < share * smaller or not -overlap <= high - low <= width:
        return None
    return sizes.sum(), high - low, normal, place + (high + low) / 2.0 * normal


def _common_points(one, two):
    """Return corners of each convex polygon within the other, and crossings of their sides."""
    points = [p for p in one if _within(p, two)] + [p for p in two if _within(p, one)]
    for a, b in zip(one, np.roll(one, -1, axis=0), strict=True):
        for c, d in zip(two, np.roll(two, -1, axis=0), strict=True):
            matrix = np.column_stack([b - a, c - d])
            if abs(np.linalg.det(matrix)) > 1e-14:
                s, t = np.linalg.solve(matrix, c - a)
                if -1e-12 <= s <= 1 + 1e-12 and -1e-12 <= t <= 1 + 1e-12:
                    points.append(a + s * (b - a))
    return np.array(points).reshape(-1, 2)


def _within(point, polygon):
    sides = np.roll(polygon, -1, axis=0) - polygon
    arms = point - polygon
    turns = sides[:, 0] * arms[:, 1] - sides[:, 1] * arms[:, 0]
    return bool((turns >= -1e-12).all() or (turns <= 1e-12).all())
