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
from scipy.special import ndtri, stdtr, stdtrit

from survey.arrays import Array
from survey.conventions import FEW, LEAST, ODDS, PER_CENT, SOME, VANISHING

LIKELY = -float(ndtri(FEW))
"""Standard deviations by which a movement that is found in 95 of 100 surveys exceeds the critical value."""

MOST = 5
"""Shapes that are taken by one wall; more are noise that the shapes before have left."""

_MIN_SHARE_OF_LARGEST = (
    SOME  # of the largest amount taken: smaller ones are what the shapes do not fit exactly
)
_AS_GOOD = ODDS  # difference of Σ r²/v below which the simpler of two shapes is taken: odds of 20 to 1
_NEARLY = PER_CENT  # the same, of the whole reduction: no wall moves exactly like a shape

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
        for column in (self.squares, self.values, self.tilt, share, tells.astype(float)):
            total = np.vstack([np.zeros(column.shape[1]), np.cumsum(column, axis=0)])
            sums.append(total[last + 1] - total[first])
        squares, values, tilt, shares, count = sums
        whole = np.divide(values**2, squares, out=np.zeros_like(squares), where=squares > 0.0)
        return squares, values, tilt, np.maximum(shares - whole, 0.0), count


def millimetres(amount: float, sigma: float, digits: int = 1) -> str:
    """Return an amount [m] and its σ in words; a σ that would be rounded to nothing is one of the last digit."""
    last = 10.0**-digits
    return f"{abs(amount) * 1e3:.{digits}f} ± {max(sigma * 1e3, last):.{digits}f} mm"


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
    ends = tuple(np.array(bounds, dtype=np.intp) for bounds in zip(*runs, strict=True))
    fits: list[Found] = []
    rest, limit, tests = sample.values, math.inf, 0
    for _ in range(MOST):
        trials = _Trials.of(_moments(sample, fields, rest), (ends[0], ends[1]))
        if not fits:
            tests = int(trials.tells.sum())
            limit = critical(alpha, tests, sample.freedom)
        enough = max(LEAST, _MIN_SHARE_OF_LARGEST * max((abs(fit.amount) for fit in fits), default=0.0))
        score = np.where(np.abs(trials.amount) < enough, 0.0, trials.score)
        if float(score.max(initial=0.0)) <= limit**2:
            break
        now = replace(sample, values=rest)
        best = [
            follow(now, family)
            for family in _best_of_families(sample, shapes, fields, ends, trials, score, limit)
        ]
        gains = [_gain(now, fit) for fit in best]
        good = max(gains) - max(_AS_GOOD, _NEARLY * max(gains))
        chosen = min(
            (fit for fit, gain in zip(best, gains, strict=True) if gain >= good),
            key=lambda fit: fit.shape.rank,
        )
        fits = _fitted(sample, [*fits, chosen])
        rest = _rest(sample, fits)
    while fits:
        judged = [_judged(sample, fits, k, fields, tests) for k in range(len(fits))]
        most = max(abs(fit.amount) for fit in judged)
        enough = max(LEAST, _MIN_SHARE_OF_LARGEST * most)
        weak = [fit for fit in judged if abs(fit.amount) <= max(limit * fit.sigma, enough)]
        if not weak:
            return judged, limit
        least = min(weak, key=lambda fit: abs(fit.amount) / fit.sigma)
        fits = _fitted(sample, [fit for fit in fits if fit.field is not least.field])
    return [], limit


def _fitted(sample: Sample, fits: Sequence[Found]) -> list[Found]:
    """Return movements with the amounts that fit best together."""
    if not fits:
        return []
    amounts = _amounts(sample, [fit.field for fit in fits])
    return [replace(fit, amount=float(amount)) for fit, amount in zip(fits, amounts, strict=True)]


def _rest(sample: Sample, fits: Sequence[Found]) -> Array:
    """Return what movements leave of the departures."""
    rest: Array = sample.values - sum((fit.amount * fit.field for fit in fits), np.zeros(len(sample.values)))
    return rest


@dataclass(frozen=True)
class _Trials:
    """Every shape in every run, (runs, m): whether it tells, its amount, the reduction of Σ r²/v, and t²."""

    tells: NDArray[np.bool_]
    amount: Array
    gain: Array
    score: Array

    @classmethod
    def of(cls, moments: "_Moments", ends: tuple[NDArray[np.intp], NDArray[np.intp]]) -> "_Trials":
        """Try all shapes in all runs."""
        squares, values, tilt, chi2, count = moments.over(ends)
        tells = squares > 0.0
        safe = np.where(tells, squares, 1.0)
        scale = np.maximum(1.0, chi2 / np.maximum(count - 1.0, 1.0))
        amount = np.where(tells, values / safe, 0.0)
        variance = scale / safe + (tilt / safe) ** 2
        gain = np.where(tells, values**2 / safe / (1.0 + tilt**2 / safe), 0.0)
        return cls(tells, amount, gain, np.where(tells, amount**2 / variance, 0.0))


def _best_of_families(
    sample: Sample,
    shapes: Sequence[Shape],
    fields: Array,
    ends: tuple[NDArray[np.intp], ...],
    trials: _Trials,
    score: Array,
    limit: float,
) -> list[Found]:
    """Return of each family the shape and run that explain most: significant ones or, without any, all of them."""
    names = np.array([shape.name for shape in shapes])
    fits = []
    for name in dict.fromkeys(names.tolist()):
        members = names == name
        allowed = (
            members & (score > limit**2) if (score[:, members] > limit**2).any() else members & (score > 0.0)
        )
        gain = np.where(allowed, trials.gain, 0.0)
        row, column = np.unravel_index(int(gain.argmax()), gain.shape)
        if gain[row, column] <= limit**2:
            continue
        run = (int(ends[0][row]), int(ends[1][row]))
        inside = (sample.group >= run[0]) & (sample.group <= run[1])
        field = np.where(inside, fields[:, column], 0.0)
        amount = float(trials.amount[row, column])
        fits.append(Found(shapes[int(column)], run, field, amount, 0.0, np.zeros((0, 2)), 0.0, 0, 0.0))
    return fits


def _gain(sample: Sample, fit: Found) -> float:
    """Return the reduction of Σ r²/v by a shape in its run."""
    moments = _moments(sample, fit.field[:, None], sample.values)
    ends = np.array([fit.run[0]]), np.array([fit.run[1]])
    return float(_Trials.of(moments, ends).gain[0, 0])


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
        members = np.flatnonzero(sample.group == k)
        root = 1.0 / np.sqrt(sample.variance[members])[:, None]
        basis = _basis(root * sample.nuisance[members])
        before = root * fields[members]
        after = before - basis @ (basis.T @ before)
        squares[k] = (after**2).sum(axis=0)
        squares[k][squares[k] <= VANISHING * (before**2).sum(axis=0)] = 0.0
        after[:, squares[k] == 0.0] = 0.0
        products[k] = after.T @ (root[:, 0] * values[members])
        tilts[k] = after.T @ (root[:, 0] * sample.tilt[members])
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


def _variance(sample: Sample, fits: Sequence[Found], k: int) -> float:
    """Return the variance of the amount of one of the shapes that are fitted together."""
    root = 1.0 / np.sqrt(sample.variance)
    fields = np.column_stack([fit.field for fit in fits]) * root[:, None]
    basis = _basis(_design(sample) * root[:, None])
    fields = fields - basis @ (basis.T @ fields)
    return float(np.linalg.pinv(fields.T @ fields)[k, k])


def _judged(sample: Sample, fits: Sequence[Found], k: int, fields: Array, tests: int) -> Found:
    """Return a movement with its standard deviation and the amounts of single groups, the others taken out."""
    fit = fits[k]
    inside = (sample.group >= fit.run[0]) & (sample.group <= fit.run[1])
    others = [f for f in fits if f is not fit]
    # what other groups alone have is not taken out of them: what it has in common with this one tells its age
    shared = [f for f in others if f.run[0] <= fit.run[0] and fit.run[1] <= f.run[1]]
    rest = np.where(inside, _rest(sample, others), _rest(sample, shared))
    # outside of its run the shape is where its family puts it
    everywhere = np.where(inside, fit.field, _outside(sample, fit, fields))
    moments = _moments(sample, everywhere[:, None], rest)
    squares, values = moments.squares[:, 0], moments.values[:, 0]
    each = np.full((sample.groups, 2), np.nan)
    tells = squares > 0.0
    each[tells, 0] = values[tells] / squares[tells]
    each[tells, 1] = 1.0 / np.sqrt(squares[tells])
    ends = np.array([fit.run[0]]), np.array([fit.run[1]])
    total, _, tilt, chi2, count = (float(part[0, 0]) for part in moments.over(ends))
    dof = max(int(count) - 1, 0)
    variance = max(_variance(sample, fits, k), 1.0 / total) * max(1.0, chi2 / max(dof, 1))
    sigma = math.sqrt(variance + (tilt / total) ** 2)
    chance = min(1.0, tests * 2.0 * float(stdtr(sample.freedom, -abs(fit.amount) / sigma)))
    return replace(fit, sigma=sigma, each=each, chi2=chi2, dof=dof, probability=chance)


def _outside(sample: Sample, fit: Found, fields: Array) -> Array:
    inside = (sample.group >= fit.run[0]) & (sample.group <= fit.run[1])
    gaps = np.abs(fields[inside] - fit.field[inside, None]).sum(axis=0)
    nearest: Array = fields[:, int(gaps.argmin())]
    return nearest
