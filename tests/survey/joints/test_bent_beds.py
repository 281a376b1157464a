"""Bent beds: chains of planes that are known, and the best divisions found by trying all."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from survey.geometry.watertight import check_watertight
from survey.joints.bent_beds import _chains, _squares
from survey.joints.bounded_closing import as_building
from survey.joints.close import close_joints
from survey.joints.contact_planes import contact_planes
from survey.joints.facing import find_facing
from survey.joints.settings import JointSettings
from survey.simplify.simplify import simplify
from tests.survey.plain_blocks import as_stone, drawn, moved
from tests.survey.unseen.statics import contact_area, near_pairs, overlap_depth

USUAL = JointSettings()
LENGTH, GAP = 0.5, 0.01


def course(tops, bottoms, starts, name):
    """Return stones between two lines, each line z(x); they end 5 mm before the head joints."""
    out = []
    for k, (a, b) in enumerate(pairwise(starts)):
        x0, x1 = a + GAP / 2, b - GAP / 2
        corners = [(x0, bottoms(x0)), (x1, bottoms(x1)), (x1, tops(x1)), (x0, tops(x0))]
        out.append(drawn(f"{name}{k}", corners))
    return out


def two_courses(bed, count=8):
    """Return courses in running bond across a bed z = bed(x), which is 10 mm wide."""
    lower = LENGTH * np.arange(count + 1.0)
    upper = np.array([0.0, *(lower[:-1] + LENGTH / 2), lower[-1]])
    return [
        *course(lambda x: bed(x) - GAP / 2, lambda x: -0.8, lower, "L"),
        *course(lambda x: 0.9, lambda x: bed(x) + GAP / 2, upper, "U"),
    ]


def bend(slope, at):
    """Return a bed that is level up to a place, then rising or falling."""
    return lambda x: slope * max(x - at, 0.0)


def found(solids):
    building = as_building([simplify(as_stone(one)) for one in solids])
    facing = find_facing(building.faces.solids, building.faces.planes, USUAL)
    contact = contact_planes(building.faces, facing, USUAL)
    owners = building.faces.planes.owner[facing.faces]
    codes = [stone.code for stone in building.stones]
    beds = {
        (codes[i], codes[j]): int(plane)
        for (i, j), plane in zip(owners.tolist(), contact.of_link, strict=True)
        if codes[i][0] != codes[j][0]
    }
    return building, contact, beds


def upward(contact, building, plane):
    """Return slope dz/dx of a plane, and its height at x = 0."""
    normal, offset = contact.normals[plane], contact.offsets[plane]
    offset = offset + normal @ building.origin
    return -normal[0] / normal[2], (offset - normal[1] * 0.2) / normal[2]


def stones_of(closed):
    return {solid.code: solid for solid in closed.solids}


def assert_all_touch(closed, bed, count=8):
    for solid in closed.solids:
        check_watertight(solid, convex=True)
    total = 0.0
    for i, j in near_pairs(closed.solids):
        one, two = closed.solids[i], closed.solids[j]
        assert overlap_depth(one, two) < 1e-9
        total += contact_area(one, two) if one.code[0] != two.code[0] else 0.0
    x = np.linspace(GAP / 2, LENGTH * count - GAP / 2, 4001)  # as far as there are stones
    z = np.array([bed(one) for one in x])
    true = 0.4 * np.hypot(np.diff(x), np.diff(z)).sum()
    assert total == pytest.approx(true, rel=5e-4)
    assert closed.report.gaps == ()


# valleys at a head joint of the lower course, so that the stone across gets two undersides; ridges at one of the upper
@pytest.mark.parametrize("slope", [0.06, 0.12, 0.2])
def test_a_valley_is_two_planes_and_the_stone_across_it_has_two_undersides(slope):
    bed = bend(slope, 4 * LENGTH)
    solids = two_courses(bed)
    # the upper stone across the bend cannot have been surveyed with a bent underside: level with its corners
    building, contact, beds = found(solids)
    planes = sorted(set(beds.values()), key=lambda plane: upward(contact, building, plane)[0])
    assert len(planes) == 2
    assert upward(contact, building, planes[0]) == pytest.approx((0.0, 0.0), abs=2e-3)
    assert upward(contact, building, planes[1])[0] == pytest.approx(slope, abs=3e-3)
    closed = close_joints([as_stone(one) for one in solids])
    assert_all_touch(closed, bed)
    faces = {code: len(one.faces) for code, one in stones_of(closed).items()}
    assert faces.pop("U4") == 7
    assert set(faces.values()) == {6}


@pytest.mark.parametrize("slope", [-0.06, -0.12, -0.2])
def test_a_ridge_is_two_planes_and_the_stone_under_it_has_two_tops(slope):
    bed = bend(slope, 3.5 * LENGTH)
    solids = two_courses(bed)
    building, contact, beds = found(solids)
    assert len(set(beds.values())) == 2
    slopes = sorted(upward(contact, building, plane)[0] for plane in set(beds.values()))
    assert slopes == pytest.approx([slope, 0.0], abs=3e-3)
    closed = close_joints([as_stone(one) for one in solids])
    assert_all_touch(closed, bed)
    faces = {code: len(one.faces) for code, one in stones_of(closed).items()}
    assert faces.pop("L3") == 7
    assert set(faces.values()) == {6}


@settings(max_examples=10, deadline=None)
@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3), st.sampled_from([(0.08, 4.0), (-0.08, 3.5)]))
def test_a_bend_is_found_wherever_the_wall_stands(turned, case):
    turn = Rotation.from_rotvec(turned).as_matrix()
    solids = two_courses(bend(case[0], case[1] * LENGTH))
    here = found(solids)[2]
    there = found([moved(one, turn, np.array([3.0, -2.0, 1.0])) for one in solids])[2]
    groups = [
        {frozenset(pair for pair, own in beds.items() if own == plane) for plane in beds.values()}
        for beds in (here, there)
    ]
    assert groups[0] == groups[1]
    assert len(groups[0]) == 2


@pytest.mark.parametrize("sag", [0.06, 0.1])
def test_a_sagging_course_becomes_a_chain_of_planes(sag):
    count = 16
    span = LENGTH * count

    def bed(x):
        return -sag * 4.0 * x * (span - x) / span**2

    solids = two_courses(bed, count)
    building, contact, beds = found(solids)
    planes = sorted(set(beds.values()), key=lambda plane: upward(contact, building, plane)[0])
    assert 2 <= len(planes) <= count // 3
    slopes = [upward(contact, building, plane)[0] for plane in planes]
    # a parabola's slope runs from -4 sag / span to +4 sag / span; chords lie within
    assert max(np.abs(slopes)) < 4.0 * sag / span
    closed = close_joints([as_stone(one) for one in solids])
    assert closed.report.largest_displacement < 0.03
    assert_all_touch(closed, bed, count)


def test_one_odd_stone_does_not_bend_a_bed():
    solids = two_courses(lambda x: 0.0)
    odd = solids[3]
    odd.vertices[odd.vertices[:, 2] > -0.1, 2] -= 0.03
    _, _, beds = found(solids)
    assert len(set(beds.values())) == 1


def test_a_bend_within_the_straightness_is_none():
    # 4 m that kink by 3 % in the middle are 15 mm off their chord in the middle, from which a plane is less than that
    _, _, beds = found(two_courses(bend(-0.03, 4 * LENGTH)))
    assert len(set(beds.values())) == 1


def test_at_a_step_no_stone_lies_in_another_and_what_does_not_meet_is_listed():
    closed = close_joints([as_stone(one) for one in two_courses(lambda x: 0.0 if x < 4 * LENGTH else 0.05)])
    for solid in closed.solids:
        check_watertight(solid, convex=True)
    solids, listed = stones_of(closed), {frozenset(gap.stones) for gap in closed.report.gaps}
    for k in range(8):
        for n in (k, k + 1):
            one, two = solids[f"L{k}"], solids[f"U{n}"]
            assert overlap_depth(one, two) < 1e-9
            facing = 0.4 * (LENGTH / 2 - GAP)
            assert contact_area(one, two) > 0.5 * facing or frozenset((f"L{k}", f"U{n}")) in listed
    assert closed.report.overlaps == ()


def line_squares(x, y):
    """Return the sum of squares off the least-squares line."""
    return float(((y - np.polyval(np.polyfit(x, y, 1), x)) ** 2).sum())


def smoothed(y):
    """Return medians of five, mirrored at the ends."""
    far = [y[2], y[1], *y, y[-2], y[-3]]
    return np.array([np.median(far[k : k + 5]) for k in range(len(y))])


places = st.lists(st.floats(0.05, 1.0), min_size=3, max_size=12)


@settings(max_examples=60, deadline=None)
@given(places, st.integers(0, 2**32 - 1))
def test_divisions_are_the_best_of_all(steps, seed):
    x, rng = np.cumsum(steps), np.random.default_rng(seed)
    y = np.abs(x - x.mean()) * rng.uniform(0.0, 0.1) + rng.normal(0.0, 0.005, len(x))
    order = rng.permutation(len(x))
    divisions = list(_chains(x[order], y[order]))
    assert [len(ends) for ends in divisions] == list(range(2, len(x) // 3 + 1))
    smooth = smoothed(y)

    def cost(cuts):
        return sum(line_squares(x[a:b], smooth[a:b]) for a, b in pairwise([0, *cuts]))

    for ends in divisions:
        every = [
            [*cuts, len(x)]
            for cuts in combinations(range(1, len(x)), len(ends) - 1)
            if min(np.diff([0, *cuts, len(x)])) >= 3
        ]
        assert ends in every
        assert cost(ends) == pytest.approx(min(map(cost, every)), rel=1e-6, abs=1e-12)


@settings(max_examples=40, deadline=None)
@given(places, st.integers(0, 2**32 - 1))
def test_squares_are_those_of_least_squares_lines(steps, seed):
    x, y = np.cumsum(steps), np.random.default_rng(seed).normal(0.0, 0.05, len(steps))
    squares = _squares(x, y)
    for i in range(len(x) + 1):
        for j in range(len(x) + 1):
            if j - i < 3:
                assert squares[i, j] == np.inf
            else:
                assert squares[i, j] == pytest.approx(line_squares(x[i:j], y[i:j]), abs=1e-12)


@pytest.mark.parametrize("odd", [0.0, 0.2])
@pytest.mark.parametrize("pieces", [2, 3])
def test_straight_pieces_are_found_with_an_odd_link_in_one_of_them(pieces, odd):
    x = np.arange(12.0 * pieces)
    y = np.interp(x, 12.0 * np.arange(pieces + 1), 0.05 * (np.arange(pieces + 1) % 2))
    y[5] += odd
    ends = list(_chains(x, y))[pieces - 2]
    assert np.abs(np.array(ends) - 12 * np.arange(1, pieces + 1)).max() <= 2
