"""Reduction of the measured outline of a face, with bevels and worn corners, to as few corners as are justified.

A dressed face has four sides; further corners come from a bevel, a break, or a point measured half-way along a
side. They are removed one by one, each time by the smaller change of area: either a short side is dropped and
its neighbours are extended until they meet (which restores a bevelled corner), or a corner is dropped. The result
is the stone's own quadrilateral, not a rectangle around it: the wedge of a voussoir and the sloped end of a springer
stay as they were measured. Where the next step would leave a sound corner too far aside, or add more than a worn
corner can have lost, the face keeps its five or more corners: a crossette is not a bevelled stone.
"""

from dataclasses import dataclass

import numpy as np

from survey.arrays import Array, Bools, Ints
from survey.conventions import SOME, TENTH, WEAR
from survey.simplify._kernels.squaring import square

_BOUNDLESS = np.array([np.inf, np.inf, np.inf, np.inf, 0.0])


@dataclass(frozen=True)
class SimplifyBounds:
    """Bounds on the changes of a stone for the sake of a simple shape.

    Attributes
    ----------
    max_shift : largest distance of a sound corner from the new outline [m]
    shift_share : the same as a part of the face's smallest width, or the survey's tolerance if that is more [-]; the
        smaller bound holds
    max_restored : largest distance of a restored corner outside the measured outline, and of a worn corner from the
        new one [m]
    restored_share : the same as a part of the face's smallest width [-]; the smaller bound holds
    least_tolerance : tolerance of a survey that is more precise than this, or of unknown precision [m]
    """

    max_shift: float = WEAR
    shift_share: float = TENTH
    max_restored: float = 0.06
    restored_share: float = SOME
    least_tolerance: float = 0.002


@dataclass(frozen=True)
class SquaredFace:
    """A face reduced to as few corners as are justified.

    Attributes
    ----------
    corners : (m, 2) in the plane of the face, counter-clockwise, convex [m]
    source : (m,) measured corner of each of them; -1: restored where two sides meet
    width : smallest distance between two parallels that enclose the face [m]
    dent : depth of a corner inside the line of its neighbours [m], if too great for the corner to be dropped;
        `corners` are then those of the convex hull. 0: the face is convex, or nearly
    """

    corners: Array
    source: Ints
    width: float
    dent: float


def square_face(flat: Array, worn: Bools, tolerance: float, bounds: SimplifyBounds) -> SquaredFace:
    """Remove the corners of a face that it does not need.

    Distances are those of the measured corners from the sides of the new outline, and of restored corners from
    the measured sides, so that many small steps cannot lead far. A quadrilateral with a corner half-way along a
    side, within the tolerance, is a triangle.

    Parameters
    ----------
    flat : (n, 2) measured corners, a simple polygon, counter-clockwise [m]
    worn : (n,) whether each corner is worn, so that its place is not that of the original corner
    tolerance : of the survey [m]
    bounds : largest displacement of a corner

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
    """Return the quadrilateral (4, 2) of a face without any bounds.

    Of a triangle, a parallelogram on two of its sides: the smallest one around it, with twice its area.
    """
    corners: Array = square(np.ascontiguousarray(flat), np.zeros(len(flat), np.bool_), _BOUNDLESS)[0]
    if len(corners) == 3:
        corners = np.vstack([corners, corners[0] + corners[2] - corners[1]])
    return corners
