"""Overlapping stones: detected as by qhull, and separated without loss beyond the overlap."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from survey.geometry._kernels.convexity import deepest_overlaps
from survey.geometry.solids import Solid, planes_of_solid, volume_of
from survey.geometry.watertight import check_watertight
from survey.joints.overlaps import find_overlaps, part_stones
from tests.survey.largest_ball import volume_within
from tests.survey.plain_blocks import cuboid, drawn, moved
from tests.survey.unseen.statics import overlap_depth, side_planes

BOUND = 0.08


def planes_of(solids):
    return {k: planes_of_solid(solid) for k, solid in enumerate(solids)}


def all_free(planes):
    return {k: np.ones(len(rows), np.bool_) for k, rows in planes.items()}


def shared_volume(one, two):
    """Return the volume by qhull, about the centre of the largest ball in both; 0 if it is below a micrometre."""
    return volume_within(np.vstack([side_planes(one), side_planes(two)]), 1e-6)


def heap(seed, count=6, spread=0.6):
    """Draw boxes and wedges, overlapping or not."""
    rng, out = np.random.default_rng(seed), []
    for k in range(count):
        size = rng.uniform(0.2, 0.5, 3)
        flat = np.array([(0, 0), (1, 0), (1, 1), (0, 1)] if k % 3 else [(0, 0), (1, 0), (0, 1)])
        solid = drawn(f"H{k}", (flat - 0.5) * size[:2], -size[2] / 2, size[2] / 2)
        turn = Rotation.random(random_state=rng.integers(2**31)).as_matrix()
        out.append(moved(solid, turn, rng.uniform(-spread, spread, 3)))
    return out


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_overlaps_are_those_that_qhull_finds(seed):
    solids = heap(seed)
    found = {one.pair: one for one in find_overlaps(solids, planes_of(solids))}
    for i in range(len(solids)):
        for j in range(i + 1, len(solids)):
            volume = shared_volume(solids[i], solids[j])
            if volume < 1e-10:  # what may be rounding to one of the two
                assert (i, j) not in found or found[i, j].volume < 1e-8
                continue
            assert found[i, j].volume == pytest.approx(volume, rel=1e-7)
            check_watertight(found[i, j].part)
            # parting along one face's normal takes at least the largest ball's diameter
            assert found[i, j].depth >= 2.0 * overlap_depth(solids[i], solids[j]) - 1e-9


def test_only_the_solids_that_are_named_are_looked_at():
    solids = [cuboid(str(k), (0.3 * k, 0, 0), (0.3 * k + 0.5, 1, 1)) for k in range(3)]
    planes = planes_of(solids)
    assert [one.pair for one in find_overlaps(solids, planes)] == [(0, 1), (1, 2)]
    del planes[1]
    assert find_overlaps(solids, planes) == []
    assert find_overlaps(solids, {0: planes[0]}) == []


def test_two_boxes_share_what_their_intervals_share():
    solids = [cuboid("A", (0, 0, 0), (1, 1, 1)), cuboid("B", (0.9, 0.2, 0.7), (2, 2, 2))]
    (found,) = find_overlaps(solids, planes_of(solids))
    assert found.pair == (0, 1)
    assert found.volume == pytest.approx(0.1 * 0.8 * 0.3)
    assert found.depth == pytest.approx(0.1)
    np.testing.assert_allclose(found.part.vertices.min(axis=0), [0.9, 0.2, 0.7], atol=1e-12)
    np.testing.assert_allclose(found.part.vertices.max(axis=0), [1.0, 1.0, 1.0], atol=1e-12)


def test_solids_that_share_a_plane_do_not_overlap():
    turn = Rotation.from_rotvec([0.3, 1.1, -0.4]).as_matrix()
    touching = [cuboid("A", (0, 0, 0), (1, 1, 1)), cuboid("B", (1, 0.2, 0), (2, 1.2, 1))]
    solids = [moved(one, turn, np.array([50.0, -20.0, 7.0])) for one in touching]
    assert find_overlaps(solids, planes_of(solids)) == []


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-10, 0.01, 0.1]))
def test_the_kernel_agrees_with_its_slow_twin(seed, least):
    solids = heap(seed)
    planes = [side_planes(solid) for solid in solids]
    pairs = np.array([(i, j) for j in range(len(solids)) for i in range(j)])
    depth = deepest_overlaps(
        pairs,
        np.concatenate([solid.vertices for solid in solids]),
        np.cumsum([0, *(len(solid.vertices) for solid in solids)]),
        np.concatenate(planes),
        np.cumsum([0, *map(len, planes)]),
        least,
    )
    for (i, j), found in zip(pairs.tolist(), depth.tolist(), strict=True):
        heights = [
            (planes[a][:, :3] @ solids[b].vertices.T - planes[a][:, 3:]).min(axis=1).max()
            for a, b in ((i, j), (j, i))
        ]
        true = -max(heights)
        # a face that parts them ends the search: what is found then says only that
        assert found == pytest.approx(true, abs=1e-12) if true > least else found <= least


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_volume_and_planes_are_those_of_the_hull(seed):
    for solid in heap(seed, 3):
        assert volume_of(solid) == pytest.approx(ConvexHull(solid.vertices).volume, rel=1e-9)
        np.testing.assert_allclose(
            np.abs(planes_of_solid(solid)[:, :3] @ side_planes(solid)[:, :3].T).max(axis=1), 1.0
        )
        assert (solid.vertices @ planes_of_solid(solid)[:, :3].T - planes_of_solid(solid)[:, 3]).max() < 1e-12


@st.composite
def lapping(draw):
    """Return two stones, turned against each other, that overlap by the width of a joint."""
    depth = draw(st.floats(0.001, 0.03))
    at = draw(st.tuples(st.floats(-0.4, 0.4), st.floats(-0.3, 0.3)))
    turn = Rotation.from_rotvec(draw(st.tuples(*[st.floats(-0.6, 0.6)] * 3))).as_matrix()
    first = cuboid("A", (-0.5, -0.3, -0.3), (0.5, 0.3, 0.0))
    second = moved(cuboid("B", (-0.3, -0.3, 0.0), (0.3, 0.3, 0.4)), turn, np.zeros(3))
    low = second.vertices[:, 2].min()
    return [first, moved(second, np.eye(3), np.array([*at, -depth - low]))], depth


@settings(max_examples=40, deadline=None)
@given(lapping())
def test_stones_are_parted_within_the_bound_and_lose_little(case):
    solids, _ = case
    planes = planes_of(solids)
    before = find_overlaps(solids, planes)
    parted, left = part_stones(solids, solids, planes, all_free(planes), BOUND)
    assert left == []
    for solid in parted:
        check_watertight(solid, convex=True)
    assert overlap_depth(*parted) < 1e-9
    for old, new in zip(solids, parted, strict=True):
        # stones only get smaller; no corner is farther from the new stone's nearest than the bound
        assert (new.vertices @ side_planes(old)[:, :3].T - side_planes(old)[:, 3]).max() < 1e-9
        apart = np.linalg.norm(old.vertices[:, None] - new.vertices, axis=2).min(axis=1)
        assert apart.max() <= BOUND + 1e-12
    lost = sum(volume_of(old) - volume_of(new) for old, new in zip(solids, parted, strict=True))
    shared = sum(one.volume for one in before)
    # a whole face that goes back by 10 mm costs 10 mm of its area, at most 1 m by 0.6 m; dividing costs less than
    # three times what is shared
    assert lost <= 3.0 * shared + 0.01 * 0.6


@settings(max_examples=15, deadline=None)
@given(lapping())
def test_nothing_is_cut_where_the_bound_forbids_it_and_all_is_reported(case):
    solids, _ = case
    planes = planes_of(solids)
    before = find_overlaps(solids, planes)
    parted, left = part_stones(solids, solids, planes, all_free(planes), 0.0)
    assert [one.pair for one in left] == [one.pair for one in before]
    for old, new in zip(solids, parted, strict=True):
        np.testing.assert_array_equal(old.vertices, new.vertices)


def test_a_free_face_goes_back_rather_than_that_a_joint_moves():
    low, high = cuboid("A", (0, 0, 0), (1, 0.4, 0.3)), cuboid("B", (0.2, 0, 0.295), (0.8, 0.4, 0.6))
    planes = planes_of([low, high])
    free = all_free(planes)
    free[0][:] = False  # all of A's faces are joints
    parted, left = part_stones([low, high], [low, high], planes, free, BOUND)
    assert left == []
    np.testing.assert_array_equal(parted[0].vertices, low.vertices)
    assert parted[1].faces == high.faces
    assert parted[1].vertices[:, 2].min() == pytest.approx(0.3, abs=1e-9)


def test_at_the_foot_of_an_arch_the_intrados_turns_and_no_face_comes():
    # the voussoir's intrados reaches 6 mm into the impost that juts out below it; its other edge stays
    voussoir = drawn("V", [(-0.006, 0.3), (0.4, 0.3), (0.45, 0.6), (0.05, 0.6)])
    impost = drawn("I", [(-0.5, 0.0), (0.0, 0.0), (0.0, 0.35), (-0.5, 0.35)])
    solids = [voussoir, impost]
    planes = planes_of(solids)
    free = {k: np.zeros(6, np.bool_) for k in range(2)}
    intrados = int(np.argmin(planes[0][:, 0]))
    free[0][intrados] = True
    parted, left = part_stones(solids, solids, planes, free, BOUND)
    assert left == []
    assert overlap_depth(*parted) < 1e-9
    assert [one.faces for one in parted] == [one.faces for one in solids]
    np.testing.assert_array_equal(parted[1].vertices, impost.vertices)
    top = parted[0].vertices[parted[0].vertices[:, 2] > 0.5]
    assert top[:, 0].min() == pytest.approx(0.05, abs=1e-9)


def test_a_stone_in_many_others_is_parted_from_all():
    row = [cuboid(f"R{k}", (0.5 * k, 0, 0), (0.5 * k + 0.5, 0.4, 0.3)) for k in range(4)]
    solids = [*row, cuboid("T", (0.1, 0, 0.292), (1.9, 0.4, 0.6))]
    planes = planes_of(solids)
    assert len(find_overlaps(solids, planes)) == 4
    parted, left = part_stones(solids, solids, planes, all_free(planes), BOUND)
    assert left == []
    lost = sum(volume_of(old) - volume_of(new) for old, new in zip(solids, parted, strict=True))
    assert lost <= 0.008 * 0.4 * 2.0 + 1e-9  # one bed as deep as the overlap
    for solid in parted:
        check_watertight(solid, convex=True)


def test_stones_that_cannot_be_cut_are_left_out():
    solids = [cuboid("A", (0, 0, 0), (1, 1, 1)), cuboid("B", (0.99, 0, 0), (2, 1, 1))]
    planes = planes_of(solids)
    parted, left = part_stones(solids, solids, {0: planes[0]}, {0: np.ones(6, np.bool_)}, BOUND)
    assert left == []
    assert all(isinstance(one, Solid) for one in parted)
    np.testing.assert_array_equal(parted[0].vertices, solids[0].vertices)
