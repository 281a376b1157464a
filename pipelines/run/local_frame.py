"""Local origin of a scene that lies far from the origin of the site's frame.

National grids have coordinates of 10⁶ m, which float64 resolves to a nanometre: too coarse for faces that are to
meet. Measurements lose nothing by a shift, so they are shifted before anything is computed from them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from archmodel.store.stone_record import StoneRecord
from pipelines.arrays import Array
from pipelines.scene.array_tables import Entry

__all__ = ["entry_about", "local_origin", "stone_about"]


_FAR = 10_000.0
"""Largest coordinates that are exact enough without a shift [m]."""
_GRID = 1_000.0
"""Origins are multiples of this, so that the shift is easy to read [m]."""
_PLACES = ("point", "pivot")
"""Values of a scene's entries that are points in the frame of the site."""


def local_origin(stones: Sequence[StoneRecord]) -> Array:
    """Return the point (3,) of the site's frame that is the origin of a scene of these stones [m]."""
    if not stones:
        return np.zeros(3)
    centres = np.array([stone.centroid for stone in stones])
    if np.abs(centres).max() <= _FAR:
        return np.zeros(3)
    out: Array = _GRID * np.round(np.median(centres, axis=0) / _GRID)
    return out


def stone_about(stone: StoneRecord, origin: Array) -> StoneRecord:
    """Return the stone with all its coordinates relative to `origin`."""
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
    """Return the entry of a scene file with its points relative to `origin`."""
    places = {name: entry.values[name] for name in _PLACES if entry.values.get(name) is not None}
    if not origin.any() or not places:
        return entry
    moved = {name: tuple((np.array(place) - origin).tolist()) for name, place in places.items()}
    return replace(entry, values={**entry.values, **moved})
