"""Rank of hypotheses by what they leave unexplained and the number of their unknowns; the verdict in one line."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc, stdtrit

from pipelines.assess.diagnosis.file import Unknown
from pipelines.assess.diagnosis.fit import Fit
from survey.conventions import FEW, ODDS, PER_CENT, TAIL

STILL = "nothing has moved"
"""Name of the hypothesis without a run, to which all others are compared."""

APART = ODDS
"""Difference of AICc from which two hypotheses are told apart: a relative likelihood of a twentieth."""

QUANTILE = 1.0 - TAIL
"""Of two-sided 95 % intervals."""

_EXPLAINS = PER_CENT  # probability of so large a χ² by chance, below which a hypothesis does not explain
_CORRELATED = 1.0 - FEW  # correlation of two amplitudes beyond which they are not told apart


@dataclass(frozen=True)
class Estimate:
    """An amplitude.

    Attributes
    ----------
    name, unit : of the unknown
    value : that explains best
    low, high : ends of its 95 % interval; infinite if it is not determined
    at_bound : whether the value lies at a bound of the search
    run_sigma : standard deviation that comes from runs that do not answer smoothly; NaN if that was not tried
    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    at_bound: bool
    run_sigma: float = math.nan


@dataclass(frozen=True)
class Ranked:
    """A hypothesis with its place in the list.

    Attributes
    ----------
    name : in words
    stood : phases that stood when it acted; empty if it is not dated
    fit : its amplitudes and residuals
    dof : degrees of freedom
    probability : of so large a χ² by chance if the hypothesis is true
    aicc : χ² + 2 k with the correction for few values
    estimates : its amplitudes
    remarks : cautions about its amplitudes and runs
    tied : amplitudes that are not told apart, or have others beside them, in words
    uneven : amplitudes that scatter with the runs themselves, each with its unit
    """

    name: str
    stood: tuple[str, ...]
    fit: Fit
    dof: int
    probability: float
    aicc: float
    estimates: tuple[Estimate, ...]
    remarks: tuple[str, ...]
    tied: tuple[str, ...] = ()
    uneven: tuple[str, ...] = ()

    @property
    def explains(self) -> bool:
        """True if what it leaves may be chance."""
        return self.probability >= _EXPLAINS

    @property
    def title(self) -> str:
        """Name, with its date."""
        return (
            f"{self.name}, when {' and '.join(f'phase {phase}' for phase in self.stood)} stood"
            if self.stood
            else self.name
        )


@dataclass(frozen=True)
class Ranking:
    """All hypotheses, the best first, and the stillness beside them.

    Attributes
    ----------
    hypotheses : those with a run
    still : nothing has moved
    """

    hypotheses: tuple[Ranked, ...]
    still: Ranked

    @property
    def rivals(self) -> tuple[Ranked, ...]:
        """Others that are not told apart from the best."""
        best = self.hypotheses[0]
        return tuple(hypothesis for hypothesis in self.hypotheses[1:] if hypothesis.aicc - best.aicc < APART)


def rank(
    name: str, stood: tuple[str, ...], unknowns: Sequence[Unknown], fit: Fit, dof: int, freedom: float
) -> Ranked:
    """Return a hypothesis with its measures.

    Parameters
    ----------
    name, stood : see `Ranked`
    unknowns : of the hypothesis
    fit : its best amplitudes
    dof : of the measurements, before amplitudes are estimated
    freedom : degrees of freedom of the scatter of beds; 0: it is taken as exact
    """
    count = len(unknowns)
    redundancy = max(dof - count, 1)
    if not len(fit.residuals):
        return Ranked(name, stood, fit, redundancy, 0.0, math.inf, (), (f"not run: {fit.trouble}",))
    ratio = fit.chi2 / redundancy
    probability = float(fdtrc(redundancy, freedom or 1e9, ratio))
    aicc = fit.chi2 + 2.0 * count + 2.0 * count * (count + 1) / max(dof - count - 1, 1)
    estimated = tuple(estimates(unknowns, fit, redundancy))
    tied = tuple(_tied(unknowns, fit))
    remarks = (*_remarks(unknowns, fit, estimated), *tied)
    return Ranked(name, stood, fit, redundancy, probability, aicc, estimated, remarks, tied)


def estimates(unknowns: Sequence[Unknown], fit: Fit, dof: int) -> Iterator[Estimate]:
    """Yield the amplitudes with intervals of Student's t, widened where the residuals are larger than expected."""
    wide = float(stdtrit(dof, QUANTILE)) * max(1.0, math.sqrt(fit.chi2 / dof))
    blind = np.abs(np.array(fit.undetermined).reshape(len(fit.undetermined), len(unknowns))).max(
        axis=0, initial=0.0
    )
    for k, (unknown, value) in enumerate(zip(unknowns, fit.amplitudes, strict=True)):
        variance = fit.covariance[k, k]
        # a part of a direction that nothing feels may be as large as the bounds allow
        determined = blind[k] < 0.1 and math.isfinite(variance)
        half = wide * math.sqrt(variance) if determined else math.inf
        margin = 1e-6 * (unknown.high - unknown.low)
        bound = min(value - unknown.low, unknown.high - value) <= margin
        yield Estimate(unknown.name, unknown.unit, value, value - half, value + half, bound)


def _remarks(unknowns: Sequence[Unknown], fit: Fit, estimated: Sequence[Estimate]) -> Iterator[str]:
    names = [unknown.name for unknown in unknowns]
    if fit.trouble:
        yield fit.trouble
    for estimate in estimated:
        if estimate.at_bound:
            yield f"{estimate.name} lies at a bound of its range"
    for direction in fit.undetermined:
        parts = [
            f"{component:+.2f} {name}"
            for component, name in zip(direction, names, strict=True)
            if abs(component) > 0.1
        ]
        directions = " ".join(parts) if len(parts) > 1 else parts[0].split()[1]
        yield f"not determined, as it moves nothing that was measured: {directions}"


def _tied(unknowns: Sequence[Unknown], fit: Fit) -> Iterator[str]:
    """Yield the pairs of amplitudes of which the measurements tell a combination alone."""
    names = [unknown.name for unknown in unknowns]
    sigma = np.sqrt(np.diag(fit.covariance))
    for i in range(len(names)):
        for k in range(i):
            correlation = fit.covariance[i, k] / (sigma[i] * sigma[k]) if sigma[i] * sigma[k] > 0.0 else 0.0
            if abs(correlation) > _CORRELATED:
                yield f"{names[k]} and {names[i]} cannot be told apart: their correlation is {correlation:+.3f}"


def with_others(ranked: Ranked, tried: Mapping[tuple[float, ...], float]) -> Ranked:
    """Return a hypothesis that tells amplitudes outside its intervals with which it explains as well.

    Where residuals are linear in the amplitudes there are none; where they are not, intervals are too narrow.

    Parameters
    ----------
    ranked : with its intervals
    tried : χ² of the amplitudes at which runs were made
    """
    more = float(stdtrit(ranked.dof, QUANTILE)) ** 2 * max(1.0, ranked.fit.chi2 / ranked.dof)
    beyond = {
        place: max(
            abs(x - estimate.value) / max(estimate.high - estimate.value, 1e-300)
            for estimate, x in zip(ranked.estimates, place, strict=True)
        )
        for place, chi2 in tried.items()
        if chi2 < ranked.fit.chi2 + more
    }
    farthest = max(beyond, key=lambda place: beyond[place], default=())
    if not farthest or beyond[farthest] <= 1.0:
        return ranked
    amounts = " and ".join(
        f"{estimate.name} = {x:.3g} {estimate.unit}"
        for estimate, x in zip(ranked.estimates, farthest, strict=True)
    )
    remark = f"{amounts} explains as well, so that its intervals are too narrow"
    return replace(ranked, remarks=(*ranked.remarks, remark), tied=(*ranked.tied, remark))


def verdict(ranking: Ranking) -> str:
    """Return the verdict in one line, with its caution."""
    best, still = ranking.hypotheses[0], ranking.still
    chi2 = f"χ² {best.fit.chi2:.4g} of {best.dof}, {still.fit.chi2:.4g} of {still.dof} if nothing had moved"
    if still.explains and still.aicc - best.aicc < APART:
        return (
            f"no movement is needed to explain what was measured: χ² {still.fit.chi2:.4g} of {still.dof} without any; "
            "CAUTION: movements that are small against the scatter of beds are not seen"
        )
    if not len(best.fit.residuals):
        return f"NONE OF THESE could be run; of {best.title!r}: {best.fit.trouble}; CAUTION: that excludes nothing"
    uneven = (
        f"runs do not answer smoothly: {' and '.join(best.uneven)} from run to run" if best.uneven else ""
    )
    if not best.explains:
        return (
            f"NONE OF THESE EXPLAINS what was measured; the best of them is {best.title!r} ({chi2}); "
            f"CAUTION: {uneven or 'its amounts are no estimates of anything'}"
        )
    rivals = [rival for rival in ranking.rivals if rival.name != best.name]
    names = " and ".join(repr(rival.name) for rival in rivals)
    unclear = (
        f"it cannot be told apart from {names}"
        if rivals
        else "a cause that is not in the list may move the stones alike"
    )
    caution = f"CAUTION: {'; '.join(filter(None, (best.fit.trouble, uneven, *best.tied, unclear)))}"
    amounts = "; ".join(_amount(estimate) for estimate in best.estimates)
    return f"{best.title!r} explains what was measured ({chi2}){f': {amounts}' if amounts else ''}; {caution}"


def _amount(estimate: Estimate) -> str:
    """Return an amplitude with its interval in words."""
    if not math.isfinite(estimate.low):
        return f"{estimate.name} is not determined"
    half = estimate.high - estimate.value
    digits = max(0, 1 - math.floor(math.log10(half))) if half > 0.0 else 6
    return f"{estimate.name} = {estimate.value:.{digits}f} ± {half:.{digits}f} {estimate.unit} (95 %)"
