"""Trishear: the kinematic model of folds ahead of a fault, and its fit to a motion.

Slip on a fault becomes distributed shear in a triangle that opens from the fault's tip (Erslev 1991). In axes of
the tip, x along the fault and y into the hanging wall, with m = tan φ of half the apical angle, the hanging wall
(y > m x) moves with the slip along x, the footwall (y < -m x) rests, and in the triangle between them

    v_x = s/2 (y/(m x) + 1),        v_y = s m/4 ((y/(m x))² - 1)

keep the area, with velocities that vary linearly across the triangle (Zehnder & Allmendinger 2000). The tip moves on
along the fault by the ratio P/S of propagation to slip (Hardy & Ford 1997).
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from mechanics.arrays import Array

_INCREMENTS = 100  # of the slip, in which places are carried along
_HALF_ANGLES = np.radians([10.0, 20.0, 30.0, 45.0, 60.0])  # from which fits start [rad]
_RATIOS = (0.0, 1.0, 2.0, 4.0)  # P/S from which fits start [-]
_MOST_HALF_ANGLE = np.radians(85.0)  # [rad]
_MOST_RATIO = 10.0  # P/S [-]
_OUTSIDE = 0.02  # distance over the slip from which a disk counts by its distance, not its square [-]


@dataclass(frozen=True)
class Trishear:
    """A fault with a triangle of shear ahead of its tip.

    Attributes
    ----------
    tip : (x, y) of the tip at the start [m]
    dip : angle of the fault from the x axis, counter-clockwise; the hanging wall is on its left [rad]
    half_angle : half the apical angle φ [rad]
    ratio : P/S, advance of the tip over the slip [-]
    """

    tip: tuple[float, float]
    dip: float
    half_angle: float
    ratio: float

    def velocity(self, place: Array, slip: float = 1.0, tip: float = 0.0) -> Array:
        """Return velocities (n, 2) at places (n, 2), with the tip advanced by `tip` [m] and a rate of slip [m/s].

        >>> fault = Trishear((0.0, 0.0), 0.0, np.radians(30.0), 0.0)
        >>> fault.velocity(np.array([[1.0, 0.0], [1.0, 0.2]])).round(6).tolist()
        [[0.5, -0.144338], [0.673205, -0.127017]]
        """
        turn = np.array([[np.cos(self.dip), np.sin(self.dip)], [-np.sin(self.dip), np.cos(self.dip)]])
        x, y = turn @ (place - np.array(self.tip)).T
        slope, x = np.tan(self.half_angle), x - tip
        # behind the tip the fault parts hanging wall and footwall
        with np.errstate(divide="ignore", invalid="ignore"):
            across = np.where(x > 0, np.clip(y / (slope * x), -1.0, 1.0), np.where(y >= 0, 1.0, -1.0))
        local = np.stack([0.5 * (across + 1.0), 0.25 * slope * (across**2 - 1.0)], axis=1)
        velocity: Array = slip * local @ turn
        return velocity

    def moved(self, place: Array, slip: float, increments: int = _INCREMENTS) -> Array:
        """Return places (n, 2) after a slip [m], by the midpoint rule."""
        step = slip / increments
        now = np.array(place, dtype=float)
        for number in range(increments):
            begin = self.ratio * step * number
            half = now + 0.5 * self.velocity(now, step, begin)
            now += self.velocity(half, step, begin + 0.5 * self.ratio * step)
        return now


@dataclass(frozen=True)
class TrishearFit:
    """The trishear that comes nearest to a motion.

    Attributes
    ----------
    model : with the half angle and ratio of least squares
    residual : root mean square distance between both motions [m]
    relative : residual over the slip [-]
    """

    model: Trishear
    residual: float
    relative: float


def trishear_fit(
    place: Array, moved: Array, tip: tuple[float, float], dip: float, slip: float
) -> TrishearFit:
    """Fit half angle and ratio to places (n, 2) at the start, and where they went (n, 2) after a slip [m].

    Robust least squares from a grid of starts, as different ratios may give nearly the same fold.
    """

    def misfit(unknown: Array) -> Array:
        """Return the differences of displacements, given half angle and ratio [m]."""
        model = Trishear(tip, dip, *map(float, unknown))
        return np.asarray((model.moved(place, slip) - moved).ravel())

    starts = [np.array([angle, ratio]) for angle in _HALF_ANGLES for ratio in _RATIOS]
    costs = [float(np.sum(misfit(start) ** 2)) for start in starts]
    best = None
    for number in np.argsort(costs)[:3]:
        fit = least_squares(
            misfit,
            starts[number],
            bounds=([np.radians(1.0), 0.0], [_MOST_HALF_ANGLE, _MOST_RATIO]),
            x_scale=[0.1, 0.5],
            diff_step=[1e-3, 1e-3],
            loss="soft_l1",  # a disk that the tip just passes, or just not, jumps by the whole slip
            f_scale=_OUTSIDE * abs(slip),
        )
        if best is None or fit.cost < best.cost:
            best = fit
    assert best is not None
    residual = float(np.sqrt(np.sum(misfit(best.x) ** 2) / len(place)))
    return TrishearFit(Trishear(tip, dip, *map(float, best.x)), residual, residual / abs(slip))
