"""Robust scale: that of the normal values, however wild the others are; roots of falling functions."""

import math

import numpy as np
import pytest

from ground.statistics.roots import root_of
from ground.statistics.scale import deviation, scatter_beyond, spread


@pytest.mark.parametrize("wild", [0, 100, 400])
def test_scale_is_that_of_the_normal_values(wild: int) -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(0.0, 2.0, 4000)
    values[:wild] += 500.0
    assert deviation(values) == pytest.approx(2.0, rel=0.05 + wild / 2000)
    assert spread(values) == pytest.approx(2.0, rel=0.04 + wild / 4000)


def test_of_none_and_of_one_value_there_is_no_scatter() -> None:
    assert deviation(np.zeros(0)) == 0.0
    assert spread(np.array([3.0])) == pytest.approx(3.0 / math.sqrt(0.911256))
    assert scatter_beyond(np.zeros(0), np.zeros(0)) == (0.0, 0)


def test_a_scatter_beyond_a_known_one_is_told_of_differences_too() -> None:
    rng = np.random.default_rng(2)
    places = np.cumsum(np.zeros(4001)) + rng.normal(0.0, math.hypot(1.0, 3.0), 4001)
    steps = np.diff(places)
    steps[:100] += 40.0
    tau, count = scatter_beyond(steps, np.full(4000, 2.0), 2.0)
    assert tau == pytest.approx(3.0, rel=0.08)
    assert 3600 < count < 3960
    assert scatter_beyond(rng.normal(0.0, 1.0, 500), np.full(500, 4.0))[0] == 0.0


def test_roots_of_falling_functions() -> None:
    assert root_of(lambda x: 2.0 - x * x, 1e-3) == pytest.approx(math.sqrt(2.0), rel=1e-12)
    assert root_of(lambda x: -1.0 - x, 1.0) == 0.0
