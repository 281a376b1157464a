"""Sampling plans: points in standard normal space that follow from a seed, whoever takes the samples."""

import numpy as np
from scipy.stats import norm, qmc

from mechanics.arrays import Array


def monte_carlo(count: int, dimension: int, seed: int, stage: int = 0) -> Array:
    """Return independent points (count, dimension); each follows from the seed, the stage and its number alone.

    >>> bool((monte_carlo(5, 2, 1)[:3] == monte_carlo(3, 2, 1)).all())
    True
    """
    points = np.empty((count, dimension))
    for number in range(count):
        points[number] = np.random.default_rng([seed, stage, number]).standard_normal(dimension)
    return points


def latin_hypercube(count: int, dimension: int, seed: int) -> Array:
    """Return points (count, dimension) of which each unknown has one in each of `count` equally probable intervals."""
    if dimension == 0:
        return np.zeros((count, 0))
    plan = qmc.LatinHypercube(dimension, rng=np.random.default_rng([seed, 1]))
    points: Array = norm.ppf(plan.random(count))
    return points
