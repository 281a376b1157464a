"""Statistics of independent samples: moments, probabilities with exact intervals, and fragility curves.

A sample that failed, is undecided or was lost may stand for a fall or for none. So a probability is given from both
sides: as if all of them stood, and as if all of them fell.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import beta, norm, t

from mechanics.arrays import Array


@dataclass(frozen=True)
class Estimate:
    """Mean with its interval.

    Attributes
    ----------
    value, sigma : mean and standard deviation of the samples
    low, high : interval of the mean
    count : samples
    share : of the variance that a control variate leaves; 1 without one
    """

    value: float
    sigma: float
    low: float
    high: float
    count: int
    share: float = 1.0


@dataclass(frozen=True)
class Probability:
    """Probability of failure.

    Attributes
    ----------
    low_value, high_value : estimates as if all samples without an answer stood, and fell
    low, high : interval around both
    failing, unknown, count : samples that fail, that have no answer, and all
    cov : coefficient of variation of the lower estimate; infinite where nothing fails
    """

    low_value: float
    high_value: float
    low: float
    high: float
    failing: int
    unknown: int
    count: int
    cov: float = float("inf")

    @property
    def index(self) -> tuple[float, float]:
        """Reliability indices β of the upper and of the lower end of the interval."""
        return reliability_index(self.high), reliability_index(self.low)


def reliability_index(probability: float) -> float:
    """Return β = -Φ⁻¹(P).

    >>> round(reliability_index(3.907e-3), 3)
    2.66
    """
    return float(-norm.ppf(min(max(probability, float(np.finfo(np.float64).tiny)), 1.0 - 1e-16)))


def probability(states: Array, confidence: float) -> Probability:
    """Return the probability that g < 0 with the interval of Clopper and Pearson.

    Parameters
    ----------
    states : (m,) g of independent samples; NaN where not known
    confidence : of the interval [-]

    >>> found = probability(np.array([1.0, -1.0, np.nan, 2.0]), 0.95)
    >>> found.low_value, found.high_value
    (0.25, 0.5)
    """
    count, missing = len(states), int(np.isnan(states).sum())
    failing = int((states < 0.0).sum())
    low, _ = _clopper_pearson(failing, count, confidence)
    _, high = _clopper_pearson(failing + missing, count, confidence)
    share = failing / count
    cov = float(np.sqrt((1.0 - share) / failing)) if failing else float("inf")
    return Probability(share, (failing + missing) / count, low, high, failing, missing, count, cov)


def _clopper_pearson(hits: int, count: int, confidence: float) -> tuple[float, float]:
    tail = 0.5 * (1.0 - confidence)
    low = 0.0 if hits == 0 else float(beta.ppf(tail, hits, count - hits + 1))
    high = 1.0 if hits == count else float(beta.isf(tail, hits + 1, count - hits))
    return low, high


def mean_of(values: Array, confidence: float) -> Estimate:
    """Return the mean of values (m,) with Student's interval; NaN are left out."""
    known = values[np.isfinite(values)]
    count = len(known)
    if count < 2:
        mean = float(known.mean()) if count else float("nan")
        return Estimate(mean, float("nan"), float("-inf"), float("inf"), count)
    mean, sigma = float(known.mean()), float(known.std(ddof=1))
    half = float(t.isf(0.5 * (1.0 - confidence), count - 1)) * sigma / np.sqrt(count)
    return Estimate(mean, sigma, mean - half, mean + half, count)


def controlled(
    values: Array, control: Array, expected: float, confidence: float, error: float = 0.0
) -> Estimate:
    """Return the mean of values (m,) by a control variate of known mean, with its interval.

    The mean of values - b (control - expected) is that of the values, with less variance where both go together; b
    is the slope of their regression.

    Parameters
    ----------
    control : (m,) another quantity of the same samples
    expected : its mean
    error : half of the interval of that mean at the same confidence, from other samples; 0: it is exact
    """
    chosen = np.isfinite(values) & np.isfinite(control)
    known, other = values[chosen], control[chosen] - expected
    spread, count = float(known.var(ddof=1)) if len(known) > 1 else 0.0, len(known)
    if count < 4 or spread == 0.0 or float(other.var()) == 0.0:
        return mean_of(values, confidence)
    slope, mean = np.polyfit(other, known, 1)
    rest = float(np.sum((known - mean - slope * other) ** 2)) / (count - 2)
    # variance of the intercept of the regression
    lever = 1.0 / count + other.mean() ** 2 / float(np.sum((other - other.mean()) ** 2))
    half = float(np.hypot(t.isf(0.5 * (1.0 - confidence), count - 2) * np.sqrt(rest * lever), slope * error))
    value = float(mean)
    return Estimate(value, float(np.sqrt(spread)), value - half, value + half, count, rest / spread)


def quantiles(values: Array, shares: Sequence[float]) -> list[float]:
    """Return the quantiles of the values that are known."""
    known = values[np.isfinite(values)]
    return [float(np.quantile(known, share)) if len(known) else float("nan") for share in shares]


def fragility(
    values: Array, levels: Sequence[float], above: bool, confidence: float
) -> list[tuple[float, Probability]]:
    """Return the probability of failure at each level of a quantity (m,), with its interval."""
    sign = -1.0 if above else 1.0
    return [(level, probability(sign * (values - level), confidence)) for level in levels]
