"""Live loads of an assessment: from [[assess]] of a scene file, or from the words of an option."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from mechanics.limit.live_loads import Acceleration, LiveLoad, PointForce
from moma.errors import SceneError, UsageError
from pipelines.arrays import Array
from pipelines.scene.array_tables import Entry
from pipelines.scene.file import SceneFile

__all__ = ["parse_load", "scene_loads"]

_AXES = {
    "x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
}
_USUAL = tuple(f"horizontal {axis}" for axis in _AXES)
_REMEDY = 'give "horizontal x", "horizontal 30" (degrees from x towards y), "tilt y" or "force CODE FX FY FZ"'


def parse_load(words: str) -> tuple[str, LiveLoad]:
    """Return a load from words, as the option --load has them, with its name.

    Raises
    ------
    UsageError : the words are no load

    >>> parse_load("tilt y")[1].direction
    (1.0, 0.0, 0.0)
    """
    kind, *rest = words.split() or [""]
    try:
        if kind in ("horizontal", "tilt") and len(rest) == 1:
            direction = _horizontal(rest[0])
            return words, Acceleration(direction if kind == "horizontal" else _downhill(direction))
        if kind == "force" and len(rest) == 4:
            x, y, z = map(float, rest[1:])
            return words, PointForce(rest[0], (x, y, z))
    except (ValueError, SceneError):
        pass
    raise UsageError(f"no such load: {words!r}", where="--load", remedy=_REMEDY)


def scene_loads(scene: SceneFile, origin: Array) -> tuple[tuple[str, LiveLoad], ...]:
    """Return the loads of [[assess]] with their names; those of the four horizontal axes where there are none.

    `origin` (3,) is that of the scene, in the frame of the site [m].
    """
    if not scene.assess:
        return tuple(map(parse_load, _USUAL))
    found = []
    for entry in scene.assess:
        with scene.document.at(*entry.path):
            found.append(_TYPES[entry.type](entry, origin))
    return tuple(found)


def _horizontal(word: str) -> tuple[float, float, float]:
    if word in _AXES:
        return _AXES[word]
    angle = np.radians(float(word))
    return float(np.cos(angle)), float(np.sin(angle)), 0.0


def _downhill(axis: tuple[float, float, float]) -> tuple[float, float, float]:
    """Return the direction towards which a table dips that turns about an axis, right-handed."""
    x, y, z = np.cross(axis, (0.0, 0.0, 1.0)).tolist()
    return x + 0.0, y + 0.0, z + 0.0


def _acceleration(entry: Entry, origin: Array) -> tuple[str, LiveLoad]:
    direction = entry.values["direction"]
    return _named(entry, direction), Acceleration(direction)


def _tilt(entry: Entry, origin: Array) -> tuple[str, LiveLoad]:
    axis = entry.values["axis"]
    return _named(entry, axis), Acceleration(_downhill(axis))


def _force(entry: Entry, origin: Array) -> tuple[str, LiveLoad]:
    values, point = entry.values, entry.values["point"]
    x, y, z = (0.0, 0.0, 0.0) if point is None else (np.asarray(point) - origin).tolist()
    load = PointForce(values["stone"], values["force"], None if point is None else (x, y, z))
    return f"force on {values['stone']}", load


def _named(entry: Entry, vector: Any) -> str:
    return f"{entry.type} ({', '.join(f'{one:g}' for one in vector)})"


_TYPES: Mapping[str, Callable[[Entry, Array], tuple[str, LiveLoad]]] = {
    "horizontal": _acceleration,
    "tilt": _tilt,
    "force": _force,
}
