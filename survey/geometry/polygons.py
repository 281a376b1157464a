"""Plane polygons: area, places within, and neighbours without a joint between them."""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ground.statistics.scale import deviation
from survey.arrays import Array, Bools
from survey.conventions import CERTAIN, FEW, MOST, PARALLEL, SAMPLE, SOME, TENTH, WIDEST_JOINT

_PARALLEL = math.cos(PARALLEL)  # of the angle between the two sides of a joint
_ALONG = MOST  # of the shorter of two sides: their common length, at least
_MIN_JOINTS = SAMPLE  # joints from which a usual one is known
_NONE = SOME  # of the usual joint: a gap below is none
_SNAPPED = TENTH  # of the usual joint: distance of two corners that are one
_RARE = FEW  # part of all joints: more that touch are a habit
_CLEAR = CERTAIN  # robust standard deviations by which it differs from the usual one


class Seamless(NamedTuple):
    """Two polygons that touch where others have a joint.

    Attributes
    ----------
    first, second : their numbers
    gap, usual : between them, and between others [m]
    """

    first: int
    second: int
    gap: float
    usual: float


def seamless(rings: Sequence[Array], pairs: Iterable[tuple[int, int]]) -> list[Seamless]:
    """Return the pairs that have no joint between them, in a wall whose joints are wider.

    Parameters
    ----------
    rings : (n, 2) corners of polygons, counter-clockwise [m]
    pairs : of neighbours, by number
    """
    gaps = [(i, j, *gap) for i, j in pairs if (gap := _gap(rings[i], rings[j])) is not None]
    if len(gaps) < _MIN_JOINTS:
        return []
    widths = np.array([width for *_, width, _ in gaps])
    usual = float(np.median(widths))
    limit = min(_NONE * usual, usual - _CLEAR * deviation(widths, usual))
    seams = [
        Seamless(i, j, max(width, 0.0), usual)
        for i, j, width, ends in gaps
        if abs(width) < limit or ends < _SNAPPED * usual
    ]
    # where many touch it is how the wall is built or drawn
    return seams if len(seams) <= max(1.0, _RARE * len(gaps)) else []


def _gap(first: Array, second: Array) -> tuple[float, float] | None:
    """Return the width of the longest joint between two polygons, and the distance of the ends of its sides [m].

    None stands for two that have no joint.
    """
    runs = [np.roll(ring, -1, axis=0) - ring for ring in (first, second)]
    lengths = [np.maximum(np.linalg.norm(run, axis=1), 1e-300) for run in runs]
    ways = runs[0] / lengths[0][:, None]
    facing = -(ways @ (runs[1] / lengths[1][:, None]).T) >= _PARALLEL
    best: tuple[float, float, float] | None = None
    for a, b in zip(*np.nonzero(facing), strict=True):
        ends = np.array([second[b], second[b] + runs[1][b]]) - first[a]
        along, across = ends @ ways[a], ends @ np.array([ways[a][1], -ways[a][0]])
        common = min(float(along.max()), float(lengths[0][a])) - max(float(along.min()), 0.0)
        width = float(across.mean())
        enough = common >= _ALONG * min(lengths[0][a], lengths[1][b])
        if enough and abs(width) <= WIDEST_JOINT and (best is None or common > best[0]):
            apart = ends[::-1] - np.array([np.zeros(2), runs[0][a]])
            best = common, width, float(np.linalg.norm(apart, axis=1).max())
    return None if best is None else best[1:]


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
