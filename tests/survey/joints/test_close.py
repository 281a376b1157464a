"""Joint closing of small assemblies whose closed shape is known, at any place and in any order."""

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground.errors import GeometryError
from survey.extrusion.depth import Depth
from survey.extrusion.extrusion import SurveyedBlock, extrude
from survey.faces.faces import outline_face
from survey.geometry.solids import Solid
from survey.geometry.watertight import check_watertight
from survey.joints.close import ClosedStones, close_joints
from survey.joints.settings import JointMode, JointSettings
from survey.records.survey import BlockRecord
from survey.simplify.result import BlockShape
from survey.simplify.simplify import simplify
from synthetic.buildings.window import make_window
from tests.survey.plain_blocks import DEPTH, as_stone, box, cuboid, drawn, moved, stone
from tests.survey.unseen.statics import contact_area, contacts, near_pairs, overlap_depth, side_planes

# two stones with a 10 mm head joint, a long one above them across a 12 mm bed joint
THREE = [box("A", 0, 0.495, 0, 0.3), box("B", 0.505, 1, 0, 0.3), box("C", 0, 1, 0.312, 0.6)]
STEPPED = [
    *(box("A", 0, 0.495, 0, 0.3), box("B", 0.505, 1, 0, 0.3), box("D", 1.01, 1.5, 0, 0.25)),
    box("C", 0, 1.5, 0.312, 0.6),
]
# an L seen from the front, and two stones in its notch, 10 mm away from it
CORNERED = drawn("L", [(0, 0), (1, 0), (1, 0.3), (0.4, 0.3), (0.4, 0.6), (0, 0.6)])


def roofed(solid: Solid) -> Solid:
    """Put a roof of four sides on the arm of the L: where these meet, planes cannot be moved one by one."""
    top = next(face for face in solid.faces if (solid.vertices[list(face), 2] > 0.599).all())
    vertices = np.vstack([solid.vertices, [[0.2, 0.2, 0.7]]])
    sides = [(a, b, len(solid.vertices)) for a, b in zip(top, (*top[1:], top[0]), strict=True)]
    return Solid(solid.code, vertices, (*(face for face in solid.faces if face != top), *sides))


ROOFED = roofed(CORNERED)


def assert_sound(solids: Sequence[Solid]) -> None:
    """Check that all are closed and convex, and that none overlap."""
    for solid in solids:
        check_watertight(solid, convex=True)
    for i, j in near_pairs(solids):
        assert overlap_depth(solids[i], solids[j]) < 1e-9


def open_pairs(closed: ClosedStones) -> dict[frozenset[str], str]:
    return {frozenset(gap.stones): gap.reason for gap in closed.report.gaps}


def shared_area(closed: ClosedStones, one: str, two: str) -> float:
    solids = {solid.code: solid for solid in closed.solids}
    return contact_area(solids[one], solids[two])


def test_a_t_junction_closes_half_way_and_fits_exactly() -> None:
    closed = close_joints(THREE)
    a, b, c = (solid.vertices for solid in closed.solids)
    np.testing.assert_allclose(a[:4, [0, 2]], [[0, 0], [0.5, 0], [0.5, 0.306], [0, 0.306]], atol=1e-12)
    np.testing.assert_allclose(b[:4, [0, 2]], [[0.5, 0], [1, 0], [1, 0.306], [0.5, 0.306]], atol=1e-12)
    np.testing.assert_allclose(c[:4, [0, 2]], [[0, 0.306], [1, 0.306], [1, 0.6], [0, 0.6]], atol=1e-12)
    np.testing.assert_allclose([v[:, 1] for v in (a, b, c)], [[0.0] * 4 + [0.4] * 4] * 3, atol=1e-12)


def test_stones_too_far_apart_stay_as_they_are() -> None:
    apart = [THREE[0], box("D", 0.6, 1, 0, 0.3)]
    closed = close_joints(apart)
    assert closed.report.alone == ("A", "D")
    assert closed.report.joints == ()
    for solid, block in zip(closed.solids, apart, strict=True):
        np.testing.assert_allclose(solid.vertices, block.solid.vertices, atol=1e-12)
    near = close_joints(apart, JointSettings(max_width=0.12, max_displacement=0.1))
    assert near.report.alone == ()
    assert close_joints([]).solids == ()


def test_a_joint_that_would_move_a_corner_too_far_stays_open_and_the_others_close() -> None:
    # closing all, A's upper corner at the head joint goes 5 mm across and 6 mm up: √(5² + 6²) = 7.8 mm
    closed = close_joints(THREE, JointSettings(max_displacement=0.007))
    assert open_pairs(closed).keys() == {frozenset("AC"), frozenset("BC")}
    for pair, reason in open_pairs(closed).items():
        (code,) = pair - {"C"}
        assert reason == f"it would move a corner of {code} by 8 mm, more than 7 mm"
    assert_sound(closed.solids)
    assert shared_area(closed, "A", "B") == pytest.approx(0.3 * 0.4)
    assert shared_area(closed, "A", "C") == 0.0
    assert closed.report.largest_displacement == pytest.approx(0.005)
    assert {frozenset(one.stones) for one in closed.report.joints if not one.left_open} == {frozenset("AB")}


def low_stone(count: int, low: int) -> list[SurveyedBlock]:
    """Return a course of stones 0.3 m high except one of 0.25 m, and a long stone across a joint of 12 mm above."""
    tops = [0.25 if k == low else 0.3 for k in range(count)]
    course = [box(f"A{k}", 0.5 * k + 0.005, 0.5 * k + 0.495, 0, top) for k, top in enumerate(tops)]
    return [*course, box("C", 0, 0.5 * count, 0.312, 0.6)]


@pytest.mark.parametrize(
    ("count", "low"), [(4, 2), (5, 2), (8, 4), (3, 2), (3, 0), (4, 0), (4, 3), (5, 0), (5, 4), (8, 0), (8, 7)]
)
def test_a_stone_that_lies_too_low_is_led_to_the_bed_of_the_others(count: int, low: int) -> None:
    closed = close_joints(low_stone(count, low), JointSettings(max_width=0.08))
    assert_sound(closed.solids)
    assert closed.report.gaps == ()
    # the bed of the others lies in the middle of their joint, at 0.306; what is odd still weighs a hundredth
    for solid in closed.solids[:-1]:
        np.testing.assert_allclose(solid.vertices[:, 2].max(), 0.306, atol=1e-3)
    np.testing.assert_allclose(closed.solids[-1].vertices[:, 2].min(), 0.306, atol=1e-3)
    assert closed.report.displacement[f"A{low}"].max() == pytest.approx(0.056, abs=5e-4)


def test_where_the_bound_forbids_that_the_step_stays_open_and_is_listed() -> None:
    closed = close_joints(STEPPED, JointSettings(max_width=0.08, max_displacement=0.04))
    (pair,) = open_pairs(closed)
    assert pair == frozenset("CD")
    reason = open_pairs(closed)[pair]
    assert re.fullmatch(r"it would move a corner of D by \d+ mm, more than 40 mm", reason)
    assert_sound(closed.solids)
    for one, two in ("AC", "BC", "AB", "BD"):
        assert shared_area(closed, one, two) > 0.09
    (gap,) = closed.report.gaps
    assert gap.width == pytest.approx(0.062)
    assert gap.area == pytest.approx(0.4 * 0.49)


@pytest.mark.parametrize("angle", [-80.0, -45.0, -30.0, -17.0, -5.0, 5.0, 17.0, 30.0, 45.0, 60.0, 80.0])
def test_walls_that_meet_at_any_angle_close_without_error(angle: float) -> None:
    # the other wall begins 10 mm beside B; its stones lie behind its face, away from B or in it
    ahead = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle)), 0.0])
    face = np.array([1.01, 0.0, 0.0]) + np.outer([0.0, 0.4, 0.4, 0.0], ahead)
    face[2:, 2] = 0.3
    record = BlockRecord("E", "header", 1, face, np.empty((0, 3)), 0.002)
    seen_from = face[0] + 9.0 * np.array([ahead[1], -ahead[0], 0.0])
    closed = close_joints([*THREE, extrude(outline_face(record, seen_from), DEPTH)])
    solids = {solid.code: solid for solid in closed.solids}
    for solid in closed.solids:
        check_watertight(solid, convex=True)
    lying = {
        (one, two) for one, two in combinations("ABCE", 2) if overlap_depth(solids[one], solids[two]) > 1e-9
    }
    assert {overlap.stones for overlap in closed.report.overlaps} == lying
    # turned into B, E's hidden side lies up to 0.4 sin(angle) deep in it: at 5° that can be cut off, at 45° not
    if angle < 11.0:
        assert not lying
    if angle >= 45.0:
        assert ("B", "E") in lying
    for one, two in ("AB", "AC", "BC"):
        assert shared_area(closed, one, two) > 0.1


def test_a_wedge_stays_a_wedge() -> None:
    wedge = stone("V", (0.45, 0.0), (0.55, 0.0), (0.65, 0.4), (0.35, 0.4))
    sides = [
        stone("L", (0.0, 0.0), (0.44, 0.0), (0.34, 0.4), (0.0, 0.4)),
        stone("R", (0.56, 0.0), (1.0, 0.0), (1.0, 0.4), (0.66, 0.4)),
    ]
    closed = close_joints([wedge, *sides])
    flat = closed.solids[0].vertices[:4][:, [0, 2]]
    np.testing.assert_allclose(flat, [[0.445, 0], [0.555, 0], [0.655, 0.4], [0.345, 0.4]], atol=1e-9)


def test_as_surveyed_no_bit_of_any_stone_changes() -> None:
    stones = [simplify(block) for block in (*THREE, box("X", 0.9, 1.3, -0.1, 0.2))]
    closed = close_joints(stones, JointSettings(mode=JointMode.AS_SURVEYED))
    for solid, one in zip(closed.solids, stones, strict=True):
        assert solid.faces == one.solid.faces
        assert solid.vertices.tobytes() == one.solid.vertices.tobytes()
    report = closed.report
    assert {frozenset(one.stones) for one in report.joints} >= {
        frozenset("AB"),
        frozenset("AC"),
        frozenset("BC"),
    }
    assert all(one.left_open == "joints are left as surveyed" and one.plane == -1 for one in report.joints)
    assert {gap.stones for gap in report.gaps} == {one.stones for one in report.joints}
    assert report.largest_displacement == 0.0
    assert set(report.volume_change.values()) == {0.0}
    (overlap,) = report.overlaps  # X lies in B: from 0.9 to 1.0, and from 0.0 to 0.2, through the wall
    assert overlap.stones == ("B", "X")
    assert overlap.volume == pytest.approx(0.1 * 0.2 * 0.4, rel=1e-9)
    assert overlap.depth == pytest.approx(0.1, abs=1e-12)
    np.testing.assert_allclose(overlap.centroid, [0.95, 0.2, 0.1], atol=1e-9)


def test_with_mortar_stones_close_as_without_and_widths_are_kept() -> None:
    dry, mortar = (close_joints(THREE, JointSettings(mode=mode)) for mode in (JointMode.CLOSE, "mortar"))
    for one, two in zip(dry.solids, mortar.solids, strict=True):
        assert one.vertices.tobytes() == two.vertices.tobytes()
    widths = {frozenset(joint.stones): joint.width for joint in mortar.report.joints}
    assert widths == pytest.approx({frozenset("AB"): 0.010, frozenset("AC"): 0.012, frozenset("BC"): 0.012})
    assert mortar.report.mode == "mortar"


def test_the_faces_of_a_notched_stone_are_moved_as_those_of_others() -> None:
    beside = [box("N", 0.41, 1.0, 0.312, 0.6), box("R", 1.01, 1.5, 0.0, 0.3)]
    closed = close_joints([beside[0], as_stone(CORNERED), beside[1]])
    notch, corner, right = closed.solids
    check_watertight(corner)
    true = drawn("L", [(0, 0), (1.005, 0), (1.005, 0.306), (0.405, 0.306), (0.405, 0.6), (0, 0.6)])
    apart = np.linalg.norm(corner.vertices[:, None] - true.vertices[None], axis=2)
    assert apart.min(axis=1).max() < 1e-12
    assert apart.min(axis=0).max() < 1e-12
    np.testing.assert_allclose(notch.vertices.min(axis=0), [0.405, 0.0, 0.306], atol=1e-12)
    assert right.vertices[:, 0].min() == pytest.approx(1.005, abs=1e-12)
    assert closed.report.gaps == closed.report.overlaps == ()
    areas = sorted(one.area for one in closed.report.joints if "N" in one.stones)
    assert areas == pytest.approx([0.294 * 0.4, 0.595 * 0.4])


def test_a_stone_whose_faces_cannot_move_keeps_its_shape_and_neighbours_are_led_to_it() -> None:
    corner = simplify(as_stone(ROOFED))
    assert corner.shape is BlockShape.POLYHEDRON
    beside = [box("N", 0.41, 1.0, 0.312, 0.6), box("R", 1.01, 1.5, 0.0, 0.3)]
    closed = close_joints([beside[0], corner, beside[1]])
    notch, kept, right = closed.solids
    assert kept.vertices.tobytes() == corner.solid.vertices.tobytes()
    assert kept.faces == corner.solid.faces
    np.testing.assert_allclose(notch.vertices.min(axis=0), [0.4, 0.0, 0.3], atol=1e-12)
    np.testing.assert_allclose(notch.vertices.max(axis=0), [1.0, 0.4, 0.6], atol=1e-12)
    assert right.vertices[:, 0].min() == pytest.approx(1.0, abs=1e-12)
    own = side_planes(ROOFED)
    for solid in (notch, right):  # each holds planes of the L's faces, turned about
        off = np.abs(side_planes(solid)[:, None] + own[None]).max(axis=2).min(axis=1)
        assert np.sort(off)[0] < 1e-12
    assert closed.report.gaps == ()
    areas = {tuple(sorted(one.stones)): [] for one in closed.report.joints}
    for one in closed.report.joints:
        areas[tuple(sorted(one.stones))].append(one.area)
    assert sorted(areas["L", "N"]) == pytest.approx([0.3 * 0.4, 0.6 * 0.4])
    assert areas["L", "R"] == pytest.approx([0.3 * 0.4])


def test_a_stone_that_keeps_its_shape_does_not_lead_a_bed_of_others() -> None:
    # N lies on the L and on M beside it, whose tops are 4 mm apart: the bed is that of N and M
    stones = [as_stone(ROOFED), box("M", 1.01, 1.5, 0.0, 0.296), box("N", 0.41, 1.5, 0.312, 0.6)]
    closed = close_joints(stones)
    assert closed.solids[0].vertices.tobytes() == simplify(stones[0]).solid.vertices.tobytes()
    beds = {frozenset(one.stones): one for one in closed.report.joints if abs(one.normal[2]) > 0.9}
    assert beds[frozenset("MN")].centroid[2] == pytest.approx(0.304, abs=1e-9)
    assert "keeps its shape" in beds[frozenset("LN")].left_open
    (gap,) = closed.report.gaps
    assert gap.stones == ("L", "N")
    assert gap.width == pytest.approx(0.012)
    assert gap.area == pytest.approx(0.59 * 0.4)
    for code in "MN":
        solid = closed.solids["LMN".index(code)]
        check_watertight(solid, convex=True)
    # the head joint of L and N, and that of L and M, are closed
    assert closed.solids[2].vertices[:, 0].min() == pytest.approx(0.4, abs=1e-12)
    assert closed.solids[1].vertices[:, 0].min() == pytest.approx(1.0, abs=1e-12)


def test_two_stones_that_keep_their_shape_stay_apart() -> None:
    first = as_stone(ROOFED)
    second = as_stone(moved(replace(ROOFED, code="M"), np.eye(3), np.array([1.01, 0.0, 0.0])))
    closed = close_joints([first, second])
    assert open_pairs(closed) == {frozenset("LM"): "both stones keep their shape"}
    touching = as_stone(moved(replace(ROOFED, code="M"), np.eye(3), np.array([1.0, 0.0, 0.0])))
    meeting = close_joints([first, touching])
    assert meeting.report.gaps == ()
    (joint,) = meeting.report.joints
    assert joint.area == pytest.approx(0.3 * 0.4)


def test_two_stones_with_one_code_are_refused() -> None:
    with pytest.raises(GeometryError, match="two stones have this code") as refused:
        close_joints([THREE[0], THREE[1], replace(THREE[2], code="A")])
    assert "stone A" in str(refused.value)


def test_four_stones_at_a_cross_share_one_bed_and_one_head_joint() -> None:
    apart = [
        cuboid(code, (x, 0.0, z), (x + 0.49, 0.4, z + 0.29))
        for code, (x, z) in zip("ABCD", [(0, 0), (0.5, 0), (0, 0.3), (0.5, 0.3)], strict=True)
    ]
    rng = np.random.default_rng(1)
    for solid in apart:
        solid.vertices[:, [0, 2]] += np.tile(rng.normal(0.0, 0.001, (4, 2)), (2, 1))
    closed = close_joints([as_stone(solid) for solid in apart])
    assert_sound(closed.solids)
    number = {frozenset(one.stones): one.plane for one in closed.report.joints}
    assert number[frozenset("AC")] == number[frozenset("BD")]
    assert number[frozenset("AB")] == number[frozenset("CD")]
    a, b, c, d = ({tuple(np.round(v, 12)) for v in solid.vertices} for solid in closed.solids)
    assert len(a & b & c & d) == 2  # the cross, front and back


def assert_closed(blocks: Sequence[SurveyedBlock], pairs: Sequence[tuple[int, int]]) -> None:
    solids = close_joints(blocks).solids
    for solid in solids:
        check_watertight(solid, convex=True)
    for i, j in pairs:
        assert overlap_depth(solids[i], solids[j]) < 1e-9
        assert len(contacts(solids[i], solids[j])) == 1


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.004, 0.015), st.floats(0.3, 0.7))
def test_any_noisy_t_junction_closes_without_overlap(seed: int, width: float, at: float) -> None:
    rng, half = np.random.default_rng(seed), width / 2
    blocks = []
    for code, (x0, x1, z0, z1) in {
        "A": (0, at - half, 0, 0.3),
        "B": (at + half, 1, 0, 0.3),
        "C": (0, 1, 0.3 + width, 0.6),
    }.items():
        corners = np.array([(x0, z0), (x1, z0), (x1, z1), (x0, z1)]) + rng.normal(0, 0.0017, (4, 2))
        blocks.append(stone(code, *map(tuple, corners), tilt=rng.normal(0, 0.003)))
    assert_closed(blocks, [(0, 1), (0, 2), (1, 2)])


def test_other_samples_close_as_well() -> None:
    # the committed sample is one draw; the method must not depend on it
    for seed in (1, 2, 3):
        sample = make_window(seed)
        blocks = [
            extrude(
                outline_face(one.record, sample.survey.head.viewpoint(None)),
                Depth(true.depth, None, "", "kind", 1),
            )
            for one, true in zip(sample.measured, sample.stones, strict=True)
        ]
        closed = close_joints(blocks)
        moved = [
            np.linalg.norm(np.sort(solid.vertices, axis=0) - np.sort(true.solid.vertices, axis=0), axis=1)
            for solid, true in zip(closed.solids, sample.stones, strict=True)
        ]
        assert np.median(np.max(moved, axis=1)) < 0.006
        assert closed.report.alone == ()


def test_a_head_joint_whose_corners_are_worn_on_both_hands_stays_upright() -> None:
    # two sound corners at the foot of the joint do not define its direction; the worn ones, which agree, do
    grid = [(x, 0.0, z) for x in (0.1, 0.25, 0.4) for z in (0.05, 0.15, 0.25)]
    left = np.array([(0, 0, 0), (0.495, 0, 0), (0.465, 0.02, 0.27), (0, 0, 0.3)])
    right = (left * np.array([-1, 1, 1]) + np.array([1, 0, 0]))[[1, 0, 3, 2]]
    blocks = []
    for code, corners, shift in (("A", left, 0.0), ("B", right, 0.5)):
        points = np.array(grid) + np.array([shift, 0, 0])
        record = BlockRecord(code, "header", 1, corners.astype(float), points, 0.002)
        block = extrude(outline_face(record, np.array([0.5, -9.0, 0.5])), DEPTH)
        assert len(block.face.rejected_vertices) == 1
        blocks.append(block)
    a, b = close_joints(blocks).solids
    np.testing.assert_allclose(a.vertices[[1, 2], 0], 0.5, atol=1e-3)
    np.testing.assert_allclose(sorted(b.vertices[:4, 0])[:2], 0.5, atol=1e-3)
