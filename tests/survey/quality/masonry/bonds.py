"""Bonds of stones half a metre long and 0.3 m high, joints of 10 mm."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def bond(shift: float, courses: int = 8, length: int = 10, size: float = 0.5) -> list[Array]:
    """Return outlines (4, 2); every second course is shifted to the left by a part of a stone."""
    found = []
    for course in range(courses):
        start = -shift * size * (course % 2)
        for k in range(length):
            left, right = start + k * size + 0.005, start + (k + 1) * size - 0.005
            low, high = 0.3 * course, 0.3 * course + 0.29
            found.append(np.array([[left, low], [right, low], [right, high], [left, high]]))
    return found
