"""Statistics of a bond of whole stones that lie by hand: courses, headers, and head joints above one another."""

import numpy as np
import pytest

from survey.clouds.pictures.statistics import bond_statistics

JOINT = 0.01


def stone(left, length, course, height=0.3):
    low, high = course * 0.31, course * 0.31 + height
    return np.array([[left, low], [left + length, low], [left + length, high], [left, high]])


def course_of(number, lengths, start=0.0, height=0.3):
    lefts = start + np.cumsum([0.0, *(length + JOINT for length in lengths[:-1])])
    return [stone(left, length, number, height) for left, length in zip(lefts.tolist(), lengths, strict=True)]


def statistics(*courses, kinds=None):
    rings = [ring for course in courses for ring in course]
    numbers = [number for number, course in enumerate(courses, start=1) for _ in course]
    return dict(bond_statistics(rings, kinds or [None] * len(rings), numbers))


def test_no_stones_have_no_statistics():
    assert bond_statistics([], [], []) == []


def test_usual_size_and_heights_of_courses_are_medians():
    found = statistics(
        course_of(0, [0.5, 0.6, 0.9]), course_of(1, [0.6, 0.6], height=0.24), course_of(2, [0.2], height=0.27)
    )
    assert found["Usual length and height"] == "0.60 × 0.29 m"
    assert found["Height of courses"] == "0.24 to 0.30 m"
    assert "Headers" not in found


@pytest.mark.parametrize(
    ("shift", "text"),
    [(0.0, "0% of 2"), (0.06, "0% of 2"), (0.08, "100% of 2"), (0.3, "100% of 2"), (-0.08, "100% of 2")],
)
def test_a_head_joint_is_staggered_from_a_quarter_of_the_height_on(shift, text):
    # a course 0.30 m high, so that a joint bonds 0.075 m from the one below
    found = statistics(course_of(0, [0.6] * 3), course_of(1, [0.6] * 3, start=shift))
    assert found["Staggered head joints"] == text


def test_stones_apart_have_no_joint_between_them():
    window = [stone(0.0, 0.6, 0), stone(0.61, 0.6, 0), stone(2.2, 0.6, 0)]
    found = statistics(
        window, [stone(0.3, 0.6, 1), stone(0.91, 0.6, 1), stone(2.0, 0.4, 1), stone(2.41, 0.6, 1)]
    )
    # one above the one joint of the course below, another a metre and more beside it
    assert found["Staggered head joints"] == "100% of 2"
    assert "Staggered head joints" not in statistics([stone(0.0, 0.6, 0)], course_of(1, [0.6, 0.6]))
    # a gap in the course above is no joint either
    apart = [stone(0.1, 0.2, 1), stone(0.4, 0.6, 1)]
    assert "Staggered head joints" not in statistics(course_of(0, [0.6, 0.6]), apart)


@pytest.mark.parametrize(("height", "share"), [(0.2, "100%"), (0.4, "0%")])
def test_the_height_that_counts_is_that_of_the_course_of_the_joint(height, share):
    above = course_of(1, [0.6] * 3, start=0.08, height=height)
    assert statistics(course_of(0, [0.6] * 3), above)["Staggered head joints"] == f"{share} of 2"


def test_the_order_of_the_stones_tells_nothing():
    rings = [*course_of(0, [0.6, 0.4, 0.6]), *course_of(1, [0.3, 0.68, 0.7])]
    courses = [1, 1, 1, 2, 2, 2]
    order = [4, 0, 5, 2, 1, 3]
    mixed = bond_statistics([rings[k] for k in order], [None] * 6, [courses[k] for k in order])
    assert mixed == bond_statistics(rings, [None] * 6, courses)
    assert dict(mixed)["Staggered head joints"] == "50% of 2"


def test_headers_are_counted_among_headers_and_stretchers_alone():
    kinds = ["header", "stretcher", "stretcher", "quoin", None, "header", "header"]
    found = statistics(course_of(0, [0.3] * 7), kinds=kinds)
    assert found["Headers"] == "60% of headers and stretchers"
    assert statistics(course_of(0, [0.3] * 2), kinds=kinds[:2])["Headers"] == "50% of headers and stretchers"


def test_stones_without_a_course_count_by_their_size_alone():
    found = dict(bond_statistics([stone(0.0, 0.4, 0), stone(1.0, 0.8, 0)], ["rubble"] * 2, [None, None]))
    assert found == {"Usual length and height": "0.60 × 0.30 m"}
