"""Plane polygons in space."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def area_and_centroid(corners: Array, normal: Array | None = None) -> tuple[float, Array]:
    """Return the area [m²] and the centroid (3,) [m] of a plane polygon; of one without area, the mean of its corners.

    Parameters
    ----------
    corners : (n, 3) in their order; concave ones too [m]
    normal : (3,) unit vector, along which the area counts, with its sign; None: that of the polygon itself

    >>> area, centroid = area_and_centroid(np.array([(0.0, 0.0, 5.0), (4.0, 0.0, 5.0), (4.0, 2.0, 5.0), (0, 2, 5)]))
    >>> area, centroid.tolist()
    (8.0, [2.0, 1.0, 5.0])
    """
    first = corners[0]
    arms = corners[1:] - first
    vectors = np.cross(arms[:-1], arms[1:])
    if normal is None:
        total = vectors.sum(axis=0)
        normal = total / (float(np.linalg.norm(total)) or 1.0)
    areas = vectors @ normal
    double = float(areas.sum())
    if not abs(double) > 0.0:
        return 0.0, np.asarray(corners.mean(axis=0))
    return double / 2.0, np.asarray(first + areas @ (arms[:-1] + arms[1:]) / (3.0 * double))
