"""Chains of straight edges: distances from them, and where they cross."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from survey.arrays import Array, Bools
from survey.geometry.polygons import ring_area


def apart(places: Array, ring: Array, closed: bool = True) -> Array:
    """Return the distances (n,) of places (n, 2) from the sides of a polygon, or of an open chain [m]."""
    start, stop = (ring, np.roll(ring, -1, axis=0)) if closed else (ring[:-1], ring[1:])
    run = stop - start
    size = np.maximum((run**2).sum(axis=1), 1e-300)
    off = places[:, None] - start[None]
    along = np.clip((off * run).sum(axis=2) / size, 0.0, 1.0)
    out: Array = np.linalg.norm(off - along[..., None] * run, axis=2).min(axis=1)
    return out


def is_simple(ring: Array) -> bool:
    """Return whether a polygon (n, 2) runs counter-clockwise and no two of its sides meet but at their corner."""
    count = len(ring)
    if count < 3 or not ring_area(ring) > 0.0:
        return False
    edges = np.roll(ring, -1, axis=0) - ring
    met = _met_along(ring, edges)
    k = np.arange(count)
    met[k, k] = met[k, (k + 1) % count] = met[(k + 1) % count, k] = False
    if met.any():
        return False
    back = np.roll(edges, 1, axis=0)
    folded = np.abs(back[:, 0] * edges[:, 1] - back[:, 1] * edges[:, 0]) < 1e-12
    return not bool((folded & ((back * edges).sum(axis=1) < 0.0)).any())


def crosses(places: Array, chains: Sequence[Sequence[int]]) -> bool:
    """Return whether edges of chains of corners meet elsewhere than at a common corner."""
    pairs = np.array([pair for chain in chains for pair in pairwise(chain)])
    start = places[pairs[:, 0]]
    way = places[pairs[:, 1]] - start
    common = (pairs[:, None, :, None] == pairs[None, :, None, :]).any(axis=(2, 3))
    return bool((_met_along(start, way) & ~common).any())


def _met_along(start: Array, run: Array) -> Bools:
    """Return which of n segments meet which, (n, n)."""
    offset = start[None] - start[:, None]
    turn = run[:, None, 0] * run[None, :, 1] - run[:, None, 1] * run[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (offset[..., 0] * run[None, :, 1] - offset[..., 1] * run[None, :, 0]) / turn
    met = (along >= 0.0) & (along <= 1.0)
    out: Bools = met & met.T
    return out
