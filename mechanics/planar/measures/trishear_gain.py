"""Gain of a trishear over a plain fault, and how well the motion determines its angle and ratio."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.planar.measures.limits import RESTING, RIGID
from mechanics.planar.measures.trishear import Trishear, TrishearFit

_HALF_ANGLES = np.radians(np.arange(2.5, 61.0, 2.5))  # that are compared with the fit [rad]
_RATIOS = np.array(
    [0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0]
)  # P/S that are compared with the fit [-]
_TURNS = np.radians(np.arange(1.0, 180.0))  # angles of plain faults [rad]
_BLOCK = 10.0  # side of the squares whose disks are drawn together, over the mean diameter [-]
_DRAWS = 1000  # of the blocks
_INTERVAL = (0.025, 0.975)  # quantiles of the interval [-]
_WORSE = 2.0  # standard errors by which a worse angle or ratio is excluded [-]
_MIN_BLOCKS = 3  # blocks, of which an interval can be drawn


@dataclass(frozen=True)
class TrishearGain:
    """Comparison of a trishear with a rigid step along one line, among the disks that shear.

    Attributes
    ----------
    disks : whose motion along the fault is 5 to 95 % of the slip
    gain : 1 - Σ misfit² of the trishear over that of the best plain fault [-]
    interval : of the gain, 95 %, by drawing blocks of disks [-]
    half_angles, ratios : least and largest that the motion does not exclude; None: it determines nothing [rad, -]
    """

    disks: int
    gain: float
    interval: tuple[float, float]
    half_angles: tuple[float, float] | None
    ratios: tuple[float, float] | None


def trishear_gain(
    fit: TrishearFit, start: Array, moved: Array, slip: float, diameter: float
) -> TrishearGain | None:
    """Compare a fit with plain faults; None where too few disks shear.

    Parameters
    ----------
    fit : of the motion
    start, moved : (n, 2) places before and after [m]
    slip : [m]
    diameter : mean of the disks [m]
    """
    model = fit.model
    along = np.array([np.cos(model.dip), np.sin(model.dip)])
    share = (moved - start) @ along / slip
    sheared = np.flatnonzero((share > RESTING) & (share < RIGID))
    place, motion = start[sheared], (moved - start)[sheared]
    block = np.unique(np.floor(place / (_BLOCK * diameter)), axis=0, return_inverse=True)[1].ravel()
    if len(sheared) == 0 or block.max() + 1 < _MIN_BLOCKS:
        return None
    misfit = _by_block(_misfit(model, place, motion, slip), block)
    plain = _by_block(_plain_misfit(place, motion, slip * along), block)
    drawn = np.random.default_rng(0).integers(0, len(plain), (_DRAWS, len(plain)))
    draws = 1.0 - misfit[drawn].sum(axis=1) / plain[drawn].sum(axis=1)
    low, high = np.quantile(draws, _INTERVAL)
    half_angles, ratios = _not_excluded(model, place, motion, slip, block, misfit)
    return TrishearGain(
        len(sheared), 1.0 - float(misfit.sum() / plain.sum()), (float(low), float(high)), half_angles, ratios
    )


def _misfit(model: Trishear, place: Array, motion: Array, slip: float) -> Array:
    """Return the squared distance (n,) between a motion and that of a trishear [m²]."""
    return np.asarray(((model.moved(place, slip) - place - motion) ** 2).sum(axis=1), dtype=float)


def _plain_misfit(place: Array, motion: Array, step: Array) -> Array:
    """Return the squared misfit (n,) of the best rigid step along a line of any angle and place [m²]."""
    moves, rests = ((motion - step) ** 2).sum(axis=1), (motion**2).sum(axis=1)
    best, best_moves = np.inf, np.array(rests)
    for turn in _TURNS:
        order = np.argsort(place @ np.array([-np.sin(turn), np.cos(turn)]))
        # disks below the line rest, those above it move
        cost = np.concatenate([[0.0], np.cumsum(rests[order])])
        cost += np.concatenate([np.cumsum(moves[order][::-1])[::-1], [0.0]])
        split = int(np.argmin(cost))
        if cost[split] < best:
            best, best_moves = float(cost[split]), moves.copy()
            best_moves[order[:split]] = rests[order[:split]]
    return best_moves


def _by_block(values: Array, block: Ints) -> Array:
    return np.asarray(np.bincount(block, values), dtype=float)


def _not_excluded(
    model: Trishear, place: Array, motion: Array, slip: float, block: Ints, least: Array
) -> tuple[tuple[float, float] | None, tuple[float, float] | None]:
    """Return the ranges of half angles and of ratios that are not worse than the fit by two standard errors.

    Parameters
    ----------
    block : (n,) of each disk, which shear together and so are not independent
    least : misfit of the fit in each block [m²]
    """
    accepted = np.zeros((len(_HALF_ANGLES), len(_RATIOS)), dtype=bool)
    for row, half in enumerate(_HALF_ANGLES):
        for column, ratio in enumerate(_RATIOS):
            trial = Trishear(model.tip, model.dip, float(half), float(ratio))
            worse = _by_block(_misfit(trial, place, motion, slip), block) - least
            accepted[row, column] = worse.sum() <= _WORSE * np.sqrt(len(worse)) * worse.std(ddof=1)
    return (
        _range(_HALF_ANGLES[accepted.any(axis=1)], _HALF_ANGLES, model.half_angle),
        _range(_RATIOS[accepted.any(axis=0)], _RATIOS, model.ratio),
    )


def _range(accepted: Array, tried: Array, fitted: float) -> tuple[float, float] | None:
    """Return the least and the largest; None if all that was tried remains."""
    if len(accepted) == len(tried):
        return None
    values = np.append(accepted, fitted)
    return float(values.min()), float(values.max())
