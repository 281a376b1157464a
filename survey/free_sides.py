"""Sides that face no other stone: the wall's ends and top, the reveals of an opening, an intrados.

A free side keeps the line on which it was measured, with two exceptions. Where it ends at a joint line beside
a
corner in which two joints cross (the foot of an arch: bed joint, skewback and intrados), it is led through
that
crossing, or stones that meet only in that point would overlap. And where its corner is worn, so that the
measured
line is not the stone's, it is led to the sound end of the free side across the joint, or, if there is none,
made
parallel to the opposite side when the stone is about as high there as here.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from survey.walls import Sides

__all__ = ["free_lines"]

Array = NDArray[np.float64]

_PARALLEL = np.sin(
    np.radians(10.0)
)  # opposite sides that are nearer to parallel than this are meant to be so


def free_lines(
    sides: Sides, corners: Array, owner: NDArray[np.intp], reach: float
) -> dict[tuple[int, int], tuple[Array, Array]]:
    """Find the lines of all free sides.

    Parameters
    ----------
    sides : as measured
    corners : (n, 4, 2) where the lines of neighbouring sides cross, with joints closed [m]
    owner : (n, 4) number of the joint that each side belongs to; -1 for a free side
    reach : how far an end may be led along its joint [m]

    Returns
    -------
    point and direction of each free side (stone, side)
    """
    crossings = _places(corners, (owner >= 0) & (np.roll(owner, 1, axis=1) >= 0), owner)
    ends = _sound_ends(sides, corners, owner)
    lines = {}
    for i, k in ((int(i), int(k)) for i, k in zip(*np.nonzero(owner < 0), strict=True)):
        points, led = [], []
        for end, (corner, beside) in enumerate(((k, (k - 1) % 4), ((k + 1) % 4, (k + 1) % 4))):
            here, joint = corners[i, corner], int(owner[i, beside])
            found = _nearest(here, crossings.get(joint), reach)
            if found is None and not sides.sound[i, k, end]:
                found = _nearest(here, ends.get(joint), 2.0 * reach)
            points.append(here if found is None else found)
            led.append(found is not None or bool(sides.sound[i, k, end]))
        direction = points[1] - points[0]
        if led[0] != led[1]:
            opposite = corners[i, (k + 2) % 4] - corners[i, (k + 3) % 4]
            sine = (direction[0] * opposite[1] - direction[1] * opposite[0]) / (
                np.linalg.norm(direction) * np.linalg.norm(opposite)
            )
            direction = opposite if abs(sine) < _PARALLEL else direction
        lines[i, k] = (points[0] if led[0] else points[1], direction)
    return lines


def _places(corners: Array, chosen: NDArray[np.bool_], owner: NDArray[np.intp]) -> dict[int, list[Array]]:
    """The chosen corners, by the joints whose lines they lie on."""
    places: dict[int, list[Array]] = {}
    for (i, k), beside in product(zip(*np.nonzero(chosen), strict=True), (0, -1)):
        places.setdefault(int(owner[i, k + beside]), []).append(corners[i, k])
    return places


def _sound_ends(sides: Sides, corners: Array, owner: NDArray[np.intp]) -> dict[int, list[Array]]:
    """Sound corners in which a free side meets a joint, by joint."""
    mixed = (owner >= 0) != (np.roll(owner, 1, axis=1) >= 0)
    ends = _places(corners, mixed & sides.sound[:, :, 0], owner)
    ends.pop(-1, None)
    return ends


def _nearest(here: Array, places: list[Array] | None, reach: float) -> Array | None:
    if not places:
        return None
    distances = [float(np.linalg.norm(place - here)) for place in places]
    nearest = int(np.argmin(distances))
    return places[nearest] if distances[nearest] <= reach else None
