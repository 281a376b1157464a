"""Least squares through the beds of stones, whose corners are correlated.

Corner j of stone i lies at z_ij = Σ β_k x_ij^k + u_i + e_ij, with x from the middle of the course; u_i, of variance
τ², is the height of its stone's bed, common to all corners of the stone; e_ij, of variance κ² σ_ij², its own
error. κ, at least 1, comes from the differences between corners of one stone; τ from the stones' means by the
rule of Paule & Mandel (1982; DerSimonian & Kacker 2007): the value for which Σ residual² / variance is the
redundancy.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ground.statistics.roots import root_of
from ground.statistics.scale import spread
from survey.arrays import Array
from survey.conventions import ENOUGH

Rows = NDArray[np.intp]

_FREEDOM = ENOUGH  # least number of differences between corners of one stone from which κ is estimated


@dataclass(frozen=True)
class BedCorners:
    """Lower corners of the stones of one course, sorted along the wall.

    Attributes
    ----------
    stone : (n,) number of the stone of each corner, from 0
    along : (n,) place along the wall [m]
    height : (n,) z [m]
    sigma : (n,) standard deviation of z as measured [m]
    """

    stone: Rows
    along: Array
    height: Array
    sigma: Array

    @property
    def count(self) -> int:
        """Number of stones."""
        return int(self.stone.max()) + 1

    @property
    def middle(self) -> float:
        """Half-way between the first and the last corner [m]."""
        return float(self.along[0] + self.along[-1]) / 2.0


@dataclass(frozen=True)
class BedScatter:
    """Scatter of beds.

    Attributes
    ----------
    tau : standard deviation of a stone's bed about the line [m]
    kappa : scatter of the corners of one stone over their measured precision, at least 1 [-]
    freedom : degrees of freedom of tau; of a course by itself, stones minus parameters
    """

    tau: float
    kappa: float
    freedom: float


def scatter_of(bed: BedCorners, parameters: int) -> BedScatter:
    """Estimate τ and κ of one course from its own stones."""
    weights = 1.0 / bed.sigma**2
    design, total = _design(bed, parameters), _by_stone(bed, weights[:, None])
    low = float(bed.height.min())
    rows = np.column_stack([design, bed.height - low])
    means = _by_stone(bed, weights[:, None] * rows) / total
    within = rows - means[bed.stone]
    freedom = len(bed.along) - bed.count
    line = _solve(means, np.full(bed.count, 1.0))
    squares = float(weights @ (within @ np.append(-line, 1.0)) ** 2)
    kappa = max(1.0, math.sqrt(squares / freedom)) if freedom >= _FREEDOM else 1.0
    variances = kappa**2 / total[:, 0]
    return BedScatter(_paule_mandel(means, variances), kappa, bed.count - parameters)


def pool(scatters: Sequence[BedScatter]) -> BedScatter | None:
    """Return the root mean squares of courses with enough stones, for courses of few; None if there are none."""
    freedom = sum(scatter.freedom for scatter in scatters)
    if not freedom:
        return None
    tau = math.sqrt(sum(scatter.freedom * scatter.tau**2 for scatter in scatters) / freedom)
    kappa = math.sqrt(sum(scatter.freedom * scatter.kappa**2 for scatter in scatters) / freedom)
    return BedScatter(tau, kappa, freedom)


def corner_roughness(beds: Sequence[BedCorners]) -> float:
    """Return κ of a wall: from the slopes of stones against those beside them, which a movement turns alike."""
    ratios = [np.zeros(0)]
    for bed in beds:
        first = np.array([np.flatnonzero(bed.stone == k)[[0, -1]] for k in range(bed.count)])
        pairs = first[first[:, 0] != first[:, 1]]
        step = bed.height[pairs[:, 1]] - bed.height[pairs[:, 0]]
        variance = (bed.sigma[pairs] ** 2).sum(axis=1)
        ratios.append(np.diff(step) / np.sqrt(variance[1:] + variance[:-1]))
    every = np.concatenate(ratios)
    return max(1.0, spread(every)) if len(every) >= _FREEDOM else 1.0


def fit_bed(bed: BedCorners, scatter: BedScatter, parameters: int) -> tuple[Array, Array]:
    """Fit by generalised least squares, C = κ²σ² + τ² 1 1ᵀ of each stone, inverted by Sherman & Morrison."""
    weights = 1.0 / (scatter.kappa * bed.sigma) ** 2
    rows = np.column_stack([_design(bed, parameters), bed.height - bed.height.min()])
    sums = _by_stone(bed, weights[:, None] * rows)
    shared = scatter.tau**2 / (1.0 + scatter.tau**2 * _by_stone(bed, weights[:, None])[:, 0])
    normal = rows.T @ (weights[:, None] * rows) - sums.T @ (shared[:, None] * sums)
    covariance: Array = np.linalg.inv(normal[:-1, :-1])
    values = covariance @ normal[:-1, -1]
    values[0] += bed.height.min()
    return values, covariance


def _design(bed: BedCorners, parameters: int) -> Array:
    """Return the powers of the distance from the middle."""
    return (bed.along - bed.middle)[:, None] ** np.arange(parameters)


def _by_stone(bed: BedCorners, columns: Array) -> Array:
    """Return the sums over the corners of each stone, (m, k)."""
    return np.array([np.bincount(bed.stone, column) for column in columns.T]).T


def _solve(rows: Array, weights: Array) -> Array:
    root = np.sqrt(weights)[:, None]
    solution = np.linalg.lstsq(root * rows[:, :-1], root[:, 0] * rows[:, -1], rcond=None)[0]
    return np.asarray(solution, dtype=np.float64)


def _paule_mandel(rows: Array, variances: Array) -> float:
    """Return τ for which Σ residual² / (variance + τ²) is the redundancy; 0 if the variances explain the scatter."""
    redundancy: int = rows.shape[0] - (rows.shape[1] - 1)

    def excess(square: float) -> float:
        """Return the weighted sum of squares minus its expectation, for an added variance [m²]."""
        weights = 1.0 / (variances + square)
        residuals: Array = rows @ np.append(-_solve(rows, weights), 1.0)
        return float(np.sum(weights * residuals**2)) - redundancy

    if redundancy <= 0:
        return 0.0
    return math.sqrt(root_of(excess, float(np.ptp(rows[:, -1])) ** 2 + float(variances.max())))
