"""Triangles between the centres of disks, and the part of the plane that belongs to each disk."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay

from mechanics.arrays import Array, Bools, Ints

_GAP = 2.0  # free distance between two disks, over the mean radius, from which they have nothing between them [-]


@dataclass(frozen=True)
class Tessellation:
    """Delaunay triangles of the centres, without those across which the sample is open.

    Attributes
    ----------
    triangles : (nt, 3) disks, counter-clockwise
    area : (nt,) [m²]
    share : (nd,) a third of each triangle that a disk belongs to [m²]
    inside : (nd,) the disk has triangles all around; elsewhere its share is a part only
    """

    triangles: Ints
    area: Array
    share: Array
    inside: Bools


def tessellation(centre: Array, radius: Array) -> Tessellation:
    """Divide the sample among its disks.

    Parameters
    ----------
    centre : (nd, 2) [m]
    radius : (nd,) [m]

    Examples
    --------
    In a hexagonal packing each disk has a hexagon of 2√3 r² for itself:

    >>> import numpy as np
    >>> i, j = np.indices((9, 9)).reshape(2, -1)
    >>> found = tessellation(np.column_stack([2 * i + j % 2, np.sqrt(3) * j]), np.ones(81))
    >>> round(float(found.share[40]), 6), bool(found.inside[40]), bool(found.inside[0])
    (3.464102, True, False)
    """
    count = len(centre)
    if count < 3:
        none = np.zeros((0, 3), dtype=np.int64)
        return Tessellation(none, np.zeros(0), np.zeros(count), np.zeros(count, dtype=bool))
    triangles: Ints = Delaunay(centre).simplices.astype(np.int64)
    area = corner_areas(centre, triangles)
    triangles = np.where((area < 0)[:, None], triangles[:, ::-1], triangles)
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1)
    length = np.linalg.norm(centre[sides[..., 0]] - centre[sides[..., 1]], axis=-1)
    free = length - radius[sides].sum(axis=-1)
    filled = (free < _GAP * radius.mean()).all(axis=1)
    triangles, area = triangles[filled], np.abs(area[filled])
    share = np.asarray(np.bincount(triangles.ravel(), np.repeat(area / 3.0, 3), minlength=count), dtype=float)
    return Tessellation(triangles, area, share, _inside(triangles, count))


def corner_areas(centre: Array, triangles: Ints) -> Array:
    """Return the areas (nt,) of triangles, positive if counter-clockwise [m²]."""
    first, second, third = centre[triangles.T]
    along, across = second - first, third - first
    area: Array = 0.5 * (along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0])
    return area


def _inside(triangles: Ints, count: int) -> Bools:
    """Find the disks that are in triangles, and at the end of no side that belongs to one triangle alone."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    low, high = sides.min(axis=1), sides.max(axis=1)
    _, index, times = np.unique(low * count + high, return_index=True, return_counts=True)
    inside = np.zeros(count, dtype=bool)
    inside[triangles.ravel()] = True
    inside[sides[index[times == 1]].ravel()] = False
    return inside
