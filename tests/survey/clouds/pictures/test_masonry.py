"""Stones are named by their courses and by what they bound: quoins at corners, sills, jambs, lintels and arches."""

import itertools

import numpy as np
import pytest

from survey.clouds.pictures.masonry import name_stones

HEIGHT = 0.3
FRONT = (0.55, 0.35)  # lengths of the first stone of every other course [m]


def wall(courses=5, ragged=0.0, joint=0.01):
    """Outlines of courses of which every other begins with a stretcher and ends with a header."""
    rings = []
    for k in range(courses):
        heads = np.cumsum([ragged * (k % 2), FRONT[k % 2], 0.5, 0.5, FRONT[(k + 1) % 2]])
        for left, right in itertools.pairwise(heads):
            low, high = k * HEIGHT, (k + 1) * HEIGHT - joint
            rings.append(np.array([[left, low], [right - joint, low], [right - joint, high], [left, high]]))
    return rings


def kinds(rings, cut=None):
    return [stone.kind for stone in name_stones(rings, [], coursed=True, cut=cut)]


def test_stones_at_both_ends_of_a_wall_are_quoins():
    found = kinds(wall())
    assert found[0::4] == found[3::4] == ["quoin"] * 5
    assert {kind for k, kind in enumerate(found) if k % 4 in (1, 2)} == {"stretcher"}


def test_the_edge_of_the_picture_is_no_corner():
    rings = wall()
    cut = [k % 4 == 0 for k in range(len(rings))]
    found = kinds(rings, cut)
    assert "quoin" not in found[0::4]
    assert found[3::4] == ["quoin"] * 5


def test_courses_that_end_ragged_or_are_few_make_no_corner():
    assert "quoin" not in kinds(wall(ragged=0.2))[0::4]
    assert "quoin" not in kinds(wall(courses=2))


def box(left, low, right, high):
    return np.array([[left, low], [right, low], [right, high], [left, high]])


def codes(rings, coursed=True, openings=()):
    return [stone.code for stone in name_stones(rings, openings, coursed)]


def test_no_stones_have_no_names():
    assert name_stones([], [], coursed=True) == []


@pytest.mark.parametrize(("length", "kind"), [(0.44, "header"), (0.46, "stretcher")])
def test_a_stone_is_a_header_up_to_one_and_a_half_times_its_height(length, kind):
    (stone,) = name_stones([box(1.0, 2.0, 1.0 + length, 2.3)], [], coursed=True)
    assert (stone.kind, stone.code, stone.course, stone.place) == (kind, "C01-01", 1, 1)


def test_courses_count_from_the_ground_and_places_from_the_left_whatever_the_order():
    rings = wall(courses=3)
    order = np.random.default_rng(1).permutation(len(rings)).tolist()
    found = codes([rings[k] for k in order])
    assert found == [f"C{k // 4 + 1:02d}-{k % 4 + 1:02d}" for k in order]


@pytest.mark.parametrize(("gap", "courses"), [(0.07, 1), (0.08, 2)])
def test_neighbours_of_a_course_are_no_farther_than_a_quarter_of_their_height(gap, courses):
    # each shares just half of its height with the next, and nothing with the one after that
    rings = [box(k * (0.5 + gap), 0.14 * k, k * (0.5 + gap) + 0.5, 0.14 * k + 0.3) for k in range(3)]
    assert len({stone.course for stone in name_stones(rings, [], coursed=True)}) == courses


@pytest.mark.parametrize(("step", "courses"), [(0.14, 1), (0.16, 2)])
def test_neighbours_of_a_course_share_half_of_their_height(step, courses):
    rings = [box(0.0, 1.0, 0.5, 1.3), box(0.51, 1.0 + step, 1.0, 1.3 + step)]
    assert len({stone.course for stone in name_stones(rings, [], coursed=True)}) == courses


def test_stones_above_one_another_are_of_two_courses_though_they_overlap():
    rings = [box(0.0, 0.0, 0.5, 0.3), box(0.1, 0.1, 0.6, 0.4)]
    assert codes(rings) == ["C01-01", "C02-01"]


def test_a_course_goes_on_behind_an_opening():
    rings = [
        ring
        for k in range(3)
        for ring in (box(0.0, 0.3 * k, 1.0, 0.3 * k + 0.27), box(2.0, 0.3 * k, 3.0, 0.3 * k + 0.27))
    ]
    assert codes(rings) == ["C01-01", "C01-02", "C02-01", "C02-02", "C03-01", "C03-02"]
    # one half a course higher does not
    shifted = [ring + np.array([0.0, 0.15 * (k % 2)]) for k, ring in enumerate(rings)]
    assert codes(shifted) == ["C01-01", "C02-01", "C03-01", "C04-01", "C05-01", "C06-01"]


def test_rubble_is_numbered_in_rows_of_about_a_stone():
    rng = np.random.default_rng(2)
    rings = [
        box(x, y, x + 0.28, y + 0.3) + rng.uniform(-0.05, 0.05, 2)
        for y in (10.1, 10.4, 10.7)
        for x in (0.0, 0.3, 0.6, 0.9)
    ]
    found = name_stones(rings, [], coursed=False)
    assert [stone.code for stone in found] == [f"S{k:03d}" for k in range(1, 13)]
    assert {(stone.kind, stone.course) for stone in found} == {("rubble", None)}


# an opening 1.0 m wide and 1.5 m high, and the stones about it
OPENING = np.array([[2.0, 1.0], [3.0, 2.5]])


def around(*rings, coursed=True):
    """Kinds of stones around the opening, which are the same in a wall twice as large, measured from elsewhere."""
    found = [stone.kind for stone in name_stones(rings, [OPENING], coursed)]
    larger = [2.0 * (ring - [2.5, 1.0]) for ring in rings]
    assert [s.kind for s in name_stones(larger, [2.0 * (OPENING - [2.5, 1.0])], coursed)] == found
    return found


@pytest.mark.parametrize(
    ("ring", "kind"),
    [
        (box(1.9, 0.7, 3.1, 1.0), "sill"),
        (box(1.9, 0.65, 3.1, 0.95), "sill"),  # a joint below the opening
        (box(1.9, 0.63, 3.1, 0.93), "stretcher"),  # a quarter of its height below
        (box(2.0, 0.7, 2.75, 1.0), "sill"),  # most of the width
        (box(2.0, 0.7, 2.65, 1.0), "stretcher"),
        (box(1.9, 0.84, 3.1, 1.14), "sill"),  # less than half of it beside the opening
        (box(1.8, 2.5, 3.2, 2.8), "lintel"),
        (box(1.8, 2.55, 3.2, 2.85), "lintel"),
        (box(1.8, 2.57, 3.2, 2.87), "stretcher"),
        (box(2.05, 2.5, 3.0, 2.8), "lintel"),  # nine tenths of the width
        (box(2.15, 2.5, 3.0, 2.8), "stretcher"),
        (box(1.4, 1.4, 2.0, 1.7), "jamb"),
        (box(1.4, 1.4, 1.95, 1.7), "jamb"),
        (box(1.4, 1.4, 1.93, 1.7), "stretcher"),
        (box(3.05, 1.4, 3.6, 1.7), "jamb"),
        (box(3.07, 1.4, 3.6, 1.7), "stretcher"),
        (box(1.4, 2.33, 2.0, 2.63), "jamb"),  # more than half of its height is beside the opening
        (box(1.4, 2.37, 2.0, 2.67), "stretcher"),
        (box(1.4, 0.87, 2.0, 1.17), "jamb"),
        (box(1.4, 0.83, 2.0, 1.13), "stretcher"),
    ],
    ids=str,
)
def test_what_bounds_an_opening_is_named_after_it(ring, kind):
    (found,) = around(ring)
    # a stone half as long again as high shows its head
    assert found == ("header" if kind == "stretcher" and np.ptp(ring[:, 0]) < 0.45 else kind)


def test_rubble_has_no_jambs():
    assert around(box(1.4, 1.4, 2.0, 1.7), coursed=False) == ["rubble"]


def test_a_jamb_bounds_the_opening_where_it_is_open():
    # a stone whose foot reaches the opening below it, but whose side beside it is far
    foot = np.array([[1.4, 1.4], [2.0, 1.4], [1.7, 1.7], [1.4, 1.7]])
    assert around(foot) != ["jamb"]
    assert around(foot + np.array([0.15, 0.0])) == ["jamb"]


def arch(stones=7, radius=0.5, depth=0.3, middle=(2.5, 2.0)):
    """Voussoirs of a half circle over the opening, from the right."""
    angles = np.linspace(0.0, np.pi, stones + 1)
    rings = []
    for a, b in itertools.pairwise(angles):
        inner = [(np.cos(t), np.sin(t)) for t in (a, b)]
        rings.append(
            np.array([*(np.array(inner) * radius), *(np.array(inner[::-1]) * (radius + depth))]) + middle
        )
    return rings


def test_stones_of_an_arch_are_voussoirs_and_the_middle_one_its_keystone():
    found = around(*arch())
    assert found == ["voussoir"] * 3 + ["keystone"] + ["voussoir"] * 3
    names = name_stones(arch(), [OPENING], coursed=True)
    assert [stone.code for stone in names] == [f"V{k:02d}" for k in range(7, 0, -1)]
    assert {stone.course for stone in names} == {None}


def test_an_arch_with_a_joint_at_its_crown_has_no_keystone():
    assert around(*arch(6)) == ["voussoir"] * 6


def test_an_arch_of_two_stones_has_a_joint_at_its_crown():
    # each leans on one side only, and stands upright on the other
    left = np.array([[2.0, 2.46], [2.48, 2.5], [2.48, 2.8], [1.8, 2.8]])
    right = np.array([5.0, 0.0]) - left * [1.0, -1.0]
    assert around(left, right[::-1]) == ["voussoir"] * 2
    # but not far from the middle of the opening: that is the end of a course
    aside = left - [0.9, 0.0]
    assert around(aside + np.array([0.4, 0.0])) != ["voussoir"]


def test_a_stone_over_the_middle_is_no_keystone_unless_it_is_about_symmetrical():
    wedge = np.array([[2.1, 2.5], [2.7, 2.5], [2.8, 2.8], [2.0, 2.8]])
    beside = [ring for ring in arch() if not 2.3 < ring[:, 0].mean() < 2.7]
    # the middle of the opening is 0.10 and 0.25 m from that of a wedge 0.8 m wide
    assert around(*beside, wedge)[-1] == "keystone"
    assert around(*beside, wedge - [0.15, 0.0])[-1] == "voussoir"


def test_the_courses_beside_an_arch_count_without_it():
    beside = [box(0.5, 2.0, 1.2, 2.3), box(0.5, 2.3, 1.2, 2.6)]
    names = name_stones([*arch(), *beside], [OPENING], coursed=True)
    assert [stone.code for stone in names[7:]] == ["C01-01", "C02-01"]


@pytest.mark.parametrize(("lean", "kind"), [(0.03, "stretcher"), (0.10, "springer")])
def test_a_stone_beside_an_arch_that_leans_steeply_towards_it_is_its_springer(lean, kind):
    # the side towards the arch leans by 6 or 18 degrees
    stone = np.array([[1.0, 1.72], [1.65, 1.72], [1.65 - lean, 2.02], [1.0, 2.02]])
    assert around(*arch(), stone)[-1] == kind
