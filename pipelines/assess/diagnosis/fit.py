"""Gauss–Newton for few amplitudes within bounds, by finite differences over runs.

In each turn the residuals r at amplitudes x and at x + δ eᵢ are asked for together, so that they can be computed side
by side. J eᵢ = (r(x + δ eᵢ) - r(x)) / δ; the step minimises |r + J s|² within the bounds, and is halved as long as the
sum of squares grows. The search ends where a step promises to lower χ² by less than a fiftieth.

Derivatives say nothing below a threshold, as of the shaking under which stones begin to slide. Where they are zero at
the start, where its run fails, and where it is asked for, the range is scanned first: the search begins with the best.
"""

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import lsq_linear

from mechanics.arrays import Array
from pipelines.assess.diagnosis.file import Unknown
from survey.conventions import NEGLIGIBLE, NOTICEABLE, ROUNDS

_TURNS = 12  # of the search
_ENOUGH = NEGLIGIBLE  # fall of χ² that a step must promise [-]
_HALVINGS = ROUNDS  # of a step that makes χ² grow
_SCANNED = 8  # values across a range that are tried where the start says nothing; fewer of each of several
_FELT = (
    NOTICEABLE  # change of the residuals over the whole range below which a direction is not determined [-]
)

Ask = Generator[list[tuple[float, ...]], list[Array | str], "Fit"]
"""Search that asks for the residuals (m,) at amplitudes; the answer is a text where a run has failed."""


@dataclass(frozen=True)
class Fit:
    """Amplitudes that explain the measurements best.

    Attributes
    ----------
    amplitudes : (k,) in the units of the unknowns
    residuals : (m,) there, standardised
    covariance : (k, k) if the residuals have unit variance; of determined directions alone
    undetermined : directions (k,) in units of the ranges to which the residuals do not answer
    turns : of the search
    trouble : reason why the search ended before its goal; empty if it did not
    """

    amplitudes: tuple[float, ...]
    residuals: Array
    covariance: Array
    undetermined: tuple[tuple[float, ...], ...]
    turns: int
    trouble: str = ""

    @property
    def chi2(self) -> float:
        """Sum of the squares of the residuals."""
        return float(self.residuals @ self.residuals)


def fit(unknowns: Sequence[Unknown]) -> Ask:
    """Search for the amplitudes; a generator that is sent the residuals for which it asks.

    >>> search = fit([Unknown("settlement", "m", 0.0, -1.0, 1.0, 0.1)])
    >>> asked = next(search)
    >>> while True:
    ...     try:
    ...         asked = search.send([np.array([10.0 * x[0] - 3.0, 10.0 * x[0] - 3.2, 0.5]) for x in asked])
    ...     except StopIteration as end:
    ...         found = end.value
    ...         break
    >>> round(found.amplitudes[0], 6), round(float(found.covariance[0, 0]), 6)
    (0.31, 0.005)
    """
    low, high, step = (
        np.array([getattr(unknown, name) for unknown in unknowns]) for name in ("low", "high", "change")
    )
    span = high - low
    best = np.array([unknown.start for unknown in unknowns], dtype=np.float64)
    answer = yield _asked(best, step, high)
    residuals, jacobian, trouble = _read(answer, best, step, high)
    turns = 1
    places = _scan(unknowns, best, residuals, jacobian)
    if places:
        answer = yield places
        least = _least(places, answer, residuals)
        if least is not None:
            best = np.array(least)
            answer = yield _asked(best, step, high)
            residuals, jacobian, trouble = _read(answer, best, step, high)
            turns += 1
    if residuals is None:
        return Fit(tuple(best.tolist()), np.zeros(0), np.zeros((len(best),) * 2), (), 1, trouble)
    while jacobian is not None and len(best):
        # the least change among all that lower χ² as much: a direction without effect is left alone
        scaled = jacobian * span
        bounds = (low - best) / span - 1e-12, (high - best) / span + 1e-12
        change = span * lsq_linear(scaled, -residuals, bounds).x
        promised = residuals @ residuals - float(((residuals + jacobian @ change) ** 2).sum())
        if promised < _ENOUGH:
            break
        trial = None
        for _ in range(_HALVINGS + 1):
            if turns == _TURNS:
                trouble = f"not converged in {_TURNS} turns"
                break
            turns += 1
            there = np.clip(best + change, low, high)
            answer = yield _asked(there, step, high)
            trial = _read(answer, there, step, high)
            if trial[0] is not None and trial[0] @ trial[0] < residuals @ residuals:
                break
            trial, change = None, 0.5 * change
        if trial is None:
            # the model answers more coarsely than the step that is left
            break
        best, (residuals, jacobian, trouble) = there, trial
        assert residuals is not None
    covariance, undetermined = _covariance(jacobian, span)
    return Fit(tuple(best.tolist()), residuals, covariance, undetermined, turns, trouble)


def _scan(
    unknowns: Sequence[Unknown], start: Array, residuals: Array | None, jacobian: Array | None
) -> list[tuple[float, ...]]:
    """Return the places to be tried before the search: a grid over the unknowns that ask for it, or do not answer."""
    blind = [
        residuals is None
        or (jacobian is not None and np.linalg.norm(jacobian[:, k]) * (unknown.high - unknown.low) < _FELT)
        for k, unknown in enumerate(unknowns)
    ]
    few = max(2, _SCANNED // max(1, sum(blind)))
    counts = [
        unknown.scan or (few if unanswered else 0)
        for unknown, unanswered in zip(unknowns, blind, strict=True)
    ]
    if not any(counts):
        return []
    values = [
        [float(unknown.low + (unknown.high - unknown.low) * (i + 0.5) / count) for i in range(count)]
        if count
        else [float(x)]
        for unknown, count, x in zip(unknowns, counts, start, strict=True)
    ]
    return list(product(*values))


def _least(
    places: Sequence[tuple[float, ...]], answer: Sequence[Array | str], residuals: Array | None
) -> tuple[float, ...] | None:
    """Return the place with the least χ², if it is less than that of the start."""
    answered = [
        (float(residual @ residual), place)
        for residual, place in zip(answer, places, strict=True)
        if not isinstance(residual, str)
    ]
    chi2, best = min(answered, default=(np.inf, None))
    return best if residuals is None or chi2 < float(residuals @ residuals) - _ENOUGH else None


def _asked(place: Array, step: Array, high: Array) -> list[tuple[float, ...]]:
    """Return a place and, for each amplitude, one beside it, within the bounds."""
    return [
        tuple(place.tolist()),
        *(tuple((place + step_of).tolist()) for step_of in np.diag(_steps(place, step, high))),
    ]


def _steps(place: Array, step: Array, high: Array) -> Array:
    return np.where(place + step <= high, step, -step)


def _read(
    answer: Sequence[Array | str], place: Array, step: Array, high: Array
) -> tuple[Array | None, Array | None, str]:
    """Return residuals and Jacobian, None where a run has failed, and the reason."""
    first, *others = answer
    if isinstance(first, str):
        return None, None, first
    columns = []
    for residual, delta in zip(others, _steps(place, step, high), strict=True):
        if isinstance(residual, str):
            return first, None, residual
        columns.append((residual - first) / delta)
    return first, np.array(columns).reshape(len(columns), len(first)).T, ""


def _covariance(jacobian: Array | None, span: Array) -> tuple[Array, tuple[tuple[float, ...], ...]]:
    """Return the inverse of JᵀJ over the directions that the residuals feel, and the others."""
    if jacobian is None or not len(span):
        return np.full((len(span),) * 2, np.nan), ()
    _, values, directions = np.linalg.svd(jacobian * span, full_matrices=False)
    felt = values > _FELT
    inverse = (directions[felt].T / values[felt] ** 2) @ directions[felt]
    return inverse * np.outer(span, span), tuple(map(tuple, directions[~felt].tolist()))
