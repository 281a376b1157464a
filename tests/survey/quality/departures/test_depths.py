"""Depths that cannot be right: against rule, kind, neighbours, opposite face and own face."""

from dataclasses import replace

import numpy as np
import pytest

from survey.quality.departures.depths import DoubtfulDepth, doubtful_depths
from survey.quality.facades import facades_of
from survey.quality.precision import StoneQuality
from survey.records.survey import DepthRule
from tests.survey.quality.plain_stones import polygon_stone, rectangle


def found(stones: list[StoneQuality], *rules: DepthRule) -> list[DoubtfulDepth]:
    return list(doubtful_depths(stones, facades_of(stones), rules, 0.001))


def row(count: int = 12, kind: str = "ashlar", **changes: object) -> list[StoneQuality]:
    """Return stones 0.5 m deep, with a scatter of 5 cm."""
    rng = np.random.default_rng(3)
    return [
        rectangle(
            f"{kind}{k}", kind, 0.5 * k, 0.0, 0.49, 0.3, **({"depth": 0.5 + rng.normal(0, 0.05)} | changes)
        )
        for k in range(count)
    ]


def with_depth(stones: list[StoneQuality], k: int, depth: float, **changes: object) -> list[StoneQuality]:
    return [replace(one, depth=depth, line=8, **changes) if i == k else one for i, one in enumerate(stones)]


def test_sound_depths_are_not_doubted() -> None:
    assert found(row()) == []
    assert found(row(depth=None, depth_sigma=None)) == []


@pytest.mark.parametrize("depth", [0.05, 5.0, 0.2, 1.2])
def test_a_depth_unlike_its_kind_is_doubted(depth: float) -> None:
    (one,) = found(with_depth(row(), 4, depth))
    assert (one.code, one.line, one.against, one.depth) == ("ashlar4", 8, "kind", depth)
    assert one.expected == pytest.approx(0.5, abs=0.05)
    assert f"it is {depth:.2f} m deep, the other stones of its kind, ashlar, have 0.49 m" in one.text
    assert one.score > 4.5


def test_a_tenth_more_or_less_is_how_stones_are() -> None:
    assert found(with_depth(row(depth=0.5, depth_sigma=0.0), 4, 0.6)) == []


def test_a_depth_measured_on_the_stone_is_held_against_its_rule() -> None:
    rule = DepthRule("header", 0.6, 0.03, "trench 2", courses=(1, 2))
    stones = [*row(), rectangle("H", "header", 7.0, 0, 0.3, 0.3, depth=0.2, depth_origin="stone", course=2)]
    (one,) = found(stones, rule)
    assert (one.code, one.against, one.expected) == ("H", "rule", 0.6)
    assert "the rule for it, trench 2, says 0.60 m" in one.text
    # other courses, other zones and other kinds have other rules
    assert found(stones, replace(rule, courses=(3, 4))) != [one]
    assert "rule" not in {one.against for one in found(stones, replace(rule, courses=(1, 1)))}
    assert "rule" not in {one.against for one in found(stones, replace(rule, zone="tower"))}
    assert "rule" not in {one.against for one in found(stones, replace(rule, kind="quoin"))}
    assert [one.against for one in found(stones, replace(rule, kind=None, courses=None))] == ["rule"]
    # a depth that the rule gave is that of the rule
    by_rule = with_depth(stones, 12, 0.6, depth_origin="rule")
    assert found(by_rule, replace(rule, depth=0.6)) == []


def test_a_rule_without_a_sigma_is_good_to_a_quarter() -> None:
    rule = DepthRule("header", 0.6, None, "a guess")
    stone = rectangle("H", "header", 7.0, 0, 0.3, 0.3, depth=0.35, depth_sigma=0.0, depth_origin="stone")
    assert found([*row(), stone], rule) == []
    assert [one.against for one in found([*row(), replace(stone, depth=0.1)], rule)] == ["rule"]


def test_the_only_stone_of_its_kind_is_held_against_its_neighbours() -> None:
    stones = [*row(), rectangle("S", "sill", 2.0, 0.3, 0.9, 0.2, depth=3.0)]
    (one,) = found(stones)
    assert (one.code, one.against) == ("S", "neighbours")
    assert "the stones beside it have 0.47 m" in one.text
    assert found([*row(), rectangle("S", "sill", 2.0, 0.3, 0.9, 0.2, depth=0.6)]) == []


def test_a_stone_longer_than_the_wall_is_thick_comes_out_of_the_opposite_face() -> None:
    front = row(depth=0.3, depth_sigma=0.01)
    back = []
    for one in row(kind="b", depth=0.2, depth_sigma=0.01):
        other = polygon_stone(one.code, "ashlar", one.outline[::-1, [0, 2]], normal=np.array([0.0, 1.0, 0.0]))
        other.outline[:, 1] = 0.6
        back.append(replace(other, area=one.area, depth=0.2, depth_sigma=0.01))
    assert found([*front, *back]) == []
    # a stone that just reaches through is a through stone, whatever its kind has
    assert found([*with_depth(front, 4, 0.58), *back]) == []
    (one,) = [one for one in found([*with_depth(front, 4, 0.8), *back]) if one.against == "opposite face"]
    assert (one.code, one.line) == ("ashlar4", 8)
    assert one.expected == pytest.approx(0.6)
    assert "comes out of the opposite face, 0.60 m behind its own" in one.text


@pytest.mark.parametrize(("depth", "doubted"), [(0.05, True), (0.07, False), (2.9, False), (3.1, True)])
def test_all_depths_may_be_wrong_together(depth: float, doubted: bool) -> None:
    """A face of 0.49 by 0.30 m: a slab of 5 cm, or a beam of more than six times its length."""
    stones = row(3, depth=depth)
    doubts = found(stones)
    assert [one.against for one in doubts] == ["own face"] * (3 if doubted else 0)
    nearest = 0.2 * 0.3 if depth < 1.0 else 6.0 * 0.49
    assert [one.expected for one in doubts] == pytest.approx([nearest] * len(doubts))


def test_the_worst_comes_first_and_a_stone_once() -> None:
    rule = DepthRule("ashlar", 0.5, 0.05, "broken ends")
    stones = with_depth(with_depth(row(), 4, 5.0, depth_origin="stone"), 6, 0.15, depth_origin="stone")
    assert [(one.code, one.against) for one in found(stones, rule)] == [
        ("ashlar4", "rule"),
        ("ashlar6", "rule"),
    ]


def test_solids_bring_their_depth_along() -> None:
    assert found(with_depth(row(), 4, 5.0, source="solid")) == []
