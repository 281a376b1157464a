"""Reflex edges of a closed polyhedron: edges with more than 180° of stone between their faces."""

from dataclasses import dataclass

import numpy as np

from survey.conventions import VANISHING
from survey.geometry.solids import Solid, highest_corner, planes_of_solid

_WARPS = 4.0  # warps of two faces by which one may seem to stand in front of the other


@dataclass(frozen=True)
class ReflexEdge:
    """A reflex edge of a stone.

    Attributes
    ----------
    corners : numbers of its two corners
    start, stop : (3,) its ends, or those of a piece of it [m]
    first, second : numbers of its two faces
    """

    corners: tuple[int, int]
    start: tuple[float, float, float]
    stop: tuple[float, float, float]
    first: int
    second: int


def flatness(solid: Solid) -> float:
    """Return the height [m] below which corners lie on a plane: 1e-9 of the size, or several times the faces' warp."""
    planes = planes_of_solid(solid)
    warp = max(
        float(np.abs(solid.vertices[list(face)] @ plane[:3] - plane[3]).max())
        for face, plane in zip(solid.faces, planes, strict=True)
    )
    return VANISHING * float(np.linalg.norm(np.ptp(solid.vertices, axis=0))) + _WARPS * warp


def is_convex(solid: Solid, tolerance: float | None = None) -> bool:
    """Return whether no corner lies in front of the plane of a face.

    Parameters
    ----------
    solid : closed
    tolerance : height by which a corner may do so [m]; None: `flatness` of the solid
    """
    tolerance = flatness(solid) if tolerance is None else tolerance
    return highest_corner(solid) <= tolerance


def reflex_edges(solid: Solid) -> tuple[ReflexEdge, ...]:
    """Return the edges with more than 180° of stone, in the order of the faces.

    Parameters
    ----------
    solid : closed, with planar faces
    """
    planes, tolerance = planes_of_solid(solid), flatness(solid)
    owner = {
        edge: k for k, face in enumerate(solid.faces) for edge in zip(face, (*face[1:], face[0]), strict=True)
    }
    edges = []
    for (i, j), k in owner.items():
        neighbour = owner[j, i]
        if i > j:
            continue
        heights = solid.vertices[list(solid.faces[neighbour])] @ planes[k, :3] - planes[k, 3]
        # at the edge the neighbour rises above this face's plane
        edge = solid.vertices[j] - solid.vertices[i]
        rises = float(np.cross(planes[k, :3], planes[neighbour, :3]) @ edge) < 0.0
        if rises and heights.max() > tolerance:
            start, stop = solid.vertices[i].tolist(), solid.vertices[j].tolist()
            edges.append(ReflexEdge((i, j), tuple(start), tuple(stop), k, neighbour))
    return tuple(edges)
