"""Thrusts of a layer that is pushed: bands of large local shear, where they are and how they dip."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import find_peaks

from mechanics.arrays import Array

__all__ = ["Thrusts", "thrusts_of"]

_COLUMN = 4.0  # width of a column of the layer, over the mean radius [-]
_SMOOTH = 3  # columns of a running mean
_PROMINENT = 0.25  # of the largest shear of a column, by which a band exceeds what is beside it [-]
_FEWEST = 5  # disks of a band whose dip is told


@dataclass(frozen=True)
class Thrusts:
    """Bands of large shear.

    Attributes
    ----------
    place : (n,) along the layer at the start [m]
    dip : angle from the x axis (n,), of disks that the shear weighs; nan of too few [rad]
    """

    place: Array
    dip: Array

    @property
    def spacing(self) -> float:
        """Mean distance of neighbours along the layer at the start; nan of fewer than two [m]."""
        return float(np.diff(self.place).mean()) if len(self.place) > 1 else float("nan")


def thrusts_of(start: Array, now: Array, shear: Array, radius: Array, layer: float) -> Thrusts:
    """Return the thrusts of a layer, from the local shear (nd,) of its disks.

    Parameters
    ----------
    start, now : (nd, 2) centres [m]
    shear : ln of the ratio of the principal stretches (nd,); nan where it is not known
    radius : (nd,) [m]
    layer : thickness; disks that started above are left out [m]
    """
    inside = np.isfinite(shear) & (start[:, 1] < layer)
    if not inside.any():
        return Thrusts(np.zeros(0), np.zeros(0))
    x, values = start[inside, 0], shear[inside]
    width = _COLUMN * float(radius.mean())
    column = ((x - x.min()) / width).astype(np.int64)
    count = np.bincount(column)
    mean = uniform_filter1d(np.bincount(column, values) / np.maximum(count, 1), _SMOOTH, mode="nearest")
    # a band may begin at the wall, where the layer begins
    bounded = np.concatenate([[0.0], mean, [0.0]])
    peaks = find_peaks(bounded, prominence=_PROMINENT * mean.max())[0] - 1
    place = x.min() + width * (peaks + 0.5)
    between = np.concatenate([[-np.inf], 0.5 * (place[1:] + place[:-1]), [np.inf]])
    high = values > np.quantile(values, 0.75)
    dips = []
    for low, end in pairwise(between):
        chosen = high & (x >= low) & (x < end)
        dips.append(_dip(now[inside][chosen], values[chosen]) if chosen.sum() >= _FEWEST else np.nan)
    return Thrusts(place, np.array(dips))


def _dip(place: Array, weight: Array) -> float:
    """Return the angle of the long axis of weighed places from the x axis [rad]."""
    away = place - np.average(place, axis=0, weights=weight)
    spread = (away * weight[:, None]).T @ away
    axis = np.linalg.eigh(spread)[1][:, -1]
    return float(np.arctan(abs(axis[1] / axis[0]))) if axis[0] else 0.5 * np.pi
