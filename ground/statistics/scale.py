"""Robust estimates of scale: from medians, then from what lies within a limit of it.

A normal variable has the standard deviation 1.4826 times its median absolute deviation, of which outliers, up to half
of all, change little. What lies within 2.5 standard deviations gives it more precisely: its variance is .9113 of that
of the whole.
"""

import math

import numpy as np
from numpy.typing import NDArray

from ground.statistics.roots import root_of

Array = NDArray[np.float64]

CONSISTENT = 1.4826
"""Standard deviation over median absolute deviation, of a normal distribution [-]."""

OUTLIER = 2.5
"""Standard deviations beyond which a value is an outlier: one normal value in eighty."""


def _variance_within(limit: float) -> float:
    """Return the variance of a standard normal variable of which only values within a limit are taken."""
    density = math.exp(-(limit**2) / 2.0) / math.sqrt(2.0 * math.pi)
    return 1.0 - 2.0 * limit * density / math.erf(limit / math.sqrt(2.0))


WITHIN = _variance_within(OUTLIER)
"""Variance of a standard normal variable within `OUTLIER`, over that of the whole [-]."""


def deviation(values: Array, about: float | None = None) -> float:
    """Return the standard deviation of values (n,) by their median absolute deviation; 0 of none.

    Parameters
    ----------
    values : (n,) of any unit
    about : place from which deviations are counted; None: the median
    """
    if len(values) == 0:
        return 0.0
    middle = float(np.median(values)) if about is None else about
    return CONSISTENT * float(np.median(np.abs(values - middle)))


def spread(values: Array) -> float:
    """Return the standard deviation of values (n,) about 0: by their median, then by those within `OUTLIER` of it."""
    first = deviation(values, 0.0)
    inliers = values[np.abs(values) <= OUTLIER * first]
    return math.sqrt(float((inliers**2).mean()) / WITHIN) if len(inliers) else first


def scatter_beyond(values: Array, measured: Array, share: Array | float = 1.0) -> tuple[float, int]:
    """Return the standard deviation of a scatter beyond a known one, and the number of values that tell it.

    The values have the variances measured + share τ². τ comes from their median, then from those within `OUTLIER`.

    Parameters
    ----------
    values : (n,) departures about 0
    measured : (n,) known variances
    share : (n,) of τ² in the variance of each; 2 of a difference
    """
    size = np.abs(values)
    if len(size) == 0:
        return 0.0, 0
    part = np.broadcast_to(np.asarray(share, dtype=np.float64), size.shape)
    high = float((size**2 / part).max())
    first = root_of(
        lambda one: CONSISTENT * float(np.median(size / np.sqrt(measured + part * one))) - 1.0, high
    )
    inliers = size <= OUTLIER * np.sqrt(measured + part * first)
    count = int(inliers.sum())

    def excess(one: float) -> float:
        """Return how much χ² exceeds its expectation at a variance."""
        return float((size[inliers] ** 2 / (measured[inliers] + part[inliers] * one)).sum()) - WITHIN * count

    return math.sqrt(root_of(excess, high)), count
