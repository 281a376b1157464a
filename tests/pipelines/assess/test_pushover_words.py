"""First line of a loading test: what the stones bear, and what may be wrong with it."""

from types import SimpleNamespace

import numpy as np
import pytest

from pipelines.assess.pushover.findings import doubts_of


@pytest.mark.parametrize(
    ("changed", "disturbed", "first"),
    [
        ({}, 0, None),
        ({"unsolved": 2}, 2, None),  # of 200 steps: too few to count
        ({"unsolved": 5}, 0, "5 of 200 steps were not solved to the tolerance"),
        ({}, 9, "in 9 of 200 steps stones gathered speed: their forces are not those of rest"),
        ({"energy_error": 0.02}, 0, "energy does not balance by 2 %"),
        ({"stopped": True, "unsolved": 5}, 0, "it was stopped before its end"),
    ],
)
def test_the_gravest_doubt_comes_first(changed, disturbed, first):
    sound = {"force": np.zeros(200), "stopped": False, "unsolved": 0, "energy_error": 0.0}
    sound["calm"] = np.arange(200) >= disturbed
    assert next(iter(doubts_of(SimpleNamespace(**sound | changed))), None) == first
