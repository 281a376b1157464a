"""Matching faces of neighbours that are meant to lie in one plane, and the common planes of all of them.

Two faces match where they are opposite and the corners of both lie within a tolerance of one plane. Matches share one
plane: a bed that carries many stones does not change from stone to stone. Faces that meet at a seam alone, such as
those of stones diagonal to each other across a corner, join a plane as well if they fit it; otherwise such stones
would overlap by the tolerance.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array
from survey.geometry._kernels.adjacency import face_planes
from survey.geometry.adjacency import SolidArrays
from survey.geometry.solids import Solid, area_vector
from survey.joints.snapping._kernels import matching_faces, near_pairs


@dataclass(frozen=True)
class Match:
    """Faces of two solids that lie in one plane within a tolerance.

    Attributes
    ----------
    faces : numbers of the two faces, counted through all solids
    solids : numbers of the two solids
    spread : distance of their corners from the plane [m]
    area : shared area [m²]; 0 if they meet at a seam alone
    """

    faces: tuple[int, int]
    solids: tuple[int, int]
    spread: float
    area: float


def find_matches(solids: Sequence[Solid], tolerance: float) -> tuple[Match, ...]:
    """Find the matching faces, best matches first and seams last.

    Parameters
    ----------
    solids : closed
    tolerance : distance of the corners of both faces from one plane [m]; faces up to twice as far apart match
    """
    all_ = SolidArrays.gather((solid.vertices, solid.faces) for solid in solids)
    local = np.ascontiguousarray(all_.vertices - all_.vertices.min(axis=0))
    planes = face_planes(local, all_.corners, all_.face_starts)
    starts = all_.solid_starts[:-1]
    boxes = np.column_stack(
        [
            np.minimum.reduceat(planes[2][:, :3], starts, axis=0),
            np.maximum.reduceat(planes[2][:, 3:], starts, axis=0),
        ]
    )
    order, margin = np.argsort(boxes[:, 0], kind="stable"), 2.0 * tolerance
    pairs = np.empty((near_pairs(boxes, order, margin, np.empty((0, 2), np.int64)), 2), np.int64)
    near_pairs(boxes, order, margin, pairs)
    solid = (local, all_.corners, all_.face_starts, all_.solid_starts)
    count = matching_faces(pairs, solid, planes, tolerance, np.empty((0, 2), np.int64), np.empty((0, 2)))
    faces, measures = np.empty((count, 2), np.int64), np.empty((count, 2))
    matching_faces(pairs, solid, planes, tolerance, faces, measures)
    owner = np.searchsorted(all_.solid_starts, faces, side="right") - 1
    spread, area = measures.T
    ranked = np.lexsort((faces[:, 1], faces[:, 0], -area, np.round(spread / tolerance, 3), area <= 0.0))
    return tuple(
        Match(
            (int(faces[k, 0]), int(faces[k, 1])),
            (int(owner[k, 0]), int(owner[k, 1])),
            float(spread[k]),
            max(float(area[k]), 0.0),
        )
        for k in ranked
    )


@dataclass
class _Plane:
    """Faces that are to lie in one plane: their corners, and the normal of each stone's face."""

    corners: Array
    looks: dict[int, Array]

    def joined(self, other: "_Plane") -> "_Plane":
        """Return the plane of the faces of both."""
        return _Plane(np.concatenate([self.corners, other.corners]), {**other.looks, **self.looks})

    def flattens(self, other: "_Plane") -> bool:
        """Return whether both sides of a stone would lie in the plane."""
        both = self.looks.keys() & other.looks.keys()
        return any(float(self.looks[face] @ other.looks[face]) < 0.0 for face in both)


def common_planes(
    corners: Sequence[Array], owner: Sequence[int], matches: Sequence[Match], tolerance: float
) -> tuple[list[int], list[Match]]:
    """Merge matching faces into planes as long as all corners of each plane lie in it.

    Parameters
    ----------
    corners : (n, 3) of each face [m]
    owner : number of each face's solid
    matches : in the order in which they are merged
    tolerance : distance of corners from their plane [m]

    Returns
    -------
    for each face a face that identifies its plane, which is itself if it matches none; and the matches with a shared
    area that could not be merged
    """
    root = list(range(len(corners)))
    planes: dict[int, _Plane] = {}
    apart: list[Match] = []
    for match in matches:
        for face in match.faces:
            if face not in planes and root[face] == face:
                planes[face] = _Plane(corners[face], {owner[face]: area_vector(corners[face])})
        first, two = sorted(_find(root, face) for face in match.faces)
        if first == two:
            continue
        both = planes[first].joined(planes[two])
        if not planes[first].flattens(planes[two]) and _spread(both.corners) <= tolerance:
            root[two] = first
            planes[first] = both
            del planes[two]
        elif match.area > 0.0:
            apart.append(match)
    return [_find(root, face) for face in range(len(corners))], apart


def _find(root: list[int], face: int) -> int:
    while root[face] != face:
        root[face] = root[root[face]]
        face = root[face]
    return face


def _spread(places: Array) -> float:
    """Return half the extent of places across the plane that fits them best [m]."""
    centred = places - places.mean(axis=0)
    normal = np.linalg.eigh(centred.T @ centred)[1][:, 0]
    heights = centred @ normal
    return 0.5 * float(heights.max() - heights.min())
