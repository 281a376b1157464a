"""Edges of a sample: the height of its free surface along x, its slope, and the disks at its sides between platens."""

from collections.abc import Mapping

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array, Ints
from mechanics.planar.measures.tessellation import tessellation

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


_TOUCHES = (
    0.1  # distance from the lowest or highest point of the sample, over the smallest radius, at a platen [-]
)


def sides_of(centre: Array, radius: Array) -> tuple[Ints, Ints]:
    """Return the disks of the right side, from below to above, and those of the left one, from above to below.

    A side is the part of the outline, counter-clockwise, between its outermost disks at the two platens.

    Parameters
    ----------
    centre : (nd, 2) [m]
    radius : (nd,) [m]

    Raises
    ------
    SceneError : the outline does not lead from one platen to the other

    Examples
    --------
    >>> i, j = np.indices((3, 4)).reshape(2, -1)
    >>> right, left = sides_of(np.column_stack([2.0 * i, 2.0 * j]), np.ones(12))
    >>> right.tolist(), left.tolist()
    ([8, 9, 10, 11], [3, 2, 1, 0])
    """
    count = len(centre)
    triangles = tessellation(centre, radius).triangles
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    rim = edges[~np.isin(edges @ [count, 1], edges @ [1, count])]
    after: dict[int, list[int]] = {}
    for first, second in rim.tolist():
        after.setdefault(first, []).append(second)
    there, margin = np.unique(rim), _TOUCHES * radius.min()
    low, high = (centre[:, 1] - radius)[there], (centre[:, 1] + radius)[there]
    floor, top = there[low < low.min() + margin], there[high > high.max() - margin]
    corners = [platen[np.argsort(centre[platen, 0])[[0, -1]]] for platen in (floor, top)]
    (bottom_left, bottom_right), (top_left, top_right) = corners
    right = _walk(centre, after, int(bottom_right), int(top_right), np.array([1.0, 0.0]))
    left = _walk(centre, after, int(top_left), int(bottom_left), np.array([-1.0, 0.0]))
    return right, left


def _walk(centre: Array, after: Mapping[int, list[int]], start: int, end: int, heading: Array) -> Ints:
    """Return the disks from one to another along the outline; where it meets itself, it goes on outside."""
    passed = [start]
    while passed[-1] != end:
        here = passed[-1]
        ways = centre[after[here]] - centre[here]
        turn = np.arctan2(heading[0] * ways[:, 1] - heading[1] * ways[:, 0], ways @ heading)
        heading = ways[np.argmin(turn)]
        passed.append(after[here][int(np.argmin(turn))])
        if len(passed) > 2 * len(after):
            raise SceneError(
                "the outline of the sample does not lead from one platen to the other",
                where="membrane",
                remedy="press with rigid walls, or compress less",
            )
    return np.array(passed, dtype=np.int64)
