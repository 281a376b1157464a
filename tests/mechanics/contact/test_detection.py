"""Contacts between stones whose interfaces are known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mechanics.contact import detection
from mechanics.contact.contacts import gaps, material_points
from mechanics.contact.detection import Detector
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.scene.scene import Fidelity
from mechanics.scene.threads import at_once
from tests.mechanics.shapes import TURN, brick, detected, ground, moved, scene

SOFT = Fidelity.DEFORMABLE


def wedge(axis, degrees):
    return Rotation.from_rotvec(np.radians(degrees) * np.array(axis, dtype=float)).as_matrix()


def assert_frames(contacts, state):
    """Right-handed, orthonormal; n points from the antagonist to the candidate."""
    product = np.einsum("cik,cjk->cij", contacts.frame, contacts.frame)
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(3), product.shape), atol=1e-13)
    np.testing.assert_allclose(np.linalg.det(contacts.frame), 1.0, rtol=1e-13)
    apart = state.centre[contacts.bodies[:, 0]] - state.centre[contacts.bodies[:, 1]]
    assert (np.einsum("ci,ci->c", contacts.frame[:, 0], apart) > 0).all()


def assert_weights(model, contacts):
    """Each elastic side is a mean of nodes of its own body, each rigid side has none."""
    elastic = model.elastic[contacts.bodies].ravel()
    np.testing.assert_allclose(contacts.weights.sum(axis=1), elastic.astype(float), atol=1e-12)
    # dual test functions weigh some nodes of antagonists a little less than not at all
    assert contacts.weights[0::2].data.min(initial=0.0) > -1e-12
    assert contacts.weights.data.min(initial=0.0) > -0.2
    for row, body in enumerate(contacts.bodies.ravel()):
        nodes = contacts.weights.indices[contacts.weights.indptr[row] : contacts.weights.indptr[row + 1]]
        owned = model.nodes_of(int(body))
        assert all(owned.start <= n < owned.stop for n in nodes)


@pytest.mark.parametrize("gap", [0.0, 0.01, -0.01])
@pytest.mark.parametrize("ground_first", [True, False])
def test_a_box_on_a_larger_one_touches_in_its_four_corners(gap, ground_first):
    stones = [ground(), brick("a", (0, 0, gap), (0.8, 0.5, 0.6 + gap))]
    model, state, contacts = detected(scene(*(stones if ground_first else stones[::-1])))
    assert len(contacts) == 4
    np.testing.assert_allclose(contacts.area, 0.1, rtol=1e-12)
    np.testing.assert_allclose(gaps(contacts, state), gap, atol=1e-14)
    np.testing.assert_allclose(np.abs(contacts.frame[:, 0, 2]), 1.0, atol=1e-14)
    assert_frames(contacts, state)
    assert_weights(model, contacts)
    points = material_points(contacts, state)
    assert {tuple(np.round(p[:2], 9)) for p in points[:, 0]} == {(0, 0), (0.8, 0), (0.8, 0.5), (0, 0.5)}
    assert len(set(contacts.key.tolist())) == 4


def test_boxes_that_overlap_in_part_touch_in_the_corners_of_the_overlap():
    first = brick("a", (0, 0, 0), (1, 1, 1), Fidelity.FIXED)
    _, state, contacts = detected(scene(first, brick("b", (0.6, 0.3, 1), (2, 2, 2))))
    assert contacts.area.sum() == pytest.approx(0.4 * 0.7, rel=1e-12)
    points = material_points(contacts, state)[:, 0]
    np.testing.assert_allclose(points.min(axis=0), [0.6, 0.3, 1], atol=1e-14)
    np.testing.assert_allclose(points.max(axis=0), [1, 1, 1], atol=1e-14)


@pytest.mark.parametrize("fidelity", [Fidelity.RIGID, SOFT])
def test_blocks_that_meet_at_an_edge_of_parallel_faces_do_not_touch(fidelity):
    step = brick("b", (1, 0, 1), (2, 1, 2), fidelity)
    _, _, contacts = detected(scene(brick("a", (0, 0, 0), (1, 1, 1), Fidelity.FIXED), step))
    assert len(contacts) == 0


@pytest.mark.parametrize("fidelity", [Fidelity.RIGID, SOFT])
@pytest.mark.parametrize(("shift", "count"), [(0.0499, 4), (0.0501, 0)])
def test_a_gap_is_watched_up_to_the_alert_distance(fidelity, shift, count):
    # 5 % of the smallest width, 1 m
    _, _, contacts = detected(scene(ground(), brick("a", (0, 0, shift), (1, 1, 1 + shift), fidelity)))
    assert (len(contacts) > 0) == (count > 0)


@pytest.mark.parametrize(("reach", "distance", "count"), [
    (0.0, 0.0, 0), (0.26, 0.0, 4), (0.24, 0.0, 0), (0.0, 0.31, 4), (0.0, 0.29, 0), (0.1, 0.21, 4),
])  # fmt: skip
def test_a_gap_is_watched_farther_where_stones_are_fast_or_laws_reach_across_it(reach, distance, count):
    """A gap of 0.3 m; 5 % of the smallest width, or the reach of a law, and how far the stone moves in the step."""
    model, state = build_model(scene(ground(), brick("a", (0, 0, 0.3), (1, 1, 1.3))))
    find = Detector(model.surfaces, model.fixed, 0.05, distance=distance)
    assert len(find(state, np.array([0.0, reach]))) == count


@pytest.mark.parametrize("speed", [1.0, 100.0])
def test_a_fast_stone_does_not_fly_through_a_thin_one(speed):
    """At 100 m/s it flies 1 m a step, ten times its width, at a plate of 0.2 m; inelastic, so it stops there."""
    plate = brick("plate", (-1, -1, -0.2), (1, 1, 0), Fidelity.FIXED)
    shot = brick("shot", (-0.05, -0.05, 1.234), (0.05, 0.05, 1.334), velocity=(0, 0, -speed, 0, 0, 0))
    one = scene(plate, shot, gravity=(0, 0, 0), step=0.01, theta=0.5)
    simulation = Simulation(*build_model(one))
    for _ in range(int(1.5 / (0.01 * speed)) + 3):
        step = simulation.step()
    np.testing.assert_allclose(step.after.centre[1], [0, 0, 0.05], atol=1e-6)
    np.testing.assert_allclose(step.after.velocity[1], 0.0, atol=1e-4 * speed)  # to the solver's tolerance


def test_pairs_of_fixed_stones_are_left_out():
    stones = ground(), brick("a", (0, 0, 0), (1, 1, 1), Fidelity.FIXED), brick("b", (0, 0, 1), (1, 1, 2))
    _, _, contacts = detected(scene(*stones))
    assert {tuple(sorted(pair)) for pair in contacts.bodies.tolist()} == {(1, 2)}


def roof(code, turn, height, fidelity=Fidelity.RIGID):
    """A bar of square section that stands on a long edge, `height` is that of its axis."""
    bar = brick(code, (-0.5, -2, -0.5), (0.5, 2, 0.5), fidelity)
    return moved(bar, turn @ wedge([0, 1, 0], 45), (0, 0, height))


@pytest.mark.parametrize("fidelity", [Fidelity.RIGID, SOFT])
@pytest.mark.parametrize("gap", [0.01, -0.01])
def test_crossed_bars_touch_in_one_point_of_their_edges(gap, fidelity):
    upper = roof("b", wedge([0, 0, 1], 90), np.sqrt(2) + gap, fidelity)
    model, state, contacts = detected(scene(roof("a", np.eye(3), 0.0, Fidelity.FIXED), upper))
    assert len(contacts) == 1
    assert contacts.area == pytest.approx([0.0])
    np.testing.assert_allclose(gaps(contacts, state), gap, atol=1e-12)
    np.testing.assert_allclose(material_points(contacts, state)[0, :, :2], 0, atol=1e-12)
    assert_frames(contacts, state)
    assert_weights(model, contacts)


@pytest.mark.parametrize("fidelity", [Fidelity.RIGID, SOFT])
@pytest.mark.parametrize("degrees", [6.0, 20.0])
def test_a_rocking_block_touches_in_the_two_corners_it_rocks_on(degrees, fidelity):
    block = brick("a", (0, 0, 0), (0.5, 0.5, 1), fidelity, mesh_size=0.3 if fidelity is SOFT else None)
    model, state, contacts = detected(scene(ground(), moved(block, wedge([0, -1, 0], degrees))))
    points = material_points(contacts, state)
    near = gaps(contacts, state) < 1e-9
    assert near.sum() == 2
    np.testing.assert_allclose(np.sort(points[near, 0, 1]), [0.0, 0.5], atol=1e-9)
    np.testing.assert_allclose(points[near, 0, 0], 0.0, atol=1e-9)
    np.testing.assert_allclose(gaps(contacts, state)[~near], 0.5 * np.sin(np.radians(degrees)), atol=1e-9)
    assert_weights(model, contacts)


def test_a_slightly_tilted_block_shows_its_true_gaps():
    block = moved(brick("a", (0, 0, 0), (0.5, 0.5, 1)), wedge([0, -1, 0], 0.5))
    _, state, contacts = detected(scene(ground(), block))
    expected = 0.5 * np.sin(np.radians(0.5))
    np.testing.assert_allclose(np.sort(gaps(contacts, state)), [0, 0, expected, expected], atol=1e-12)


@pytest.mark.parametrize("other", [Fidelity.FIXED, SOFT])
@pytest.mark.parametrize("degrees", [0.0, 25.0])
def test_a_deformable_stone_shares_out_the_whole_overlap(other, degrees):
    base = brick("a", (-1, -1, -1), (1, 1, 0), other, mesh_size=0.6 if other is SOFT else None)
    upper = moved(
        brick("b", (-0.4, -0.3, 0), (0.4, 0.3, 0.5), SOFT, mesh_size=0.25), wedge([0, 0, 1], degrees)
    )
    fixed = ground((-2, -2, -2), (2, 2, -1))
    model, state, contacts = detected(scene(fixed, base, upper))
    mine = (contacts.bodies == [2, 1]).all(axis=1)
    # one contact for each node of the finer face, its area ∫N
    face = model.surfaces.face_mesh[model.surfaces.shapes.fptr[2]]
    assert mine.sum() == len(face.node)
    assert contacts.area[mine].sum() == pytest.approx(0.8 * 0.6, rel=1e-9)
    np.testing.assert_allclose(gaps(contacts, state), 0.0, atol=1e-12)
    assert_frames(contacts, state)
    assert_weights(model, contacts)
    # an even pressure acts in the middle of the overlap, on both stones
    points = material_points(contacts, state)[mine]
    middle = np.einsum("c,csi->si", contacts.area[mine], points) / contacts.area[mine].sum()
    np.testing.assert_allclose(middle, 0.0, atol=1e-9)


def test_two_deformable_stones_that_overlap_in_part_share_out_the_overlap():
    lower = brick("a", (0, 0, 0), (1, 1, 1), SOFT, mesh_size=0.4)
    upper = brick("b", (0.33, 0.21, 1), (1.4, 1.3, 2), SOFT, mesh_size=0.3)
    model, state, contacts = detected(scene(lower, upper))
    # nodes with next to no share give it to a neighbour
    assert contacts.area.sum() == pytest.approx(0.67 * 0.79, rel=1e-9)
    assert_weights(model, contacts)
    points = material_points(contacts, state)
    np.testing.assert_allclose(points[:, 0], points[:, 1], atol=1e-9)


# --- what may not matter ---


def mixed():
    """A rocking block, a flat one, a deformable one and a bar across an edge."""
    return (
        ground(),
        moved(brick("rocking", (0, 0, 0), (0.4, 0.4, 0.9)), wedge([0, -1, 0], 7.0)),
        brick("flat", (1, 0, 0.003), (1.7, 0.6, 0.5)),
        brick("soft", (1.1, 0.1, 0.503), (1.6, 0.5, 0.9), SOFT, mesh_size=0.2),
        moved(roof("edge", np.eye(3), 0.7), np.eye(3), (-1.2, 0, 0), 0.5),
        moved(roof("across", wedge([0, 0, 1], 90), 0.7 + np.sqrt(2)), np.eye(3), (-1.2, 0, 0), 0.5),
    )


def summary(stones, scale=1.0):
    """Pairs, gaps and areas, sorted; deformable stones by pair alone, for their mesh may differ."""
    model, state, contacts = detected(scene(*stones))
    assert len(set(contacts.key.tolist())) == len(contacts)
    rigid = ~model.elastic[contacts.bodies].any(axis=1)
    rows = [
        (*pair, round(gap / scale, 8), round(area / scale**2, 8))
        for pair, gap, area in zip(
            contacts.bodies[rigid].tolist(),
            gaps(contacts, state)[rigid],
            contacts.area[rigid],
            strict=True,
        )
    ]
    soft = contacts.area[~rigid].sum() / scale**2
    return np.array(sorted(rows)) + 0.0, soft


@pytest.mark.parametrize(
    ("turn", "shift", "scale"),
    [
        (np.eye(3), (1e4, -1e4, 1e4), 1.0),
        (TURN, (0, 0, 0), 1.0),
        (wedge([1, 0, 0], 90), (0, 0, 0), 1.0),
        (np.eye(3), (0, 0, 0), 1e-2),
        (np.eye(3), (0, 0, 0), 1e3),
        (TURN, (1e4, 0, 0), 10.0),
    ],
    ids=["far", "turned", "lying", "small", "large", "all"],
)
def test_contacts_do_not_change_when_the_whole_scene_is_moved_turned_or_scaled(turn, shift, scale):
    reference, soft = summary(mixed())
    assert len(reference) > 8
    found, found_soft = summary([moved(s, turn, shift, scale) for s in mixed()], scale)
    np.testing.assert_allclose(found, reference, atol=2e-8)
    assert found_soft == pytest.approx(soft, rel=1e-3)


@pytest.mark.parametrize("points", [1, 4, 8])
@pytest.mark.parametrize("seed", range(4))
def test_contacts_do_not_change_when_the_stones_come_in_another_order(seed, points):
    """A wall of boxes, some of them shifted and turned a little; as places, areas and normals on the upper stone."""
    stones = bond()
    order = np.random.default_rng(seed).permutation(len(stones))
    reference = places(stones, points)
    assert len(reference) == 37 * min(points, 4)
    np.testing.assert_allclose(places([stones[k] for k in order], points), reference, atol=1e-9)


def bond():
    """Four courses in half-brick bond on the ground, with joints of different widths, and two bricks that stand out."""
    stones = [ground((-1, -1, -1), (5, 2, 0))]
    for z in range(4):
        for x in range(4):
            low = np.array([x + 0.5 * (z % 2), 0.05 * ((x + z) % 3), 0.5 * z])
            stones.append(brick(f"{z}.{x}", low, low + np.array([0.99, 0.5, 0.5])))
    return stones


def places(stones, points):
    """Codes of both stones, mean place, area and gap of every contact, in an order of their own."""
    model, state, contacts = detected(scene(*stones), points)
    codes = [block.code for block in model.scene.blocks]
    number = {code: n for n, code in enumerate(sorted(codes))}
    pair = np.sort([[number[codes[b]] for b in pair] for pair in contacts.bodies], axis=1)
    middle = material_points(contacts, state).mean(axis=1)
    rows = np.column_stack([pair, middle, contacts.area, gaps(contacts, state)])
    return rows[np.lexsort(np.round(rows[:, [4, 3, 2, 1, 0]], 6).T)]


@pytest.mark.parametrize("points", [1, 4, 8])
def test_contacts_do_not_change_in_a_mirror(points):
    def mirrored(block):
        faces = tuple(face[::-1] for face in block.faces)
        return replace(block, vertices=block.vertices * [-1, 1, 1], faces=faces)

    reference = places(bond(), points)
    found = places([mirrored(block) for block in bond()], points)
    found[:, 2] *= -1
    found = found[np.lexsort(np.round(found[:, [4, 3, 2, 1, 0]], 6).T)]
    np.testing.assert_allclose(found, reference, atol=1e-9)


def test_keys_stay_when_stones_move_a_little():
    before = detected(scene(*mixed()))[2]
    rng = np.random.default_rng(3)
    nudged = [
        moved(s, wedge(rng.normal(size=3), 0.01), 1e-4 * rng.normal(size=3))
        if s.fidelity is Fidelity.RIGID
        else s
        for s in mixed()
    ]
    after = detected(scene(*nudged))[2]
    assert len(before) >= 20
    assert np.isin(before.key, after.key).all()


@settings(max_examples=30, deadline=None)
@given(
    st.floats(-1.0, 1.0),
    st.floats(-1.0, 1.0),
    st.floats(-180.0, 180.0),
    st.floats(-0.02, 0.02),
    st.booleans(),
)
def test_wherever_a_box_lies_on_another_the_keys_are_unique_and_the_area_is_the_overlap(
    x, y, degrees, gap, swap
):
    lower = brick("a", (-0.5, -0.5, -1), (0.5, 0.5, 0), Fidelity.FIXED)
    upper = moved(brick("b", (-0.7, -0.35, 0), (0.7, 0.35, 0.6)), wedge([0, 0, 1], degrees), (x, y, gap))
    stones = (upper, lower) if swap else (lower, upper)
    _, state, contacts = detected(scene(*stones))
    assert len(set(contacts.key.tolist())) == len(contacts)
    if len(contacts) == 0:
        return
    assert_frames(contacts, state)
    if np.abs(contacts.frame[:, 0, 2]).min() > 1 - 1e-12:
        np.testing.assert_allclose(gaps(contacts, state), gap, atol=1e-12)
        other = detected(scene(*stones[::-1]))[2]
        assert contacts.area.sum() == pytest.approx(other.area.sum(), rel=1e-9)
    else:  # beside one another: some upright face parts them by more than the lying ones do
        assert gaps(contacts, state).max() > gap - 1e-3 * 0.6


@pytest.mark.parametrize("fidelity", [Fidelity.RIGID, SOFT])
def test_any_number_of_threads_finds_the_same_contacts_in_the_same_order(monkeypatch, fidelity):
    stones = [
        brick(f"{x} {z}", (x + 0.5 * (z % 2), 0, z), (x + 1 + 0.5 * (z % 2), 1, z + 1), fidelity)
        for x in range(3)
        for z in range(4)
    ]
    turned = [moved(stone, wedge((1, 2, 3), 0.1 * n)) for n, stone in enumerate(stones)]
    model, state = build_model(scene(ground(), *turned))
    reach = np.zeros(len(model.mass))
    parts = []
    monkeypatch.setattr(detection, "_THREAD_BATCH", 4)
    runs = [Detector(model.surfaces, model.fixed, 0.1, threads=count) for count in (1, 2, 5)]
    monkeypatch.setattr(detection, "at_once", lambda count: parts.append(count) or at_once(count))
    # the second time with the faces that kept pairs apart the first time
    whole, *others = [(find(state, reach), find(state, reach)) for find in runs]
    assert {2, 5} == set(parts)
    for other in others:
        for one, same in zip(whole, other, strict=True):
            assert len(one) > 50
            for name in ("bodies", "key", "frame", "area", "arm"):
                np.testing.assert_array_equal(getattr(one, name), getattr(same, name))
