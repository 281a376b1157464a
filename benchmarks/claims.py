"""Claims of Renouf, Dubois & Alart (2006), each with a number that is positive where it holds, and verdicts of them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import fmean, stdev

import numpy as np
from scipy.stats import t

from mechanics.arrays import Array

CONSTANT = 0.2
"""Largest change of a curve that counts as constant, and of a ratio as equal [-]."""
_LEVEL = 0.95  # of the intervals [-]


@dataclass(frozen=True)
class Run:
    """Results on which claims are tested.

    Attributes
    ----------
    gamma : of the paper [N]
    seed : of the sample
    cells : columns of the rows by cell
    course : columns of what the experiment observes
    last : numbers of single instants, by name
    """

    gamma: float
    seed: int
    cells: Mapping[str, Mapping[str, Array]]
    course: Mapping[str, Array]
    last: Mapping[str, float]


@dataclass(frozen=True)
class Finding:
    """Margin of a claim by the runs of one seed, with its numbers.

    Attributes
    ----------
    margin : positive: the claim holds; nan: it cannot be measured [-]
    numbers : it was made of, by label; several follow each other in time
    """

    margin: float
    numbers: Mapping[str, Sequence[float]]


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper, and the criterion by which it is judged.

    Attributes
    ----------
    kind : of experiment
    name : short, unique
    words : what the paper says
    criterion : when it holds
    measure : of the runs of one seed by γ
    gammas : of the runs that it needs
    digits : of its numbers
    """

    kind: str
    name: str
    words: str
    criterion: str
    measure: Callable[[Mapping[float, Run]], Finding]
    gammas: tuple[float, ...] = (0.0,)
    digits: int = 2


@dataclass(frozen=True)
class Verdict:
    """Conclusion from margins.

    Attributes
    ----------
    words : agrees, contradicts, cannot be told
    margin : mean [-]
    within : half the width of its interval of 95 %; nan: unknown [-]
    deviation : standard deviation of the margins; nan of a single one [-]
    """

    words: str
    margin: float
    within: float
    deviation: float


def verdict_of(margins: Sequence[float], alike: Sequence[float] = ()) -> Verdict:
    """Conclude from the margins of several seeds.

    A claim agrees where the interval of Student's t about the mean lies above 0, and contradicts where it lies below. A
    single run has no deviation: that of other runs is taken, of a smaller sample, whose numbers vary more.

    Parameters
    ----------
    margins : of each seed; nan where it could not be measured
    alike : margins of the same claim in runs that lend their deviation

    >>> verdict_of([0.3, 0.4, 0.2]).words, verdict_of([-0.3, 0.4, 0.2]).words, verdict_of([-0.3]).words
    ('agrees', 'cannot be told', 'cannot be told')
    """
    found = [one for one in margins if np.isfinite(one)]
    lent = found if len(found) > 1 else [one for one in alike if np.isfinite(one)]
    own = stdev(found) if len(found) > 1 else float("nan")
    if not found or len(found) < len(margins) or len(lent) < 2:
        return Verdict("cannot be told", fmean(found) if found else float("nan"), float("nan"), own)
    quantile = float(t.ppf(0.5 + 0.5 * _LEVEL, len(lent) - 1))
    within, mean = quantile * stdev(lent) / np.sqrt(len(found)), fmean(found)
    words = "agrees" if mean > within else "contradicts" if mean < -within else "cannot be told"
    return Verdict(words, mean, float(within), own)


def mean_of(columns: Mapping[str, Array], name: str, begin: float, end: float) -> float:
    """Return the mean of a column over a part of the run, from and to shares of its duration."""
    time = columns["time"]
    during = (time > begin * time[-1]) & (time <= end * time[-1])
    return float(columns[name][during].mean())


def parts_of(
    columns: Mapping[str, Array], name: str, begin: float, end: float, count: int = 4
) -> list[float]:
    """Return the means of a column over equal parts of a phase."""
    edges = np.linspace(begin, end, count + 1)
    return [mean_of(columns, name, *pair) for pair in pairwise(edges)]


def single(numbers: Mapping[str, float]) -> dict[str, Sequence[float]]:
    """Return numbers of one instant each."""
    return {label: [value] for label, value in numbers.items()}


def strayed(values: Sequence[float]) -> float:
    """Return the largest change from the first value, over it."""
    return max(abs(value / values[0] - 1.0) for value in values)
