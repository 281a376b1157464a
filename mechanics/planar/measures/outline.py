"""Outline of a sample between two level platens: the disks at its sides, in the order of their neighbours."""

from collections.abc import Mapping

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array, Ints
from mechanics.planar.measures.tessellation import tessellation

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
