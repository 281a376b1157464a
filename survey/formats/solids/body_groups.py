"""Grouping of the polygons of a file into bodies.

Faces that share an edge belong together. Where stones touch along an edge, four faces or more share it, and the
bodies are distinguished by their interiors: each takes up an angle about the edge, which runs from a face of one
direction to the next one of the other. The outer side of every face must be known for this, so the faces of such files
must agree on it; elsewhere it follows from the neighbours.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Iterator

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import SAME
from survey.geometry.solids import area_vector

Polygon = tuple[int, ...]
Edge = tuple[int, int]

_FULL = math.tau


def body_groups(vertices: Array, polygons: list[Polygon]) -> list[list[Polygon]]:
    """Group the polygons by bodies, those of one body all seen from the same side.

    Parameters
    ----------
    vertices : (nv, 3) [m]
    polygons : vertex indices of each

    Raises
    ------
    GeometryError
        if there are edges with one face, or edges whose faces cannot be paired
    """
    owners: dict[Edge, list[int]] = defaultdict(list)
    for k, polygon in enumerate(polygons):
        for a, b in _edges(polygon):
            owners[min(a, b), max(a, b)].append(k)
    single = sum(len(owner) == 1 for owner in owners.values())
    if single:
        raise GeometryError(f"the solid is not closed: {single} edges have one face", remedy="close it")
    if any(len(owner) > 2 for owner in owners.values()):
        if signed_volume(vertices, polygons) < 0.0:
            polygons = [polygon[::-1] for polygon in polygons]
        mates = _mates_by_angle(vertices, polygons, owners)
    else:
        mates = {(edge, k): pair[k == pair[0]] for edge, pair in owners.items() for k in pair}
    turned: dict[int, Polygon] = {}
    groups = []
    for seed in range(len(polygons)):
        if seed not in turned:
            turned[seed] = polygons[seed]
            groups.append([turned[k] for k in _grow(seed, polygons, mates, turned)])
    return groups


def signed_volume(vertices: Array, polygons: list[Polygon]) -> float:
    """Compute the volume of closed bodies, negative if they are inside out [m³]."""
    fans = [
        (polygon[0], polygon[k], polygon[k + 1]) for polygon in polygons for k in range(1, len(polygon) - 1)
    ]
    a, b, c = (vertices[list(ids)] - vertices[polygons[0][0]] for ids in zip(*fans, strict=True))
    return float((a * np.cross(b, c)).sum()) / 6.0


def _edges(polygon: Polygon) -> Iterator[Edge]:
    return zip(polygon, polygon[1:] + polygon[:1], strict=True)


def _grow(
    seed: int, polygons: list[Polygon], mates: dict[tuple[Edge, int], int], turned: dict[int, Polygon]
) -> list[int]:
    """Collect the faces of a body from neighbour to neighbour, turning each like its neighbour."""
    members = [seed]
    for k in members:
        for a, b in _edges(turned[k]):
            neighbour = mates[(min(a, b), max(a, b)), k]
            if neighbour not in turned:
                wrong = (a, b) in set(_edges(polygons[neighbour]))
                turned[neighbour] = polygons[neighbour][::-1] if wrong else polygons[neighbour]
                members.append(neighbour)
    return members


def _mates_by_angle(
    vertices: Array, polygons: list[Polygon], owners: dict[Edge, list[int]]
) -> dict[tuple[Edge, int], int]:
    """Find the other face of the same body at each edge of each face."""
    mates: dict[tuple[Edge, int], int] = {}
    for edge, faces in owners.items():
        forward = [k for k in faces if edge in set(_edges(polygons[k]))]
        backward = [k for k in faces if k not in forward]
        if len(forward) != len(backward):
            raise GeometryError(
                f"an edge has {len(faces)} faces that do not agree on what is outside",
                remedy="give stones that touch an object of their own each",
            )
        pairs = [(forward[0], backward[0])]
        if len(forward) > 1:
            pairs = _pairs(vertices, edge, [polygons[k] for k in forward], [polygons[k] for k in backward])
            pairs = [(forward[i], backward[j]) for i, j in pairs]
        for first, second in pairs:
            mates[edge, first], mates[edge, second] = second, first
    return mates


def _pairs(
    vertices: Array, edge: Edge, forward: list[Polygon], backward: list[Polygon]
) -> list[tuple[int, int]]:
    """Pair each face with the next one of the other direction, through the interior."""
    axis = vertices[edge[1]] - vertices[edge[0]]
    frame = np.linalg.svd(axis[None, :])[2][1:]
    if np.linalg.det([*frame, axis]) < 0.0:
        frame = frame[::-1]
    starts = [_angle(vertices, vertex, axis, frame) for vertex in forward]
    stops = [_angle(vertices, vertex, -axis, frame) for vertex in backward]
    pairs = []
    for i, start in enumerate(starts):
        # the interior lies behind a face seen from outside: decreasing angle about its own direction
        turns = [(start - stop - SAME) % _FULL for stop in stops]
        pairs.append((i, min(range(len(stops)), key=turns.__getitem__)))
    if max(Counter(j for _, j in pairs).values()) > 1:
        raise GeometryError(
            "bodies overlap at an edge", remedy="give stones that touch an object of their own each"
        )
    return pairs


def _angle(vertices: Array, polygon: Polygon, direction: Array, frame: Array) -> float:
    """Return the angle about the edge at which a face leaves it, for its direction along the edge."""
    normal = area_vector(vertices[list(polygon)])
    u, v = frame @ np.cross(normal, direction)
    return math.atan2(float(v), float(u))
