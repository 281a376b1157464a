"""Thrusts of a layer that is pushed: bands of large local shear, where they are and how they dip."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import find_peaks

from mechanics.arrays import Array

_COLUMN = 4.0  # width of a column of the layer, over the mean radius [-]
_SMOOTH = 3  # columns of a running mean
_PROMINENT = 0.25  # of the largest shear of a column, by which a band exceeds what is beside it [-]
_MIDDLE = 1.0 / 3.0  # part of the height in which bands are looked for: below, all slides over the base [-]
# of the layer about the middle of a band in which its dip is measured: length to both sides over the thickness, and
# part of the height [-]
_BESIDE, _TALL = 0.6, 0.6
_SHIFTS = 3  # of its line to both sides, in half columns
_ANGLES = np.radians(np.arange(10.0, 171.0))  # among which it is looked for
_MIN_BAND_DISKS = 5  # disks of a band whose dip is told


@dataclass(frozen=True)
class Thrusts:
    """Bands of large shear.

    Attributes
    ----------
    place : (n,) along the layer at the start, at half its height [m]
    dip : angle from the x axis (n,), of the line of largest shear through the middle; nan of too few disks [rad]
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
    finite = np.isfinite(shear)
    middle = finite & (np.abs(start[:, 1] - 0.5 * layer) < 0.5 * _MIDDLE * layer)
    if not middle.any():
        return Thrusts(np.zeros(0), np.zeros(0))
    x, values = start[middle, 0], shear[middle]
    width = _COLUMN * float(radius.mean())
    column = ((x - x.min()) / width).astype(np.int64)
    count = np.bincount(column)
    mean = uniform_filter1d(np.bincount(column, values) / np.maximum(count, 1), _SMOOTH, mode="nearest")
    # a band may begin at the wall, where the layer begins
    bounded = np.concatenate([[0.0], mean, [0.0]])
    peaks = find_peaks(bounded, prominence=_PROMINENT * mean.max())[0] - 1
    place = x.min() + width * (peaks + 0.5)
    dips = []
    for at in place:
        beside = finite & (np.abs(start - [at, 0.5 * layer]) < [_BESIDE * layer, 0.5 * _TALL * layer]).all(
            axis=1
        )
        dips.append(
            _dip(now[beside], shear[beside], 0.5 * width) if beside.sum() >= _MIN_BAND_DISKS else np.nan
        )
    return Thrusts(place, np.array(dips))


def _dip(place: Array, shear: Array, wide: float) -> float:
    """Return the angle from the x axis of the strip, through the middle of places, whose shear exceeds the mean most.

    Sums over the root of the number of disks: strips of different lengths compare as the means of random samples do.
    """
    x, y = (place - place.mean(axis=0)).T
    excess, best = shear - shear.mean(), (-np.inf, 0.0)
    for shift in np.arange(-_SHIFTS, _SHIFTS + 1) * wide:
        across = np.abs((x - shift)[:, None] * np.sin(_ANGLES) - y[:, None] * np.cos(_ANGLES)) < wide
        score = (excess[:, None] * across).sum(axis=0) / np.sqrt(np.maximum(across.sum(axis=0), 1))
        best = max(best, (float(score.max()), float(_ANGLES[np.argmax(score)])))
    return min(best[1], np.pi - best[1])
