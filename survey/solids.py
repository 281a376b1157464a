"""Closed solids with planar faces: what a stone becomes once its hidden half is known."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Solid"]


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
