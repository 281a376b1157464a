"""Slow reference of the report of a simplified stone, from the two solids and by other methods."""

import itertools

import numpy as np
from scipy.spatial import ConvexHull, HalfspaceIntersection

from survey.geometry.solids import Solid
from survey.geometry.watertight import triangulate


def random_turn(rng: np.random.Generator) -> np.ndarray:
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return turn * np.sign(np.linalg.det(turn))


def edges_of(solid: Solid) -> list[tuple[int, int]]:
    return sorted({tuple(sorted((f[k - 1], f[k]))) for f in solid.faces for k in range(len(f))})


def distance_to_edges(point: np.ndarray, solid: Solid) -> float:
    """Return the distance by the foot of the perpendicular on each edge, or its ends."""
    best = np.inf
    for a, b in edges_of(solid):
        p, q = solid.vertices[a], solid.vertices[b]
        t = float((point - p) @ (q - p) / ((q - p) @ (q - p)))
        best = min(best, *(np.linalg.norm(p + s * (q - p) - point) for s in (0.0, 1.0)))
        if 0.0 < t < 1.0:
            best = min(best, np.linalg.norm(p + t * (q - p) - point))
    return float(best)


def displacement(old: Solid, new: Solid) -> np.ndarray:
    out = [distance_to_edges(corner, new) for corner in old.vertices]
    for corner in new.vertices:
        nearest = min(range(len(out)), key=lambda i: float(np.linalg.norm(old.vertices[i] - corner)))
        out[nearest] = max(out[nearest], distance_to_edges(corner, old))
    return np.array(out)


def volume(solid: Solid) -> float:
    """Return the sum of signed tetrahedra on the mean of the corners."""
    middle = solid.vertices.mean(axis=0)
    return sum(float(np.linalg.det(solid.vertices[t] - middle)) for t in triangulate(solid)) / 6.0


def planes(solid: Solid) -> list[np.ndarray]:
    out = []
    for face in solid.faces:
        p = solid.vertices[list(face)]
        normal = sum(np.cross(p[k] - p[0], p[k + 1] - p[0]) for k in range(1, len(p) - 1))
        normal = normal / np.linalg.norm(normal)
        out.append(np.append(normal, -normal @ p.mean(axis=0)))
    return out


def common_share(a: Solid, b: Solid) -> float:
    """Return the share of two intersecting convex solids by the hull of the corners of their intersection."""
    middle = np.mean([a.vertices.mean(axis=0), b.vertices.mean(axis=0)], axis=0)
    common = HalfspaceIntersection(
        np.array(
            [
                *planes(Solid("", a.vertices - middle, a.faces)),
                *planes(Solid("", b.vertices - middle, b.faces)),
            ]
        ),
        np.zeros(3),
    )
    both = ConvexHull(common.intersections).volume
    return both / (volume(a) + volume(b) - both)


def worst_angle(solid: Solid) -> float:
    """Return the worst of 180° less the angle between the outward normals of a convex solid's adjacent faces."""
    normals = [plane[:3] for plane in planes(solid)]
    worst = 0.0
    for i, j in itertools.combinations(range(len(solid.faces)), 2):
        if len(set(solid.faces[i]) & set(solid.faces[j])) == 2:
            inside = 180.0 - np.degrees(np.arccos(np.clip(normals[i] @ normals[j], -1.0, 1.0)))
            worst = max(worst, abs(inside - 90.0))
    return worst


def bend(solid: Solid) -> float:
    """Return the largest distance of a corner from the plane of its face, over the solid's size."""
    size = float(np.ptp(solid.vertices, axis=0).max())
    return (
        max(
            float(np.abs(solid.vertices[list(f)] @ p[:3] + p[3]).max())
            for f, p in zip(solid.faces, planes(solid), strict=True)
        )
        / size
    )


def highest(solid: Solid) -> float:
    """Return the largest height of any corner above any face."""
    return max(float((solid.vertices @ p[:3] + p[3]).max()) for p in planes(solid))
