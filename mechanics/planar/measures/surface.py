"""Free surface of a sample: its height along x, and its slope."""

import numpy as np

from mechanics.arrays import Array

_STEPS = 10  # places at which the surface is looked up in each part of its length, over which it is averaged


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


def rise(start: Array, now: Array, radius: Array, length: float, width: float) -> tuple[Array, Array]:
    """Return the middles (n,) of parts of the length, and the mean rise (n,) of the surface in each [m].

    The surface itself is as rough as its disks, and one that has come to lie on the others is no rise.

    Parameters
    ----------
    start, now : (nd, 2) centres [m]
    radius : (nd,) [m]
    length : from x = 0 on [m]
    width : of a part [m]
    """
    edges = np.arange(0.0, length + width, width)
    places = np.arange(0.0, length, width / _STEPS)
    risen = profile(now, radius, places) - profile(start, radius, places)
    finite = np.isfinite(risen)
    number = np.digitize(places[finite], edges) - 1
    count = np.bincount(number, minlength=len(edges))
    mean = np.bincount(number, risen[finite], minlength=len(edges)) / np.maximum(count, 1)
    return edges + 0.5 * width, mean


def front(middle: Array, risen: Array, least: float) -> float:
    """Return the farthest place whose rise is larger than `least`; the first one without any [m].

    >>> front(np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.2, 0.05]), 0.1)
    2.0
    """
    return float(middle[np.flatnonzero(risen > least).max(initial=0)])


def slope(places: Array, height: Array) -> float:
    """Return the slope angle of the straight line that fits a profile, rising along x positive [rad]; nan without two.

    >>> round(float(np.degrees(slope(np.arange(3.0), np.arange(3.0)))), 6)
    45.0
    """
    finite = np.isfinite(height)
    if finite.sum() < 2:
        return float("nan")
    return float(np.arctan(np.polyfit(places[finite], height[finite], 1)[0]))
