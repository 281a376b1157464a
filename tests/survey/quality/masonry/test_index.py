"""The masonry quality index against the worked examples of the paper, and with what is not known."""

import pytest

from survey.quality.masonry.index import (
    DIRECTIONS,
    PARAMETERS,
    UNKNOWN,
    Direction,
    Grade,
    category,
    given_grade,
    graded,
    index_range,
    mechanical_ranges,
)

F, PF, NF = (given_grade(level) for level in ("good", "medium", "poor"))


def grades(**given: Grade) -> dict:
    return dict.fromkeys(PARAMETERS, F) | given


def exact(direction: Direction, **given: Grade) -> float:
    low, high = index_range(grades(**given), direction)
    assert low == high
    return low


def test_a_wall_that_fulfils_all_has_ten_and_one_that_fulfils_nothing_has_nothing():
    for direction in DIRECTIONS:
        assert exact(direction) == 10.0
        assert index_range(dict.fromkeys(PARAMETERS, NF), direction) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("name", "lost"),
    [
        ("SD", (0.5, 0.5, 0.5, 1.0, 1.0, 1.0)),
        ("SS", (1.5, 1.0, 1.0, 3.0, 2.0, 2.0)),
        ("WC", (0.0, 1.0, 1.5, 1.0, 2.0, 3.0)),
        ("HJ", (1.0, 0.5, 1.0, 2.0, 1.0, 2.0)),
        ("VJ", (0.5, 1.0, 0.5, 1.0, 2.0, 1.0)),
        ("MM", (1.5, 1.0, 0.5, 2.0, 2.0, 1.0)),
        ("SM", (3.0, 3.0, 3.0, 7.0, 7.0, 5.0)),
    ],
)
def test_what_each_parameter_is_worth_in_table_8(name, lost):
    """Lost from ten if partly, and if not fulfilled: vertical, in plane, out of plane."""
    assert [10.0 - exact(one, **{name: PF}) for one in DIRECTIONS] == pytest.approx(lost[:3])
    assert [10.0 - exact(one, **{name: NF}) for one in DIRECTIONS] == pytest.approx(lost[3:])


def test_the_example_of_figure_12_has_its_index_category_and_strengths():
    """All fulfilled but the mortar in part: f_m 6.25 to 9.15 MPa, τ₀ 0.133 to 0.182 MPa, E 2400 to 3290 MPa."""
    indices = {one: index_range(grades(MM=PF), one) for one in DIRECTIONS}
    assert [indices[one][0] for one in DIRECTIONS] == [8.5, 9.0, 9.5]
    assert [category(indices[one][0], one) for one in DIRECTIONS] == ["A", "A", "A"]
    ranges = mechanical_ranges(indices)
    assert ranges["compressive_strength"] == pytest.approx((6.25e6, 9.15e6), rel=0.002)
    assert ranges["shear_strength"] == pytest.approx((0.133e6, 0.182e6), rel=0.005)
    assert ranges["young"] == pytest.approx((2400e6, 3290e6), rel=0.002)


@pytest.mark.parametrize(
    ("direction", "bounds"),
    [
        (Direction.VERTICAL, (2.5, 5.0)),
        (Direction.IN_PLANE, (3.0, 5.0)),
        (Direction.OUT_OF_PLANE, (4.0, 7.0)),
    ],
)
def test_categories_begin_where_table_9_says(direction, bounds):
    low, high = bounds
    found = [category(one, direction) for one in (0.0, low - 0.01, low, high - 0.01, high, 10.0)]
    assert found == ["C", "C", "B", "B", "A", "A"]


def test_what_is_not_known_makes_the_index_a_range():
    assert index_range(grades(MM=UNKNOWN), Direction.VERTICAL) == (8.0, 10.0)
    assert index_range(grades(SM=UNKNOWN, MM=UNKNOWN), Direction.IN_PLANE) == pytest.approx((2.4, 10.0))
    ranges = mechanical_ranges({one: index_range(grades(MM=UNKNOWN), one) for one in DIRECTIONS})
    assert ranges["shear_strength"][0] < 0.133e6 < 0.182e6 < ranges["shear_strength"][1]


def test_a_measured_quantity_is_graded_with_its_uncertainty():
    sure = graded(1.8, 0.01, (1.4, 1.6), "")
    assert sure.chances == pytest.approx((0.0, 0.0, 1.0))
    assert (sure.possible, sure.words) == ((2,), "F")
    even = graded(1.6, 0.02, (1.4, 1.6), "")
    assert even.chances == pytest.approx((0.0, 0.5, 0.5))
    assert even.words == "PF or F"
    assert graded(1.2, 0.01, (1.4, 1.6), "").words == "NF"
    assert graded(1.5, 1.0, (1.4, 1.6), "").words == "NF or PF or F"
    assert UNKNOWN.words == "not known"
    assert graded(1.6 + 1.97 * 0.02, 0.02, (1.4, 1.6), "").words == "F"  # PF has less than 2.5 %
