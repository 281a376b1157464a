"""Depth of a stone by the best evidence, in whatever order the rules are written."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ground.errors import SurveyError
from survey.extrusion.depth import depth_for
from survey.records.survey import BlockRecord, DepthRule

CORNERS = np.array([[0.0, 0.0, 0.0], [0.6, 0.0, 0.0], [0.6, 0.0, 0.3]])


def stone(kind="header", course=2, zone="west", **more):
    return BlockRecord("A", kind, course, CORNERS, np.empty((0, 3)), 0.003, line=40, zone=zone, **more)


STRUCTURE = DepthRule(None, 0.4, 0.1, "thickness of the wall", 5)
KIND = DepthRule("header", 0.5, 0.03, "archive", 6)
COURSES = DepthRule("header", 0.52, 0.01, "broken end", 7, courses=(1, 3))
ZONE = DepthRule("header", 0.47, 0.02, "core", 8, zone="west")
BOTH = DepthRule("header", 0.49, None, "drilled", 9, courses=(2, 2), zone="west")


@pytest.mark.parametrize("order", list(permutations(range(3))))
@pytest.mark.parametrize(
    ("rules", "found", "origin"),
    [
        ((STRUCTURE, KIND, COURSES), COURSES, "rule"),
        ((STRUCTURE, KIND, ZONE), ZONE, "rule"),
        ((STRUCTURE, KIND, BOTH), BOTH, "rule"),
        ((COURSES, ZONE, BOTH), BOTH, "rule"),
        ((STRUCTURE, KIND, DepthRule("jamb", 0.3, None, "x", 9, courses=(2, 2))), KIND, "kind"),
        (
            (STRUCTURE, DepthRule("jamb", 0.3, None, "x", 9), DepthRule("sill", 0.2, None, "y", 3)),
            STRUCTURE,
            "structure",
        ),
    ],
)
def test_the_most_particular_rule_holds_in_whatever_order_they_are_written(rules, found, origin, order):
    depth = depth_for(stone(), [rules[k] for k in order])
    assert (depth.value, depth.sigma, depth.source, depth.line) == (
        found.depth,
        found.sigma,
        found.source,
        found.line,
    )
    assert depth.origin == origin


def test_a_measured_depth_comes_before_every_rule_and_says_its_evidence():
    own = depth_for(stone(depth=0.61, depth_sigma=0.01, depth_source="open end"), [BOTH])
    assert (own.value, own.sigma, own.source, own.origin, own.line) == (0.61, 0.01, "open end", "stone", 40)
    bare = depth_for(stone(depth=0.61), [BOTH])
    assert (bare.sigma, bare.source) == (None, "measured on the stone")
    # even where the rules contradict each other
    assert depth_for(stone(depth=0.61), [COURSES, ZONE]).value == 0.61


@given(st.integers(1, 30), st.integers(1, 30), st.integers(1, 30))
def test_a_range_of_courses_holds_from_its_first_to_its_last(first, last, course):
    first, last = sorted((first, last))
    rule = DepthRule("header", 0.52, None, "broken end", 7, courses=(first, last))
    assert depth_for(stone(course=course), [KIND, rule]).value == (0.52 if first <= course <= last else 0.5)


def test_a_stone_of_no_course_or_zone_is_under_no_rule_of_one():
    assert depth_for(stone("voussoir", None, None), [STRUCTURE]).origin == "structure"
    for rule in (COURSES, ZONE, BOTH):
        assert depth_for(stone(course=None, zone=None), [KIND, rule]).origin == "kind"
    assert depth_for(stone(course=None), [KIND, COURSES, ZONE]).value == ZONE.depth
    assert depth_for(stone(zone="east"), [KIND, COURSES, ZONE]).value == COURSES.depth


@pytest.mark.parametrize(
    ("rules", "lines"),
    [
        ((KIND, COURSES, ZONE), "7 and 8"),
        ((KIND, DepthRule("header", 0.6, None, "again", 20)), "6 and 20"),
        ((STRUCTURE, DepthRule(None, 0.6, None, "again", 21)), "5 and 21"),
        ((BOTH, DepthRule("header", 0.6, None, "again", 22, courses=(1, 5), zone="west")), "9 and 22"),
        ((COURSES, DepthRule("header", 0.6, None, "again", 23, courses=(2, 2))), "7 and 23"),
    ],
)
def test_two_rules_of_the_same_weight_are_refused_by_their_lines(rules, lines):
    with pytest.raises(SurveyError, match=rf"stone A \(line 40\): .*lines {lines} both hold") as caught:
        depth_for(stone(), rules)
    assert "depth of its own" in caught.value.remedy


def test_rules_that_contradict_each_other_elsewhere_do_not_matter():
    other = DepthRule("header", 0.6, None, "again", 20, zone="east")
    assert depth_for(stone(), [ZONE, other]).value == ZONE.depth
    assert depth_for(stone(zone=None), [KIND, ZONE, other]).value == KIND.depth


def test_without_evidence_the_stone_and_the_remedy_are_named():
    with pytest.raises(
        SurveyError, match=r"stone A \(line 40\): no depth is known for a sill; .*depth sill D source"
    ):
        depth_for(stone("sill"), [KIND, BOTH])
