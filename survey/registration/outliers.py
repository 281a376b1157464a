"""Outliers among measured points: tests of single points, and the smallest set that explains all contradictions.

Every point carries a residual of two or three coordinates. In a linear adjustment with known precision, the
square Tᵢ = rᵢᵀ Qᵢ⁻¹ rᵢ of a point's residual over its own covariance Qᵢ is the decrease of the sum of squares when
the point is left out, and follows chi-square if the point is sound (Baarda 1968; here in its form for vectors,
Förstner 1987, with α₀ = 0.1 %). A single outlier is safely found by the largest T; two may hide each other, and an
outlier of metres turns the whole frame, so the search refits: it leaves out one point, then two, and so on, and
takes the first set whose absence makes all others agree. Where two sets do that about equally well, the search
reports that the wrong one cannot be identified; unless the test fails so narrowly that the choice matters little, as
happens with sound points now and then: then the likelier set is taken.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.special import chdtri

from survey.arrays import Array, Bools
from survey.conventions import ODDS, PER_MILLE, RARE

_CONTROLLED = PER_MILLE  # share of an error in the point's own residual below which it cannot be tested
_MAX_SUBSETS = 600  # number beyond which only sets that contain the best smaller one are tried
_NARROW = 1.5  # factor of a test beyond its limit below which chance is a plausible reason


@dataclass(frozen=True)
class Agreement:
    """Agreement of a set of points with its own best fit.

    Attributes
    ----------
    squares : sum of squared residuals over their variances [-]
    redundancy : number of its degrees of freedom
    tests : (n,) square root of the test quantity T of every point, nan where it cannot be tested [-]
    limits : (n,) values of `tests` that chance exceeds once in a thousand [-]
    accepted : (n,) the points that were fitted
    """

    squares: float
    redundancy: int
    tests: Array
    limits: Array
    accepted: Bools

    @property
    def failed(self) -> Bools:
        """Fitted points that contradict the others, (n,)."""
        return self.accepted & (np.nan_to_num(self.tests) > self.limits)

    @property
    def consistent(self) -> bool:
        """True if the sum of squares and every fitted point pass their tests."""
        if self.redundancy == 0:
            return True
        return self.squares <= float(chdtri(self.redundancy, RARE)) and not self.failed.any()


@dataclass(frozen=True)
class Outliers:
    """Result of the search.

    Attributes
    ----------
    rejected : points whose absence makes all others agree
    suspects : points of which some are wrong, without evidence as to which; empty if the search succeeded
    """

    rejected: tuple[int, ...] = ()
    suspects: tuple[int, ...] = ()


def point_tests(
    residuals: Array, covariances: Array, effects: Array, parameters: Array, accepted: Bools
) -> tuple[Array, Array]:
    """Test the residual of every point against its own covariance.

    Parameters
    ----------
    residuals : (n, d) observed minus adjusted
    covariances : (n, d, d) of the observations
    effects : (n, d, p) derivatives of the adjusted values by the parameters
    parameters : (p, p) covariance of the parameters
    accepted : (n,) points of the fit, whose residuals are smaller than their errors; those of the others are larger

    Returns
    -------
    tests, limits : (n,) square root of T, nan if the other points do not control it; its limit at `RARE`
    """
    whiten = np.linalg.inv(np.linalg.cholesky(covariances))
    whitened = whiten @ effects
    carried = whitened @ parameters @ whitened.transpose(0, 2, 1)
    shares, directions = np.linalg.eigh(
        np.eye(residuals.shape[1]) + np.where(accepted, -1.0, 1.0)[:, None, None] * carried
    )
    along = np.einsum("nji,njk,nk->ni", directions, whiten, residuals)
    controlled = shares > _CONTROLLED
    squares = np.where(controlled, along**2 / np.where(controlled, shares, 1.0), 0.0).sum(axis=1)
    freedom = controlled.sum(axis=1)
    tests = np.where(freedom > 0, np.sqrt(squares), np.nan)
    return tests, np.sqrt(chdtri(np.maximum(freedom, 1), RARE))


def find_outliers(count: int, smallest: int, judge: Callable[[Bools], Agreement | None]) -> Outliers:
    """Find the fewest points that have to be left out so that the others agree.

    Parameters
    ----------
    count : number of points
    smallest : number of points that have to be left, so that what is left can still be tested
    judge : the verdict on a set of points; None if it determines no fit

    Returns
    -------
    Outliers
    """
    everything = np.ones(count, dtype=bool)
    whole = judge(everything)
    if whole is not None and whole.consistent:
        return Outliers()
    best: tuple[int, ...] = ()
    for size in range(1, min(count - smallest, (count - 1) // 2) + 1):
        tried = _judged(_subsets(count, size, best), everything, judge)
        explanations = [(squares, subset) for squares, subset, consistent in tried if consistent]
        if explanations:
            return _decide(explanations, whole)
        best = min(tried)[1] if tried else best
    return Outliers(suspects=_suspects(count, whole, judge))


def _subsets(count: int, size: int, best: tuple[int, ...]) -> Iterable[tuple[int, ...]]:
    if math.comb(count, size) <= _MAX_SUBSETS:
        return combinations(range(count), size)
    return (tuple(sorted((*best, i))) for i in range(count) if i not in best)


def _judged(
    subsets: Iterable[tuple[int, ...]], everything: Bools, judge: Callable[[Bools], Agreement | None]
) -> list[tuple[float, tuple[int, ...], bool]]:
    """Return for each subset the sum of squares, itself, and whether all others agree without it."""
    out = []
    for subset in subsets:
        accepted = everything.copy()
        accepted[list(subset)] = False
        verdict = judge(accepted)
        if verdict is not None:
            out.append((verdict.squares, subset, verdict.consistent))
    return out


def _decide(explanations: list[tuple[float, tuple[int, ...]]], whole: Agreement | None) -> Outliers:
    least, best = min(explanations)
    rivals = [subset for squares, subset in explanations if squares - least < ODDS]
    narrow = whole is not None and not (np.nan_to_num(whole.tests) > _NARROW * whole.limits).any()
    if len(rivals) == 1 or narrow:
        return Outliers(rejected=best)
    return Outliers(suspects=tuple(sorted({i for subset in rivals for i in subset})))


def _suspects(
    count: int, whole: Agreement | None, judge: Callable[[Bools], Agreement | None]
) -> tuple[int, ...]:
    """Return the points that could be the only wrong one; without any, those that fail; otherwise all."""
    everything = np.ones(count, dtype=bool)
    single = _judged(combinations(range(count), 1), everything, judge)
    alone = tuple(subset[0] for _, subset, consistent in single if consistent)
    failed = () if whole is None else tuple(int(i) for i in np.flatnonzero(whole.failed))
    return alone or failed or tuple(range(count))
