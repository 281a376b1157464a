"""Contacts in the plane against a twin that looks at every pair, and what must not depend on place, turn or scale."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanics.planar.contacts import PlanarDetector
from mechanics.planar.model import build_planar_model
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from tests.mechanics.planar.shapes import grid_of_disks

ALERT = 0.05
STEP = 1e-3


def scene_of(centres, radii, velocities=None, fixed=None, walls=(), alert=ALERT):
    count = len(radii)
    velocities = np.zeros((count, 3)) if velocities is None else velocities
    fixed = np.zeros(count, dtype=bool) if fixed is None else fixed
    return PlanarScene(
        "disks",
        tuple(
            Disk(
                f"d{i}",
                tuple(centres[i]),
                float(radii[i]),
                fixed=bool(fixed[i]),
                velocity=tuple(velocities[i]),
            )
            for i in range(count)
        ),
        tuple(Wall(f"w{i}", tuple(a), tuple(b)) for i, (a, b) in enumerate(walls)),
        alert_distance=alert,
        time=PlanarTime(STEP),
    )


def detect(scene):
    model, start = build_planar_model(scene)
    return PlanarDetector(model)(start)


def pairs_twin(centres, radii, velocities, fixed):
    """Every pair of disks, gap by gap."""
    found = []
    for i in range(len(radii)):
        for j in range(i + 1, len(radii)):
            if fixed[i] and fixed[j]:
                continue
            gap = np.hypot(*(centres[i] - centres[j])) - radii[i] - radii[j]
            closing = STEP * np.hypot(*(velocities[i] - velocities[j])[:2])
            if gap <= ALERT * min(radii[i], radii[j]) + closing:
                found.append((i, j))
    return found


@st.composite
def clouds(draw):
    count = draw(st.integers(1, 40))
    seed = draw(st.integers(0, 2**31))
    spread = draw(st.floats(0, 6))
    fast = draw(st.sampled_from([0.0, 1.0, 1000.0]))
    rng = np.random.default_rng(seed)
    # sizes over up to six orders of magnitude, places at the scale of the large and of the small ones
    radii = 10.0 ** rng.uniform(-spread, 0, count)
    centres = rng.uniform(-3, 3, (count, 2)) * np.where(rng.random((count, 1)) < 0.5, 1.0, 10**-spread)
    fixed = rng.random(count) < 0.2
    velocities = np.where(fixed[:, None], 0.0, fast * rng.normal(size=(count, 3)))
    return centres, radii, velocities, fixed


@settings(deadline=None, max_examples=150)
@given(clouds())
def test_the_pairs_found_are_those_of_the_slow_twin(cloud):
    contacts = detect(scene_of(*cloud))
    assert list(map(tuple, contacts.bodies.tolist())) == pairs_twin(*cloud)


def segment_distance(point, start, end):
    along = np.clip((point - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
    return np.hypot(*(point - start - along * (end - start)))


@settings(deadline=None, max_examples=150)
@given(clouds(), st.integers(0, 2**31), st.integers(1, 6))
def test_walls_that_share_no_end_are_met_at_their_nearest_point(cloud, seed, count):
    centres, radii, velocities, fixed = cloud
    rng = np.random.default_rng(seed)
    walls = rng.uniform(-3, 3, (count, 2, 2))
    contacts = detect(scene_of(centres, radii, velocities, fixed, walls))
    of_walls = contacts.bodies[:, 1] >= len(radii)
    expected = {}
    for i in np.flatnonzero(~fixed):
        for w, (start, end) in enumerate(walls):
            gap = segment_distance(centres[i], start, end) - radii[i]
            if gap <= ALERT * radii[i] + STEP * np.hypot(*velocities[i, :2]):
                expected[int(i), len(radii) + w] = gap
    found = dict(zip(map(tuple, contacts.bodies[of_walls].tolist()), contacts.gap[of_walls], strict=True))
    assert found.keys() == expected.keys()
    for pair, gap in expected.items():
        assert found[pair] == pytest.approx(gap, abs=1e-12)
    # n points from the wall's nearest point to the disk's centre, and the contact point lies in the middle of the gap
    for pair, n, point in zip(
        contacts.bodies[of_walls], contacts.normal[of_walls], contacts.point[of_walls], strict=True
    ):
        i, gap = int(pair[0]), expected[tuple(pair.tolist())]
        np.testing.assert_allclose(point, centres[i] - (radii[i] + 0.5 * gap) * n, atol=1e-12)
        start, end = walls[pair[1] - len(radii)]
        assert segment_distance(centres[i] - (radii[i] + gap) * n, start, end) < 1e-12


def test_frames_levers_and_areas_of_two_disks():
    # candidate at (3, 4), 5 m from the antagonist; radii 2 and 2.9: gap 0.1, the point 2.05 and 2.95 from the centres
    scene = scene_of(np.array([[3.0, 4.0], [0.0, 0.0]]), np.array([2.0, 2.9]), alert=0.1)
    contacts = detect(scene)
    np.testing.assert_allclose(contacts.normal, [[0.6, 0.8]], atol=1e-15)
    np.testing.assert_allclose(contacts.gap, [0.1], atol=1e-14)
    np.testing.assert_allclose(contacts.point, [[2.95 * 0.6, 2.95 * 0.8]], atol=1e-14)
    # a × t with a = -2.05 n and a = 2.95 n
    np.testing.assert_allclose(contacts.lever, [[0.0, -2.05, 0.0, 2.95]], atol=1e-14)
    np.testing.assert_allclose(contacts.area, [4.0])  # width of the smaller disk × 1 m
    np.testing.assert_allclose(contacts.size, [4.0])


def packing(seed=0):
    centres, radii = grid_of_disks(12, 10, radius=0.5, seed=seed, spread=0.3)
    centres = 0.75 * centres + np.random.default_rng(seed).uniform(-0.1, 0.1, centres.shape)
    walls = np.array([[[-0.1, 0.0], [12.0, 0.2]], [[0.0, -0.1], [0.1, 10.0]], [[11.8, -0.1], [12.3, 10.0]]])
    return centres, radii, walls


@pytest.mark.parametrize("scale", [1e-2, 1.0, 1e3])
@pytest.mark.parametrize("angle", [0.0, 0.7, 2.9])
@pytest.mark.parametrize("shift", [0.0, 1e4])
def test_contacts_do_not_depend_on_place_turn_and_scale(scale, angle, shift):
    centres, radii, walls = packing()
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    there = detect(
        scene_of((centres @ turn.T + shift) * scale, radii * scale, walls=(walls @ turn.T + shift) * scale)
    )
    here = detect(scene_of(centres, radii, walls=walls))
    assert len(here) > 100
    np.testing.assert_array_equal(there.bodies, here.bodies)
    np.testing.assert_array_equal(there.key, here.key)
    np.testing.assert_allclose(there.gap / scale, here.gap, atol=1e-14 * max(shift, 100))
    np.testing.assert_allclose(there.normal, here.normal @ turn.T, atol=1e-13 * max(shift, 10))


def test_a_scene_that_travels_as_a_whole_has_the_contacts_of_one_at_rest():
    centres, radii, _ = packing()
    travel = np.tile([300.0, -200.0, 0.0], (len(radii), 1))
    np.testing.assert_array_equal(
        detect(scene_of(centres, radii, travel)).bodies, detect(scene_of(centres, radii)).bodies
    )


def test_contacts_are_ordered_by_bodies_and_permuted_bodies_have_the_same():
    centres, radii, walls = packing()
    contacts = detect(scene_of(centres, radii, walls=walls))
    order = np.random.default_rng(0).permutation(len(radii))
    other = detect(scene_of(centres[order], radii[order], walls=walls))
    assert sorted(map(tuple, contacts.bodies.tolist())) == list(map(tuple, contacts.bodies.tolist()))
    names = np.append(order, len(radii) + np.arange(3))
    assert {frozenset(pair) for pair in names[other.bodies].tolist()} == {
        frozenset(pair) for pair in contacts.bodies.tolist()
    }


def test_keys_name_the_same_contacts_when_everything_has_moved_a_little():
    centres, radii, walls = packing()
    first = detect(scene_of(centres, radii, walls=walls))
    moved = centres + np.random.default_rng(1).uniform(-1e-3, 1e-3, centres.shape)
    second = detect(scene_of(moved, radii, walls=walls))
    pairs = [dict(zip(map(tuple, one.bodies.tolist()), one.key, strict=True)) for one in (first, second)]
    common = pairs[0].keys() & pairs[1].keys()
    assert len(common) > 0.9 * len(pairs[0])
    assert all(pairs[0][pair] == pairs[1][pair] for pair in common)
    assert len(set(first.key.tolist())) == len(first)


def test_disks_far_apart_and_of_all_sizes_are_found_without_a_cell_for_all_the_space_between():
    # a dense grid over this space would have 10²⁰ cells
    centres = np.array([[0.0, 0.0], [2e-3, 0.0], [1e7, 1e7], [1e7 + 2.0, 1e7]])
    contacts = detect(scene_of(centres, np.array([1e-3, 1e-3, 1.0, 1.0])))
    assert contacts.bodies.tolist() == [[0, 1], [2, 3]]


def test_a_wall_that_is_a_million_disks_long_is_met():
    walls = [[[-1e6, -1.0], [1e6, -1.0]], [[3.0, -1e6], [3.0, 1e6]]]
    contacts = detect(scene_of(np.array([[0.0, 0.0], [2.0, 5.0]]), np.array([1.0, 1.0]), walls=walls))
    assert contacts.bodies.tolist() == [[0, 2], [1, 3]]
    np.testing.assert_allclose(contacts.gap, 0.0, atol=1e-9)


def features(centre, walls, radius=1.0):
    """Bodies and normals of one disk's contacts with walls that share ends."""
    contacts = detect(scene_of(np.array([centre], dtype=float), np.array([radius]), walls=walls, alert=0.2))
    return [(int(w) - 1, n) for w, n in zip(contacts.bodies[:, 1], contacts.normal, strict=True)]


FLAT = [[[-5.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [5.0, 0.0]]]
ROOF = [[[-5.0, -1.0], [0.0, 0.0]], [[0.0, 0.0], [5.0, -1.0]]]
VALLEY = [[[-5.0, 1.0], [0.0, 0.0]], [[0.0, 0.0], [5.0, 1.0]]]


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("x", [-0.3, -1e-9, 0.0, 1e-9, 0.3])
def test_on_a_straight_line_a_disk_meets_one_wall_upright_also_beside_a_joint(x, turned):
    walls = [wall[::-1] for wall in FLAT] if turned else FLAT
    ((wall, normal),) = features((x, 1.05), walls)
    assert wall == (0 if x <= 0 else 1)
    np.testing.assert_allclose(normal, [0.0, 1.0], atol=1e-12)


def test_over_a_ridge_a_disk_meets_the_end_once():
    ((wall, normal),) = features((0.05, 1.04), ROOF)
    assert wall == 0
    np.testing.assert_allclose(normal, np.array([0.05, 1.04]) / np.hypot(0.05, 1.04), atol=1e-12)


def test_in_a_valley_a_disk_meets_both_slopes_and_no_end():
    found = features((0.0, 1.03), VALLEY)
    slope = np.arctan2(1.0, 5.0)
    assert [wall for wall, _ in found] == [0, 1]
    np.testing.assert_allclose(found[0][1], [np.sin(slope), np.cos(slope)], atol=1e-12)
    np.testing.assert_allclose(found[1][1], [-np.sin(slope), np.cos(slope)], atol=1e-12)


def test_before_a_valley_the_slope_ahead_is_watched_before_the_disk_is_over_it():
    # flat, then rising by 0.02 rad: the foot on the rise is its end until x = -R tan(0.02), the disk touches it only
    # at x = -R tan(0.01), and a step may be longer than what lies between
    walls = [[[-5.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [5.0, 5.0 * np.tan(0.02)]]]
    x = -1.5 * np.tan(0.02)
    found = features((x, 1.0), walls)
    assert [wall for wall, _ in found] == [0, 1]
    np.testing.assert_allclose(found[1][1], [-np.sin(0.02), np.cos(0.02)], atol=1e-12)


def test_a_wall_that_ends_on_another_is_not_felt_through_it():
    # a post stands on the floor; below the floor a disk passes under its foot
    walls = [[[-5.0, 0.0], [5.0, 0.0]], [[0.0, 0.0], [0.0, 3.0]]]
    ((wall, normal),) = features((0.3, -1.02), walls)
    assert wall == 0
    np.testing.assert_allclose(normal, [0.0, -1.0], atol=1e-12)
    # in the corner above it, both are met
    assert [one for one, _ in features((1.0, 1.0), walls)] == [0, 1]


def test_a_free_end_is_met_from_beyond():
    ((wall, normal),) = features((5.6, 0.8), FLAT)
    assert wall == 1
    np.testing.assert_allclose(normal, [0.6, 0.8], atol=1e-12)
