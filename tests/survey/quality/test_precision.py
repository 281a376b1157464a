"""Quality of a survey: the summary of a stone, and the verdict on the stated precision."""

import math
from dataclasses import replace

import numpy as np
import pytest

from survey.extrusion.depth import Depth
from survey.extrusion.extrusion import extrude
from survey.faces.faces import outline_face
from survey.quality.precision import StoneQuality, appraise, judge_survey
from survey.records.survey import BlockRecord
from tests.survey.quality.plain_stones import rectangle

DEPTH = Depth(0.4, 0.03, "guess", "kind", 3)
FRONT = np.array([0.0, -10.0, 0.0])


def wall_face(rng: np.random.Generator, true_sigma: float, stated: float, **changes: object) -> StoneQuality:
    """Return a plane face 0.6 m x 0.3 m in the plane y = 0, measured at its corners and 16 points."""
    corners = np.array([[0, 0, 0], [0.6, 0, 0], [0.6, 0, 0.3], [0, 0, 0.3]])
    points = np.column_stack([rng.uniform(0, 0.6, 16), np.zeros(16), rng.uniform(0, 0.3, 16)])
    record = BlockRecord(
        "S1",
        "stretcher",
        1,
        corners + rng.normal(0, true_sigma, (4, 3)),
        points + rng.normal(0, true_sigma, (16, 3)),
        stated,
        line=7,
    )
    return appraise(extrude(outline_face(replace(record, **changes), FRONT), DEPTH))  # type: ignore[arg-type]


def test_left_out_points_and_corners_are_named_as_the_instrument_did() -> None:
    rng = np.random.default_rng(5)
    points = np.column_stack([rng.uniform(0, 0.6, 16), np.zeros(16), rng.uniform(0, 0.3, 16)])
    points[2, 1] = -0.1
    vertices = np.array([[0, 0, 0], [0.6, 0.02, 0], [0.6, 0, 0.3], [0, 0, 0.3]])
    stone = wall_face(rng, 0.001, 0.001, points=points, vertices=vertices)
    assert (stone.blunders, stone.worn) == (("point 3",), ("corner 2",))
    names = tuple(f"{number}" for number in range(101, 121))
    stone = wall_face(rng, 0.001, 0.001, points=points, vertices=vertices, names=names)
    assert (stone.blunders, stone.worn) == (("103",), ("118",))
    assert len(stone.worn_corners) == 1
    assert stone.outline[stone.worn_corners[0]] == pytest.approx([0.6, 0.0, 0.0], abs=1e-3)
    assert len(stone.standardised) == 18
    assert (stone.points, stone.redundancy) == (20, 15)


def test_the_precision_of_a_stone_is_that_of_its_plane_and_corners() -> None:
    stone = wall_face(np.random.default_rng(1), 0.002, 0.002)
    assert stone.offset_sigma == pytest.approx(0.002 / math.sqrt(20), rel=1e-9)  # of a mean of 20 points
    # tilt about the long axis: σ / sqrt(Σ (z - mean)²)
    assert stone.tilt_sigma == pytest.approx(math.degrees(0.002 / (0.105 * math.sqrt(20))), rel=0.15)
    assert stone.dimension_sigma == pytest.approx(math.sqrt(2) * 0.002)  # of the difference of two corners
    assert (stone.length, stone.height) == pytest.approx((0.6, 0.3), abs=0.008)


@pytest.mark.parametrize(("ratio", "word"), [(1.0, "is right"), (2.0, "too small"), (0.5, "too large")])
def test_the_stated_sigma_is_judged_by_the_residuals_of_all_stones(ratio: float, word: str) -> None:
    rng = np.random.default_rng(7)
    stones = [wall_face(rng, 0.002 * ratio, 0.002) for _ in range(100)]
    quality = judge_survey(stones)
    assert quality.sigma0 is not None
    assert quality.sigma0_sigma is not None
    assert word in quality.verdict
    assert quality.redundancy == sum(stone.redundancy for stone in stones)
    if ratio <= 1.0:  # at twice the stated sigma the worst points are taken for blunders
        assert abs(quality.sigma0 - ratio) < 4.0 * ratio * quality.sigma0_sigma + 0.01
    assert quality.rms == pytest.approx(0.002 * quality.sigma0 * math.sqrt(17 / 20), rel=0.02)


@pytest.mark.parametrize(
    ("sigma0", "words"),
    [
        (1.0, ("is right", "1.00 ±")),
        (2.0, ("too small", "2.00 ±", "4 mm would be right instead of 2 mm")),
        (0.5, ("too large", "0.50 ±", "1 mm would be right instead of 2 mm")),
    ],
)
def test_the_verdict_names_the_sigma_that_would_be_right(sigma0: float, words: tuple[str, ...]) -> None:
    stones = [rectangle(f"{k}", "header", k, 0, 0.4, 0.3, sigma0=sigma0) for k in range(30)]
    verdict = judge_survey(stones).verdict
    assert all(one in verdict for one in words)
    assert ("instead of" in verdict) == (sigma0 != 1.0)


def test_the_histogram_of_good_residuals_is_the_normal_one() -> None:
    rng = np.random.default_rng(11)
    residuals = judge_survey([wall_face(rng, 0.002, 0.002) for _ in range(150)]).residuals
    total = int(residuals.counts.sum())
    assert total == pytest.approx(150 * 20, rel=0.01)
    assert residuals.expected.sum() == pytest.approx(total)
    # chi-square of the bins that expect 20 or more; residuals of one face are correlated by 3 in 20
    large = residuals.expected >= 20.0
    squares = ((residuals.counts - residuals.expected)[large] ** 2 / residuals.expected[large]).sum()
    assert squares < large.sum() + 5.0 * math.sqrt(2.0 * large.sum())


def test_what_three_points_measure_says_nothing_of_their_precision() -> None:
    rng = np.random.default_rng(2)
    triangle = np.array([[0, 0, 0], [0.6, 0, 0], [0.3, 0, 0.3]])
    stone = wall_face(rng, 0.002, 0.002, vertices=triangle, points=np.empty((0, 3)))
    assert (stone.sigma0, stone.redundancy, stone.shape, stone.skew) == (None, 0, "untested", None)
    quality = judge_survey([stone])
    assert (quality.sigma0, quality.sigma0_sigma) == (None, None)
    assert "nothing says" in quality.verdict
    assert quality.residuals.counts.sum() == 0


def test_no_stones_are_no_error() -> None:
    quality = judge_survey([])
    assert (quality.stones, quality.sigma0) == (0, None)
    assert math.isnan(quality.rms)
