"""Faces that face each other across a joint, against a slow search over every pair of faces."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from survey.geometry.adjacency import SolidArrays
from survey.geometry.solids import area_vector
from survey.joints.facing import find_facing, planes_of
from survey.joints.settings import JointSettings
from tests.survey.geometry.touching_twin import _contact
from tests.survey.plain_blocks import bond, cuboid, drawn, moved

USUAL = JointSettings()


def gathered(solids):
    return SolidArrays.gather((solid.vertices, solid.faces) for solid in solids)


def facing(solids, limits=USUAL):
    all_of_them = gathered(solids)
    return find_facing(all_of_them, planes_of(all_of_them), limits)


def polygons(solids):
    """Return (solid, corners) of all faces."""
    return [(n, one.vertices[list(face)]) for n, one in enumerate(solids) for face in one.faces]


def slowly(solids, limits=USUAL):
    """Return {(face, face): (area, gap, normal, place)} of all facing pairs, with widths at the narrow end."""
    found, faces = {}, polygons(solids)
    for i, (one, first) in enumerate(faces):
        for j, (two, second) in enumerate(faces):
            contact = None if one >= two else _contact(first, second, 9.0, limits.max_angle, 9.0, 0.0)
            if contact is None:
                continue
            area, gap, normal, _ = contact
            down, up = (v / np.linalg.norm(v) for v in map(area_vector, (first, second)))
            slope = np.tan(np.arccos(np.clip(-(down @ up), -1.0, 1.0)))
            thinner = min(np.ptp(solids[k].vertices @ normal) for k in (one, two))
            smaller = min(np.linalg.norm(area_vector(polygon)) for polygon in (first, second))
            narrow = abs(gap) - 0.5 * np.sqrt(area) * slope
            wide_enough = area >= limits.min_overlap * np.sqrt(smaller)
            if narrow <= limits.max_width and abs(gap) <= 0.5 * thinner and wide_enough:
                found[i, j] = contact
    return found


def assert_as_found_slowly(solids, limits=USUAL):
    quick, slow = facing(solids, limits), slowly(solids, limits)
    assert [tuple(pair) for pair in quick.faces.tolist()] == sorted(slow)
    for k, pair in enumerate(sorted(slow)):
        area, gap, normal, place = slow[pair]
        assert quick.area[k] == pytest.approx(area, rel=1e-9)
        assert quick.gap[k] == pytest.approx(gap, abs=1e-9)
        np.testing.assert_allclose(quick.normal[k], normal, atol=1e-9)
        np.testing.assert_allclose(quick.centroid[k], place, atol=1e-9)
    return quick


def arch(count=7, inner=1.2, outer=1.6, joint=0.004):
    """Return voussoirs with open joints of the same angle."""
    out = []
    for k in range(count):
        a, b = np.pi * k / count + joint, np.pi * (k + 1) / count - joint
        ring = [(inner, b), (inner, a), (outer, a), (outer, b)]
        out.append(drawn(f"V{k}", [(r * np.cos(t), r * np.sin(t)) for r, t in ring]))
    return out


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**32 - 1), st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_noisy_walls_have_the_joints_that_are_found_slowly(seed, turned):
    turn = Rotation.from_rotvec(turned).as_matrix()
    solids = [moved(one, turn, np.zeros(3)) for one in bond(2, 3, 0.01, 0.002, seed)]
    found = assert_as_found_slowly(solids)
    owners = np.repeat(np.arange(len(solids)), 6)[found.faces]
    # per course one head joint fewer than stones; 3 stones below 4 with half stones at the ends: 6 beds
    assert len(found) == 2 + 3 + 6
    assert (owners[:, 0] < owners[:, 1]).all()


def test_voussoirs_have_the_joints_that_are_found_slowly():
    found = assert_as_found_slowly(arch())
    assert len(found) == 6


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_planes_of_faces_are_those_of_their_corners(seed):
    turn = Rotation.random(random_state=seed).as_matrix()
    solids = [moved(one, turn, np.array([1.0, 2.0, 3.0])) for one in bond(1, 2, 0.01, 0.01, seed)]
    planes = planes_of(gathered(solids))
    for k, (owner, corners) in enumerate(polygons(solids)):
        assert planes.owner[k] == owner
        # an independent area: of the hull in the plane of the two longest directions
        centre = corners.mean(axis=0)
        axes = np.linalg.svd(corners - centre)[2]
        assert planes.areas[k] == pytest.approx(ConvexHull((corners - centre) @ axes[:2].T).volume)
        assert abs(planes.normals[k] @ axes[2]) == pytest.approx(1.0)
        assert planes.normals[k] @ (centre - solids[owner].vertices.mean(axis=0)) > 0.0
        assert planes.offsets[k] == pytest.approx(planes.normals[k] @ centre)
        np.testing.assert_allclose(planes.boxes[k], [*corners.min(axis=0), *corners.max(axis=0)])
        assert planes.convex[k]


def test_a_face_with_a_notch_is_not_convex():
    notched = drawn("L", [(0, 0), (1, 0), (1, 0.3), (0.4, 0.3), (0.4, 0.6), (0, 0.6)])
    planes = planes_of(gathered([notched]))
    assert planes.convex.tolist() == [False, False, *[True] * 6]
    assert planes.areas[0] == pytest.approx(1.0 * 0.3 + 0.4 * 0.3)


def head(width):
    return [cuboid("A", (0, 0, 0), (0.5, 0.4, 0.4)), cuboid("B", (0.5 + width, 0, 0), (1.0, 0.4, 0.4))]


@pytest.mark.parametrize(("width", "count"), [(0.0499, 1), (0.0501, 0), (-0.0499, 1), (-0.0501, 0)])
def test_joints_are_at_most_so_wide_and_overlaps_so_deep(width, count):
    assert len(facing(head(width))) == count


@pytest.mark.parametrize(("strip", "count"), [(0.0099, 0), (0.0101, 1)])
def test_faces_share_more_than_a_strip(strip, count):
    # faces of 0.4 by 0.4 m that share a strip of 0.4 m
    beside = cuboid("B", (0.51, 0.0, 0.4 - strip), (1.0, 0.4, 0.8 - strip))
    assert len(facing([head(0.01)[0], beside])) == count


@pytest.mark.parametrize(("angle", "count"), [(19.9, 1), (20.1, 0)])
def test_faces_that_open_wider_do_not_face_each_other(angle, count):
    lean = 0.4 * np.tan(np.radians(angle))
    wedge = drawn("B", [(0.51, 0), (1.2, 0), (1.2, 0.4), (0.51 + lean, 0.4)])
    assert len(facing([head(0.01)[0], wedge])) == count


@pytest.mark.parametrize(("narrow", "count"), [(0.01, 1), (0.045, 1), (0.06, 0)])
def test_the_width_of_a_wedge_counts_at_its_narrow_end(narrow, count):
    # of an arch surveyed from below: 13.8° over 0.4 m, so that the mean width is 49 mm more than the narrow one
    lean = 0.4 * np.tan(np.radians(13.8))
    wedge = drawn("B", [(0.5 + narrow, 0), (1.2, 0), (1.2, 0.4), (0.5 + narrow + lean, 0.4)])
    assert len(facing([head(0.01)[0], wedge])) == count


def test_across_a_thin_stone_there_is_no_joint():
    # 30 mm between two tiles of 50 mm is more than half of either
    assert len(facing([cuboid("A", (0, 0, 0), (1, 1, 0.05)), cuboid("B", (0, 0, 0.08), (1, 1, 0.13))])) == 0
    assert len(facing([cuboid("A", (0, 0, 0), (1, 1, 0.07)), cuboid("B", (0, 0, 0.10), (1, 1, 0.17))])) == 1


def test_nothing_faces_nothing():
    assert len(facing([head(0.01)[0]])) == 0
    apart = [cuboid("A", (0, 0, 0), (1, 1, 1)), cuboid("B", (5, 5, 5), (6, 6, 6))]
    assert len(facing(apart)) == 0
