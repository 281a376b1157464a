"""Importance sampling about design points: small probabilities from some hundred samples, without bias."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp
from scipy.stats import norm

from mechanics.arrays import Array
from pipelines.assess.study.methods.counting import Probability
from pipelines.assess.study.methods.design_points import Design
from pipelines.assess.study.methods.failure import Evaluate, Failure
from pipelines.assess.workers.store import Sample


@dataclass(frozen=True)
class Weighted:
    """Samples about design points.

    Attributes
    ----------
    points : (m, n)
    samples : there
    ratios : (m,) φ(u) over the density from which each was drawn: a mean of values times these is that of values
    """

    points: Array
    samples: list[Sample]
    ratios: Array

    def probability(self, failure: Failure, confidence: float) -> Probability:
        """Return the probability of a failure, with its interval."""
        return _estimate(failure.states(self.samples), self.ratios, confidence)

    def levels(self, values: Array, count: int) -> tuple[float, ...]:
        """Return levels of a quantity (m,): 1/count of the samples is below the least, as much above the largest."""
        known = values[np.isfinite(values)]
        if not len(known):
            return ()
        low, high = np.quantile(known, [1.0 / count, 1.0 - 1.0 / count]).tolist()
        return tuple(np.linspace(low, high, count).tolist())


def importance(
    evaluate: Evaluate,
    designs: Sequence[Design],
    count: int,
    seed: int,
) -> Weighted:
    """Return samples about design points, with the weights by which they tell probabilities.

    Each is drawn about one of the design points, at random by their probabilities, with unit variance.

    Parameters
    ----------
    count : samples
    seed : of the random numbers
    """
    weight = np.array([design.probability for design in designs])
    weight = weight / weight.sum()
    centres = np.array([design.point for design in designs])
    points = np.empty((count, centres.shape[1]))
    for number in range(count):
        random = np.random.default_rng([seed, 2, number])
        which = int(random.choice(len(designs), p=weight))
        points[number] = centres[which] + random.standard_normal(centres.shape[1])
    return Weighted(points, evaluate(points), _likelihood(points, centres, weight))


def _likelihood(points: Array, centres: Array, weight: Array) -> Array:
    """Return φ(u) over the density from which the points (m, n) were drawn."""
    exponents = points @ centres.T - 0.5 * np.sum(centres**2, axis=1)
    ratio: Array = np.exp(-logsumexp(exponents, b=weight, axis=1))
    return ratio


def _estimate(states: Array, ratios: Array, confidence: float) -> Probability:
    missing = np.isnan(states)
    fails = states < 0.0
    low_value, low_error = _mean(np.where(fails, ratios, 0.0))
    high_value, high_error = _mean(np.where(fails | missing, ratios, 0.0))
    wide = float(norm.isf(0.5 * (1.0 - confidence)))
    return Probability(
        low_value,
        high_value,
        _end(low_value, low_error, -wide),
        min(_end(high_value, high_error, wide), 1.0),
        int(fails.sum()),
        int(missing.sum()),
        len(states),
        low_error / low_value if low_value > 0.0 else float("inf"),
    )


def _mean(terms: Array) -> tuple[float, float]:
    return float(terms.mean()), float(terms.std(ddof=1) / np.sqrt(len(terms)))


def _end(value: float, error: float, wide: float) -> float:
    """Return the end of an interval of ln P, which is nearer to normal than P and never negative."""
    if value <= 0.0:
        return 0.0 if wide < 0.0 else 1.0
    return float(value * np.exp(wide * error / value))
