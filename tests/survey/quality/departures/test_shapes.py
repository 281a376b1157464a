"""Shapes of movement: exact amounts, honest uncertainties, and no more findings by chance than were allowed."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as student

from survey.quality.departures.shapes import Sample, Shape, critical, fit_shapes, powers

ALONG = np.tile(np.arange(10.0), 4)
GROUP = np.repeat(np.arange(4), 10)
STEP, TILT = Shape("step", (4.5,), 2), Shape("tilt", (0.0, 9.0), 0)
FIELDS = np.column_stack([(ALONG > 4.5).astype(float), ALONG / 9.0])
RUNS = [(0, 0), (1, 1), (2, 2), (3, 3), (0, 1), (0, 2), (0, 3)]


def sample(values: np.ndarray, sigma: float = 0.001, tilt: float = 0.0) -> Sample:
    return Sample(
        values,
        np.full(40, sigma**2),
        ALONG,
        np.zeros(40),
        GROUP,
        np.ones((40, 1)),
        tilt * ALONG,
        1e6,
    )


def heights(*groups: float) -> np.ndarray:
    """Return what courses of these heights look like after a step of 20 mm in the first two."""
    return np.array(groups)[GROUP] + 0.02 * (ALONG > 4.5) * (GROUP < 2)


def test_the_critical_value_is_students_for_all_tests_together():
    assert critical(0.01, 1, 20.0) == pytest.approx(student.isf(0.005, 20))
    assert critical(0.01, 500, 20.0) == pytest.approx(student.isf(0.005 / 500, 20))
    assert critical(0.01, 0, 1e9) == pytest.approx(2.5758, abs=1e-3)


def test_a_step_is_found_in_its_courses_with_its_amount_and_sigma():
    values = heights(5.0, 6.0, 7.0, 8.0) + np.random.default_rng(1).normal(0, 0.001, 40)
    (found,), limit = fit_shapes(sample(values), [STEP, TILT], FIELDS, RUNS, 0.01)
    assert (found.shape, found.run) == (STEP, (0, 1))
    # of two courses of ten stones, half of them moved: Var = σ² (1/5 + 1/5) / 2
    assert found.sigma == pytest.approx(0.001 * math.sqrt(0.2), rel=0.3)
    assert abs(found.amount - 0.02) < 3.0 * found.sigma
    assert limit == pytest.approx(critical(0.01, 14, 1e6))
    assert found.probability < 1e-10
    assert found.each[:2, 0] == pytest.approx([0.02, 0.02], abs=0.002)
    assert found.each[2:, 0] == pytest.approx([0.0, 0.0], abs=0.002)
    assert found.each[:, 1] == pytest.approx(0.001 * math.sqrt(0.4))
    assert found.dof == 1
    assert (found.field != 0.0).sum() == 10


def test_groups_that_disagree_make_the_amount_uncertain():
    """Steps of 10 and 30 mm in two courses: χ² = 2 (10 mm)² / (0.4 mm²) = 500, so σ grows by √500."""
    values = 0.01 * (ALONG > 4.5) * (GROUP == 0) + 0.03 * (ALONG > 4.5) * (GROUP == 1)
    two = replace(sample(values), values=values)
    (found, *_), _ = fit_shapes(two, [STEP], FIELDS[:, :1], [(0, 1)], 0.9999)
    assert found.chi2 == pytest.approx(500.0)
    assert found.sigma == pytest.approx(0.001 * math.sqrt(0.2) * math.sqrt(500.0))
    # 20 ± 10 mm are nothing
    assert fit_shapes(two, [STEP], FIELDS[:, :1], [(0, 1)], 0.01)[0] == []


def test_a_frame_that_may_be_tilted_explains_a_tilt_but_no_step():
    tilted = 0.02 * ALONG / 9.0
    (found,), _ = fit_shapes(sample(tilted), [STEP, TILT], FIELDS, RUNS, 0.01)
    assert found.shape == TILT
    assert found.amount == pytest.approx(0.02)
    level, shaken = (powers(sample(tilted, tilt=one), FIELDS, (0, 3)) for one in (0.0, 0.005))
    assert shaken[1] == pytest.approx(math.hypot(level[1], 0.045))
    assert shaken[0] == pytest.approx(math.hypot(level[0], 0.025))  # a tilt looks like a step of 5 stones
    assert fit_shapes(sample(tilted, tilt=0.005), [STEP, TILT], FIELDS, RUNS, 0.01)[0] == []
    # 20 mm are more than a frame that is level to 4.5 mm over the wall explains, and known no better than it
    (uncertain,), _ = fit_shapes(sample(tilted, tilt=0.0005), [STEP, TILT], FIELDS, RUNS, 0.01)
    assert uncertain.sigma == pytest.approx(math.hypot(found.sigma, 0.0045))


def test_what_a_shape_leaves_because_it_does_not_fit_exactly_is_no_movement():
    """A step two stones farther on in one course of four leaves a fifth of itself."""
    values = 0.02 * (ALONG > 4.5) + 0.004 * (ALONG > 6.5)
    other = Shape("step", (6.5,), 2)
    fields = np.column_stack([FIELDS[:, 0], (ALONG > 6.5).astype(float)])
    found, _ = fit_shapes(sample(values, 0.0002), [STEP, other], fields, [(0, 3)], 0.01)
    assert len(found) == 1
    values = 0.02 * (ALONG > 4.5) + 0.01 * (ALONG > 7.5)
    fields = np.column_stack([FIELDS[:, 0], (ALONG > 7.5).astype(float)])
    found, _ = fit_shapes(sample(values, 0.0002), [STEP, other], fields, [(0, 3)], 0.01)
    assert [one.amount for one in found] == pytest.approx([0.02, 0.01])


def test_of_two_shapes_that_fit_as_well_the_simpler_is_taken():
    twice = [Shape("part", (4.5, 99.0), 4), STEP]
    fields = np.column_stack([FIELDS[:, 0], FIELDS[:, 0]])
    (found,), _ = fit_shapes(sample(heights(0, 0, 0, 0)), twice, fields, RUNS, 0.01)
    assert found.shape == STEP


def test_walls_at_rest_are_given_a_movement_no_more_often_than_allowed():
    """Of 400 walls with α = 20 % up to 80 may; Bonferroni gives a few less, as the tests are related."""
    rng = np.random.default_rng(4)
    wrong = sum(
        bool(fit_shapes(sample(rng.normal(0, 0.001, 40)), [STEP, TILT], FIELDS, RUNS, 0.2)[0])
        for _ in range(400)
    )
    assert 20 <= wrong <= 95
