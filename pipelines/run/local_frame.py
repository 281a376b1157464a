"""A scene far from the origin of the site's frame is computed about a point amid its stones.

National grids have coordinates of 10⁶ m, of which float64 keeps a nanometre: too coarse for faces that are to
meet. Measurements lose nothing by it; so they are moved before anything is computed of them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from archmodel.store.stone_record import StoneRecord
from pipelines.arrays import Array
from pipelines.scene.array_tables import Entry

__all__ = ["entry_about", "local_origin", "stone_about"]


_FAR = 10_000.0
"""Coordinates up to this are exact enough as they are [m]."""
_GRID = 1_000.0
"""Origins are multiples of this, so that one sees what was taken off [m]."""
_PLACES = ("point", "pivot")
"""Values of a scene's entries that are places in the frame of the site."""


def local_origin(stones: Sequence[StoneRecord]) -> Array:
    """The point (3,) of the site's frame that a scene of these stones has as its origin [m]."""
    if not stones:
        return np.zeros(3)
    centres = np.array([stone.centroid for stone in stones])
    if np.abs(centres).max() <= _FAR:
        return np.zeros(3)
    out: Array = _GRID * np.round(np.median(centres, axis=0) / _GRID)
    return out


def stone_about(stone: StoneRecord, origin: Array) -> StoneRecord:
    """The stone with all its coordinates counted from `origin`."""
    if not origin.any():
        return stone
    centroid = stone.centroid - origin
    return replace(
        stone,
        vertices=stone.vertices - origin,
        points=stone.points - origin,
        outline=stone.outline - origin,
        solid_vertices=stone.solid_vertices - origin,
        centroid=centroid,
        offset=float(stone.normal @ centroid),
    )


def entry_about(entry: Entry, origin: Array) -> Entry:
    """The entry of a scene file with its places counted from `origin`."""
    places = {name: entry.values[name] for name in _PLACES if entry.values.get(name) is not None}
    if not origin.any() or not places:
        return entry
    moved = {name: tuple((np.array(place) - origin).tolist()) for name, place in places.items()}
    return replace(entry, values={**entry.values, **moved})
