"""Sobol' indices: shares of the variance by groups of unknowns, alone and with all interactions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.stats import norm, qmc, sobol_indices

from mechanics.arrays import Array
from pipelines.assess.study.methods.failure import Evaluate

_RESAMPLES = 200  # of the bootstrap


@dataclass(frozen=True)
class Indices:
    """Sobol' indices of groups.

    Attributes
    ----------
    first, total : (k,) shares of the variance by each group alone, and with its interactions
    first_interval, total_interval : (k, 2)
    values : of the independent samples, for their statistics
    evaluations : samples taken
    missing : rows that were left out, as one of their samples has no answer
    """

    first: Array
    total: Array
    first_interval: Array
    total_interval: Array
    values: Array
    evaluations: int
    missing: int


def sobol(
    evaluate: Evaluate,
    quantity: str,
    dimension: int,
    groups: Sequence[Sequence[int]],
    count: int,
    seed: int,
    confidence: float,
) -> Indices:
    """Return the indices of groups of unknowns (Saltelli et al. 2010), from count (k + 2) samples.

    Parameters
    ----------
    quantity : its name
    groups : numbers of the unknowns of each
    count : of each set; a power of two is best
    """
    plan = qmc.Sobol(2 * dimension, rng=np.random.default_rng([seed, 5]))
    whole = 1 << max(1, int(np.ceil(np.log2(count))))
    points = norm.ppf(np.clip(plan.random(whole)[:count], 1e-16, 1.0 - 1e-16))
    first, second = points[:, :dimension], points[:, dimension:]
    sets = [first, second]
    for group in groups:
        mixed = first.copy()
        mixed[:, list(group)] = second[:, list(group)]
        sets.append(mixed)
    found = evaluate(np.concatenate(sets))
    values = np.array([sample.values.get(quantity, np.nan) for sample in found]).reshape(len(sets), count)
    known = np.isfinite(values).all(axis=0)
    clear = values[:, known]
    answers: Mapping[Literal["f_A", "f_B", "f_AB"], Array] = {
        "f_A": clear[0][None],
        "f_B": clear[1][None],
        "f_AB": clear[2:, None, :],
    }
    indices = sobol_indices(func=answers, n=clear.shape[1])
    ends = _intervals(clear, confidence, seed)
    return Indices(
        np.atleast_1d(np.squeeze(indices.first_order)),
        np.atleast_1d(np.squeeze(indices.total_order)),
        ends[0],
        ends[1],
        np.concatenate([values[0], values[1]]),
        values.size,
        int((~known).sum()),
    )


def _intervals(values: Array, confidence: float, seed: int) -> tuple[Array, Array]:
    """Return the intervals (k, 2) of first and total indices, by resampling rows."""
    random, count = np.random.default_rng([seed, 6]), values.shape[1]
    drawn = np.empty((_RESAMPLES, 2, len(values) - 2))
    for row in range(_RESAMPLES):
        part = values[:, random.integers(count, size=count)]
        variance = float(np.var(part[:2])) or 1.0
        mixed = part[2:]
        drawn[row, 0] = np.mean((part[1] - part[:2].mean()) * (mixed - part[0]), axis=1) / variance
        drawn[row, 1] = 0.5 * np.mean((part[0] - mixed) ** 2, axis=1) / variance
    tail = 0.5 * (1.0 - confidence)
    ends = np.quantile(drawn, [tail, 1.0 - tail], axis=0)
    return ends[:, 0].T, ends[:, 1].T
