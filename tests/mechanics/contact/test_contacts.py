"""The names of contacts: unique, and the same wherever the scene is and however large it is."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mechanics.contact.contacts import gaps, material_points
from mechanics.contact.detection import Detector
from mechanics.model.model import build_model
from mechanics.scene.scene import Fidelity, Placement
from tests.mechanics.shapes import TURN, brick, detected, ground, pile, scene, transformed

seeds = st.integers(0, 2**32 - 1)
placements = st.sampled_from([one for one in Placement if one is not Placement.AREA])


def facts(one, points=4, placement=Placement.CORNERS, spacing=None):
    """By key: bodies, gap, area and the two material points."""
    _, state, contacts = detected(one, points, placement, spacing)
    assert len(set(contacts.key.tolist())) == len(contacts)
    assert (contacts.key >= 0).all()
    order = np.argsort(contacts.key)
    place = material_points(contacts, state)
    return (
        contacts.key[order],
        contacts.bodies[order],
        gaps(contacts, state)[order],
        contacts.area[order],
        place[order],
    )


@settings(max_examples=60, deadline=None)
@given(
    seeds,
    st.sampled_from([1e-2, 1.0, 1e3]),
    st.sampled_from([0.0, 1e4]),
    st.sampled_from([1, 3, 4, 8]),
    placements,
)
@example(seed=0, scale=1e-2, far=1e4, points=4, placement=Placement.CORNERS)
def test_no_contact_appears_vanishes_or_changes_its_name_when_the_scene_is_turned_moved_or_scaled(
    seed, scale, far, points, placement
):
    one = pile(seed, stones=6, alert=0.3)
    key, bodies, gap, area, place = facts(one, points, placement)
    rng = np.random.default_rng(seed + 1)
    turn, shift = Rotation.random(random_state=rng).as_matrix(), far * rng.normal(size=3)
    there = facts(transformed(one, turn, shift, scale), points, placement)
    np.testing.assert_array_equal(there[0], key)
    np.testing.assert_array_equal(there[1], bodies)
    # far away coordinates have fewer digits: 2e-12 m at 1e4 m
    atol = 1e-10 + 1e-9 * (far > 0) * max(1.0, 1 / scale)
    np.testing.assert_allclose(there[2] / scale, gap, atol=atol)
    np.testing.assert_allclose(there[3] / scale**2, area, atol=10 * atol)
    np.testing.assert_allclose((there[4] - shift) @ turn / scale, place, atol=10 * atol)


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_names_stay_when_the_state_turns_as_a_whole(seed):
    model, state, contacts = detected(pile(seed, stones=6, alert=0.3))
    turn = Rotation.random(random_state=seed).as_matrix()
    turned = replace(state, centre=state.centre @ turn.T + 7.0, rotation=turn @ state.rotation)
    found = Detector(model.surfaces, model.fixed, 0.3)(turned, np.zeros(len(model.mass)))
    np.testing.assert_array_equal(found.key, contacts.key)
    np.testing.assert_allclose(found.frame, contacts.frame @ turn.T, atol=1e-9)
    np.testing.assert_allclose(found.arm, contacts.arm, atol=1e-9)  # the same material points


@settings(max_examples=30, deadline=None)
@given(seeds)
def test_names_stay_when_stones_move_by_a_hair(seed):
    model, state, contacts = detected(pile(seed, stones=6, alert=0.3))
    rng = np.random.default_rng(seed)
    near = replace(
        state,
        centre=state.centre + 1e-9 * rng.normal(size=(6, 3)),
        rotation=Rotation.from_rotvec(1e-9 * rng.normal(size=(6, 3))).as_matrix() @ state.rotation,
    )
    found = Detector(model.surfaces, model.fixed, 0.3)(near, np.zeros(len(model.mass)))
    np.testing.assert_array_equal(found.key, contacts.key)
    np.testing.assert_allclose(found.arm, contacts.arm, atol=1e-6)


def column(count, shift=0.0):
    """Equal cubes on a cube, each moved a little against the one below."""
    place = [np.array([shift * k, shift * k, k]) for k in range(count)]
    kind = [Fidelity.FIXED] + [Fidelity.RIGID] * (count - 1)
    return scene(*(brick(str(k), place[k], place[k] + 1, kind[k]) for k in range(count)))


def names(model, state, noise=None, detector=None):
    if noise is not None:
        state = replace(
            state,
            centre=state.centre + noise[0],
            rotation=Rotation.from_rotvec(noise[1]).as_matrix() @ state.rotation,
        )
    find = detector or Detector(model.surfaces, model.fixed, 0.05)
    return find(state, np.zeros(len(model.mass))).key.tolist()


@pytest.mark.parametrize("shift", [0.0, 0.01])
@pytest.mark.parametrize(
    ("turn", "far", "scale"), [(None, 0.0, 1.0), (TURN, 0.0, 1.0), (TURN, 1e4, 1e-2), (TURN, 1e4, 1e3)]
)
def test_faces_that_coincide_keep_their_names_under_rounding(shift, turn, far, scale):
    model, state = build_model(transformed(column(5, shift), turn, (far, -far, far), scale))
    expected = names(model, state)
    assert len(expected) == 16
    rng = np.random.default_rng(0)
    for _ in range(50):
        noise = 1e-12 * scale * rng.normal(size=(5, 3)), 1e-12 * rng.normal(size=(5, 3))
        assert names(model, state, noise) == expected


def test_contacts_slide_with_their_names_where_no_edge_is_crossed():
    """Small on large: its corners. Shifted equal ones: also where edges cross."""
    for one, count in ((scene(ground(), brick("a", (0, 0, 0), (1, 1, 1))), 4), (column(3, 0.1), 8)):
        model, state = build_model(one)
        expected = names(model, state)
        assert len(expected) == count
        for step in np.linspace(0, 0.05, 6):
            noise = np.zeros((2, len(model.mass), 3))
            noise[0, 1, :2], noise[1, 1, 2] = (step, -step), step
            assert names(model, state, noise) == expected


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_what_a_detector_has_seen_before_changes_nothing(seed):
    """Hints of earlier detections against a detector that knows nothing, along a random motion."""
    model, state = build_model(pile(seed, stones=8, alert=0.1))
    rng = np.random.default_rng(seed)
    used = Detector(model.surfaces, model.fixed, 0.1)
    for _ in range(6):
        noise = 0.1 * rng.normal(size=(8, 3)), 0.2 * rng.normal(size=(8, 3))
        assert names(model, state, noise, used) == names(
            model, state, noise, Detector(model.surfaces, model.fixed, 0.1)
        )


@settings(max_examples=20, deadline=None)
@given(seeds, st.sampled_from([1e-2, 1.0, 1e3]), st.sampled_from([0.1, 1.0]))
def test_points_over_the_area_keep_their_names_when_the_scene_is_turned_moved_and_scaled(
    seed, scale, spacing
):
    one = pile(seed, stones=4, alert=0.3)
    key, bodies, gap, area, place = facts(one, placement=Placement.AREA, spacing=spacing)
    turn = Rotation.random(random_state=np.random.default_rng(seed + 1)).as_matrix()
    there = facts(
        transformed(one, turn, np.ones(3), scale), placement=Placement.AREA, spacing=spacing * scale
    )
    np.testing.assert_array_equal(there[0], key)
    np.testing.assert_array_equal(there[1], bodies)
    np.testing.assert_allclose(there[2] / scale, gap, atol=1e-8)
    np.testing.assert_allclose(there[3] / scale**2, area, atol=1e-8)
    np.testing.assert_allclose((there[4] - np.ones(3)) @ turn / scale, place, atol=1e-8)


def test_points_over_the_area_keep_their_names_as_equal_faces_tilt_either_way():
    """Of two equal stones each face is the deeper one in turn, by a part of a millimetre."""
    one = scene(brick("a", (0, 0, 0), (0.4, 0.2, 0.2)), brick("b", (0, 0, 0.2), (0.4, 0.2, 0.4)))
    model, state = build_model(one)
    find = Detector(model.surfaces, model.fixed, 0.05, placement=Placement.AREA, spacing=0.05)
    keys, faces = [], []
    for tilt in (0.0, 1e-4, -1e-4, 3e-4, -3e-4):
        turned = state.rotation.copy()
        turned[1] = Rotation.from_rotvec([0.0, tilt, 0.0]).as_matrix() @ turned[1]
        contacts = find(replace(state, rotation=turned), np.zeros(2))
        keys.append(np.sort(contacts.key))
        faces.append(set(contacts.bodies[:, 0].tolist()))
    for key, face in zip(keys, faces, strict=True):
        np.testing.assert_array_equal(key, keys[0])
        assert face == {1}


@pytest.mark.parametrize(("spacing", "count"), [(1.0, 4), (0.2, 12), (0.05, 160)])
def test_a_joint_has_a_point_in_each_cell_two_each_way_at_least_and_in_its_corners(spacing, count):
    one = scene(ground(), brick("a", (0, 0, 0), (0.8, 0.5, 0.6)))
    key, _, gap, area, place = facts(one, 4, Placement.AREA, spacing)
    assert len(key) == count + 4
    np.testing.assert_allclose(gap, 0.0, atol=1e-14)
    quarters, rests = (0.25 * 0.4 / count, 0.75 * 0.4 / count)
    expected = np.sort([quarters] * 4 + [rests] * 4 + [0.4 / count] * (count - 4))
    np.testing.assert_allclose(np.sort(area), expected, rtol=1e-12)
    at = place[:, 0, :2]
    corners = at[(np.abs(at / [0.8, 0.5] - 0.5) > 0.5 - 1e-12).all(axis=1)]
    assert {tuple(one.round(9)) for one in corners} == {(0, 0), (0.8, 0), (0, 0.5), (0.8, 0.5)}
    np.testing.assert_allclose(area @ at / 0.4, [0.4, 0.25], rtol=1e-12)
    if count == 4:  # cells in corners carry their second moments
        local = at - [0.4, 0.25]
        second = np.einsum("c,ci,cj->ij", area, local, local)
        np.testing.assert_allclose(second, 0.4 / 12 * np.diag([0.64, 0.25]), atol=1e-14)


@pytest.mark.parametrize(("points", "placement", "count"), [
    (1, Placement.CORNERS, 1), (3, Placement.CORNERS, 4), (4, Placement.CORNERS, 4), (8, Placement.CORNERS, 4),
    (1, Placement.INERTIA, 1), (3, Placement.INERTIA, 3), (4, Placement.INERTIA, 4), (8, Placement.INERTIA, 8),
])  # fmt: skip
def test_a_joint_has_as_many_points_as_asked_for_or_as_its_edge_needs(points, placement, count):
    one = scene(ground(), brick("a", (0, 0, 0), (0.8, 0.5, 0.6)))
    key, _, gap, area, place = facts(one, points, placement)
    assert len(key) == count
    np.testing.assert_allclose(gap, 0.0, atol=1e-14)
    assert area.sum() == pytest.approx(0.4, rel=1e-12)
    centroid = np.einsum("c,ci->i", area, place[:, 0, :2]) / 0.4
    np.testing.assert_allclose(centroid, [0.4, 0.25], atol=1e-13)
    if placement is Placement.INERTIA and count > 1:
        # ∫(x - x̄)(x - x̄)ᵀ of a rectangle
        local = place[:, 0, :2] - [0.4, 0.25]
        second = np.einsum("c,ci,cj->ij", area, local, local)
        np.testing.assert_allclose(second, 0.4 / 12 * np.diag([0.64, 0.25]), atol=1e-14)
