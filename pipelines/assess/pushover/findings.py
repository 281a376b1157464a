"""Findings of a loading test in words: what the stones bear, by which mechanism, and what limits the answer."""

import numpy as np

from mechanics.limit.loading_test import LoadingTest
from pipelines.assess.pushover.band import Band
from survey.conventions import NEGLIGIBLE, PER_MILLE

# share of turning, or of sliding, from which it is the whole mechanism [-]
_MOSTLY = 0.85
# share of steps that may be left unsolved, or that inertia may disturb, without a caution [-]
_MAX_UNSOLVED_SHARE = NEGLIGIBLE
# energy that no term explains, up to which there is no caution [-]
_BALANCE = PER_MILLE


def headline_of(test: LoadingTest, band: Band | None) -> str:
    """Return what the stones bear, and the mechanism, in a sentence."""
    borne = [f"{1e-3 * value:.4g} kN" for value in test.strength if value]
    text = f"bears {' and '.join(borne) or 'nothing'}"
    if band is not None:
        text += f" ± {1e-3 * band.strength:.2g} kN ({100 * band.level:g} % band)"
    return f"{text}; it {mechanism_of(test.turning)}"


def mechanism_of(turning: float) -> str:
    """Return the mechanism in words, by the share of the displacement that comes of turning [-]."""
    if turning >= _MOSTLY:
        return "rocks"
    if turning <= 1.0 - _MOSTLY:
        return "slides in its joints"
    return f"rocks ({100 * turning:.0f} %) and slides"


def doubts_of(test: LoadingTest) -> list[str]:
    """Return why the curve may be wrong, the gravest reason first."""
    steps, disturbed = len(test.force), int(np.sum(~test.calm))
    cautions = ["it was stopped before its end"] if test.stopped else []
    if test.unsolved > _MAX_UNSOLVED_SHARE * steps:
        cautions.append(f"{test.unsolved} of {steps} steps were not solved to the tolerance")
    if disturbed > _MAX_UNSOLVED_SHARE * steps:
        cautions.append(
            f"in {disturbed} of {steps} steps stones gathered speed: their forces are not those of rest"
        )
    if test.energy_error > _BALANCE:
        cautions.append(f"energy does not balance by {100 * test.energy_error:.2g} %")
    return cautions
