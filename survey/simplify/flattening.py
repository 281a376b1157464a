"""Flattening of imported solids: faces planar to the last digit, and one face per plane.

Meshes cut a planar face in two, or into triangles, and coordinates rounded to a millimetre bend it. Faces that share
an edge and lie in one plane, within a tolerance, are merged here. A corner of three faces is put at the intersection
of their planes; corners of only one or two planes are dropped.

A warped polygon, whose corners are in no plane, was folded along diagonals when it was read. Where three such polygons
meet in every corner, the stone gets one plane for each of them: the mean plane of its corners, the same for both stones
that share it.
"""

from collections import Counter, defaultdict
from collections.abc import Container
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array
from survey.conventions import EPSILON, FLAT, TENTH
from survey.geometry.convexity import is_convex
from survey.geometry.solids import Solid
from survey.simplify.blockiness import face_vectors, from_edges

Face = tuple[int, ...]

_WARP = TENTH  # of a stone's width: largest displacement of a corner that makes its warped faces plane
_SAME_SIDE = 1.0 - TENTH  # least cosine between normals, which are poor in thin triangles: heights decide
_SHALLOWEST = FLAT  # determinant of three unit normals below which their intersection is undetermined


@dataclass(frozen=True)
class FlatSolid:
    """A solid whose faces are planar.

    Attributes
    ----------
    solid : with one face for each plane
    moved : (nv,) distance of each corner of the old solid from the nearest edge of the new one; of a corner in
        the middle of a plane, from that plane [m]
    """

    solid: Solid
    moved: Array


def flatten(solid: Solid, tolerance: float) -> FlatSolid | None:
    """Flatten the faces of a solid and merge those in one plane.

    Parameters
    ----------
    solid : closed, seen from outside, near the origin
    tolerance : largest distance of a corner from the plane of its face, and its largest displacement [m]

    Returns
    -------
    FlatSolid; None if no such solid is within the tolerance, a face has a hole, or more than three planes meet
    in one corner
    """
    vectors = face_vectors(solid)
    return _with_planes(solid, vectors, _plane_groups(solid, vectors, tolerance), tolerance)


def unfold(solid: Solid) -> FlatSolid | None:
    """Make the folded faces of a stone plane, so that it is convex; its corners move by a tenth of its width at most.

    Parameters
    ----------
    solid : closed, seen from outside, near the origin

    Returns
    -------
    FlatSolid; None if no faces are folded, not every corner has three planes, or its corners would move farther
    """
    vectors = face_vectors(solid)
    groups = _folded_groups(solid, vectors)
    if len(groups) == len(solid.faces):
        return None
    normals = np.array([vectors[group].sum(axis=0) for group in groups])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    width = float(np.ptp(solid.vertices @ normals.T, axis=0).min())
    flat = _with_planes(solid, vectors, groups, _WARP * width)
    # a curved face has corners that only divide its edge, and would lose them
    kept = flat is not None and len(flat.solid.vertices) == len({i for face in solid.faces for i in face})
    return flat if flat is not None and kept and is_convex(flat.solid) else None


def _with_planes(solid: Solid, vectors: Array, groups: list[list[int]], tolerance: float) -> FlatSolid | None:
    """Give each group of faces one plane; None if corners would move by more than the tolerance [m]."""
    around: dict[int, list[int]] = defaultdict(list)
    for number, group in enumerate(groups):
        for i in sorted({i for face in group for i in solid.faces[face]}):
            around[i].append(number)
    corners = [i for i in sorted(around) if len(around[i]) > 2]
    loops = [_outline([solid.faces[face] for face in group]) for group in groups]
    if not corners or any(len(around[i]) > 3 for i in corners):
        return None
    place = {i: k for k, i in enumerate(corners)}
    faces = [tuple(place[i] for i in loop if i in place) for loop in loops if loop is not None]
    if len(faces) < len(groups) or min(len(face) for face in faces) < 3:
        return None
    planes = np.array([_plane(solid, vectors, group, place) for group in groups])
    vertices = _crossings(solid.vertices[corners], planes, [around[i] for i in corners])
    if vertices is None or np.linalg.norm(vertices - solid.vertices[corners], axis=1).max() > tolerance:
        return None
    flat = Solid(solid.code, vertices, tuple(faces))
    moved = from_edges(solid.vertices, flat)
    for i in range(len(moved)):
        if len(around[i]) == 1:
            (plane,) = planes[around[i]]
            moved[i] = abs(solid.vertices[i] @ plane[:3] - plane[3])
        elif not around[i]:  # a corner of no face
            moved[i] = 0.0
    return FlatSolid(flat, moved) if moved.max() <= tolerance else None


def _plane_groups(solid: Solid, vectors: Array, tolerance: float) -> list[list[int]]:
    """Group faces that share edges and lie in one plane, that of the largest of them."""
    polygons = [solid.vertices[list(face)] for face in solid.faces]
    areas = np.linalg.norm(vectors, axis=1)
    normals = vectors / np.maximum(areas, 1e-300)[:, None]
    owner = {edge: k for k, face in enumerate(solid.faces) for edge in _edges(face)}
    groups: list[list[int]] = []
    taken = [False] * len(polygons)
    for seed in np.argsort(-areas, kind="stable").tolist():
        if taken[seed]:
            continue
        taken[seed], group = True, [seed]
        normal, origin = normals[seed], polygons[seed].mean(axis=0)
        for k in group:
            for p, q in _edges(solid.faces[k]):
                neighbour = owner.get((q, p), seed)
                if taken[neighbour] or (normals[neighbour] @ normal < _SAME_SIDE and areas[neighbour] > 0.0):
                    continue
                if np.abs((polygons[neighbour] - origin) @ normal).max() <= tolerance:
                    taken[neighbour] = True
                    group.append(neighbour)
        groups.append(group)
    return groups


def _folded_groups(solid: Solid, vectors: Array) -> list[list[int]]:
    """Group faces across folds: shallow edges, at both ends of which more than three faces meet."""
    count = Counter(i for face in solid.faces for i in face)
    normals = vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-300)[:, None]
    owner = {edge: k for k, face in enumerate(solid.faces) for edge in _edges(face)}
    group = list(range(len(solid.faces)))
    for (p, q), k in owner.items():
        neighbour = owner.get((q, p), k)
        if min(count[p], count[q]) > 3 and normals[k] @ normals[neighbour] > _SAME_SIDE:
            old, new = group[neighbour], group[k]
            group = [new if number == old else number for number in group]
    return [[k for k, own in enumerate(group) if own == number] for number in dict.fromkeys(group)]


def _edges(face: Face) -> list[tuple[int, int]]:
    return [(face[k - 1], face[k]) for k in range(len(face))]


def _outline(faces: list[Face]) -> Face | None:
    """Return the one loop around faces that share edges; None if there are several, or it touches itself."""
    if len(faces) == 1:
        return faces[0]
    inside = {edge for face in faces for edge in _edges(face)}
    outer = [(p, q) for p, q in inside if (q, p) not in inside]
    after = dict(outer)
    if len(after) != len(outer) or not outer:
        return None
    start = min(after)
    loop = [start]
    while (following := after.get(loop[-1], start)) != start and len(loop) <= len(after):
        loop.append(following)
    return tuple(loop) if len(loop) == len(after) else None


def _plane(solid: Solid, vectors: Array, group: list[int], corners: Container[int]) -> Array:
    """Return the mean plane (4,) of a group's faces: unit normal, and the mean offset of their corners."""
    vector = vectors[group].sum(axis=0)
    normal = vector / max(float(np.linalg.norm(vector)), 1e-300)
    own = sorted({i for k in group for i in solid.faces[k] if i in corners})
    return np.append(normal, float((solid.vertices[own] @ normal).mean()) if own else 0.0)


def _crossings(corners: Array, planes: Array, around: list[list[int]]) -> Array | None:
    """Return the intersections (n, 3) of the three planes around each corner; a corner on all of them stays."""
    three = planes[np.array(around)]
    heights = np.einsum("nki,ni->nk", three[:, :, :3], corners) - three[:, :, 3]
    if np.abs(np.linalg.det(three[:, :, :3])).min() < _SHALLOWEST:
        return None
    moved = corners - np.linalg.solve(three[:, :, :3], heights[:, :, None])[:, :, 0]
    on_planes = np.abs(heights).max(axis=1) <= EPSILON * float(np.ptp(corners, axis=0).max())
    return np.where(on_planes[:, None], corners, moved)
