"""Free surface of a sample: its height along x, and its slope."""

import numpy as np

from mechanics.arrays import Array

__all__ = ["profile", "slope"]


def profile(centre: Array, radius: Array, places: Array) -> Array:
    """Return the height of the highest point of any disk above each place (n,) on the x axis; nan above none [m].

    >>> profile(np.array([[0.0, 1.0], [2.0, 1.0]]), np.ones(2), np.array([0.0, 1.0, 4.0])).tolist()
    [2.0, 1.0, nan]
    """
    height = np.full(len(places), -np.inf)
    order = np.argsort(places)
    ordered = places[order]
    first = np.searchsorted(ordered, centre[:, 0] - radius)
    last = np.searchsorted(ordered, centre[:, 0] + radius, side="right")
    number = last - first
    disk = np.repeat(np.arange(len(centre)), number)
    place = np.arange(number.sum()) - np.repeat(np.cumsum(number) - number, number) + first[disk]
    away = ordered[place] - centre[disk, 0]
    top = centre[disk, 1] + np.sqrt(np.maximum(radius[disk] ** 2 - away**2, 0.0))
    np.maximum.at(height, order[place], top)
    return np.where(np.isfinite(height), height, np.nan)


def slope(places: Array, height: Array) -> float:
    """Return the slope angle of the straight line that fits a profile, rising along x positive [rad]; nan without two.

    >>> round(float(np.degrees(slope(np.arange(3.0), np.arange(3.0)))), 6)
    45.0
    """
    known = np.isfinite(height)
    if known.sum() < 2:
        return float("nan")
    return float(np.arctan(np.polyfit(places[known], height[known], 1)[0]))
