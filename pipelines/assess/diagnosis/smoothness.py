"""Smoothness of the answer of runs to their amplitudes, and what unevenness adds to the error of an amplitude.

Finite differences and intervals take it that residuals change smoothly. Rocking, sliding and cracking may make two runs
of nearly the same amplitude end differently. Of five runs across an amplitude, each tells by the linear model where the
best amplitude lies: x̂ = x - (J⁺ r)ᵢ. What a parabola through the five x̂ leaves, with two degrees of freedom, is the
standard deviation of the amplitude that comes from the runs themselves.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import stdtrit

from mechanics.arrays import Array
from pipelines.assess.diagnosis.file import Unknown
from pipelines.assess.diagnosis.ranking import QUANTILE, Ranked
from survey.conventions import MOST

_OFFSETS = np.linspace(-1.0, 1.0, 5)  # of the runs, in steps of the unknown
_UNEVEN = MOST  # standard deviation from the runs over that from the survey, beyond which it is told in the first line

Place = tuple[float, ...]
Answer = Array | str


def probes(unknowns: Sequence[Unknown], best: Place) -> list[list[Place]]:
    """Return for each unknown five places across its best amplitude, within its bounds, the others at their best."""
    places = []
    for k, unknown in enumerate(unknowns):
        middle = min(max(best[k], unknown.low + unknown.change), unknown.high - unknown.change)
        places.append(
            [(*best[:k], float(middle + unknown.change * share), *best[k + 1 :]) for share in _OFFSETS]
        )
    return places


def with_unevenness(ranked: Ranked, unknowns: Sequence[Unknown], answers: Mapping[Place, Answer]) -> Ranked:
    """Return a hypothesis whose intervals include the unevenness of its runs, and that tells it.

    Parameters
    ----------
    ranked : the hypothesis, with its best amplitudes
    unknowns : of the hypothesis
    answers : residuals (m,) at the places of `probes`; a text where a run has failed
    """
    rows = [[answers[place] for place in probed] for probed in probes(unknowns, ranked.fit.amplitudes)]
    failed = next((answer for row in rows for answer in row if isinstance(answer, str)), None)
    if failed is not None:
        remark = f"runs beside its best amounts fail, so that its intervals may be too narrow: {failed}"
        return replace(ranked, remarks=(*ranked.remarks, remark))
    residuals = np.array(rows)
    steps = np.array([parameter.change for parameter in unknowns])
    jacobian = ((residuals[:, -1] - residuals[:, 0]) / (2.0 * steps)[:, None]).T
    inverse = np.linalg.pinv(jacobian)
    wide = float(stdtrit(ranked.dof, QUANTILE))
    estimates, uneven = [], []
    for k, (unknown, estimate) in enumerate(zip(unknowns, ranked.estimates, strict=True)):
        predicted = unknown.change * _OFFSETS - residuals[k] @ inverse[k]
        deviation = predicted - np.polyval(np.polyfit(_OFFSETS, predicted, 2), _OFFSETS)
        sigma = float(np.sqrt(deviation @ deviation / (len(deviation) - 3)))
        half = estimate.high - estimate.value
        if np.isfinite(half) and sigma > _UNEVEN * half / wide:
            uneven.append(f"{estimate.name} by {sigma:.2g} {estimate.unit}")
        half = float(np.hypot(half, wide * sigma))
        estimates.append(
            replace(estimate, low=estimate.value - half, high=estimate.value + half, run_sigma=sigma)
        )
    return replace(ranked, estimates=tuple(estimates), uneven=tuple(uneven))
