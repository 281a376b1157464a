"""Validation of the values of a scene: NaN, zero lengths and negative steps are refused."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from ground.errors import SceneError
from mechanics.arrays import Array

# numbers between these bounds, and their quotients, can still be squared and added
LARGEST = 1e75
SMALLEST = 1e-75
# between these widths moments of inertia, of the fifth order, can be computed too
_WIDEST = 1e25  # [m]
_NARROWEST = 1e-25  # [m]
_ROUNDED = 1e-6  # largest rounding of a corner far from the origin, over the stone's width

# quantity, its value, True if that is right, remedy
Rule = tuple[str, object, bool, str]


def refuse_unless(where: str, rules: Iterable[Rule]) -> None:
    """Refuse the first value that is not right.

    Raises
    ------
    SceneError : naming the place, the quantity, its value and a remedy
    """
    for quantity, value, right, remedy in rules:
        if not right:
            raise SceneError(f"{quantity} = {value!r}", where=where, remedy=remedy)


def finite(values: ArrayLike, count: int) -> bool:
    """Return True if these are `count` numbers that can be computed with."""
    return np.shape(values) == (count,) and bool((np.abs(values) <= LARGEST).all())


def check_corners(where: str, vertices: Array) -> None:
    """Refuse corners (nv, 3) that are no numbers, no wider than a point, or too far away for their width [m].

    Raises
    ------
    SceneError : naming the corner, or the width
    """
    if np.ndim(vertices) != 2 or np.shape(vertices)[1] != 3 or len(vertices) < 4:
        raise SceneError(
            f"corners of shape {np.shape(vertices)}",
            where=where,
            remedy="give x, y, z of four corners or more",
        )
    sound = np.isfinite(vertices).all(axis=1)
    if not sound.all():
        corner = int(np.argmin(sound))
        raise SceneError(
            f"corner {corner} is at {np.asarray(vertices)[corner].tolist()}",
            where=where,
            remedy="give numbers",
        )
    farthest = float(np.abs(vertices).max())
    wide = float(np.ptp(vertices, axis=0).max()) if farthest <= _WIDEST else farthest
    if not _NARROWEST <= wide <= _WIDEST:
        raise SceneError(
            f"it is {wide:.3g} m wide",
            where=where,
            remedy="give lengths in metres, of stones that can be built",
        )
    if np.finfo(float).eps * farthest > _ROUNDED * wide:
        raise SceneError(
            f"it is {wide:.3g} m wide, {farthest:.3g} m from the origin: rounding would move its corners",
            where=where,
            remedy="shift the scene to the origin",
        )
