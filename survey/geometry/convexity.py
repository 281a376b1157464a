"""Where a closed polyhedron is not convex: edges at which its faces meet with more than 180° of stone between them."""

from dataclasses import dataclass

import numpy as np

from survey.geometry.solids import Solid, highest_corner, planes_of_solid

__all__ = ["ReflexEdge", "flatness", "is_convex", "reflex_edges"]


_FLAT = 1e-9  # of its size: corners so little in front of a plane are on it, and edges so shallow are none
_WARPS = 4.0  # times by which two faces that are not quite planes may seem to stand in front of each other


@dataclass(frozen=True)
class ReflexEdge:
    """An edge into which the stone is folded.

    Attributes
    ----------
    corners : numbers of its two corners
    start, stop : (3,) where they are, or where a piece of the edge begins and ends [m]
    first, second : numbers of its two faces
    """

    corners: tuple[int, int]
    start: tuple[float, float, float]
    stop: tuple[float, float, float]
    first: int
    second: int


def flatness(solid: Solid) -> float:
    """Heights below this tell nothing of a solid: 1e-9 of its size, and some times what its faces are warped [m]."""
    planes = planes_of_solid(solid)
    warp = max(
        float(np.abs(solid.vertices[list(face)] @ plane[:3] - plane[3]).max())
        for face, plane in zip(solid.faces, planes, strict=True)
    )
    return _FLAT * float(np.linalg.norm(np.ptp(solid.vertices, axis=0))) + _WARPS * warp


def is_convex(solid: Solid, tolerance: float | None = None) -> bool:
    """Whether no corner lies in front of the plane of a face.

    Parameters
    ----------
    solid : closed
    tolerance : by which a corner may [m]; `flatness` of the solid if None
    """
    tolerance = flatness(solid) if tolerance is None else tolerance
    return highest_corner(solid) <= tolerance


def reflex_edges(solid: Solid) -> tuple[ReflexEdge, ...]:
    """The edges with more than 180° of stone, in the order of the faces.

    Parameters
    ----------
    solid : closed, with planar faces
    """
    planes, tolerance = planes_of_solid(solid), flatness(solid)
    owner = {
        edge: k for k, face in enumerate(solid.faces) for edge in zip(face, (*face[1:], face[0]), strict=True)
    }
    found = []
    for (i, j), k in owner.items():
        other = owner[j, i]
        if i > j:
            continue
        heights = solid.vertices[list(solid.faces[other])] @ planes[k, :3] - planes[k, 3]
        # at the edge the neighbour rises above this face's plane
        edge = solid.vertices[j] - solid.vertices[i]
        rises = float(np.cross(planes[k, :3], planes[other, :3]) @ edge) < 0.0
        if rises and heights.max() > tolerance:
            start, stop = solid.vertices[i].tolist(), solid.vertices[j].tolist()
            found.append(ReflexEdge((i, j), tuple(start), tuple(stop), k, other))
    return tuple(found)
