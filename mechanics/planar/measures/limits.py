"""Limits of the sheared zone above a fault, and the radius of the surface that bends over it."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import theilslopes

from mechanics.arrays import Array, Bools

RIGID = 0.95
"""Share of the slip, along the fault, above which a disk moves with the hanging wall [-]."""
RESTING = 0.05
"""Share of the slip below which a disk rests with the footwall [-]."""
_BANDS = 8  # of the height, in each of which a limit has a place
_MIN_BAND_DISKS = 20  # disks of a band
_CERTAIN = 2.0  # standard errors beyond which a surface is bent [-]


@dataclass(frozen=True)
class ShearLimits:
    """Straight lines that bound the sheared zone at the left and at the right.

    Attributes
    ----------
    left, right : angles from the x axis, counter-clockwise, within 0 to π; nan where too few bands show one [rad]
    """

    left: float
    right: float

    @property
    def mean(self) -> float:
        """Mean of both angles [rad]."""
        return 0.5 * (self.left + self.right)


def shear_limits(now: Array, share: Array) -> ShearLimits:
    """Find the limits of the sheared zone.

    In each of some bands of height, a limit is where it puts the fewest disks on the wrong side; the line through these
    places is that of Theil and Sen.

    Parameters
    ----------
    now : (n, 2) places [m]
    share : (n,) motion along the fault over the slip [-]

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> place = rng.uniform([-30.0, 0.0], [40.0, 10.0], (4000, 2))
    >>> limits = shear_limits(place, np.clip(0.5 - (place[:, 0] - place[:, 1]) / 5.0, 0.0, 1.0))
    >>> [bool(abs(np.degrees(one) - 45.0) < 3.0) for one in (limits.left, limits.right)]
    [True, True]
    """
    height = now[:, 1]
    band = np.minimum((_BANDS * (height - height.min()) / (np.ptp(height) or 1.0)).astype(int), _BANDS - 1)
    angles = []
    for least in (RIGID, RESTING):
        chosen = [np.flatnonzero(band == number) for number in range(_BANDS)]
        chosen = [group for group in chosen if len(group) >= _MIN_BAND_DISKS]
        splits = [_split(now[group, 0], share[group] > least) for group in chosen]
        middles = [float(height[group].mean()) for group in chosen]
        finite = np.isfinite(splits)
        if finite.sum() < 3:
            angles.append(float("nan"))
            continue
        slope = theilslopes(np.array(splits)[finite], np.array(middles)[finite])[0]
        angles.append(float(np.arctan2(1.0, slope)))
    return ShearLimits(*angles)


def _split(x: Array, moves: Bools) -> float:
    """Return the place with the fewest disks that move at its right or rest at its left; nan at an end."""
    order = np.argsort(x)
    ordered = moves[order]
    wrong = np.concatenate([[0], np.cumsum(~ordered)]) + np.concatenate([np.cumsum(ordered[::-1])[::-1], [0]])
    least = int(np.argmin(wrong))
    if least in (0, len(x)):
        return float("nan")
    return float(0.5 * (x[order[least - 1]] + x[order[least]]))


def crest_radius(place: Array, height: Array) -> float:
    """Return the radius of the parabola that fits a crest; infinite if it is not surely bent upwards [m].

    Parameters
    ----------
    place, height : (n,) of the surface between its flat top and half of its rise [m]

    >>> x = np.linspace(-1.0, 1.0, 50)
    >>> round(crest_radius(x, np.sqrt(100.0 - x**2)), 1)
    10.0
    >>> crest_radius(x, -x)
    inf
    """
    if len(place) < 5:
        return float("nan")
    middle = place - place.mean()
    design = np.vander(middle, 3)
    fit, _, _, _ = np.linalg.lstsq(design, height, rcond=None)
    deviation = height - design @ fit
    variance = float(deviation @ deviation) / (len(place) - 3) * np.linalg.inv(design.T @ design)[0, 0]
    curved, slope = float(fit[0]), float(fit[1])
    # rounding alone leaves no error to compare with
    if -curved <= max(_CERTAIN * np.sqrt(variance), 1e-9 / np.ptp(place)):
        return float("inf")
    return float((1.0 + slope**2) ** 1.5 / (-2.0 * curved))
