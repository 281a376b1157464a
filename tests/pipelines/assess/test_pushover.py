"""Loading tests of scenes: the band about a curve, the mechanism in words, the first line and its cautions."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from pipelines.assess.pushover.band import banded
from pipelines.assess.pushover.findings import doubts_of, mechanism_of
from tests.mechanics.limit.test_loading_test import slippery


@pytest.fixture(scope="module")
def test():
    """A block that slides below a beam."""
    return slippery(0.002)


def test_the_band_adds_squares_and_has_its_level_on_both_sides(test):
    """Friction raises the force by 3 %, density by 4 %: together by 5 %; 90 % lie within 1.645 of that."""
    raised = {"friction": 1.03, "density": 1.04}
    found = banded(
        test, dict.fromkeys(raised, 0.1), 0.9, lambda name, _: replace(test, force=raised[name] * test.force)
    )
    half = norm.ppf(0.95) * 0.05
    assert found.half_width == pytest.approx(half * found.force)
    assert found.strength == pytest.approx(half * test.force.max())
    assert found.parts["density"] == pytest.approx(0.04 * test.force.max())
    place, low, high = found.curve.T
    assert place[-1] == pytest.approx(0.002)
    assert (low[-1], high[-1]) == pytest.approx(test.force[-1] * np.array([1.0 - half, 1.0 + half]))


@pytest.mark.parametrize(
    ("turning", "words"),
    [
        (1.02, "rocks"),
        (0.85, "rocks"),
        (0.84, "rocks (84 %) and slides"),
        (0.71, "rocks (71 %) and slides"),
        (0.16, "rocks (16 %) and slides"),
        (0.14, "slides in its joints"),
        (-0.01, "slides in its joints"),
    ],
)
def test_rocking_and_sliding_are_named_alone_from_a_share_of_85_percent(turning, words):
    assert mechanism_of(turning) == words


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
