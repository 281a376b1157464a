"""Rubble of one leaf: the partition among outlines, its thickness, and the solids that come of it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground.errors import GeometryError
from survey.clouds.masks import open_masks
from survey.clouds.settings import MaskOptions
from survey.geometry.solids import volume_of
from survey.joints.close import close_joints
from survey.joints.grown.chains import is_simple
from survey.joints.grown.grow import grow
from survey.joints.grown.leaf import find_leaves
from survey.joints.grown.medial_lines import medial_lines
from survey.joints.grown.partition import partition
from survey.joints.settings import JointMode, JointSettings
from survey.registration.stones import survey_stones

MORTAR = JointSettings(mode=JointMode.MORTAR)


def area(ring):
    x, y = (ring - ring[0]).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def box(x0, y0, x1, y1):
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], dtype=float)


def divided(outlines, width, height, step=0.003, straightness=0.02, shortest=0.01):
    lines = medial_lines(outlines, np.array([[0.0, 0.0], [width, height]]), step)
    return partition(lines, outlines, straightness, shortest), lines


def rings_of(found):
    return [found.corners[list(one)] for one in found.rings]


def as_stones(outlines, path, size, depth=0.2):
    """Stones as they come in from a file of outlines."""
    rows = ["code,x,y"]
    for k, ring in enumerate(outlines, start=1):
        rows += [f"S{k:02d},{x:.9f},{y:.9f}" for x, y in ring.tolist()]
    path.write_text("\n".join(rows), encoding="utf-8")
    return list(survey_stones(open_masks(path, MaskOptions(size=size, depth=depth))).stones)


def rubble(seed, columns, rows, gap, noise):
    """Jittered quadrilaterals of a grid, drawn in by a gap, their corners off by some noise."""
    chance = np.random.default_rng(seed)
    knots = np.stack(np.meshgrid(np.arange(columns + 1.0), np.arange(rows + 1.0), indexing="ij"), axis=-1) * [
        0.2,
        0.15,
    ]
    knots[1:-1, 1:-1] += chance.uniform(-0.05, 0.05, knots[1:-1, 1:-1].shape)
    outlines = []
    for i in range(columns):
        for j in range(rows):
            ring = np.array([knots[i, j], knots[i + 1, j], knots[i + 1, j + 1], knots[i, j + 1]])
            middle = ring.mean(axis=0)
            outlines.append(middle + (1.0 - gap) * (ring - middle) + chance.normal(0.0, noise, ring.shape))
    return outlines, 0.2 * columns, 0.15 * rows


def test_two_stones_meet_half_way():
    found, _ = divided([box(0.01, 0.02, 0.2, 0.28), box(0.23, 0.02, 0.39, 0.28)], 0.4, 0.3)
    left, right = rings_of(found)
    np.testing.assert_allclose(sorted(left[:, 0]), [0.0, 0.0, 0.215, 0.215], atol=1e-4)
    np.testing.assert_allclose(sorted(right[:, 1]), [0.0, 0.0, 0.3, 0.3], atol=0.0)
    (joint,) = [one for one in found.edges if min(one.left, one.right) >= 0]
    assert joint.thickness == pytest.approx(
        0.03, rel=0.05
    )  # the line's ends are nearer to corners than to sides


def test_thickness_of_a_joint_that_widens():
    slanted = np.array([[0.21, 0.0], [0.39, 0.0], [0.39, 0.3], [0.25, 0.3]])
    found, _ = divided([box(0.01, 0.0, 0.2, 0.3), slanted], 0.4, 0.3)
    joints = [one for one in found.edges if min(one.left, one.right) >= 0]
    lengths = [float(np.linalg.norm(np.subtract(*found.corners[list(one.ends)]))) for one in joints]
    mean = np.average([one.thickness for one in joints], weights=lengths)
    assert mean == pytest.approx(0.030, rel=0.03)  # of 10 to 50 mm
    assert joints[0].opening == pytest.approx(np.degrees(np.arctan(0.04 / 0.3)), rel=0.05)


def test_four_stones_at_a_cross_share_one_corner():
    cells = [(0.0, 0.0), (0.2, 0.0), (0.0, 0.2), (0.2, 0.2)]
    found, _ = divided([box(x + 0.01, y + 0.01, x + 0.19, y + 0.19) for x, y in cells], 0.4, 0.4)
    shared = set.intersection(*(set(ring) for ring in found.rings))
    assert len(shared) == 1
    np.testing.assert_allclose(found.corners[shared.pop()], [0.2, 0.2], atol=1e-3)
    assert [len(ring) for ring in found.rings] == [4, 4, 4, 4]


def test_a_stone_within_another_is_refused():
    with pytest.raises(GeometryError, match="outline 1 lies within another"):
        divided([box(0.0, 0.0, 0.4, 0.4), box(0.15, 0.15, 0.25, 0.25)], 0.4, 0.4)


@settings(max_examples=25, deadline=None)
@given(
    st.integers(0, 10**6),
    st.integers(1, 5),
    st.integers(1, 5),
    st.sampled_from([0.0, 0.02, 0.1, 0.3]),
    st.sampled_from([0.0, 0.004, 0.008]),
)
def test_any_rubble_fills_its_frame_with_simple_polygons(seed, columns, rows, gap, noise):
    outlines, width, height = rubble(seed, columns, rows, gap, noise)
    found, lines = divided(outlines, width, height)
    rings = rings_of(found)
    assert all(is_simple(ring) for ring in rings)
    assert sum(map(area, rings)) == pytest.approx(width * height, rel=1e-9)
    assert found.corners.min() == 0.0
    np.testing.assert_array_equal(found.corners.max(axis=0), [width, height])
    if gap > 0.05 and noise == 0.0:
        assert not lines.crossing
    used = [one for ring in found.rings for one in ring]
    assert len(used) == 2 * len(found.edges) - sum(min(one.left, one.right) < 0 for one in found.edges)


def test_finer_samples_change_little(tmp_path):
    outlines, width, height = rubble(3, 4, 5, 0.15, 0.002)
    (leaf,) = find_leaves(as_stones(outlines, tmp_path / "a.csv", (width, height)), MORTAR)
    codes = [f"S{k:02d}" for k in range(1, 21)]
    coarse, fine = grow(leaf, codes, MORTAR), grow(leaf, codes, MORTAR, fineness=2.0)
    for code in codes:
        assert area(fine.report.grown[code]) == pytest.approx(area(coarse.report.grown[code]), rel=0.005)
    assert fine.report.thickness.keys() == coarse.report.thickness.keys()
    for stones, thickness in coarse.report.thickness.items():
        assert fine.report.thickness[stones] == pytest.approx(thickness, rel=0.02)


def test_outlines_that_cross_are_parted_and_told():
    found, lines = divided([box(0.0, 0.0, 0.22, 0.2), box(0.2, 0.0, 0.4, 0.2)], 0.4, 0.2)
    assert lines.crossing == ((0, 1),)
    assert sum(map(area, rings_of(found))) == pytest.approx(0.08, rel=1e-9)
    np.testing.assert_allclose([area(one) for one in rings_of(found)], [0.042, 0.038], rtol=0.02)


def test_short_edges_become_corners():
    # the head joint above is 6 mm beside the one below
    stones = [(0.0, 0.0, 0.2, 0.1), (0.2, 0.0, 0.4, 0.1), (0.0, 0.1, 0.206, 0.2), (0.206, 0.1, 0.4, 0.2)]
    outlines = [box(x0 + 0.005, y0 + 0.005, x1 - 0.005, y1 - 0.005) for x0, y0, x1, y1 in stones]
    kept, _ = divided(outlines, 0.4, 0.2, step=0.001, shortest=0.001)
    few, _ = divided(outlines, 0.4, 0.2, step=0.001, shortest=0.01)
    assert (kept.collapsed, few.collapsed) == (0, 1)
    assert len(few.edges) == len(kept.edges) - 1


def test_grown_stones_are_prisms_that_fill_the_leaf(tmp_path):
    outlines, width, height = rubble(5, 4, 5, 0.15, 0.002)
    stones = as_stones(outlines, tmp_path / "a.csv", (width, height))
    closed = close_joints(stones, MORTAR)
    assert sum(map(volume_of, closed.solids)) == pytest.approx(0.2 * width * height, rel=1e-9)
    z = np.concatenate([one.vertices[:, 2] for one in closed.solids])
    assert (z.min(), z.max()) == (0.0, height)  # flat, to the last bit
    assert np.count_nonzero(z == 0.0) == 2 * 2 * 4  # two corners of each of four stones, in front and behind
    report = closed.report
    (leaf,) = report.leaves
    assert report.alone == report.gaps == report.overlaps == ()
    assert leaf.stones_over_all == pytest.approx(sum(map(area, outlines)) / (width * height), rel=0.01)
    assert {frozenset(one.stones) for one in report.joints} == {
        one for one in leaf.thickness if len(one) == 2
    }
    assert {len(one) for one in leaf.thickness} == {1, 2}
    for joint in report.joints:
        first, second = (next(s for s in closed.solids if s.code == code) for code in joint.stones)
        assert (first.vertices.mean(axis=0) - second.vertices.mean(axis=0)) @ joint.normal > 0.0


def test_only_outlines_grow_unless_asked(tmp_path):
    outlines, width, height = rubble(5, 2, 2, 0.15, 0.0)
    stones = as_stones(outlines, tmp_path / "a.csv", (width, height))
    assert find_leaves(stones, JointSettings()) == []
    assert find_leaves(stones, replace(MORTAR, grow=False)) == []
    measured = [_without_notes(one) for one in stones]
    assert find_leaves(measured, MORTAR) == []
    (asked,) = find_leaves(measured, replace(MORTAR, grow=True, margin=0.01))
    every = np.concatenate([one.face.outline[:, [0, 2]] for one in stones])
    np.testing.assert_allclose(asked.frame, [every.min(axis=0) - 0.01, every.max(axis=0) + 0.01], atol=1e-9)
    with pytest.raises(GeometryError, match="no two stones are prisms"):
        find_leaves(stones[:1], replace(MORTAR, grow=True))


def _without_notes(stone):
    return replace(stone, face=replace(stone.face, record=replace(stone.face.record, notes={})))


def test_a_base_beside_the_leaf_keeps_its_shape_and_its_joints_are_found(tmp_path):
    outlines, width, height = rubble(7, 2, 2, 0.15, 0.0)
    stones = as_stones(outlines, tmp_path / "a.csv", (width, height))
    base = as_stones([box(0.0, -0.2, 0.4, 0.0)], tmp_path / "b.csv", None)[0]
    base = _without_notes(replace(base, code="BASE", solid=replace(base.solid, code="BASE")))
    closed = close_joints([base, *stones], MORTAR)
    np.testing.assert_array_equal(closed.solids[0].vertices, base.solid.vertices)
    beside = {code for one in closed.report.joints if "BASE" in one.stones for code in one.stones} - {"BASE"}
    assert beside == {"S01", "S03"}
    joint = next(one for one in closed.report.joints if "BASE" in one.stones)
    (code,) = {*joint.stones} - {"BASE"}
    assert joint.width == pytest.approx(closed.report.leaves[0].thickness[frozenset({code})])
