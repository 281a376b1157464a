"""Contact pressure that does not depend on how the area of a joint is shared among its contact points.

Where the mesh of one stone overhangs the edge of another, contact points stand for slivers of area; force over area is
large there and means nothing. Taken together with their neighbours they do mean something.
"""

import numpy as np
from scipy.spatial import cKDTree

from mechanics.arrays import Array, Ints

__all__ = ["patch_pressure"]


# radius of a patch, over the mean distance of the contact points of a joint
_REACH = 1.5


def patch_pressure(point: Array, force: Array, area: Array, joint: Ints) -> Array:
    """Pressure (n,) of the patches around contact points: the normal forces in them over their areas [Pa].

    A patch has the radius 1.5 √(A/n) in a joint of area A with n points, so that it shrinks as the mesh gets finer.

    Parameters
    ----------
    point, force, area : (n, 3) [m], (n,) normal forces [N], (n,) tributary areas, positive [m²]
    joint : (n,) the joint of each, from 0
    """
    if not len(joint):
        return np.zeros(0)
    number = np.bincount(joint)
    radius = _REACH * np.sqrt(np.bincount(joint, area) / np.maximum(number, 1))
    first = np.full(len(number), len(joint))
    np.minimum.at(first, joint, np.arange(len(joint)))
    # in units of the radius, and joints far from each other in a fourth direction
    place = np.column_stack([(point - point[first[joint]]) / radius[joint, None], 2.0 * joint])
    near = cKDTree(place).query_pairs(1.0, output_type="ndarray")
    one, other = np.concatenate([near[:, 0], near[:, 1]]), np.concatenate([near[:, 1], near[:, 0]])
    count = len(joint)
    pressure: Array = (force + np.bincount(one, force[other], count)) / (
        area + np.bincount(one, area[other], count)
    )
    return pressure
