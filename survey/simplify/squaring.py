"""From the measured outline of a face, bevels and worn corners included, to as few corners as are honest.

A dressed face has four sides; further corners come from a bevel, a break, or a point measured half-way along a
side. They are taken out one by one, each time by the smaller change of area: either a short side is dropped and
its neighbours are prolonged until they meet (which restores a bevelled corner), or a corner is dropped. What
remains is the stone's own quadrilateral, not a rectangle around it: the wedge of a voussoir and the sloped end of
a springer stay as they were measured. Where the next step would leave a sound corner too far aside, or add more
than a worn corner can have lost, the face keeps its five corners or more: a crossette is no bevelled stone.
"""

from dataclasses import dataclass

import numpy as np

from survey.arrays import Array, Bools, Ints
from survey.simplify._kernels.squaring import square

__all__ = ["SimplifyBounds", "SquaredFace", "nearest_quadrilateral", "square_face"]


_BOUNDLESS = np.array([np.inf, np.inf, np.inf, np.inf, 0.0])


@dataclass(frozen=True)
class SimplifyBounds:
    """How far a stone may be changed for the sake of a simple shape.

    Attributes
    ----------
    max_shift : farthest that a sound corner may be left from the new outline [m]
    shift_share : the same as a part of the face's smallest width, or the survey's tolerance if that is more [-]; the
        smaller bound holds
    max_restored : farthest that a restored corner may stand out of the measured outline, and that a worn corner
        may be left from the new one [m]
    restored_share : the same as a part of the face's smallest width [-]; the smaller bound holds
    least_tolerance : tolerance of a survey that is more precise than that, or of unknown precision [m]
    """

    max_shift: float = 0.03
    shift_share: float = 0.1
    max_restored: float = 0.06
    restored_share: float = 0.25
    least_tolerance: float = 0.002


@dataclass(frozen=True)
class SquaredFace:
    """A face with as few corners as are honest.

    Attributes
    ----------
    corners : (m, 2) in the plane of the face, counter-clockwise, convex [m]
    source : (m,) which measured corner each of them is; -1: restored where two sides meet
    width : smallest distance between two parallels that enclose the face [m]
    dent : how deep a corner lies inside the line of its neighbours [m], if that is too deep for it to be left out;
        `corners` are then those that stand out. 0: the face is convex, or nearly
    """

    corners: Array
    source: Ints
    width: float
    dent: float


def square_face(flat: Array, worn: Bools, tolerance: float, bounds: SimplifyBounds) -> SquaredFace:
    """Take out the corners of a face that it does not need.

    Distances are those of the measured corners from the sides of the new outline, and of restored corners from
    the measured sides, so that many small steps cannot lead far. A quadrilateral with a corner half-way along a
    side, within the tolerance, is a triangle.

    Parameters
    ----------
    flat : (n, 2) measured corners, a simple polygon, counter-clockwise [m]
    worn : (n,) whether each corner is worn, so that its place is not that of the sound stone's corner
    tolerance : of the survey [m]
    bounds : how far a corner may be moved

    Returns
    -------
    SquaredFace that begins with the corner nearest to the first measured one
    """
    limits = np.array(
        [bounds.max_shift, bounds.shift_share, bounds.max_restored, bounds.restored_share, tolerance]
    )
    corners, source, width, dent = square(np.ascontiguousarray(flat), worn, limits)
    return SquaredFace(corners, source, width, dent)


def nearest_quadrilateral(flat: Array) -> Array:
    """The quadrilateral (4, 2) that a face would become without any bounds.

    Of a triangle, a parallelogram on two of its sides: the smallest around it, twice as large.
    """
    corners: Array = square(np.ascontiguousarray(flat), np.zeros(len(flat), np.bool_), _BOUNDLESS)[0]
    if len(corners) == 3:
        corners = np.vstack([corners, corners[0] + corners[2] - corners[1]])
    return corners
