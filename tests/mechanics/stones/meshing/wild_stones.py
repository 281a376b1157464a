"""Random convex stones, with their volumes computed otherwise than the program does."""

import itertools

import numpy as np
from scipy.spatial import ConvexHull, HalfspaceIntersection
from scipy.spatial.transform import Rotation

from tests.pipelines.results_by_hand import box


# the planes of a cube's corners: which of the low and high sides of x, y, z meet there
def wild_hexahedron(rng, slender=None):
    """Corners (8, 3) of a hexahedron with planar faces that lean, each by itself, as long as it stays one.

    Its sides differ by up to 1:20, or by `slender`, in one direction or in two.
    """
    low = 0.05 if slender is None else slender
    extent = np.exp(rng.uniform(np.log(low), 0.0, 3)) if slender is None else _slender(rng, slender)
    unit = box((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
    while True:
        normals = np.repeat(np.eye(3), 2, axis=0) * np.tile([-1.0, 1.0], 3)[:, None]
        normals = normals + rng.uniform(0.0, 0.35) * rng.uniform(-1.0, 1.0, (6, 3))
        corners = []
        for place in unit:
            three = [2 * k + int(place[k] > 0) for k in range(3)]
            corners.append(np.linalg.solve(normals[three], np.full(3, 0.5)))
        depth = 0.5 - np.array(corners) @ normals.T
        own = [[2 * k + int(place[k] > 0) for k in range(3)] for place in unit]
        np.put_along_axis(depth, np.array(own), np.inf, axis=1)
        if depth.min() > 0.15:
            break
    turn = Rotation.random(random_state=rng).as_matrix()
    return (np.array(corners) * extent) @ turn.T + rng.uniform(-10.0, 10.0, 3)


def _slender(rng, ratio):
    extent = np.ones(3)
    extent[: rng.integers(1, 3)] = ratio
    return rng.permutation(extent)


def cut_out(half_spaces):
    """Corners and faces, counter-clockwise seen from outside, of the points with n·x ≤ d, rows (n, d); 0 is inside."""
    rows = np.column_stack([half_spaces[:, :3], -half_spaces[:, 3]])
    points = HalfspaceIntersection(rows, np.zeros(3)).intersections
    corners = points[:1]
    for point in points[1:]:  # a corner of four planes is found more than once
        if np.linalg.norm(corners - point, axis=1).min() > 1e-9:
            corners = np.vstack([corners, point])
    faces = []
    for row in half_spaces:
        normal = row[:3] / np.linalg.norm(row[:3])
        on = np.flatnonzero(np.abs(corners @ row[:3] - row[3]) < 1e-9)
        if len(on) < 3:
            continue
        spokes = corners[on] - corners[on].mean(axis=0)
        u = spokes[0] / np.linalg.norm(spokes[0])
        angle = np.arctan2(spokes @ np.cross(normal, u), spokes @ u)
        faces.append(tuple(on[np.argsort(angle)].tolist()))
    used = sorted(set(itertools.chain(*faces)))
    number = {old: new for new, old in enumerate(used)}
    return corners[used], tuple(tuple(number[k] for k in face) for face in faces)


def wild_polyhedron(rng, faces=None):
    """A convex polyhedron of 5 to 14 faces from random planes about a point."""
    while True:
        count = int(rng.integers(5, 15)) if faces is None else faces
        normals = rng.normal(size=(count, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        # bounded, if the normals hold the origin between them
        if (ConvexHull(normals).equations[:, -1] > -0.1).any():
            continue
        stretch = np.exp(rng.uniform(np.log(0.2), 0.0, 3))
        corners, rings = cut_out(np.column_stack([normals / stretch, rng.uniform(0.2, 0.5, count)]))
        if len(rings) >= 5:
            return corners + rng.uniform(-10.0, 10.0, 3), rings


def hull_volume(corners):
    """By qhull [m³]."""
    return float(ConvexHull(corners - corners.mean(axis=0)).volume)
