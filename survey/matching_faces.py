"""Faces of neighbours that are meant to lie in one plane: which match, and which planes all of them are.

Two faces match where they look at each other and the corners of both lie within a tolerance of one plane. What is
matched is one plane for all: a bed on which many stones stand is not stone by stone another. Faces that meet at a
seam alone, such as those of stones that stand across a corner from each other, join a plane as well if it can be
theirs too; else such stones would be a tolerance deep in each other.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from survey._kernels_adjacency import face_planes
from survey._kernels_matching import matching_faces, near_pairs
from survey.adjacency import Polyhedra
from survey.solids import Solid

__all__ = ["Match", "common_planes", "find_matches"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Match:
    """Faces of two solids that lie in one plane but for a tolerance.

    Attributes
    ----------
    faces : numbers of the two, counted through all solids
    solids : numbers of the two
    area : that they share [m²]; 0 if they meet at a seam alone
    """

    faces: tuple[int, int]
    solids: tuple[int, int]
    area: float


def find_matches(solids: Sequence[Solid], tolerance: float) -> tuple[Match, ...]:
    """Find the faces that match, the largest shared areas first.

    Parameters
    ----------
    solids : closed
    tolerance : within which the corners of both faces lie in one plane [m]
    """
    all_ = Polyhedra.gather((one.vertices, one.faces) for one in solids)
    local = np.ascontiguousarray(all_.vertices - all_.vertices.min(axis=0))
    planes = face_planes(local, all_.corners, all_.face_starts)
    starts = all_.solid_starts[:-1]
    boxes = np.column_stack(
        [
            np.minimum.reduceat(planes[2][:, :3], starts, axis=0),
            np.maximum.reduceat(planes[2][:, 3:], starts, axis=0),
        ]
    )
    order = np.argsort(boxes[:, 0], kind="stable")
    pairs = np.empty((near_pairs(boxes, order, tolerance, np.empty((0, 2), np.int64)), 2), np.int64)
    near_pairs(boxes, order, tolerance, pairs)
    solid = (local, all_.corners, all_.face_starts, all_.solid_starts)
    count = matching_faces(pairs, solid, planes, tolerance, np.empty((0, 2), np.int64), np.empty(0))
    faces, areas = np.empty((count, 2), np.int64), np.empty(count)
    matching_faces(pairs, solid, planes, tolerance, faces, areas)
    owner = np.searchsorted(all_.solid_starts, faces, side="right") - 1
    order = np.lexsort((faces[:, 1], faces[:, 0], -areas))
    return tuple(
        Match(
            (int(faces[k, 0]), int(faces[k, 1])),
            (int(owner[k, 0]), int(owner[k, 1])),
            max(float(areas[k]), 0.0),
        )
        for k in order
    )


def common_planes(
    corners: Sequence[Array], matches: Sequence[Match], tolerance: float
) -> tuple[list[int], list[Match]]:
    """Join matching faces to planes, as long as the corners of all of a plane lie in it.

    Parameters
    ----------
    corners : (n, 3) of each face [m]
    matches : in the order in which they are to be joined
    tolerance : within which corners lie in a plane [m]

    Returns
    -------
    for each face a face by which its plane is known: itself if it matches none; and the matches with a shared area
    that could not be joined
    """
    root = list(range(len(corners)))
    members: dict[int, Array] = {}
    apart: list[Match] = []
    for match in matches:
        one, two = (_find(root, face) for face in match.faces)
        if one == two:
            continue
        both = np.concatenate([members.get(one, corners[one]), members.get(two, corners[two])])
        if _spread(both) <= tolerance:
            first, second = min(one, two), max(one, two)
            root[second] = first
            members[first] = both
            members.pop(second, None)
        elif match.area > 0.0:
            apart.append(match)
    return [_find(root, face) for face in range(len(corners))], apart


def _find(root: list[int], face: int) -> int:
    while root[face] != face:
        root[face] = root[root[face]]
        face = root[face]
    return face


def _spread(places: Array) -> float:
    """Largest distance of places from the plane that fits them best."""
    centred = places - places.mean(axis=0)
    normal = np.linalg.eigh(centred.T @ centred)[1][:, 0]
    heights = centred @ normal
    return 0.5 * float(heights.max() - heights.min())
