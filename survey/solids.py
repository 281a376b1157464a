"""Closed solids with planar faces: what a stone becomes once its hidden half is known."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Solid", "area_vector"]


@dataclass(frozen=True)
class Solid:
    """A closed polyhedron with planar faces.

    Attributes
    ----------
    code : the stone's code in the survey
    vertices : (nv, 3) corner coordinates [m]
    faces : vertex indices of each face, counter-clockwise seen from outside
    """

    code: str
    vertices: NDArray[np.float64]
    faces: tuple[tuple[int, ...], ...]


def area_vector(polygon: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area times normal of a polygon (n, 3) in space, counter-clockwise about it [m²]."""
    corners = polygon - polygon[0]
    out: NDArray[np.float64] = 0.5 * np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    return out
