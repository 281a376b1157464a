"""Movement that beds show: what moved, by how much, in which courses, how old, and what can be excluded."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from survey.quality.courses import measure_courses
from survey.quality.deformation import measure_deformation
from survey.quality.departures.beds import (
    BedMovement,
    WallBeds,
    _age,
    _Beds,
    _beds,
    _scatter,
    find_bed_movements,
    measure_beds,
)
from survey.quality.departures.shapes import Found, Shape
from survey.quality.facades import facades_of
from survey.quality.movement import compare_courses
from survey.quality.precision import StoneQuality
from tests.survey.quality.departures.walls_by_hand import Shift, wall
from tests.survey.quality.plain_stones import polygon_stone

MIDDLE = 2.875  # of a wall of 6 m in running bond, between its first and last stone [m]


def beds_of(stones: list[StoneQuality], tilt: float = 0.0) -> WallBeds:
    tilts = [np.diag([0.0, tilt**2, 0.0])] if tilt else []
    lines = measure_courses(stones, facades_of(stones), tilts)
    lengths = {one.code: one.length for one in stones}
    (beds,) = find_bed_movements(lines, lengths, 0.003, {one.code: 7 for one in stones})
    return beds


def only(stones: list[StoneQuality]) -> BedMovement:
    (movement,) = beds_of(stones).movements
    return movement


def test_a_wall_at_rest_has_no_movement_and_says_what_is_excluded() -> None:
    beds = beds_of(wall())
    assert beds.movements == ()
    assert beds.odd == ()
    assert beds.scatter == pytest.approx(0.002, rel=0.35)
    assert beds.excluded is not None
    assert 0.003 < beds.excluded < 0.008
    assert set(beds.excluded_in) == set(range(1, 9))
    assert min(beds.excluded_in.values()) > 2.0 * beds.excluded
    assert beds.finding(3) == f"no movement found; more than {beds.excluded_in[3] * 1e3:.0f} mm is excluded"
    assert beds.finding(99) == "not tested: too few stones"


def test_a_settled_pier_is_named_with_its_courses_extent_and_age() -> None:
    """Right of an opening the pier sank by 20 mm, before courses 7 and 8 were laid level over it."""
    sunk = wall(3, lambda s, c: -0.02 if s > 3.4 and c <= 6 else 0.0, gap=(2.4, 3.4, 2, 5))
    one = only(sunk)
    assert (one.kind, one.first, one.last) == ("step", 1, 6)
    assert abs(one.amount + 0.02) < 3.5 * one.sigma < 0.004
    assert one.left == pytest.approx(3.5 - MIDDLE, abs=0.35)
    assert one.right == pytest.approx(MIDDLE, abs=0.5)
    assert "settlement: its right part" in one.text
    assert (
        f"lies {abs(one.amount) * 1e3:.1f} ± {one.sigma * 1e3:.1f} mm lower, in 6 courses (1 to 6)"
        in one.text
    )
    assert "which agree" in one.text
    assert one.older_than == 7
    assert one.above is not None
    assert one.above_sigma is not None
    assert abs(one.above) < 3.0 * one.above_sigma
    assert one.dating.startswith("older than course 7, which was laid level above it")
    assert set(one.stones) == {s.code for s in sunk if s.outline[:, 0].mean() > 3.4 and (s.course or 9) <= 6}
    beds = beds_of(sunk)
    assert beds.finding(4).startswith("settled -")
    assert beds.finding(8).startswith("laid level above older movement; no movement found")


def test_a_settlement_on_the_left_is_told_of_the_left() -> None:
    one = only(wall(3, lambda s, c: -0.02 if s < 2.5 else 0.0))
    assert one.amount > 0.0
    assert "its left part" in one.text
    assert one.left < one.right < 0.0
    assert one.older_than is None
    assert one.dating == "no course above tells its age"


def test_a_part_between_two_cracks_is_found_and_either_side_of_what_stayed() -> None:
    sunk = only(wall(5, lambda s, c: -0.015 if 2.0 < s < 4.0 else 0.0))
    assert (sunk.kind, sunk.first, sunk.last) == ("part", 1, 8)
    assert sunk.amount == pytest.approx(-0.015, abs=0.003)
    assert "lower than both sides" in sunk.text
    raised = only(wall(5, lambda s, c: 0.015 if 2.0 < s < 4.0 else 0.0))
    assert raised.amount == pytest.approx(0.015, abs=0.003)
    assert "both sides of the part" in raised.text


@pytest.mark.parametrize(
    ("lift", "kind", "amount", "words"),
    [
        (lambda s, c: 0.02 * s / 5.75, "tilt", 0.02, "rises to the right"),
        (lambda s, c: -0.02 * s / 5.75, "tilt", -0.02, "falls to the right"),
        (lambda s, c: -0.02 * (1 - (s / 2.9 - 1) ** 2), "sag", -0.02, "sags by"),
        (lambda s, c: 0.02 * (1 - (s / 2.9 - 1) ** 2), "sag", 0.02, "hogs by"),
        (lambda s, c: -0.03 * max(s - 3.5, 0.0) / 2.2, "right end", -0.03, "its right end"),
        (lambda s, c: -0.03 * max(2.5 - s, 0.0) / 2.5, "left end", -0.03, "its left end"),
    ],
)
def test_every_shape_has_its_name(lift: object, kind: str, amount: float, words: str) -> None:
    one = only(wall(8, lift))  # type: ignore[arg-type]
    assert one.kind == kind
    assert one.amount == pytest.approx(amount, abs=0.004)
    assert words in one.text
    assert (one.first, one.last) == (1, 8)


def test_a_zigzag_crack_is_one_step() -> None:
    """The crack goes to the right by half a stone in every course."""
    one = only(wall(9, lambda s, c: -0.02 if s > 2.0 + 0.15 * c else 0.0))
    assert (one.kind, one.first, one.last) == ("step", 1, 8)
    assert one.amount == pytest.approx(-0.02, abs=0.003)


def test_one_course_that_was_laid_sloping_is_no_movement_of_the_wall() -> None:
    one = only(wall(10, lambda s, c: 0.03 * s / 6.0 if c == 4 else 0.0))
    assert (one.kind, one.first, one.last) == ("tilt", 4, 4)
    assert one.dating == "in one course alone: laid so, rather than moved"
    assert "in course 4" in one.text


def test_movement_above_is_not_older_than_what_lies_on_it() -> None:
    """Courses 5 to 8 sag over an opening; those below are level: nothing dates it."""
    one = only(wall(11, lambda s, c: -0.02 * (1 - (s / 2.9 - 1) ** 2) if c >= 5 else 0.0))
    assert (one.first, one.last) == (5, 8)
    assert one.older_than is None


def test_half_of_a_movement_above_dates_nothing() -> None:
    half = wall(12, lambda s, c: -0.02 if s > 3.0 and c <= 4 else -0.01 if s > 3.0 else 0.0)
    found = beds_of(half).movements
    assert found[0].kind == "step"
    assert all(one.older_than is None for one in found)


def test_a_stone_that_sank_alone_is_odd_and_no_movement() -> None:
    stones = wall(13, lambda s, c: -0.03 if c == 4 and abs(s - 2.75) < 0.1 else 0.0)
    beds = beds_of(stones)
    (odd,) = beds.odd
    assert (odd.code, odd.line) == ("4-6", 7)
    assert abs(odd.amount + 0.03) < 4.0 * odd.sigma < 0.016
    assert "below those of its neighbours" in odd.text
    assert beds.movements == ()


def test_a_frame_that_control_points_level_to_a_milliradian_shows_no_tilt_of_one() -> None:
    stones = wall(14, lambda s, c: 0.003 * s)
    assert [one.kind for one in beds_of(stones).movements] == ["tilt"]
    assert beds_of(stones, tilt=0.003).movements == ()
    # a settlement is found in any frame
    sunk = wall(14, lambda s, c: -0.02 if 2.0 < s < 4.0 else 0.0)
    assert [one.kind for one in beds_of(sunk, tilt=0.003).movements] == ["part"]


def test_what_is_excluded_would_have_been_found() -> None:
    """Settlements of the size that is said to be excluded are found in 95 of 100 surveys."""
    found = 0
    for seed in range(12):
        bound = beds_of(wall(seed)).excluded
        assert bound is not None
        moved = wall(seed, lambda s, c, bound=bound: -bound if s > 2.9 else 0.0)  # type: ignore[misc]
        found += bool(beds_of(moved).movements)
    assert found >= 10
    missed = sum(
        bool(beds_of(wall(seed, lambda s, c: -0.0005 if s > 2.9 else 0.0)).movements) for seed in range(8)
    )
    assert missed <= 1


def test_the_scatter_is_not_that_of_a_movement() -> None:
    still = beds_of(wall(15)).scatter
    moved = beds_of(wall(15, lambda s, c: -0.1 if s > 3.0 else 0.0)).scatter
    assert moved == pytest.approx(still, rel=0.25)


def test_walls_of_a_facade_are_told_apart_by_zone() -> None:
    beside = [
        polygon_stone(
            f"t{one.code}", one.kind, one.outline[:, [0, 2]] + [20.0, 0.0], course=one.course, zone="tower"
        )
        for one in wall(17, lambda s, c: -0.02 if s > 3.0 else 0.0)
    ]
    stones = [*wall(16, zone="nave"), *beside]
    lines = measure_courses(stones, facades_of(stones))
    found = find_bed_movements(lines, {one.code: one.length for one in stones}, 0.003)
    assert {one.zone: len(one.movements) for one in found} == {"nave": 0, "tower": 1}


def test_each_wall_has_a_scatter_of_its_own_where_its_stones_suffice() -> None:
    rough = wall(20, zone="rough", beds=0.008)
    small = wall(21, zone="small", courses=2, length=3.1)
    fine = wall(22, zone="fine", beds=0.002)
    stones = [
        polygon_stone(
            f"{one.zone}{one.code}",
            one.kind,
            one.outline[:, [0, 2]] + [20.0 * place, 0.0],
            course=one.course,
            zone=one.zone,
            corner_sigma=one.corner_sigma,
            offset_sigma=one.offset_sigma,
        )
        for place, part in enumerate((rough, small, fine))
        for one in part
    ]
    lines = measure_courses(stones, facades_of(stones))
    found = find_bed_movements(lines, {one.code: one.length for one in stones}, 0.003)
    scatter = {one.zone: one.scatter for one in found}
    assert scatter["rough"] > 3.0 * scatter["fine"]
    # of ten stones: that of the whole survey
    assert scatter["fine"] < scatter["small"] < scatter["rough"]


def test_too_few_stones_are_not_tested() -> None:
    stones = wall(18, courses=1, length=1.1)
    beds = beds_of(stones)
    assert (beds.movements, beds.excluded) == ((), None)
    assert beds.finding(1) == "not tested: too few stones"


def test_the_lift_of_a_movement_is_what_was_put_in() -> None:
    one = only(wall(3, lambda s, c: -0.02 if s > 3.0 else 0.0, beds=0.0, sigma=0.0001))
    places = np.array([-2.0, 2.0])
    assert one.lift(places, (-MIDDLE, MIDDLE)) == pytest.approx([0.0, -0.02], abs=1e-3)
    # where the left side sank the right side lies higher, and it is the left that moved
    left = only(wall(3, lambda s, c: -0.02 if s < 3.0 else 0.0, beds=0.0, sigma=0.0001))
    assert left.amount > 0.0
    assert left.lift(places, (-MIDDLE, MIDDLE)) == pytest.approx([-0.02, 0.0], abs=1e-3)
    sag = only(wall(3, lambda s, c: -0.02 * (1 - (s / 2.9 - 1) ** 2), beds=0.0, sigma=0.0005))
    assert sag.lift(np.array([-MIDDLE, 0.0, MIDDLE]), (-MIDDLE, MIDDLE)) == pytest.approx(
        [0.0, sag.amount, 0.0]
    )
    assert math.isfinite(sag.probability)


def seen(*amounts: float, run: tuple[int, int] = (0, 1), sigma: float = 0.001) -> Found:
    """Return a settlement of 20 mm in a run of courses, of which each has this amount by itself."""
    each = np.array([[amount, sigma] for amount in amounts])
    return Found(Shape("step", (0.0,), 2), run, np.zeros(1), -0.02, sigma, each, 0.0, 1, 0.0)


@pytest.mark.parametrize(
    ("found", "older"),
    [
        (seen(-0.02, -0.02, 0.0, 0.001), 2),  # level above
        (seen(-0.02, -0.02, -0.01, -0.01), None),  # half of it above: neither level nor the same
        (seen(-0.02, -0.02, -0.019, -0.02), None),  # the same above
        (seen(-0.02, -0.02, -0.01, -0.01, sigma=0.01), None),  # above nothing is known
        (seen(0.0, -0.02, 0.0, 0.0, run=(1, 1)), None),  # the course below has not moved
        (seen(-0.02, -0.02), None),  # nothing above
    ],
)
def test_courses_date_a_movement_only_if_they_are_level_and_differ_from_it(
    found: Found, older: int | None
) -> None:
    assert _age(found, range(len(found.each)))[0] == older


def test_the_scatter_of_neighbours_is_without_the_slope_of_their_course() -> None:
    level, sloping = (
        _scatter([_beds(measure_courses(stones, facades_of(stones)))])[0]
        for stones in (wall(19), wall(19, lambda s, c: 0.03 * s))
    )
    assert sloping == pytest.approx(level, rel=0.1)


@pytest.mark.parametrize("slope", [0.0, 0.02, -0.3])
def test_the_scatter_of_differences_about_their_median(slope: float) -> None:
    """Steps of ±2, ±1 mm in turn about a slope: by Gauss' law of |step|/√2, widened by √(n/(n − 1)) for the slope."""
    steps = 1e-3 * np.tile([2.0, -1.0, 1.0, -2.0], 5)
    along = np.arange(len(steps) + 1, dtype=float)
    height = np.concatenate([[0.0], np.cumsum(steps)]) + slope * along
    course, measured = np.zeros(len(height), dtype=np.intp), np.full(len(height), 1e-10)
    beds = _Beds(tuple(map(str, course)), course, (1,), along, height, measured, 0.0)
    tau, _, count = _scatter([beds])
    wider = len(steps) / (len(steps) - 1.0)
    assert count == len(steps)
    assert tau == pytest.approx(math.sqrt(2.5e-6 * wider / (2.0 * 0.9112563609) - 1e-10), rel=1e-6)


def test_no_stone_of_a_steep_bed_is_odd() -> None:
    assert beds_of(wall(20, lambda s, c: 0.06 * s)).odd == ()


@pytest.mark.parametrize(
    "lift",
    [
        lambda s, c: 0.0,
        lambda s, c: -0.02 if s > 3.4 and c <= 6 else 0.0,
        lambda s, c: -0.02 * (1 - (s / 2.9 - 1) ** 2),
    ],
    ids=["rest", "pier", "sag"],
)
def test_all_tell_one_scatter_and_one_misfit(lift: Shift) -> None:
    """The table of courses, the comparison, the diagnosis and the verdict on movement; the truth is 1 mm."""
    stones = wall(2, lift, beds=0.001, sigma=0.001)
    facades = facades_of(stones)
    lines, (beds,) = measure_beds(stones, facades)
    deformation = measure_deformation(stones, facades)
    assert beds.scatter == pytest.approx(0.001, rel=0.25)
    assert {line.scatter for line in lines} == {beds.scatter} == set(deformation.scatter.values())

    def still(code: str, places: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.zeros_like(places)

    compared = sum(one.misfit.still for one in compare_courses(lines, still))
    groups = [one for one in deformation.groups if one.quantity == "beds"]
    diagnosed = sum(float(one.residuals(still) @ one.residuals(still)) for one in groups)
    assert compared == pytest.approx(diagnosed, rel=1e-9)
    moved = bool(beds.movements)
    dof = sum(one.dof for one in groups)
    assert (compared > 5.0 * dof) if moved else (abs(compared - dof) < 4.0 * math.sqrt(2.0 * dof))
