"""Bed lines: exact on exact beds, and with the precision that they have."""

import math

import numpy as np
import pytest
from scipy.stats import kstest

from survey.quality.courses import CourseLine, course_heights, lower_corners, measure_courses
from survey.quality.facades import facades_of
from survey.quality.precision import StoneQuality
from tests.survey.quality.plain_stones import polygon_stone, rectangle


def lines_of(stones: list[StoneQuality]) -> tuple[CourseLine, ...]:
    return measure_courses(stones, facades_of(stones))


def course(heights: np.ndarray, number: int = 1, **changes: object) -> list[StoneQuality]:
    """Return stones 0.5 m long with 10 mm joints, whose two lower corners lie at the heights (m, 2)."""
    stones = []
    for k, (left, right) in enumerate(heights):
        x, top = 0.51 * k, float(heights.max()) + 0.3
        polygon = [(x, left), (x + 0.5, right), (x + 0.5, top), (x, top)]
        stones.append(polygon_stone(f"{number}-{k}", "stretcher", polygon, course=number, **changes))
    return stones


def places(count: int) -> np.ndarray:
    """Return x of the lower corners, (m, 2)."""
    start = 0.51 * np.arange(count)
    return np.column_stack([start, start + 0.5])


def test_a_sloping_bed_has_its_slope_and_nothing_else() -> None:
    (line,) = lines_of(course(2.0 + 0.004 * places(8)))
    assert line.slope == pytest.approx(0.004, abs=1e-12)
    assert line.deviations == pytest.approx(0.0, abs=1e-12)
    assert (line.scatter, line.roughness, line.evidence) == (0.0, 1.0, "own")
    assert (line.sag, line.rms) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert line.level == pytest.approx(2.0 + 0.004 * places(8).mean())


def test_the_right_of_the_viewer_is_right_on_every_side_of_a_building() -> None:
    """Seen from +y, x runs to the left: the same bed falls."""
    south = np.array([0.0, 1.0, 0.0])
    stones = [
        polygon_stone(one.code, one.kind, one.outline[::-1, [0, 2]], normal=south, area=one.area)
        for one in course(2.0 + 0.004 * places(6))
    ]
    (line,) = lines_of(stones)
    assert line.slope == pytest.approx(-0.004, abs=1e-12)


def test_a_frame_that_may_be_tilted_makes_slopes_uncertain_and_nothing_else() -> None:
    """The wall runs along x: a rotation about y tilts it, one about x or z does not."""
    stones = course(2.0 + 0.004 * places(8))
    (level,) = lines_of(stones)
    for axis, sigma in ((0, 0.0), (1, 0.003), (2, 0.0)):
        tilt = np.zeros((3, 3))
        tilt[axis, axis] = 0.003**2
        (line,) = measure_courses(stones, facades_of(stones), [tilt])
        assert line.frame_sigma == pytest.approx(sigma, abs=1e-12)
        assert level.slope_sigma is not None
        assert line.slope_sigma == pytest.approx(math.hypot(level.slope_sigma, sigma))
        assert line.sag_sigma == level.sag_sigma


def test_a_parabola_sags_by_its_rise() -> None:
    x = places(9)
    middle, span = (x.min() + x.max()) / 2, x.max() - x.min()
    (line,) = lines_of(course(1.0 + 0.03 * ((x - middle) / (span / 2)) ** 2))
    assert line.sag == pytest.approx(-0.03, abs=1e-12)
    assert line.slope == pytest.approx(0.0, abs=1e-12)


def test_precision_without_scatter_is_that_of_the_corners() -> None:
    """Var(slope) = σ² / Σ (x - mean)² of a plain regression, if the beds' τ is 0."""
    (line,) = lines_of(course(1.0 + 0.0 * places(8)))
    x = places(8).ravel()
    assert line.slope_sigma == pytest.approx(0.002 / math.sqrt(((x - x.mean()) ** 2).sum()), rel=1e-9)


def test_predicted_precision_is_right_for_beds_that_scatter() -> None:
    """1500 level courses of 12 stones, beds scattered by τ = 4 mm: normalised errors have variance 1, tests are t.

    One line per zone, so that all are measured at once. Plain least squares would promise var 1 for what is 1.7.
    """
    rng = np.random.default_rng(42)
    count, tau, sigma = 12, 0.004, 0.002
    stones: list[StoneQuality] = []
    for zone in range(1500):
        beds = rng.normal(0, tau, (count, 1)) + rng.normal(0, sigma, (count, 2))
        stones += course(1.0 + beds, zone=f"{zone}")
    lines = lines_of(stones)
    assert len(lines) == 1500
    slopes = np.array(
        [line.slope / line.slope_sigma for line in lines if line.slope is not None and line.slope_sigma]
    )
    sags = np.array([line.sag / line.sag_sigma for line in lines if line.sag is not None and line.sag_sigma])
    # t with 10 and with 9 degrees of freedom has variance 10/8 and 9/7; 1500 samples: ± 4 %
    assert slopes.var() == pytest.approx(10 / 8, rel=0.15)
    assert sags.var() == pytest.approx(9 / 7, rel=0.15)
    assert np.mean([line.scatter**2 for line in lines]) == pytest.approx(tau**2, rel=0.05)
    chances = [line.slope_probability for line in lines]
    assert kstest(chances, "uniform").pvalue > 0.01
    assert np.mean(np.array(chances) < 0.01) < 0.02
    assert kstest([line.sag_probability for line in lines], "uniform").pvalue > 0.01


def test_true_slopes_and_sags_are_found_without_bias() -> None:
    rng = np.random.default_rng(3)
    x = places(12)
    middle, span = (x.min() + x.max()) / 2, x.max() - x.min()
    shape = 0.002 * x + 0.02 * ((x - middle) / (span / 2)) ** 2
    stones: list[StoneQuality] = []
    for zone in range(300):
        beds = shape + rng.normal(0, 0.003, (12, 1)) + rng.normal(0, 0.002, (12, 2))
        stones += course(beds, zone=f"{zone}")
    lines = lines_of(stones)
    for values, sigmas, truth in (
        ([line.slope for line in lines], [line.slope_sigma for line in lines], 0.002),
        ([line.sag for line in lines], [line.sag_sigma for line in lines], -0.02),
    ):
        error = np.mean(values) - truth
        assert abs(error) < 4.0 * np.mean(sigmas) / math.sqrt(300)
    chances = np.array([line.sag_probability for line in lines])
    assert np.mean(chances < 0.01) > 0.95


def test_worn_corners_and_bevels_are_no_beds() -> None:
    heights = 1.0 + 0.0 * places(6)
    stones = course(heights)
    heights[2, 1] = 1.03
    worn = course(heights, worn_corners=())[2]
    stones[2] = polygon_stone("1-2", "stretcher", worn.outline[:, [0, 2]], worn_corners=(1,))
    x = 0.51 * 3
    bevelled = [(x, 1.04), (x + 0.04, 1.0), (x + 0.5, 1.0), (x + 0.5, 1.3), (x, 1.3)]
    stones[3] = polygon_stone("1-3", "stretcher", bevelled)
    x = 0.51 * 4
    shallow = [(x, 1.02), (x + 0.05, 1.0), (x + 0.5, 1.0), (x + 0.5, 1.3), (x, 1.3)]
    stones[4] = polygon_stone("1-4", "stretcher", shallow)
    (line,) = lines_of(stones)
    assert line.left_out == 2
    assert len(line.codes) == 11
    assert line.deviations == pytest.approx(0.0, abs=1e-12)
    assert lower_corners(stones[3].outline, facades_of(stones)[0].frame) == [1, 2]


def test_a_course_of_one_stone_is_as_uncertain_as_its_two_corners() -> None:
    (line,) = lines_of([rectangle("A", "sill", 0.0, 1.0, 0.8, 0.2)])
    assert line.slope_sigma == pytest.approx(math.sqrt(2) * 0.002 / 0.8)
    assert (line.evidence, line.slope_probability, line.sag) == ("none", None, None)
    (line,) = lines_of([rectangle("A", "sill", 0.0, 1.0, 0.8, 0.2, worn_corners=(0,))])
    assert (line.slope, line.slope_sigma) == (None, None)
    assert lines_of([rectangle("A", "sill", 0.0, 1.0, 0.8, 0.2, worn_corners=(0, 1))]) == ()


def test_short_courses_borrow_the_scatter_of_the_long_ones() -> None:
    rng = np.random.default_rng(8)
    stones = course(1.0 + rng.normal(0, 0.005, (20, 1)) + rng.normal(0, 0.002, (20, 2)))
    stones += course(1.5 + np.array([[0.0, 0.0], [0.004, 0.004], [0.008, 0.008]]), number=2)
    long, short = lines_of(stones)
    assert (long.evidence, short.evidence) == ("own", "other courses")
    assert short.scatter == long.scatter
    # 8 mm over three stones is nothing where beds scatter by 5 mm
    assert short.slope_probability is not None
    assert short.slope_probability > 0.01


def test_the_stone_that_has_sunk_is_named() -> None:
    heights = 1.0 + 0.0 * places(10)
    heights[4] -= 0.02
    (line,) = lines_of(course(heights))
    code, deviation = line.worst
    assert code == "1-4"
    assert deviation == pytest.approx(-0.018, abs=1e-3)  # a tenth of it has drawn the line down


def test_course_heights_are_taken_where_both_courses_are() -> None:
    stones = course(1.0 + 0.01 * places(6)) + course(1.32 + 0.02 * places(3), number=2)
    (height,) = course_heights(lines_of(stones))
    place = (0.0 + 1.52) / 2
    assert height.course == 1
    assert height.height == pytest.approx(0.32 + 0.01 * place, abs=1e-9)
    assert 0.0 < height.sigma < 0.002


def test_a_site_frame_of_a_thousand_kilometres_loses_nothing() -> None:
    shift = np.array([7.1e6, 5.4e5, 0.0])
    near = course(2.0 + 0.004 * places(8))
    far = [
        polygon_stone(one.code, one.kind, one.outline[:, [0, 2]] + shift[[0, 2]], course=one.course)
        for one in near
    ]
    (line,) = lines_of(far)
    assert line.slope == pytest.approx(0.004, abs=1e-9)
    assert abs(line.deviations).max() < 1e-8


def test_voussoirs_and_floors_have_no_bed_line() -> None:
    floor = rectangle("F", "header", 0, 0, 1, 1, normal=np.array([0.0, 0.0, 1.0]))
    assert lines_of([floor, rectangle("V", "voussoir", 0, 0, 1, 1, course=None)]) == ()
