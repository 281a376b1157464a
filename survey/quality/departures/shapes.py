"""Shapes of movement, tested together on the departures of a wall's stones.

A departure y_i of variance v_i is a nuisance of its group (the height of its course, the place of its wall) plus
Σ a_k φ_k(s_i, z_i) over the shapes φ_k that the wall has taken, each in a run of groups. Shapes are taken one by one,
the most significant first (orthogonal matching pursuit; Pati, Rezaiifar & Krishnaprasad 1993), as long as Student's t
of the amount exceeds its critical value for *all* shapes and runs that were looked at (Bonferroni). So the probability
that a wall without any movement is given one is at most α, whatever number of shapes is looked at.

Groups that disagree on an amount make it uncertain: its variance is that of the fit times χ² / (groups - 1), if that is
more than 1 (Birge 1932).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr, stdtrit

from survey.arrays import Array

__all__ = ["LIKELY", "Found", "Run", "Sample", "Shape", "critical", "fit_shapes", "powers"]

LIKELY = 1.645
"""Standard deviations by which a movement that is found in 95 of 100 surveys exceeds the critical value."""

_MOST = 5  # shapes taken by one wall; more are noise that the shapes before have left
_LEAST = 0.25  # of the largest amount taken: smaller ones are what the shapes do not fit exactly
_AS_GOOD = 6.0  # difference of t² below which the simpler of two shapes is taken: odds of 20 to 1
_NOTHING = 1e-9  # part of a shape's sum of squares that is left if the nuisance explains it [-]

Run = tuple[int, int]
"""First and last group."""


class Shape(NamedTuple):
    """A shape of movement of unit amount.

    Attributes
    ----------
    name : of its family
    places : where it lies, by family [m]
    rank : simplicity of its family, the simplest first
    """

    name: str
    places: tuple[float, ...]
    rank: int


@dataclass(frozen=True)
class Sample:
    """Departures of the stones of one wall.

    Attributes
    ----------
    values : (n,) [m]
    variance : (n,) of their scatter and measurement together [m²]
    along, up : (n,) place on the wall [m]
    group : (n,) number of the group of each, from 0
    nuisance : (n, k) columns that are free in each group
    tilt : (n,) departure by a tilt of the frame by one standard deviation [m]
    freedom : degrees of freedom of the scatter
    """

    values: Array
    variance: Array
    along: Array
    up: Array
    group: NDArray[np.intp]
    nuisance: Array
    tilt: Array
    freedom: float

    @property
    def groups(self) -> int:
        """Number of groups."""
        return int(self.group.max()) + 1


@dataclass(frozen=True)
class Found:
    """A movement that was found.

    Attributes
    ----------
    shape : its shape
    run : groups that have it
    field : (n,) the shape at every stone, 0 outside of the run
    amount, sigma : [m]
    each : (groups, 2) amount and standard deviation of every group by itself, also outside of the run; NaN if a group
        does not tell [m]
    chi2, dof : disagreement of the groups of the run
    probability : that as much is found anywhere in a wall that has not moved
    """

    shape: Shape
    run: Run
    field: Array
    amount: float
    sigma: float
    each: Array
    chi2: float
    dof: int
    probability: float


@dataclass(frozen=True)
class _Moments:
    """Sums over the stones of each group, (groups, m): squares of shapes, with the values, with the tilt."""

    squares: Array
    values: Array
    tilt: Array

    def over(
        self, run: tuple[NDArray[np.intp], NDArray[np.intp]]
    ) -> tuple[Array, Array, Array, Array, Array]:
        """Return squares, products with values and tilt, χ² and groups that tell of every run, (runs, m)."""
        tells = self.squares > 0.0
        share = np.divide(self.values**2, self.squares, out=np.zeros_like(self.squares), where=tells)
        first, last = run
        sums = []
        for one in (self.squares, self.values, self.tilt, share, tells.astype(float)):
            total = np.vstack([np.zeros(one.shape[1]), np.cumsum(one, axis=0)])
            sums.append(total[last + 1] - total[first])
        squares, values, tilt, shares, count = sums
        whole = np.divide(values**2, squares, out=np.zeros_like(squares), where=squares > 0.0)
        return squares, values, tilt, np.maximum(shares - whole, 0.0), count


def critical(alpha: float, tests: int, freedom: float) -> float:
    """Return the value of |t| that chance exceeds in any of some tests with probability α at most (Bonferroni)."""
    return float(-stdtrit(freedom, alpha / (2.0 * max(tests, 1))))


def fit_shapes(
    sample: Sample,
    shapes: Sequence[Shape],
    fields: Array,
    runs: Sequence[Run],
    alpha: float,
    follow: Callable[[Sample, Found], Found] = lambda _, found: found,
) -> tuple[list[Found], float]:
    """Find the movements of a wall.

    Parameters
    ----------
    sample : departures of its stones
    shapes : those that are looked for, m of them
    fields : (n, m) their values at the stones
    runs : of groups in which each shape may be
    alpha : probability that a wall without movement is given one
    follow : fits the field of a shape to the stones; called once for every shape that was found

    Returns
    -------
    movements, the most significant first, and the critical value of |t|
    """
    first, last = (np.array(one, dtype=np.intp) for one in zip(*runs, strict=True))
    found: list[Found] = []
    rest = sample.values
    limit = math.inf
    ranks = np.array([shape.rank for shape in shapes])
    for _ in range(_MOST):
        taken = [one.field for one in found]
        moments = _moments(sample, fields, rest)
        squares, values, tilt, chi2, count = moments.over((first, last))
        tells = squares > 0.0
        if not found:
            limit = critical(alpha, int(tells.sum()), sample.freedom)
        scale = np.maximum(1.0, chi2 / np.maximum(count - 1.0, 1.0)).astype(np.float64)
        amount = np.divide(values, squares, out=np.zeros_like(values), where=tells)
        lever = np.divide(tilt, squares, out=np.zeros_like(values), where=tells)
        variance = np.divide(scale, squares, out=np.full_like(values, np.inf), where=tells) + lever**2
        score = amount**2 / variance
        if found:
            score[np.abs(amount) < _LEAST * max(abs(one.amount) for one in found)] = 0.0
        best = float(score.max(initial=0.0))
        if best <= limit**2:
            break
        rows, columns = np.nonzero(score >= max(best - _AS_GOOD, limit**2))
        long = (last - first)[rows]
        k = np.lexsort((-score[rows, columns], -long, ranks[columns]))[0]
        run = (int(first[rows[k]]), int(last[rows[k]]))
        field = np.where((sample.group >= run[0]) & (sample.group <= run[1]), fields[:, columns[k]], 0.0)
        start = float(amount[rows[k], columns[k]])
        one = Found(shapes[int(columns[k])], run, field, start, 0.0, np.zeros((0, 2)), 0.0, 0, 0.0)
        found.append(follow(replace(sample, values=rest), one))
        fitted = _amounts(sample, [*taken, found[-1].field])
        found = [replace(one, amount=float(a)) for one, a in zip(found, fitted, strict=True)]
        rest = sample.values - np.column_stack([one.field for one in found]) @ fitted
    tests = int((_moments(sample, fields, sample.values).over((first, last))[0] > 0.0).sum())
    return [_judged(sample, found, k, fields, tests) for k in range(len(found))], limit


def powers(sample: Sample, fields: Array, run: Run) -> Array:
    """Return the standard deviations of the amounts of shapes (n, m) in a run of groups; inf where it does not tell."""
    moments = _moments(sample, fields, sample.values)
    ends = np.array([run[0]]), np.array([run[1]])
    squares, _, tilt, _, _ = (one[0] for one in moments.over(ends))
    sigma = np.full(len(squares), np.inf)
    tells = squares > 0.0
    sigma[tells] = np.sqrt(1.0 / squares[tells] + (tilt[tells] / squares[tells]) ** 2)
    return sigma


def _moments(sample: Sample, fields: Array, values: Array) -> _Moments:
    shape = (sample.groups, fields.shape[1])
    squares, products, tilts = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for k in range(sample.groups):
        own = np.flatnonzero(sample.group == k)
        root = 1.0 / np.sqrt(sample.variance[own])[:, None]
        basis = _basis(root * sample.nuisance[own])
        before = root * fields[own]
        after = before - basis @ (basis.T @ before)
        squares[k] = (after**2).sum(axis=0)
        squares[k][squares[k] <= _NOTHING * (before**2).sum(axis=0)] = 0.0
        after[:, squares[k] == 0.0] = 0.0
        products[k] = after.T @ (root[:, 0] * values[own])
        tilts[k] = after.T @ (root[:, 0] * sample.tilt[own])
    return _Moments(squares, products, tilts)


def _basis(columns: Array) -> Array:
    """Return an orthonormal basis of columns (n, k)."""
    left, size, _ = np.linalg.svd(columns, full_matrices=False)
    basis: Array = left[:, size > 1e-9 * size.max(initial=0.0)]
    return basis


def _design(sample: Sample) -> Array:
    """Return the nuisance of every group, (n, groups k)."""
    inside = sample.group[:, None] == np.arange(sample.groups)
    columns = inside[:, :, None] * sample.nuisance[:, None, :]
    design: Array = columns.reshape(len(sample.values), -1)
    return design


def _amounts(sample: Sample, fields: Sequence[Array]) -> Array:
    """Return the amounts of all shapes together."""
    root = 1.0 / np.sqrt(sample.variance)
    design = np.column_stack([*fields, _design(sample)]) * root[:, None]
    solved = np.linalg.lstsq(design, root * sample.values, rcond=None)[0]
    return np.asarray(solved[: len(fields)], dtype=np.float64)


def _judged(sample: Sample, found: Sequence[Found], k: int, fields: Array, tests: int) -> Found:
    """Return a movement with its standard deviation and the amounts of single groups, the others taken out."""
    one = found[k]
    rest = sample.values - sum(
        (f.amount * f.field for f in found if f is not one), np.zeros(len(sample.values))
    )
    inside = (sample.group >= one.run[0]) & (sample.group <= one.run[1])
    # outside of its run the shape is where its family puts it
    everywhere = np.where(inside, one.field, _outside(sample, one, fields))
    moments = _moments(sample, everywhere[:, None], rest)
    squares, values = moments.squares[:, 0], moments.values[:, 0]
    each = np.full((sample.groups, 2), np.nan)
    tells = squares > 0.0
    each[tells, 0] = values[tells] / squares[tells]
    each[tells, 1] = 1.0 / np.sqrt(squares[tells])
    ends = np.array([one.run[0]]), np.array([one.run[1]])
    total, _, tilt, chi2, count = (float(part[0, 0]) for part in moments.over(ends))
    dof = max(int(count) - 1, 0)
    sigma = math.sqrt(max(1.0, chi2 / max(dof, 1)) / total + (tilt / total) ** 2)
    chance = min(1.0, tests * 2.0 * float(stdtr(sample.freedom, -abs(one.amount) / sigma)))
    return replace(one, sigma=sigma, each=each, chi2=chi2, dof=dof, probability=chance)


def _outside(sample: Sample, one: Found, fields: Array) -> Array:
    inside = (sample.group >= one.run[0]) & (sample.group <= one.run[1])
    gaps = np.abs(fields[inside] - one.field[inside, None]).sum(axis=0)
    nearest: Array = fields[:, int(gaps.argmin())]
    return nearest
