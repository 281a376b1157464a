"""Masonry quality of walls, from their surveyed faces and depths."""

from dataclasses import replace

import numpy as np
import pytest

from survey.quality.facades import facades_of
from survey.quality.masonry.index import given_grade
from survey.quality.masonry.walls import MasonryQuality, WallStone, judge_masonry
from tests.survey.quality.masonry.bonds import bond


def wall(shift: float = 0.5, scale: float = 1.0, lift: float = 0.0, **changes: object) -> list[WallStone]:
    rng = np.random.default_rng(2)
    stones = []
    for k, face in enumerate(bond(shift)):
        flat = face * scale
        flat[:, 1] += rng.normal(0.0, lift)
        outline = np.column_stack([flat[:, 0], np.zeros(4), flat[:, 1]])
        area = float(np.ptp(flat[:, 0]) * np.ptp(flat[:, 1]))
        given = {
            "code": f"A{k}", "kind": "ashlar", "course": k // 10 + 1, "zone": None, "outline": outline,
            "normal": np.array([0.0, -1.0, 0.0]), "sigma": 0.002, "depth": 0.3, "depth_sigma": 0.02, "area": area,
        }  # fmt: skip
        stones.append(WallStone(**(given | changes)))  # type: ignore[arg-type]
    return stones


def judged(stones: list[WallStone], **given: str) -> list[MasonryQuality]:
    facades = facades_of(stones)
    return list(judge_masonry(stones, facades, {name: given_grade(level) for name, level in given.items()}))


def words(stones: list[WallStone]) -> dict[str, str]:
    (found,) = judged(stones)
    return {name: grade.words for name, grade in found.grades.items()}


def test_squared_stones_in_running_bond_fulfil_what_a_face_tells() -> None:
    found = words(wall())
    assert {name: found[name] for name in ("SD", "SS", "HJ", "VJ")} == {
        "SD": "F", "SS": "F", "HJ": "F", "VJ": "F"
    }  # fmt: skip
    assert {found[name] for name in ("SM", "MM", "WC")} == {"not known"}
    (one,) = judged(wall(), SM="good", MM="medium")
    assert one.indices["vertical"] == (7.5, 8.5)  # type: ignore[index]
    assert one.categories["vertical"] == "A"  # type: ignore[index]
    assert one.categories["out_of_plane"] == "B to A"  # type: ignore[index]
    assert one.trace == pytest.approx(1.69, abs=0.1)
    assert one.trace_sigma is not None
    assert 0.0 < one.trace_sigma < 0.05
    assert one.section is None
    assert one.headers is None
    assert one.strengths["young"][0] < one.strengths["young"][1]


def test_aligned_joints_are_not_staggered() -> None:
    assert words(wall(0.0))["VJ"] == "NF"


@pytest.mark.parametrize(("scale", "grade"), [(0.3, "NF"), (0.6, "PF"), (1.0, "F")])
def test_stones_are_small_or_large_by_their_larger_side(scale: float, grade: str) -> None:
    """Larger sides of 0.15, 0.29 and 0.49 m."""
    assert words(wall(scale=scale))["SD"] == grade


def test_of_sizes_that_are_half_and_half_either_may_hold() -> None:
    mixed = [*wall()[:40], *wall(scale=0.6)[40:]]
    assert words(mixed)["SD"] == "PF or F"


def test_beds_that_jump_by_more_than_a_joint_do_not_run_through() -> None:
    assert words(wall(lift=0.002))["HJ"] == "F"
    assert words(wall(lift=0.1))["HJ"] == "NF"
    assert words(wall(course=None))["HJ"] == "not known"


def test_rubble_is_not_cut() -> None:
    assert words(wall(kind="rubble"))["SS"] == "NF"
    half = [replace(one, kind="rubble") if k % 2 else one for k, one in enumerate(wall())]
    assert words(half)["SS"] == "PF"


def test_headers_bond_a_wall_of_which_one_face_was_surveyed() -> None:
    """Stones of 0.14 m²: all, a third and none of them headers are 7, 2.4 and 0 per m²."""
    every = wall(kind="header")
    assert words(every)["WC"] == "F"
    some = [replace(one, kind="header" if k % 2 == 0 else "stretcher") for k, one in enumerate(wall())]
    assert words(some)["WC"] == "PF"
    assert words(wall(kind="stretcher"))["WC"] == "NF"
    (one,) = judged(some)
    assert one.headers == pytest.approx(3.5, abs=0.1)


def both_faces(front: list[float], back: list[float], thickness: float = 0.6) -> list[WallStone]:
    """Return two faces whose courses have these depths, by turns."""
    outer = [replace(one, depth=front[(one.course or 0) % len(front)], depth_sigma=0.005) for one in wall()]
    inner = []
    for one in wall(depth_sigma=0.005):
        outline = one.outline[::-1] + np.array([0.0, thickness, 0.0])
        depth = back[(one.course or 0) % len(back)]
        inner.append(
            replace(one, code=f"B{one.code}", outline=outline, normal=np.array([0.0, 1.0, 0.0]), depth=depth)
        )
    return [*outer, *inner]


@pytest.mark.parametrize(
    ("front", "back", "grade"),
    [
        ([0.2], [0.2], "NF"),  # two faces with a core between them
        ([0.3], [0.3], "NF"),  # a straight joint
        ([0.5, 0.1], [0.1, 0.5], "F"),  # 0.4 m to the side in each course of 0.3 m
        ([0.42, 0.18], [0.18, 0.42], "F"),  # 0.24 m in each
        ([0.38, 0.22], [0.22, 0.38], "PF"),  # 0.16 m in each
    ],
)
def test_sections_tell_the_bond_where_both_faces_were_surveyed(
    front: list[float], back: list[float], grade: str
) -> None:
    found = judged(both_faces(front, back))
    assert len(found) == 2
    for one in found:
        assert one.grades["WC"].words == grade  # type: ignore[index]
        assert one.section is not None


def test_arches_small_walls_and_unknown_depths_are_left_out() -> None:
    assert judged(wall()[:7]) == []
    assert judged(wall(kind="voussoir")) == []
    (front, _) = judged([replace(one, depth=None) for one in both_faces([0.5, 0.1], [0.1, 0.5])])
    assert front.section is None
    zones = [replace(one, zone="east" if k < 40 else "west") for k, one in enumerate(wall())]
    assert [(one.zone, len(one.stones)) for one in judged(zones)] == [("east", 40), ("west", 40)]
