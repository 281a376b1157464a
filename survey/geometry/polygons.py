"""Plane polygons: area, and places within."""

import numpy as np

from survey.arrays import Array, Bools

__all__ = ["inside", "ring_area"]


def ring_area(ring: Array) -> float:
    """Return the signed area of a polygon (n, 2), positive if it runs from the first axis to the second."""
    x, y = (ring - ring[0]).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def inside(places: Array, ring: Array) -> Bools:
    """Return which places (n, 2) lie within a polygon (m, 2), by the number of sides that a ray crosses."""
    start, stop = ring, np.roll(ring, -1, axis=0)
    y = places[:, 1, None]
    spans = (start[:, 1] > y) != (stop[:, 1] > y)
    rise = stop[:, 1] - start[:, 1]
    safe = np.where(rise == 0.0, 1.0, rise)
    crossing = start[:, 0] + (y - start[:, 1]) / safe * (stop[:, 0] - start[:, 0])
    out: Bools = (np.count_nonzero(spans & (places[:, 0, None] < crossing), axis=1) % 2).astype(np.bool_)
    return out
