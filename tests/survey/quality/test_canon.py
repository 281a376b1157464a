"""Usual dimensions of a kind, and the deviation of stones from them."""

import math

import numpy as np
import pytest

from survey.quality.canon import deviations, standards
from survey.quality.precision import StoneQuality
from survey.records.survey import Canon
from tests.survey.quality.plain_stones import SIGMA, rectangle


def stretchers(rng: np.random.Generator, count: int, scatter: float, **changes: object) -> list[StoneQuality]:
    size = math.hypot(scatter, math.sqrt(2) * SIGMA)  # as measured
    return [
        rectangle(f"S{k}", "stretcher", 0, 0, rng.normal(0.6, size), rng.normal(0.3, size), **changes)
        for k in range(count)
    ]


def test_the_median_and_its_scatter_are_those_of_the_stones() -> None:
    usual = standards(stretchers(np.random.default_rng(1), 2000, 0.02), [])["stretcher"]
    assert (usual.length, usual.height) == pytest.approx((0.6, 0.3), abs=0.003)
    # standard error of 1.4826 MAD: 1.17 σ / sqrt(n), 2.6 % here
    assert (usual.length_scatter, usual.height_scatter) == pytest.approx((0.02, 0.02), rel=0.08)
    assert usual.stones == 2000


def test_odd_stones_do_not_move_the_median() -> None:
    rng = np.random.default_rng(2)
    odd = [rectangle(f"O{k}", "stretcher", 0, 0, 3.0, 2.0) for k in range(20)]
    usual = standards(stretchers(rng, 100, 0.02) + odd, [])["stretcher"]
    assert usual.length == pytest.approx(0.6, abs=0.02)
    assert usual.length_scatter < 0.035


def test_scores_are_normal_where_precision_and_scatter_are_right() -> None:
    rng = np.random.default_rng(3)
    stones = stretchers(rng, 3000, 0.004)
    scores = [one.length_score for one in deviations(stones, standards(stones, []))]
    assert np.var(scores) == pytest.approx(1.0, abs=0.12)


def test_the_archaeologists_canon_comes_first() -> None:
    stones = stretchers(np.random.default_rng(4), 10, 0.0)
    usual = standards(stones, [Canon("stretcher", 0.64, 0.32, 0.01, "two feet", 3)])
    assert (usual["stretcher"].source, usual["stretcher"].stones) == ("two feet", 0)
    odd = rectangle("X", "stretcher", 0, 0, 0.60, 0.35)
    (deviation,) = deviations([odd], usual)
    assert (deviation.length, deviation.height) == pytest.approx((-0.04, 0.03))
    sigma = math.hypot(0.01, math.sqrt(2) * SIGMA)
    assert (deviation.length_score, deviation.height_score) == pytest.approx((-0.04 / sigma, 0.03 / sigma))
    assert deviation.worst == pytest.approx(0.04 / sigma)


def test_four_stones_make_no_rule() -> None:
    stones = stretchers(np.random.default_rng(5), 4, 0.01)
    assert standards(stones, []) == {}
    assert deviations(stones, {}) == ()
