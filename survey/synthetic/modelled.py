"""Simulated modelling of stones that can be seen on several sides, as closed solids between measured planes."""

from collections.abc import Iterable
from random import Random

import numpy as np

from survey.geometry.half_spaces import intersection
from survey.geometry.solids import Solid, planes_of_solid
from survey.synthetic.measure import HALF_JOINT, SIGMA

__all__ = ["modelled_solid"]


_TILT = 0.003  # standard deviation of each tilt of a measured plane: SIGMA over half a stone's width [rad]
_BEYOND = 0.1  # room around a stone for its measured planes [m]
_ROUNDING = 1e-9  # distance of corners that lie on one plane [m]


def modelled_solid(solid: Solid, joints: Iterable[int], rng: Random) -> Solid:
    """Measure the planes of a convex stone and cut its solid out of them.

    Parameters
    ----------
    solid : the true stone
    joints : faces in contact with other stones, measured half a joint inside
    rng : random numbers

    Returns
    -------
    the measured solid, with plane faces
    """
    touched, middle = set(joints), solid.vertices.mean(axis=0)
    planes = []
    for k, normal in enumerate(planes_of_solid(solid)[:, :3]):
        centre = solid.vertices[list(solid.faces[k])].mean(axis=0)
        tilted = normal + np.cross(normal, [rng.gauss(0.0, _TILT) for _ in range(3)])
        tilted /= np.linalg.norm(tilted)
        half = rng.uniform(*HALF_JOINT) if k in touched else 0.0
        at = float(tilted @ (centre - middle)) - half + rng.gauss(0.0, SIGMA)
        planes.append((*tilted.tolist(), at))
    low, high = solid.vertices.min(axis=0) - middle - _BEYOND, solid.vertices.max(axis=0) - middle + _BEYOND
    cut = intersection(solid.code, planes, low, high, _ROUNDING)
    assert cut is not None
    return Solid(solid.code, cut.vertices + middle, cut.faces)
