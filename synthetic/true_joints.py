"""The true joints of a building, where its solids, built without gaps, share faces to the last bits.

They are found slowly and exactly from the true solids alone, by intersecting coplanar faces.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from survey.arrays import Array
from survey.geometry.solids import Solid, area_vector

Point = tuple[float, float]

_COPLANAR = 1e-9  # distance of two faces in one plane, due to rounding [m]
_OPPOSITE = 1e-12  # 1 + cosine of their normals, due to rounding [-]
_SMALLEST = 1e-8  # least shared area, above rounding [m²]


@dataclass(frozen=True)
class TrueJoint:
    """A plane contact surface of two stones.

    Attributes
    ----------
    stones : codes of the two
    faces : index of the face of each in its solid
    area : [m²]
    centroid : (3,) [m]
    normal : (3,) from the second stone to the first [-]
    """

    stones: tuple[str, str]
    faces: tuple[int, int]
    area: float
    centroid: Array
    normal: Array


@dataclass(frozen=True)
class _Faces:
    """Faces of one solid: corners, outward unit normals (nf, 3), offsets (nf,) and its box."""

    polygons: tuple[Array, ...]
    normals: Array
    offsets: Array
    low: Array
    high: Array


def true_joints(solids: Sequence[Solid]) -> tuple[TrueJoint, ...]:
    """Find all faces that solids share.

    Parameters
    ----------
    solids : with convex faces; parts of one stone bear the same code, and share no joint

    Returns
    -------
    in the order of the solids; a pair that shares two faces comes twice
    """
    if not solids:
        return ()
    origin = np.mean([solid.vertices[0] for solid in solids], axis=0)
    faces = [_faces(solid, origin) for solid in solids]
    return tuple(
        TrueJoint((solids[i].code, solids[j].code), (a, b), area, centroid + origin, -faces[i].normals[a])
        for i, j in _near(faces)
        if solids[i].code != solids[j].code
        for a, b, area, centroid in _shared(faces[i], faces[j])
    )


def _faces(solid: Solid, origin: Array) -> _Faces:
    vertices = solid.vertices - origin
    polygons = tuple(vertices[list(face)] for face in solid.faces)
    vectors = np.array([area_vector(polygon) for polygon in polygons])
    normals = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    offsets = np.array([n @ p.mean(axis=0) for n, p in zip(normals, polygons, strict=True)])
    return _Faces(polygons, normals, offsets, vertices.min(axis=0), vertices.max(axis=0))


def _near(faces: Sequence[_Faces]) -> Iterator[tuple[int, int]]:
    """Find pairs i < j whose boxes touch, by a sweep along the longest axis."""
    low = np.array([face.low for face in faces]) - _COPLANAR
    high = np.array([face.high for face in faces]) + _COPLANAR
    axis = int(np.argmax(high.max(axis=0) - low.min(axis=0)))
    order = np.argsort(low[:, axis], kind="stable")
    starts = low[order, axis]
    pairs = []
    for place, i in enumerate(order):
        others = order[place + 1 : int(np.searchsorted(starts, high[i, axis], side="right"))]
        touching = (low[others] <= high[i]).all(axis=1) & (low[i] <= high[others]).all(axis=1)
        pairs += [(min(int(i), int(j)), max(int(i), int(j))) for j in others[touching]]
    yield from sorted(pairs)


def _shared(first: _Faces, second: _Faces) -> Iterator[tuple[int, int, float, Array]]:
    """Find the face of each, area and centroid of every plane piece that two solids share."""
    opposite = first.normals @ second.normals.T <= -1.0 + _OPPOSITE
    coplanar = np.abs(first.offsets[:, None] + second.offsets[None, :]) <= _COPLANAR
    for a, b in np.argwhere(opposite & coplanar):
        normal, polygon = first.normals[a], first.polygons[a]
        u = polygon[1] - polygon[0]
        u = u / np.linalg.norm(u)
        axes = np.array([u, np.cross(normal, u)])
        flat = (polygon - polygon[0]) @ axes.T
        cutter = (second.polygons[b][::-1] - polygon[0]) @ axes.T
        common = _common([(x, y) for x, y in flat.tolist()], [(x, y) for x, y in cutter.tolist()])
        area, x, y = _area_and_centroid(common)
        if area > _SMALLEST:
            yield int(a), int(b), area, polygon[0] + x * axes[0] + y * axes[1]


def _common(polygon: list[Point], cutter: list[Point]) -> list[Point]:
    """Intersect two convex polygons, both counter-clockwise: cut one by each side of the other."""
    for k, (x, y) in enumerate(cutter):
        to_x, to_y = cutter[(k + 1) % len(cutter)]
        heights = [(to_x - x) * (q - y) - (to_y - y) * (p - x) for p, q in polygon]
        points: list[Point] = []
        for i, here in enumerate(polygon):
            before, h, g = polygon[i - 1], heights[i], heights[i - 1]
            if (h > 0.0) != (g > 0.0):
                share = g / (g - h)
                points.append(
                    (before[0] + share * (here[0] - before[0]), before[1] + share * (here[1] - before[1]))
                )
            if h > 0.0:
                points.append(here)
        polygon = points
    return polygon


def _area_and_centroid(polygon: list[Point]) -> tuple[float, float, float]:
    if len(polygon) < 3:
        return 0.0, 0.0, 0.0
    x0, y0 = polygon[0]
    area = x = y = 0.0
    for (ax, ay), (bx, by) in pairwise(polygon[1:]):
        part = 0.5 * ((ax - x0) * (by - y0) - (bx - x0) * (ay - y0))
        area += part
        x += part * (x0 + ax + bx) / 3.0
        y += part * (y0 + ay + by) / 3.0
    return (area, x / area, y / area) if area > 0.0 else (0.0, 0.0, 0.0)
