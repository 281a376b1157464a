"""Subset simulation (Au & Beck 2001): small probabilities without gradients, level by level.

Each level holds the tenth of the samples that is nearest to failure; chains from them, by conditional moves
(Papaioannou et al. 2015), fill the next. Samples without an answer count as standing in the lower estimate; their
number bounds the upper one.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from mechanics.arrays import Array, Bools, Ints
from pipelines.assess.study.methods.counting import Probability
from pipelines.assess.study.methods.failure import Evaluate, Failure
from survey.conventions import TENTH

_SHARE = TENTH  # of the samples of a level from which the next begins [-]
_CORRELATION = 0.8
"""Correlation of a move with the point before: less is refused too often, more moves too little [-]."""
_LEVELS = 12  # at most: P of 10⁻¹²


@dataclass(frozen=True)
class Subset:
    """Result of subset simulation.

    Attributes
    ----------
    probability : of failure
    evaluations : samples taken
    levels : of g
    complete : failure was reached
    curve : levels of g, from the largest to zero, and the probability that g is less
    states : (m,) g of the first level, which are independent samples
    """

    probability: Probability
    evaluations: int
    levels: tuple[float, ...]
    complete: bool
    curve: tuple[tuple[float, Probability], ...]
    states: Array


def subset(
    evaluate: Evaluate, failure: Failure, dimension: int, count: int, seed: int, confidence: float
) -> Subset:
    """Return the probability of failure with `count` samples of each level."""
    kept = max(2, int(_SHARE * count))
    points = np.array(
        [np.random.default_rng([seed, 3, number]).standard_normal(dimension) for number in range(count)]
    )
    states = failure.states(evaluate(points))
    used, missing, share, variance = count, int(np.isnan(states).sum()), 1.0, 0.0
    levels: list[float] = []
    curve: list[tuple[float, Probability]] = []
    independent = states
    chains: Ints = np.arange(count)
    for level in range(_LEVELS):
        order = np.argsort(np.where(np.isnan(states), np.inf, states), kind="stable")
        threshold = float(states[order[kept - 1]])
        if not np.isfinite(threshold):
            break
        bound = max(threshold, 0.0)
        inside = np.where(np.isnan(states), False, states < bound if bound == 0.0 else states <= bound)
        hit = float(inside.mean())
        variance += _variance(inside, chains, level)
        if bound == 0.0:
            failing = int(inside.sum())
            found = _bounded(share * hit, variance, failing, missing, used, confidence)
            curve.append((0.0, found))
            return Subset(found, used, tuple(levels), True, tuple(curve), independent)
        share *= hit
        curve.append((threshold, _bounded(share, variance, int(inside.sum()), missing, used, confidence)))
        levels.append(threshold)
        seeds = order[: int(inside.sum())]
        points, states, chains, lost = _grown(
            evaluate, failure, points[seeds], states[seeds], count, threshold, [seed, 4, level]
        )
        used += count - len(seeds)
        missing += lost
    found = _bounded(share, variance, 0, missing, used, confidence)
    return Subset(found, used, tuple(levels), False, tuple(curve), independent)


def _grown(
    evaluate: Evaluate,
    failure: Failure,
    points: Array,
    states: Array,
    count: int,
    threshold: float,
    seed: list[int],
) -> tuple[Array, Array, Ints, int]:
    """Return the points (count, n) of the next level, g, the number of the chain of each, and moves without answer."""
    chain = np.arange(len(points))
    every, known, chains, missing = [points], [states], [chain], 0
    total, move = len(points), 0
    while total < count:
        wanted = min(len(points), count - total)
        random = np.random.default_rng([*seed, move])
        here, state = every[-1][:wanted], known[-1][:wanted]
        trial = _CORRELATION * here + np.sqrt(1.0 - _CORRELATION**2) * random.standard_normal(here.shape)
        found = failure.states(evaluate(trial))
        missing += int(np.isnan(found).sum())
        taken = np.where(np.isnan(found), False, found <= threshold)
        every.append(np.where(taken[:, None], trial, here))
        known.append(np.where(taken, found, state))
        chains.append(chain[:wanted])
        total, move = total + wanted, move + 1
    return np.concatenate(every), np.concatenate(known), np.concatenate(chains), missing


def _variance(inside: Bools, chains: Ints, level: int) -> float:
    """Return the squared coefficient of variation of the share that is inside.

    Points of a chain are correlated, and chains are not: so it comes from the sums over chains.
    """
    count, share = len(inside), float(inside.mean())
    if share == 0.0 or count < 2:
        return 1.0
    if level == 0:
        return (1.0 - share) / (count * share)
    sums = np.bincount(chains, inside - share)
    return float(np.sum(sums**2)) / (count * share) ** 2 + (1.0 - share) / (count * share)


def _bounded(
    share: float, variance: float, failing: int, missing: int, used: int, confidence: float
) -> Probability:
    wide = float(norm.isf(0.5 * (1.0 - confidence))) * np.sqrt(variance)
    upper = min(1.0, share + missing / used)
    return Probability(
        share,
        upper,
        float(share * np.exp(-wide)),
        float(min(1.0, share * np.exp(wide) + missing / used)),
        failing,
        missing,
        used,
        float(np.sqrt(variance)) if share > 0.0 else float("inf"),
    )
