"""From contacts to relations: slopes at which a stone of an arch rests, circles, joints that come in pieces."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from archmodel.relations.classify import RelationSettings, StoneContacts, StonesOf, relations_between
from archmodel.tables.relations import RELATIONS

FRONT, BACK = (0.0, -1.0, 0.0), (0.0, 1.0, 0.0)


def contacts(*rows):
    """Contacts from (first, second, normal) or (…, area, gap)."""
    full = [(*row, 1.0, 0.01)[:5] for row in rows]
    normals = np.array([row[2] for row in full], dtype=float)
    return StoneContacts(
        np.array([row[:2] for row in full]),
        np.array([row[3] for row in full], dtype=float),
        np.array([row[4] for row in full], dtype=float),
        normals / np.linalg.norm(normals, axis=1)[:, None],
        np.arange(3.0 * len(full)).reshape(-1, 3),
    )


def found(given, kinds, looks=None, **changes):
    """{(kind of relation, subject, object)}."""
    normals = np.array(looks or [FRONT] * len(kinds), dtype=float)
    made = relations_between(given, StonesOf(kinds, normals), RelationSettings(**changes))
    return {
        (RELATIONS[kind], int(one), int(other))
        for kind, one, other in zip(made.kind, made.subject, made.object, strict=True)
    }


def leaning(degrees, along=0.0):
    """A normal so far from the vertical, in a plane that contains it."""
    angle, turn = np.radians(degrees), np.radians(along)
    return (np.sin(angle) * np.cos(turn), np.sin(angle) * np.sin(turn), np.cos(angle))


@pytest.mark.parametrize(
    ("kinds", "degrees", "rests"),
    [
        (("ashlar", "ashlar"), 44.0, True),
        (("ashlar", "ashlar"), 46.0, False),
        (("voussoir", "voussoir"), 88.5, True),
        (("voussoir", "keystone"), 88.5, True),
        (("rib_segment", "boss"), 88.5, True),
        (("voussoir", "voussoir"), 89.5, False),
        (("voussoir", "ashlar"), 69.0, True),  # a skewback
        (("voussoir", "ashlar"), 71.0, False),
        (("ashlar", "voussoir"), 60.0, False),  # the wall beside the extrados
        (("web_stone", "rib_segment"), 84.0, True),  # a seat
        (("web_stone", "web_stone"), 84.0, True),
        (("web_stone", "web_stone"), 86.0, False),  # a head joint, as measured
        (("rib_segment", "web_stone"), 86.0, False),
    ],
)
def test_the_slope_from_which_a_stone_rests_on_the_next(kinds, degrees, rests):
    up = np.array(leaning(degrees))
    expected = {("rests_on", 0, 1)} if rests else {("beside", 0, 1)}
    assert found(contacts((0, 1, up)), kinds) == expected
    assert found(contacts((1, 0, -up)), kinds) == expected


def test_voussoirs_of_two_arches_back_to_back_do_not_rest_on_each_other():
    # the joint is 2° out of plumb
    given = contacts((0, 1, (0.0, -np.cos(0.035), np.sin(0.035))))
    assert found(given, ("voussoir", "voussoir"), [FRONT, BACK]) == {("across_the_wall", 0, 1)}


def test_a_stretcher_back_to_back_with_another_is_not_bonded_a_header_is():
    given = contacts((0, 1, FRONT))
    assert found(given, ("stretcher", "stretcher"), [FRONT, BACK]) == {("across_the_wall", 0, 1)}
    assert found(given, ("header", "stretcher"), [FRONT, BACK]) == {
        ("across_the_wall", 0, 1),
        ("bonded_with", 0, 1),
    }


def test_a_stone_behind_another_that_looks_the_same_way_is_beside_it():
    given = contacts((0, 1, FRONT))
    assert found(given, ("stretcher", "stretcher")) == {("beside", 0, 1)}


def test_stones_without_a_face_rest_and_stand_but_belong_to_no_facing():
    unknown = (np.nan, np.nan, np.nan)
    given = contacts((0, 1, (0, 0, 1)), (1, 2, (0, 1, 0)))
    assert found(given, ("infill", "header", "stretcher"), [unknown, FRONT, unknown]) == {
        ("rests_on", 0, 1),
        ("beside", 1, 2),
    }


def test_joints_of_a_pair_become_one_relation_of_a_kind():
    given = contacts(
        (0, 1, (0, 0, -1), 1.0, 0.01), (0, 1, (1, 0, 0), 0.5, 0.0), (0, 1, leaning(150), 3.0, 0.03)
    )
    made = relations_between(given, StonesOf(("ashlar",) * 2, np.array([FRONT] * 2)))
    assert [RELATIONS[kind] for kind in made.kind] == ["rests_on", "beside"]
    assert made.subject.tolist() == [1, 0]
    assert made.area == pytest.approx([4.0, 0.5])
    assert made.gap == pytest.approx([(0.01 + 0.09) / 4, 0.0])
    # weighted by area: the first contact at (0, 1, 2), the third at (6, 7, 8)
    assert made.centroid[0] == pytest.approx([4.5, 5.5, 6.5])
    upward = np.array([0, 0, 1]) * 1.0 - 3.0 * np.array(leaning(150))
    assert made.normal[0] == pytest.approx(upward / np.linalg.norm(upward))


def test_a_circle_is_broken_at_its_least_steep_joint():
    # three stones of a ring lean on one another, as noise can make it
    given = contacts((0, 1, leaning(80)), (1, 2, leaning(70, 120)), (2, 0, leaning(85, 240)))
    assert found(given, ("voussoir",) * 3) == {("rests_on", 0, 1), ("rests_on", 1, 2), ("beside", 0, 2)}


def test_stones_that_truly_lie_on_one_another_in_a_ring_stay_so():
    given = contacts((0, 1, (0, 0, 1)), (1, 2, (0, 0, 1)), (2, 0, (0, 0, 1)))
    assert found(given, ("slab",) * 3) == {("rests_on", 0, 1), ("rests_on", 1, 2), ("rests_on", 2, 0)}


@settings(max_examples=60, deadline=None)
@given(
    pairs=st.lists(
        st.tuples(st.integers(0, 9), st.integers(0, 9), st.floats(46.0, 134.0), st.floats(0.0, 360.0)).filter(
            lambda one: one[0] < one[1]
        ),
        min_size=1,
        max_size=40,
    )
)
def test_no_stone_of_an_arch_rests_on_itself_through_others(pairs):
    given = contacts(*((one, other, leaning(tilt, turn)) for one, other, tilt, turn in pairs))
    below = {k: set() for k in range(10)}
    for kind, one, other in found(given, ("voussoir",) * 10):
        if kind == "rests_on":
            below[one].add(other)
    for start in below:
        reached, front = set(), {start}
        while front:
            front = set().union(*(below[one] for one in front)) - reached
            reached |= front
        assert start not in reached


@settings(max_examples=30, deadline=None)
@given(st.permutations(range(5)))
def test_the_order_in_which_stones_are_given_does_not_matter(order):
    rows = [
        (0, 1, leaning(5)),
        (1, 2, leaning(60)),
        (2, 3, (0, 1, 0)),
        (3, 4, leaning(88)),
        (0, 4, leaning(30)),
    ]
    kinds, looks = (
        ["header", "voussoir", "voussoir", "quoin", "stretcher"],
        [FRONT, FRONT, BACK, (1, 0, 0), BACK],
    )
    place = {old: new for new, old in enumerate(order)}
    moved = contacts(*((place[a], place[b], normal) for a, b, normal in rows))
    expected = set()
    for kind, one, other in found(contacts(*rows), kinds, looks):
        one, other = place[one], place[other]
        expected.add((kind, one, other) if kind == "rests_on" else (kind, min(one, other), max(one, other)))
    assert found(moved, [kinds[i] for i in order], [looks[i] for i in order]) == expected
