"""Stones that contradict their kind, and stones that only seem to within the precision."""

import math

import numpy as np
import pytest

from survey.quality.contradictions import Contradiction, contradictions
from survey.quality.facades import facades_of
from survey.quality.precision import StoneQuality
from tests.survey.quality.plain_stones import SIGMA, polygon_stone, rectangle


def found(stones: list[StoneQuality]) -> tuple[Contradiction, ...]:
    return contradictions(stones, facades_of(stones))


def course(*lengths: tuple[str, float]) -> list[StoneQuality]:
    stones, x = [], 0.0
    for k, (kind, length) in enumerate(lengths):
        stones.append(rectangle(f"{k}", kind, x, 0.0, length, 0.3, depth=0.4))
        x += length + 0.01
    return stones


def arch(
    centre: tuple[float, float], start: float, stop: float, count: int, radius: float = 1.0
) -> list[StoneQuality]:
    """Return voussoirs 0.35 m deep between two angles [degrees] with a chord for intrados."""
    angles = np.radians(np.linspace(start, stop, count + 1))
    ring = np.column_stack([np.cos(angles), np.sin(angles)])
    stones = []
    for k in range(count):
        corners = [
            radius * ring[k],
            (radius + 0.35) * ring[k],
            (radius + 0.35) * ring[k + 1],
            radius * ring[k + 1],
        ]
        polygon = np.array(corners) + centre
        stones.append(polygon_stone(f"V{k}", "voussoir", polygon, course=None))
    return stones


def test_a_header_longer_than_the_stretchers_beside_it_is_reported() -> None:
    stones = course(("stretcher", 0.35), ("header", 0.39), ("stretcher", 0.36), ("stretcher", 0.34))
    (one,) = found(stones)
    assert (one.code, one.excess) == ("1", pytest.approx(0.04))
    sigma = math.sqrt(2) * SIGMA * math.hypot(1.0, 1.2533 / math.sqrt(3))
    assert one.significance == pytest.approx(0.04 / sigma, rel=1e-4)
    assert "stretchers beside it" in one.text


def test_nothing_is_reported_within_the_precision() -> None:
    assert found(course(("stretcher", 0.405), ("header", 0.414), ("stretcher", 0.405))) == ()
    assert found(course(("header", 0.405), ("stretcher", 0.55), ("stretcher", 0.55))) == ()


def test_a_header_longer_than_deep_is_reported_if_the_depth_is_known_well_enough() -> None:
    stones = course(("stretcher", 0.9), ("header", 0.5), ("stretcher", 0.9))
    (one,) = found(stones)  # 0.5 m against 0.40 ± 0.02 m
    assert one.significance == pytest.approx(0.1 / math.hypot(0.02, math.sqrt(2) * SIGMA))
    stones[1] = rectangle("1", "header", 0.91, 0.0, 0.5, 0.3, depth=0.4, depth_sigma=None)
    assert found(stones) == ()


def test_a_header_without_neighbours_is_compared_with_the_stretchers_of_the_survey() -> None:
    stones = [rectangle(f"{k}", "stretcher", k, 0.0, 0.5, 0.3) for k in range(5)]
    stones.append(rectangle("H", "header", 0.0, 1.0, 0.7, 0.3, course=2, depth=0.9))
    (one,) = found(stones)
    assert (one.code, one.excess) == ("H", pytest.approx(0.2))
    assert "stretchers of the survey" in one.text


@pytest.mark.parametrize("kind", ["stretcher", "sill", "lintel"])
def test_what_lies_along_the_wall_is_longer_than_high(kind: str) -> None:
    upright, flat = (
        rectangle("A", kind, 0, 0, 0.3, 0.6, depth=0.2),
        rectangle("B", kind, 1, 0, 0.6, 0.3, depth=0.2),
    )
    (one,) = found([upright, flat])
    assert (one.code, one.excess) == ("A", pytest.approx(0.3))


def test_a_stretcher_deeper_than_long_may_be_a_header() -> None:
    (one,) = found([rectangle("A", "stretcher", 0, 0, 0.35, 0.3, depth=0.55, depth_sigma=0.01)])
    assert "the stone 0.550 m deep" in one.text


@pytest.mark.parametrize(("start", "stop"), [(50.0, 130.0), (0.0, 180.0)])
def test_the_stones_of_a_true_arch_are_wedges(start: float, stop: float) -> None:
    assert found(arch((0.0, 0.0), start, stop, 9)) == ()


@pytest.mark.parametrize("place", [0, 4, 7])
def test_a_voussoir_that_is_no_wedge_is_reported_wherever_it_sits(place: int) -> None:
    """A semicircle of nine: at its springing the sides are nearly level, at its crown nearly plumb."""
    stones = arch((5.0, 2.0), 0.0, 180.0, 9)
    flat = stones[place].outline[:, [0, 2]]
    inner = (flat[0] + flat[3]) / 2 + (flat[[1, 2]] - (flat[1] + flat[2]) / 2)
    stones[place] = polygon_stone("X", "voussoir", [inner[0], flat[1], flat[2], inner[1]], course=None)
    (one,) = found(stones)
    assert one.code == "X"
    assert "0.0° towards the intrados; a wedge has 10.0°" in one.text
    assert one.excess == pytest.approx(math.radians(10.0), rel=1e-6)
    assert one.significance == pytest.approx(math.radians(10.0) / (2 * SIGMA / 0.35), rel=0.02)


def test_a_keystone_upside_down_is_reported() -> None:
    stones = arch((0.0, 0.0), 50.0, 130.0, 9)
    flat = stones[4].outline[::-1, [0, 2]] * [1, -1] + [0, 2.35]
    stones[4] = polygon_stone("K", "keystone", flat, course=None)
    (one,) = found(stones)
    assert (one.code, one.kind) == ("K", "keystone")
    assert "diverge" in one.text


def test_a_springer_has_a_sloped_side() -> None:
    sloped = polygon_stone("A", "springer", [(0, 0), (0.6, 0), (0.4, 0.4), (0, 0.4)])
    bevelled = polygon_stone("B", "springer", [(1, 0), (1.6, 0), (1.6, 0.36), (1.56, 0.4), (1, 0.4)])
    (one,) = found([sloped, bevelled])
    assert (one.code, one.excess) == ("B", pytest.approx(math.radians(5.0)))


@pytest.mark.parametrize(("degrees", "contradicts"), [(22.0, False), (8.0, False), (4.0, True), (0.0, True)])
def test_the_face_of_a_springer_slopes_where_a_vault_springs_from_the_wall(
    degrees: float, contradicts: bool
) -> None:
    out, down = math.cos(math.radians(degrees)), -math.sin(math.radians(degrees))
    square = [(0.0, 0.0), (0.6, 0.0), (0.6, 0.4), (0.0, 0.4)]
    stone = polygon_stone("A", "springer", square, normal=np.array([0.0, -out, down]))
    assert bool(contradictions([stone], [])) == contradicts


def test_the_sloped_side_of_a_springer_may_be_short_beside_its_bed() -> None:
    long_bed = polygon_stone("A", "springer", [(0, 0), (1.2, 0), (1.0, 0.3), (0, 0.3)])
    corbelled = polygon_stone("B", "springer", [(2, 0), (2.8, 0), (3.0, 0.3), (2, 0.3)])
    assert found([long_bed, corbelled]) == ()


def test_noise_alone_is_reported_as_rarely_as_three_sigma_promise() -> None:
    """Chance alone exceeds three standard deviations in 0.1 %: at most one of the true stones is reported."""
    rng = np.random.default_rng(9)
    told = 0
    for _ in range(40):
        stones = course(*[("header", 0.4), ("stretcher", 0.401)] * 25)
        noisy = [
            polygon_stone(
                one.code,
                one.kind,
                one.outline[:, [0, 2]] + rng.normal(0, SIGMA, (4, 2)),
                depth=0.4,
                depth_sigma=None,
            )
            for one in stones
        ]
        told += sum(one.kind == "header" for one in found(noisy))
    # extents of noisy rectangles are a little longer than these, alike for both kinds
    assert told <= 8
