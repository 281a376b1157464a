"""Stones cut by planes: against half-spaces intersected by qhull, on wild and on nearly degenerate planes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from survey.geometry.cutting import common_part, cut_stones, moves
from survey.geometry.solids import Solid
from survey.geometry.watertight import check_watertight
from tests.survey.largest_ball import volume_within
from tests.survey.plain_blocks import cuboid, drawn
from tests.survey.unseen.statics import side_planes

BOX = cuboid("S", (0.0, 0.0, 0.0), (1.0, 0.5, 0.4))
PLANES = side_planes(BOX)
FACES = range(6)
SLIVER = 1e-5  # metres: radius of the largest ball in a body too thin to be sure of


def through(point, normal):
    """Return the plane n·x = d through a point."""
    unit = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    return np.array([*unit, unit @ np.asarray(point, dtype=float)])


def assert_is_what_planes_leave(cut, planes):
    """Check: closed, convex, every edge in two faces in opposite directions, corners on planes, the true volume."""
    solid = cut.solid
    check_watertight(solid, convex=True)
    edges = [edge for face in solid.faces for edge in zip(face, (*face[1:], face[0]), strict=True)]
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)
    assert {i for face in solid.faces for i in face} == set(range(len(solid.vertices)))
    assert len(solid.vertices) - len(edges) // 2 + len(solid.faces) == 2  # Euler
    assert len(cut.of_face) == len(solid.faces)
    for face, plane in zip(solid.faces, cut.of_face, strict=True):
        row = planes[plane]
        assert np.abs(solid.vertices[list(face)] @ row[:3] - row[3]).max() < 1e-9
        corners = solid.vertices[list(face)]
        vector = np.cross(corners - corners[0], np.roll(corners, -1, axis=0) - corners[0]).sum(axis=0)
        assert vector @ row[:3] > 0.0
    height = (solid.vertices @ planes[:, :3].T - planes[:, 3]).max(axis=0)
    assert height[list(cut.of_face)].max() < 1e-8
    assert height.max() < 1e-4  # over planes whose face would be a sliver, thinner than 1e-5 m


def assert_cut(planes):
    cut = cut_stones([BOX], {0: planes})[0]
    volume = volume_within(planes, SLIVER)
    if cut is None:
        assert volume < 1e-6
    elif volume > 1e-6:
        assert_is_what_planes_leave(cut, planes)
        # the hull of the corners is the solid, as of qhull, except for slivers of less than 1e-5 m
        own = ConvexHull(cut.solid.vertices).volume
        assert own == pytest.approx(volume_within(planes[list(cut.of_face)], SLIVER), rel=1e-9, abs=1e-12)
        height = (cut.solid.vertices @ planes[:, :3].T - planes[:, 3]).max()
        assert own == pytest.approx(volume, rel=1e-9 if height < 1e-9 else 1e-4)
    return cut


unit = st.floats(0.0, 1.0)
direction = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda n: np.linalg.norm(n) > 0.1)
wild = st.builds(
    lambda p, n: through(BOX.vertices.min(axis=0) + np.array(p) * [1.0, 0.5, 0.4], n),
    st.tuples(unit, unit, unit),
    direction,
)


@settings(max_examples=100, deadline=None)
@given(st.lists(wild, max_size=8))
def test_what_wild_planes_leave_of_a_box_is_what_qhull_finds(more):
    assert_cut(np.vstack([PLANES, *more]))


corner = st.sampled_from(range(8))
# from rounding distance of a corner or an edge to a millimetre
nudge = st.sampled_from([0.0, 1e-16, -1e-16, 1e-12, -1e-12, 1e-4, -1e-4, -1e-3])


@st.composite
def degenerate(draw):
    """Draw a plane through corners of the box: through one, along an edge, along a diagonal, or through three."""
    a, b, c = (BOX.vertices[draw(corner)] for _ in range(3))
    kind = draw(st.sampled_from(["corner", "edge", "three"]))
    normal = np.array(draw(direction))
    if kind == "edge":
        normal = normal - (normal @ (b - a)) * (b - a) / max(float((b - a) @ (b - a)), 1e-9)
    if kind == "three":
        normal = np.cross(b - a, c - a)
    if np.linalg.norm(normal) < 0.05:
        normal = np.array([1.0, 2.0, 3.0])
    plane = through(a, normal)
    if (BOX.vertices.mean(axis=0) @ plane[:3]) > plane[3] + 1e-6:  # the middle of the box stays
        plane = -plane
    plane[3] += draw(nudge)
    return plane


@settings(max_examples=100, deadline=None)
@given(st.lists(degenerate(), max_size=5))
def test_planes_through_corners_and_edges_leave_a_closed_solid(more):
    assert_cut(np.vstack([PLANES, *more]))


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(0, 5), min_size=1, max_size=4), st.lists(wild, max_size=3))
def test_a_plane_that_comes_twice_changes_nothing(again, more):
    planes = np.vstack([PLANES, *more])
    once, twice = assert_cut(planes), cut_stones([BOX], {0: np.vstack([planes, PLANES[again]])})[0]
    if volume_within(planes, SLIVER) > 1e-6:  # what is smaller may be rounding in one of two
        assert ConvexHull(twice.solid.vertices).volume == pytest.approx(
            ConvexHull(once.solid.vertices).volume, rel=1e-9
        )


@settings(max_examples=60, deadline=None)
@given(st.tuples(*[st.floats(-0.03, 0.03)] * 6), st.tuples(*[st.tuples(*[st.floats(-0.03, 0.03)] * 3)] * 6))
def test_where_planes_only_move_faces_and_numbers_of_corners_stay(offsets, tilts):
    rows = [
        through(BOX.vertices[list(face)].mean(axis=0) + offset * plane[:3], plane[:3] + np.array(tilt))
        for face, plane, offset, tilt in zip(BOX.faces, PLANES, offsets, tilts, strict=True)
    ]
    planes = np.array(rows)
    cut = assert_cut(planes)
    assert cut.solid.faces == BOX.faces
    assert cut.of_face == tuple(FACES)
    for number, vertex in enumerate(cut.solid.vertices):
        own = [f for f, face in enumerate(BOX.faces) if number in face]
        expected = np.linalg.solve(planes[own, :3], planes[own, 3])
        np.testing.assert_allclose(vertex, expected, atol=1e-12)


def test_many_stones_are_cut_as_one_by_one():
    rng = np.random.default_rng(0)
    solids, planes = [], {}
    for k in range(12):
        solid = BOX if k % 3 else drawn("P", [(0, 0), (1, 0), (1.2, 0.3), (0.5, 0.6), (0, 0.3)])
        own = side_planes(solid)
        own[:, 3] += rng.normal(0.0, 0.005, len(own))
        if k % 4 == 0:
            own = np.vstack([own, through(solid.vertices[0] + 0.02, [-1.0, -1.0, -1.0])])
        solids.append(solid)
        planes[k] = own
    del planes[5]
    together = cut_stones(solids, planes)
    assert together.keys() == planes.keys()
    for k, own in planes.items():
        (alone,) = cut_stones([solids[k]], {0: own}).values()
        assert together[k].solid.faces == alone.solid.faces
        np.testing.assert_allclose(together[k].solid.vertices, alone.solid.vertices, atol=1e-12)


def test_a_plane_that_cuts_a_corner_off_comes_with_a_face_of_its_own():
    planes = np.vstack([PLANES, through((1.0, 0.5, 0.3), (1.0, 1.0, 1.0))])
    cut = assert_cut(planes)
    assert len(cut.solid.faces) == 7
    assert len(cut.solid.vertices) == 10
    assert set(cut.of_face) == set(range(7))
    # a corner pyramid whose legs are 0.1 m
    assert ConvexHull(cut.solid.vertices).volume == pytest.approx(0.2 - 0.1**3 / 6.0, rel=1e-12)


def test_nothing_is_left_where_planes_exclude_each_other_or_do_not_close():
    nothing = PLANES.copy()
    nothing[0, 3] = -PLANES[1, 3] - 0.01  # the front behind the back
    assert cut_stones([BOX], {0: nothing})[0] is None
    flat = PLANES.copy()
    flat[0, 3] = -PLANES[1, 3]
    assert cut_stones([BOX], {0: flat})[0] is None
    assert cut_stones([BOX], {0: PLANES[:5]})[0] is None


def test_slivers_that_are_no_more_than_rounding_are_left_out():
    # a plane a micrometre within one face, and turned by nothing that is worth a face
    for tilt in (0.0, 2e-6):
        sliver = through((1.0 - 1e-6, 0.25, 0.2), (1.0, 0.0, tilt))
        cut = cut_stones([BOX], {0: np.vstack([PLANES, sliver])})[0]
        assert len(cut.solid.faces) == 6
        assert ConvexHull(cut.solid.vertices).volume == pytest.approx(0.2, rel=1e-5)
    # one that cuts a millimetre from an edge is a face
    bevel = through((0.999, 0.0, 0.4), (1.0, 0.0, 1.0))
    cut = assert_cut(np.vstack([PLANES, bevel]))
    assert len(cut.solid.faces) == 7


def test_stones_are_cut_as_well_far_from_the_origin():
    far = np.array([4.1e5, 7.02e6, 312.0])
    planes = np.vstack([PLANES, through((0.9, 0.5, 0.3), (1.0, 0.7, 1.0))])
    moved = planes.copy()
    moved[:, 3] += planes[:, :3] @ far
    near = cut_stones([BOX], {0: planes})[0]
    away = cut_stones([Solid("S", BOX.vertices + far, BOX.faces)], {0: moved})[0]
    assert away.solid.faces == near.solid.faces
    np.testing.assert_allclose(away.solid.vertices - far, near.solid.vertices, atol=1e-8)


@settings(max_examples=80, deadline=None)
@given(st.lists(wild, min_size=1, max_size=4), st.tuples(*[st.floats(-0.6, 0.6)] * 3))
def test_what_two_solids_have_in_common_is_what_qhull_finds(more, shift):
    second = PLANES.copy()
    second[:, 3] += PLANES[:, :3] @ np.array(shift)
    second = np.vstack([second, *more])
    found = common_part(PLANES, second, np.array([0.5, 0.25, 0.2]), 2.0)
    volume = volume_within(np.vstack([PLANES, second]), SLIVER)
    if volume > 1e-6:
        check_watertight(found)
        assert ConvexHull(found.vertices).volume == pytest.approx(volume, rel=1e-9, abs=1e-12)
    else:
        assert found is None or ConvexHull(found.vertices, qhull_options="QJ").volume < 1.1e-6


def test_moves_follow_corners_where_faces_stay_and_the_nearest_where_not():
    shifted = Solid("S", BOX.vertices + np.array([0.0, 0.0, 0.007]), BOX.faces)
    np.testing.assert_allclose(moves(BOX, shifted), 0.007)
    cut = cut_stones([BOX], {0: np.vstack([PLANES, through((1.0, 0.5, 0.3), (1.0, 1.0, 1.0))])})[0].solid
    far = np.argmax(BOX.vertices @ [1.0, 1.0, 1.0])
    expected = np.zeros(8)
    expected[far] = 0.1  # to the new corners along the edges
    np.testing.assert_allclose(moves(BOX, cut), expected, atol=1e-12)
