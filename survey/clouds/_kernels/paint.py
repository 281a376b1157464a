"""Numba kernel that adds the points of a cloud to a picture of a wall."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Canvas(NamedTuple):
    """A picture in the plane of a wall, of which each pixel holds sums over its points.

    origin : (3,) float64, place of the upper left corner of the picture [m]
    axes : (3, 3) float64, rows: right, up, outwards
    pixel : float64, side of a pixel [m]
    slab : float64, largest distance of a point from the plane [m]
    counts : (h, w) float32
    depths : (h, w) float32, sum of the distances from the plane [m]
    tints : (h, w, 3) float32, sum of the colours
    """

    origin: NDArray[np.float64]
    axes: NDArray[np.float64]
    pixel: float
    slab: float
    counts: NDArray[np.float32]
    depths: NDArray[np.float32]
    tints: NDArray[np.float32]


@njit(cache=True, nogil=True)
def paint(points, colours, canvas):
    """Add points to a picture; return how many lie on it.

    Inputs: points (n, 3) float64, relative to the frame of `canvas.origin` [m]; colours (n, 3) or (0, 3) uint8.
    """
    height, width = canvas.counts.shape
    a, o, shown, tinted = canvas.axes, canvas.origin, 0, len(colours) > 0
    for i in range(len(points)):
        x, y, z = points[i, 0] - o[0], points[i, 1] - o[1], points[i, 2] - o[2]
        d = a[2, 0] * x + a[2, 1] * y + a[2, 2] * z
        if not abs(d) <= canvas.slab:
            continue
        s = (a[0, 0] * x + a[0, 1] * y + a[0, 2] * z) / canvas.pixel
        t = -(a[1, 0] * x + a[1, 1] * y + a[1, 2] * z) / canvas.pixel
        if not (s >= 0.0 and s < width and t >= 0.0 and t < height):
            continue
        row, column = int(t), int(s)
        canvas.counts[row, column] += 1.0
        canvas.depths[row, column] += d
        if tinted:
            for k in range(3):
                canvas.tints[row, column, k] += colours[i, k]
        shown += 1
    return shown
