"""Contact pressure independent of the division of a joint's area among its contact points.

Where the mesh of one stone overhangs the edge of another, contact points stand for slivers of area, and force over area
is large without meaning. The mean over a contact point and its neighbours is meaningful.
"""

import numpy as np
from scipy.spatial import cKDTree

from mechanics.arrays import Array, Ints

REACH = 1.5
"""Radius of a patch over the mean distance of the contact points of a joint [-]."""


def patch_pressure(point: Array, force: Array, area: Array, joint: Ints) -> Array:
    """Return the pressure (n,) of the patches around contact points: their normal forces over their areas [Pa].

    A patch has the radius 1.5 √(A/n) in a joint of area A with n points, so that it shrinks as the mesh gets finer.

    Parameters
    ----------
    point, force, area : (n, 3) [m], (n,) normal forces [N], (n,) tributary areas, positive [m²]
    joint : (n,) the joint of each, from 0
    """
    if not len(joint):
        return np.zeros(0)
    number = np.bincount(joint)
    radius = REACH * np.sqrt(np.bincount(joint, area) / np.maximum(number, 1))
    first = np.full(len(number), len(joint))
    np.minimum.at(first, joint, np.arange(len(joint)))
    # in units of the radius; a fourth coordinate keeps joints apart
    place = np.column_stack([(point - point[first[joint]]) / radius[joint, None], 2.0 * joint])
    pairs = cKDTree(place).query_pairs(1.0, output_type="ndarray")
    source, target = np.concatenate([pairs[:, 0], pairs[:, 1]]), np.concatenate([pairs[:, 1], pairs[:, 0]])
    count = len(joint)
    pressure: Array = (force + np.bincount(source, force[target], count)) / (
        area + np.bincount(source, area[target], count)
    )
    return pressure
