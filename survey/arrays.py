"""Array types that annotations of the package share."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]

AXES = 3
"""Axes of space."""


def no_places() -> Array:
    """Return an empty array of places in space (0, 3)."""
    return np.empty((0, AXES))


def no_pixels() -> Array:
    """Return an empty array of places in a picture (0, 2)."""
    return np.empty((0, 2))
