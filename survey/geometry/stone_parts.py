"""Convex parts of any stone, measured or infill."""

import math
from collections.abc import Iterator, Sequence
from itertools import permutations

import numpy as np

from survey.arrays import Array, Bools
from survey.conventions import ALIKE, MANY, ON_PLANE, ROWS, SAME
from survey.geometry.convex_parts import convex_parts
from survey.geometry.solids import BOX, Solid, area_vector, volume_of
from survey.geometry.watertight import triangulate


def stone_parts(solid: Solid) -> tuple[Solid, ...]:
    """Cut a stone into convex parts; a storey of infill, which has hundreds of faces, by its own grid.

    Returns
    -------
    the parts; the solid itself if it is convex

    Raises
    ------
    GeometryError
        if it has too many parts
    """
    return (grid_parts(solid) if len(solid.faces) > MANY else None) or convex_parts(solid)


Box = tuple[tuple[int, int], ...]

_FAMILY = math.cos(ALIKE)  # planes nearer to parallel are of one family


def grid_parts(solid: Solid) -> tuple[Solid, ...] | None:
    """Cut a solid into hexahedra that fill it without overlap.

    Parameters
    ----------
    solid : closed, with planar faces

    Returns
    -------
    The parts, all under the solid's code; None unless its faces are in three families of planes that nowhere cross
    """
    origin = solid.vertices.mean(axis=0)
    local = Solid(solid.code, solid.vertices - origin, solid.faces)
    families = _families(local)
    if families is None:
        return None
    nodes = _nodes(families)
    filled = _inside(local, nodes)
    best = min((_boxes(filled, order) for order in permutations(range(3))), key=len)
    parts = [_part(solid.code, nodes, box) for box in best]
    whole = volume_of(local)
    if abs(sum(volume_of(piece) for piece in parts) - whole) > SAME * whole:
        return None
    return tuple(Solid(piece.code, piece.vertices + origin, piece.faces) for piece in parts)


def _families(solid: Solid) -> list[Array] | None:
    """Return the planes (n, 4) of each of three families, in order; None unless there are three and none cross."""
    polygons = [solid.vertices[list(face)] for face in solid.faces]
    groups: list[list[Array]] = []
    for polygon in polygons:
        vector = area_vector(polygon)
        plane = np.append(vector, float(vector @ polygon.mean(axis=0))) / np.linalg.norm(vector)
        group = next((group for group in groups if abs(group[0][:3] @ plane[:3]) > _FAMILY), None)
        if group is None:
            groups.append(group := [])
        elif group[0][:3] @ plane[:3] < 0.0:
            plane = -plane
        if not any(np.abs(polygon @ plane[:3] - plane[3]).max() < ON_PLANE for plane in group):
            group.append(plane)
    if len(groups) != 3:
        return None
    families = [_in_order(group, solid.vertices) for group in groups]
    return (
        None
        if any(family is None for family in families)
        else [family for family in families if family is not None]
    )


def _in_order(planes: Sequence[Array], places: Array) -> Array | None:
    """Sort planes along their mean normal; return None if two cross where the solid is."""
    mean = np.sum([plane[:3] for plane in planes], axis=0)
    heights = np.array([(plane[3] - places @ plane[:3]) / (plane[:3] @ mean) for plane in planes])
    order = np.argsort(heights.mean(axis=1))
    if len(planes) < 2 or (np.diff(heights[order], axis=0) <= 0.0).any():
        return None
    return np.array([planes[k] for k in order])


def _nodes(families: Sequence[Array]) -> Array:
    """Return the intersections (n0, n1, n2, 3) of three planes, one of each family [m]."""
    i, j, k = np.meshgrid(*(np.arange(len(family)) for family in families), indexing="ij")
    planes = np.stack([families[0][i], families[1][j], families[2][k]], axis=-2)
    return np.asarray(np.linalg.solve(planes[..., :3], planes[..., 3:])[..., 0], dtype=np.float64)


def _inside(solid: Solid, nodes: Array) -> Bools:
    """Return the cells inside a solid: seen from the middle of one, its faces fill the whole sphere."""
    shape = tuple(n - 1 for n in nodes.shape[:3])
    corners = [nodes[a : a + shape[0], b : b + shape[1], c : c + shape[2]] for a, b, c in np.ndindex(2, 2, 2)]
    middles = np.mean(corners, axis=0, dtype=np.float64).reshape(-1, 3)
    triangles = solid.vertices[triangulate(solid)]
    inside = [
        _angles(middles[start : start + ROWS // len(triangles)], triangles) > 2.0 * np.pi
        for start in range(0, len(middles), ROWS // len(triangles))
    ]
    return np.concatenate(inside).reshape(shape)


def _angles(points: Array, triangles: Array) -> Array:
    """Return the solid angles (n,) of a closed surface seen from points (van Oosterom & Strackee 1983)."""
    a, b, c = (triangles[None, :, k] - points[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(vector, axis=2) for vector in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=2)
    scale = la * lb * lc + (a * b).sum(axis=2) * lc + (b * c).sum(axis=2) * la + (c * a).sum(axis=2) * lb
    out: Array = np.abs(2.0 * np.arctan2(volume, scale).sum(axis=1))
    return out


def _boxes(filled: Bools, order: Sequence[int]) -> list[Box]:
    """Yield boxes of filled cells, each extended from the first one left along one axis after the other."""
    remaining, boxes = filled.copy(), []
    for first in np.argwhere(filled).tolist():
        if not remaining[tuple(first)]:
            continue
        spans = [[p, p + 1] for p in first]
        for axis in order:
            for stop in range(spans[axis][1], remaining.shape[axis]):
                layer = [slice(*span) for span in spans]
                layer[axis] = slice(stop, stop + 1)
                if not remaining[tuple(layer)].all():
                    break
                spans[axis][1] = stop + 1
        remaining[tuple(slice(*span) for span in spans)] = False
        boxes.append(tuple((a, b) for a, b in spans))
    return boxes


def _part(code: str, nodes: Array, box: Box) -> Solid:
    """Return the hexahedron of a box of cells."""
    vertices = np.array([nodes[place] for place in _corners(box)])
    hexahedron = Solid(code, vertices, BOX)
    return (
        hexahedron
        if volume_of(hexahedron) > 0.0
        else Solid(code, vertices, tuple(face[::-1] for face in BOX))
    )


def _corners(box: Box) -> Iterator[tuple[int, int, int]]:
    for i in box[0]:
        for j in box[1]:
            for k in box[2]:
                yield i, j, k
