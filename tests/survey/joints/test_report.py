"""Report of closed joints, against measurements of the solids before and after."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from survey.joints.close import close_joints
from survey.joints.report import ClosingReport
from survey.joints.settings import JointMode, JointSettings
from tests.survey.plain_blocks import as_stone, bond, box, drawn
from tests.survey.unseen.statics import area_of, contacts

THREE = [box("A", 0, 0.495, 0, 0.3), box("B", 0.505, 1, 0, 0.3), box("C", 0, 1, 0.312, 0.6)]


def test_joints_are_pairs_with_width_area_place_and_plane():
    joints = {frozenset(one.stones): one for one in close_joints(THREE).report.joints}
    assert joints.keys() == {frozenset("AB"), frozenset("AC"), frozenset("BC")}
    ab, ac, bc = (joints[frozenset(pair)] for pair in ("AB", "AC", "BC"))
    assert [one.width for one in (ab, ac, bc)] == pytest.approx([0.010, 0.012, 0.012], abs=1e-12)
    assert [one.area for one in (ab, ac, bc)] == pytest.approx([0.306 * 0.4, 0.5 * 0.4, 0.5 * 0.4])
    assert [one.opening for one in (ab, ac, bc)] == pytest.approx([0.0] * 3, abs=1e-5)
    assert ac.plane == bc.plane != ab.plane
    np.testing.assert_allclose(ab.centroid, [0.5, 0.2, 0.153], atol=1e-12)
    np.testing.assert_allclose(ac.centroid, [0.25, 0.2, 0.306], atol=1e-12)
    np.testing.assert_allclose(bc.centroid, [0.75, 0.2, 0.306], atol=1e-12)
    assert ac.stones == ("A", "C")
    np.testing.assert_allclose(ac.normal, [0.0, 0.0, -1.0], atol=1e-12)  # from C down to A
    np.testing.assert_allclose(ab.normal, [-1.0, 0.0, 0.0], atol=1e-12)


def test_it_says_how_far_corners_moved_and_how_volumes_changed():
    report = close_joints(THREE).report
    np.testing.assert_allclose(report.displacement["C"], [0.006, 0.006, 0, 0] * 2, atol=1e-12)
    np.testing.assert_allclose(
        report.displacement["A"], [0, 0.005, np.hypot(0.005, 0.006), 0.006] * 2, atol=1e-12
    )
    assert report.largest_displacement == pytest.approx(np.hypot(0.005, 0.006))
    assert report.volume_change["C"] == pytest.approx(0.006 / 0.288)
    assert report.volume_change["A"] == pytest.approx(0.5 * 0.306 / (0.495 * 0.3) - 1.0)
    assert report.alone == report.gaps == report.overlaps == ()


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_areas_displacements_and_volumes_are_those_of_the_solids(seed):
    before = [as_stone(solid) for solid in bond(3, 3, 0.012, 0.002, seed)]
    closed = close_joints(before)
    solids = {solid.code: solid for solid in closed.solids}
    for joint in closed.report.joints:
        polygons = contacts(*(solids[code] for code in joint.stones))
        assert joint.area == pytest.approx(sum(area_of(one) for _, one in polygons), rel=1e-9)
        assert joint.normal == pytest.approx(polygons[0][0], abs=1e-9)
    for block, solid in zip(before, closed.solids, strict=True):
        assert solid.faces == closed.simplified[before.index(block)].solid.faces
        old = closed.simplified[before.index(block)].solid.vertices
        np.testing.assert_allclose(
            closed.report.displacement[block.code],
            np.linalg.norm(solid.vertices - old, axis=1),
            atol=1e-12,
        )
        change = ConvexHull(solid.vertices).volume / ConvexHull(old).volume - 1.0
        assert closed.report.volume_change[block.code] == pytest.approx(change, abs=1e-9)


def test_the_width_is_that_of_the_survey_and_negative_where_stones_overlap():
    lapped = [box("A", 0, 0.5, 0, 0.3), box("B", 0.49, 1, 0, 0.3)]
    (joint,) = close_joints(lapped).report.joints
    assert joint.width == pytest.approx(-0.010, abs=1e-12)
    assert joint.centroid[0] == pytest.approx(0.495)


def test_the_opening_is_the_angle_between_the_two_faces():
    # B's side leans by 5° away from A's
    lean = 0.3 * np.tan(np.radians(5.0))
    wedge = drawn("B", [(0.505, 0), (1.0, 0), (1.0, 0.3), (0.505 + lean, 0.3)])
    (joint,) = close_joints([box("A", 0, 0.495, 0, 0.3), as_stone(wedge)]).report.joints
    assert joint.opening == pytest.approx(5.0, abs=1e-6)
    # in the middle, along the normal half-way between the faces
    assert joint.width == pytest.approx(0.010 + 0.5 * lean, rel=0.01)


def test_a_gap_reports_the_area_over_which_stones_face_each_other():
    report = close_joints(THREE, JointSettings(mode=JointMode.AS_SURVEYED)).report
    areas = {frozenset(gap.stones): gap.area for gap in report.gaps}
    assert areas == pytest.approx(
        {frozenset("AB"): 0.3 * 0.4, frozenset("AC"): 0.495 * 0.4, frozenset("BC"): 0.495 * 0.4}
    )
    for gap in report.gaps:
        (joint,) = (one for one in report.joints if one.stones == gap.stones)
        assert (gap.width, gap.area) == (joint.width, joint.area)
        np.testing.assert_array_equal(gap.centroid, joint.centroid)


def test_contacts_that_share_their_plane_already_are_no_gaps_as_surveyed():
    touching = [box("A", 0, 0.5, 0, 0.3), box("B", 0.5, 1, 0, 0.3)]
    report = close_joints(touching, JointSettings(mode=JointMode.AS_SURVEYED)).report
    assert report.gaps == ()
    (joint,) = report.joints
    assert joint.width == pytest.approx(0.0, abs=1e-12)


def test_the_largest_displacement_of_nothing_is_none():
    assert ClosingReport(JointMode.CLOSE, (), {}, {}, (), (), ()).largest_displacement == 0.0
    assert close_joints([]).report.joints == ()
