"""The separating axis of two convex polyhedra, against known cases, a linear program and trying all axes."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from mechanics.contact._kernels import narrow_phase as kernel
from mechanics.contact.surfaces import surfaces
from mechanics.scene.shapes import BOX_FACES
from tests.mechanics.shapes import TURN, random_stone
from tests.pipelines.results_by_hand import box

# features that are as good are told apart by this part of the smaller stone's size, once among faces, once for edges
EASE = 2e-3
seeds = st.integers(0, 2**32 - 1)


def pack(first, second):
    """Polyhedra of two stones, each given by corners and faces."""
    (one, one_faces), (two, two_faces) = first, second
    count = len(one_faces) + len(two_faces)
    return surfaces([one, two], [one_faces, two_faces], [None] * count, [0, 1]).shapes


def separating(first, second, alert=0.1, hint=-1):
    """Kind, feature and axis of one pair, and the hint that is left behind."""
    packed, hints = pack(first, second), np.array([hint])
    kind, feature, axis = kernel.separating_axes(
        np.array([[0, 1]]), np.array([alert]), hints, kernel.SAME_PLANE, packed
    )
    return int(kind[0]), feature[0].tolist(), axis[0], int(hints[0])


def cube(shift=(0.0, 0.0, 0.0), turn=None):
    corners = box((0, 0, 0), (1, 1, 1))
    return (corners if turn is None else corners @ turn.T) + np.array(shift), BOX_FACES


# a bar along y that stands on one of its long edges
ROOF = (
    box((-0.5, -2, -0.5), (0.5, 2, 0.5)) @ np.array([[1, 0, -1], [0, np.sqrt(2), 0], [1, 0, 1]]) / np.sqrt(2)
)


# --- known cases ---


def test_box_on_box_is_parted_by_the_first_ones_face():
    kind, feature, axis, _ = separating(cube(), cube([0.2, 0.1, 1.01]))
    assert kind == kernel.FACE_FIRST
    assert feature == [1, 6]  # top face of the first, bottom face of the second
    np.testing.assert_allclose(axis, [0, 0, 1], atol=1e-15)


def test_corner_on_face_is_parted_by_the_face_whichever_body_has_it():
    tip = box((-0.5,) * 3, (0.5,) * 3) @ TURN.T
    tip = tip + np.array([0.5, 0.5, 1.02 - tip[:, 2].min()]), BOX_FACES
    kind, feature, axis, _ = separating(cube(), tip)
    assert (kind, feature[0]) == (kernel.FACE_FIRST, 1)
    np.testing.assert_allclose(axis, [0, 0, 1], atol=1e-12)
    kind, feature, axis, _ = separating(tip, cube())
    assert (kind, feature[0]) == (kernel.FACE_SECOND, 7)
    np.testing.assert_allclose(axis, [0, 0, -1], atol=1e-12)


@pytest.mark.parametrize(
    ("lift", "expected"), [(0.05, kernel.EDGES), (-0.05, kernel.EDGES), (0.2, kernel.SEPARATED)]
)
def test_crossed_edges_are_parted_by_their_common_normal(lift, expected):
    bar = ROOF @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])  # the same, along x
    top = ROOF[:, 2].max()
    kind, _, axis, _ = separating((ROOF, BOX_FACES), (bar + np.array([0, 0, 2 * top + lift]), BOX_FACES))
    assert kind == expected
    if kind:
        np.testing.assert_allclose(axis, [0, 0, 1], atol=1e-12)


def test_of_two_faces_that_part_stones_as_well_the_first_ones_is_kept_whatever_the_last_digits():
    rng = np.random.default_rng(0)
    for _ in range(50):
        lower, upper = cube(), cube((0, 0, 1))
        noisy = [
            (corners + 1e-9 * rng.normal(size=corners.shape), faces) for corners, faces in (lower, upper)
        ]
        kind, feature, _, _ = separating(*noisy)
        assert (kind, feature) == (kernel.FACE_FIRST, [1, 6])


# --- any two stones ---


def common_room(first, second):
    """The largest t for which some point lies deeper than t inside all faces of both, by linear programming."""
    packed = pack(first, second)
    offset = [n @ packed.vertex[packed.corner[c]] for n, c in zip(packed.normal, packed.cptr, strict=False)]
    rows = np.column_stack([packed.normal, np.ones(len(packed.normal))])
    return -linprog([0, 0, 0, -1], rows, offset, bounds=[(None, None)] * 4).fun


def separation(first, second, axis):
    return (second[0] @ axis).min() - (first[0] @ axis).max()


def best_axis(first, second):
    """Largest separation along all face normals and all cross products of edges."""
    packed = pack(first, second)
    edge = packed.vertex[packed.edge_b] - packed.vertex[packed.edge_a]
    one, two = edge[: packed.eptr[1]], edge[packed.eptr[1] :]
    crossed = np.array([np.cross(a, b) for a, b in itertools.product(one, two)])
    length = np.linalg.norm(crossed, axis=1)
    scale = np.linalg.norm(one, axis=1)[:, None] * np.linalg.norm(two, axis=1)
    keep = length > 1e-3 * scale.ravel()
    axes = np.vstack([packed.normal, crossed[keep] / length[keep, None]])
    return max(max(separation(first, second, n), separation(first, second, -n)) for n in axes)


def random_pair(seed, near=0.6):
    """Two stones, about as often apart as not."""
    rng = np.random.default_rng(seed)
    first, (corners, faces) = random_stone(rng), random_stone(rng)
    return first, (corners + near * rng.normal(size=3), faces), pack(first, (corners, faces)).size.min()


@settings(max_examples=100, deadline=None)
@given(seeds)
def test_stones_are_apart_exactly_where_they_share_no_room(seed):
    first, second, size = random_pair(seed)
    room = common_room(first, second)
    kind, _, _, _ = separating(first, second, alert=0.0)
    if abs(room) > EASE * size:
        assert (kind == kernel.SEPARATED) == (room < 0)


@settings(max_examples=100, deadline=None)
@given(seeds)
def test_where_stones_overlap_no_axis_shows_less_depth(seed):
    """And where they do not, the axis shows it (separating-axis theorem)."""
    first, second, size = random_pair(seed)
    kind, feature, axis, _ = separating(first, second, alert=1e3)
    found, best = separation(first, second, axis), best_axis(first, second)
    assert np.linalg.norm(axis) == pytest.approx(1.0, rel=1e-12)
    assert found <= best + 1e-9
    if best <= 0:
        assert found >= best - EASE * size
    else:
        assert found > -EASE * size
    packed = pack(first, second)
    if kind == kernel.EDGES:
        edge = packed.vertex[packed.edge_b[feature]] - packed.vertex[packed.edge_a[feature]]
        np.testing.assert_allclose(edge @ axis, 0.0, atol=1e-10)
        ends = packed.vertex[packed.edge_a[feature]] @ axis
        assert ends[1] - ends[0] == pytest.approx(found, abs=1e-9)
    else:
        sign = 1.0 if kind == kernel.FACE_FIRST else -1.0
        np.testing.assert_allclose(packed.normal[feature[0]], sign * axis, atol=1e-15)
        owner, other = (0, 1) if kind == kernel.FACE_FIRST else (1, 0)
        assert packed.fptr[owner] <= feature[0] < packed.fptr[owner + 1]
        # the face that looks most against it
        start, stop = packed.fptr[other], packed.fptr[other + 1]
        assert feature[1] == start + np.argmin(packed.normal[start:stop] @ packed.normal[feature[0]])


@settings(max_examples=40, deadline=None)
@given(seeds, st.sampled_from([0.0, 0.05, 0.5]))
def test_no_hint_changes_what_is_found(seed, alert):
    first, second, _ = random_pair(seed, near=1.0)
    kind, feature, axis, left = separating(first, second, alert)
    for hint in range(0, len(first[1]) + len(second[1]), 4):
        again = separating(first, second, alert, hint)
        assert again[:2] == (kind, feature)
        np.testing.assert_array_equal(again[2], axis)
    if left >= 0:
        # what is left behind is a face that keeps them apart
        packed = pack(first, second)
        mine = left < packed.fptr[1]
        n = packed.normal[left] if mine else -packed.normal[left]
        assert kind == kernel.SEPARATED
        assert separation(first, second, n) > alert


@settings(max_examples=60, deadline=None)
@given(seeds, st.sampled_from([1e-2, 1.0, 1e3]), st.sampled_from([0.0, 1e4]))
def test_the_feature_stays_when_both_stones_are_turned_moved_and_scaled(seed, scale, far):
    first, second, size = random_pair(seed)
    kind, feature, axis, _ = separating(first, second, 0.05 * size)
    rng = np.random.default_rng(seed + 1)
    turn, shift = Rotation.random(random_state=rng).as_matrix(), far * rng.normal(size=3)
    there = [(scale * corners @ turn.T + shift, faces) for corners, faces in (first, second)]
    again = separating(*there, 0.05 * size * scale)
    assert again[:2] == (kind, feature)
    # far away coordinates have fewer digits
    np.testing.assert_allclose(again[2], turn @ axis, atol=1e-10 + 1e-13 * far / scale)


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_the_order_of_two_stones_does_not_matter_but_for_ties(seed):
    first, second, size = random_pair(seed)
    one, other = (separating(*pair, 1e3) for pair in ((first, second), (second, first)))
    found = separation(first, second, one[2]), separation(second, first, other[2])
    assert found[0] == pytest.approx(found[1], abs=EASE * size)
