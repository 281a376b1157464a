"""Band about a capacity curve whose parameters are known to change it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from pipelines.assess.pushover.band import banded
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
