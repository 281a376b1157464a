"""Which measured points contradict the others: tests of single points, and the smallest set that explains all.

Every point carries a residual of two or three coordinates. In a linear adjustment with known precision, the
square Tᵢ = rᵢᵀ Qᵢ⁻¹ rᵢ of a point's residual over its own covariance Qᵢ is what the sum of squares loses when the
point is left out, and follows chi-square if the point is sound (Baarda 1968; here in its form for vectors,
Förstner 1987, with α₀ = 0.1 %). One blunder is safely found by the largest T; two may hide each other, and a
blunder of metres turns the whole frame, so the search refits: it leaves out one point, then two, and so on, and
takes the first set whose absence makes all others agree. Where two sets do that about equally well, nobody can
tell which one is wrong, and the search says so; unless the test is failed so narrowly that the choice matters
little, as sound points do now and then: then the likelier set is taken.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.special import chdtri

from survey.arrays import Array, Bools

__all__ = ["LEVEL", "Blunders", "Verdict", "find_blunders", "point_tests"]


LEVEL = 1e-3
"""Probability that a sound point, or a sound set of points, is called wrong: Baarda's α₀."""

_CONTROLLED = 1e-3  # part of an error that shows in the point's own residual, below which it cannot be tested
_MAX_SUBSETS = 600  # beyond, only sets that contain the best smaller one are tried
_RIVAL = 6.0  # difference of the sums of squares at which one explanation is 20 times likelier than another
_NARROW = 1.5  # a test beyond its limit by less than this factor may well be chance


@dataclass(frozen=True)
class Verdict:
    """How a set of points agrees with its own best fit.

    Attributes
    ----------
    squares : sum of squared residuals over their variances [-]
    redundancy : number of its degrees of freedom
    tests : (n,) square root of the test quantity T of every point, nan where it cannot be tested [-]
    limits : (n,) what chance exceeds once in a thousand [-]
    accepted : (n,) the points that were fitted
    """

    squares: float
    redundancy: int
    tests: Array
    limits: Array
    accepted: Bools

    @property
    def failed(self) -> Bools:
        """(n,) fitted points that contradict the others."""
        return self.accepted & (np.nan_to_num(self.tests) > self.limits)

    @property
    def consistent(self) -> bool:
        """Whether the sum of squares and every fitted point pass their tests."""
        if self.redundancy == 0:
            return True
        return self.squares <= float(chdtri(self.redundancy, LEVEL)) and not self.failed.any()


@dataclass(frozen=True)
class Blunders:
    """What the search found.

    Attributes
    ----------
    rejected : points whose absence makes all others agree
    suspects : not empty: something is wrong, in some of these points, and it cannot be told in which
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
    accepted : (n,) points that took part in the fit: their residual is less than their error, others' more

    Returns
    -------
    tests, limits : (n,) square root of T, nan if nothing of the point is controlled; its limit at `LEVEL`
    """
    whiten = np.linalg.inv(np.linalg.cholesky(covariances))
    own = whiten @ effects
    carried = own @ parameters @ own.transpose(0, 2, 1)
    shares, directions = np.linalg.eigh(
        np.eye(residuals.shape[1]) + np.where(accepted, -1.0, 1.0)[:, None, None] * carried
    )
    along = np.einsum("nji,njk,nk->ni", directions, whiten, residuals)
    controlled = shares > _CONTROLLED
    squares = np.where(controlled, along**2 / np.where(controlled, shares, 1.0), 0.0).sum(axis=1)
    freedom = controlled.sum(axis=1)
    tests = np.where(freedom > 0, np.sqrt(squares), np.nan)
    return tests, np.sqrt(chdtri(np.maximum(freedom, 1), LEVEL))


def find_blunders(count: int, smallest: int, judge: Callable[[Bools], Verdict | None]) -> Blunders:
    """Find the fewest points that have to be left out so that the others agree.

    Parameters
    ----------
    count : number of points
    smallest : number of points that have to be left, so that what is left can still be tested
    judge : the verdict on a set of points; None if it determines no fit

    Returns
    -------
    Blunders
    """
    everything = np.ones(count, dtype=bool)
    whole = judge(everything)
    if whole is not None and whole.consistent:
        return Blunders()
    best: tuple[int, ...] = ()
    for size in range(1, min(count - smallest, (count - 1) // 2) + 1):
        tried = _judged(_subsets(count, size, best), everything, judge)
        explanations = [(squares, subset) for squares, subset, consistent in tried if consistent]
        if explanations:
            return _decide(explanations, whole)
        best = min(tried)[1] if tried else best
    return Blunders(suspects=_suspects(count, whole, judge))


def _subsets(count: int, size: int, best: tuple[int, ...]) -> Iterable[tuple[int, ...]]:
    if math.comb(count, size) <= _MAX_SUBSETS:
        return combinations(range(count), size)
    return (tuple(sorted((*best, i))) for i in range(count) if i not in best)


def _judged(
    subsets: Iterable[tuple[int, ...]], everything: Bools, judge: Callable[[Bools], Verdict | None]
) -> list[tuple[float, tuple[int, ...], bool]]:
    """Sum of squares, subset and whether all agree once the subset is left out."""
    out = []
    for subset in subsets:
        accepted = everything.copy()
        accepted[list(subset)] = False
        verdict = judge(accepted)
        if verdict is not None:
            out.append((verdict.squares, subset, verdict.consistent))
    return out


def _decide(explanations: list[tuple[float, tuple[int, ...]]], whole: Verdict | None) -> Blunders:
    least, best = min(explanations)
    rivals = [subset for squares, subset in explanations if squares - least < _RIVAL]
    narrow = whole is not None and not (np.nan_to_num(whole.tests) > _NARROW * whole.limits).any()
    if len(rivals) == 1 or narrow:
        return Blunders(rejected=best)
    return Blunders(suspects=tuple(sorted({i for subset in rivals for i in subset})))


def _suspects(count: int, whole: Verdict | None, judge: Callable[[Bools], Verdict | None]) -> tuple[int, ...]:
    """Points of which something is wrong: those that alone could be it, else those that fail, else all."""
    everything = np.ones(count, dtype=bool)
    single = _judged(combinations(range(count), 1), everything, judge)
    alone = tuple(subset[0] for _, subset, consistent in single if consistent)
    failed = () if whole is None else tuple(int(i) for i in np.flatnonzero(whole.failed))
    return alone or failed or tuple(range(count))
