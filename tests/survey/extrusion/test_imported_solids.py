"""Imported solids: their visible side, and the depth of the stone behind it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground.errors import GeometryError
from survey.extrusion.imported_solids import block_of_solid
from survey.records.survey import SolidRecord

RING = [(0, 0), (1, 0), (1, 1), (0, 1)]
BOX = np.array([(x, y, z) for z in (0, 1) for x, y in RING], dtype=float)
SIDES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def solid(vertices, faces=SIDES):
    return SolidRecord("A", "voussoir", 3, np.array(vertices, dtype=float), faces, line=9)


def box(x, y, z):
    return solid(BOX * [x, y, z])


def prism(outline, depth):
    """Make the prism of a polygon (x, z), counter-clockwise seen from -y, at y = 0, to y = depth."""
    front = [(x, 0.0, z) for x, z in outline]
    n = len(front)
    sides = [(i, i + n, (i + 1) % n + n, (i + 1) % n) for i in range(n)]
    return solid(
        [*front, *((x, depth, z) for x, _, z in front)],
        (tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1)), *sides),
    )


def test_without_a_viewpoint_the_face_is_the_largest_upright_side():
    block = block_of_solid(box(0.6, 0.4, 0.3), None, "a.obj")
    assert abs(block.face.fit.normal[1]) == pytest.approx(1.0)
    assert block.depth.value == pytest.approx(0.4)
    # the bed of a slab is larger, but no wall shows it
    slab = block_of_solid(box(1.0, 0.5, 0.1), None, "a.obj")
    assert abs(slab.face.fit.normal[1]) == pytest.approx(1.0)
    assert (slab.face.measures.length, slab.face.measures.height) == pytest.approx((1.0, 0.1))


@pytest.mark.parametrize(
    ("viewpoint", "normal", "depth"),
    [
        ((0.3, -9.0, 0.1), (0, -1, 0), 0.4),
        ((0.3, 9.0, 0.1), (0, 1, 0), 0.4),
        ((-9.0, 0.2, 0.1), (-1, 0, 0), 0.6),
        ((9.0, 0.2, 0.1), (1, 0, 0), 0.6),
        ((0.3, 0.2, 9.0), (0, 0, 1), 0.3),
        ((0.3, 0.2, -9.0), (0, 0, -1), 0.3),
    ],
)
def test_the_face_is_the_side_that_is_seen_largest(viewpoint, normal, depth):
    block = block_of_solid(box(0.6, 0.4, 0.3), np.array(viewpoint), "a.obj")
    np.testing.assert_allclose(block.face.fit.normal, normal, atol=1e-12)
    assert block.depth.value == pytest.approx(depth)


def test_seen_askew_the_larger_projection_counts():
    # from 60° beside the normal of the front the end of a stone as deep as long shows more: sin 60° > cos 60°
    view = 100.0 * np.array([np.sin(np.radians(60.0)), -np.cos(np.radians(60.0)), 0.0])
    assert block_of_solid(box(0.5, 0.5, 0.3), view, "").face.fit.normal[0] == pytest.approx(1.0)
    assert block_of_solid(box(1.5, 0.5, 0.3), view, "").face.fit.normal[1] == pytest.approx(-1.0)


def test_what_is_not_known_of_a_solid_is_said_to_be_unknown():
    block = block_of_solid(box(0.6, 0.4, 0.3), None, "stones/a.obj")
    assert (block.code, block.kind, block.course) == ("A", "voussoir", 3)
    assert block.face.provenance.source == "solid"
    assert "stones/a.obj" in block.face.provenance.text
    assert (block.depth.origin, block.depth.sigma) == ("solid", None)
    assert "stones/a.obj" in block.depth.source
    assert str(block.face.shape.kind) == "untested"
    assert np.isnan(block.vertex_sigma).all()
    assert block.vertex_sigma.shape == block.solid.vertices.shape
    assert block.face.record.line == 9


def test_the_solid_stays_as_it_was_made():
    made = prism([(0, 0), (0.6, 0), (0.6, 0.3), (0.3, 0.2), (0, 0.3)], 0.5)
    block = block_of_solid(made, np.array([0.3, -5.0, 0.2]), "")
    np.testing.assert_array_equal(block.solid.vertices, made.vertices)
    assert block.solid.faces == made.faces


def test_a_dented_face_keeps_its_outline_and_the_depth_reaches_behind_it():
    # an L, 2 × 2 less a quarter: area 3
    made = prism([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], 0.7)
    block = block_of_solid(made, np.array([0.3, -50.0, 0.2]), "")
    assert block.face.measures.area == pytest.approx(3.0)
    assert block.depth.value == pytest.approx(0.7)
    np.testing.assert_allclose(block.face.fit.normal, [0, -1, 0], atol=1e-12)


def test_a_tenon_in_front_of_the_face_does_not_count_as_depth():
    # an L on plan: the larger front at y = 0, a nose reaches to y = -0.2, the back is at y = 0.5
    plan = [(0, 0), (1, 0), (1, -0.2), (1.3, -0.2), (1.3, 0.5), (0, 0.5)]
    n = len(plan)
    low, high = ([(x, y, z) for x, y in plan] for z in (0.0, 0.4))
    sides = [(i, (i + 1) % n, (i + 1) % n + n, i + n) for i in range(n)]
    made = solid([*low, *high], (tuple(range(n - 1, -1, -1)), tuple(range(n, 2 * n)), *sides))
    block = block_of_solid(made, np.array([0.5, -50.0, 0.2]), "")
    assert block.face.measures.area == pytest.approx(0.4)
    assert block.depth.value == pytest.approx(0.5)


@given(st.integers(0, 2**32 - 1))
@settings(deadline=None)
def test_a_solid_that_is_turned_and_moved_has_the_same_face(seed):
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    shift = rng.uniform(-1e6, 1e6, 3)
    made, view = box(0.6, 0.4, 0.3), np.array([0.9, -7.0, 1.1])
    moved = solid(made.vertices @ turn.T + shift)
    here, there = block_of_solid(made, view, ""), block_of_solid(moved, turn @ view + shift, "")
    np.testing.assert_allclose(there.face.fit.normal, turn @ here.face.fit.normal, atol=1e-8)
    assert there.depth.value == pytest.approx(here.depth.value, abs=1e-8)
    assert there.face.measures.area == pytest.approx(here.face.measures.area, abs=1e-8)


@pytest.mark.parametrize("degrees", [0.0, 17.0, 90.0, 123.0, 200.0, 301.0])
def test_without_a_viewpoint_stones_of_a_wall_show_the_same_side(degrees):
    # front and back are as large but for rounding; voussoirs taper by less than a hundredth
    a = np.radians(degrees)
    turn = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    rng = np.random.default_rng(3)
    normals = []
    for k in range(40):
        corners = BOX * [0.6, 0.4, 0.3] + [0.61 * k, 0.0, 0.0]
        if k % 2:
            corners[[2, 6], 0] -= rng.uniform(-0.002, 0.002)
        normals.append(block_of_solid(solid(corners @ turn.T), None, "").face.fit.normal)
    np.testing.assert_allclose(normals @ normals[0], 1.0, atol=1e-12)


def test_a_solid_that_is_seen_from_inside_or_has_no_depth_is_refused():
    corners = [(-1, 0.0, -1), (1, 0.0, -1), (1, 0.0, 1), (-1, 0.0, 1), (0, -0.5, 0)]
    sides = ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4))
    assert block_of_solid(solid(corners, sides), None, "").depth.value == pytest.approx(0.5)
    with pytest.raises(GeometryError, match=r"its sides enclose -0\.667 m³"):
        block_of_solid(solid(corners, tuple(face[::-1] for face in sides)), None, "")
    flat = solid(BOX * [1.0, 5e-7, 1.0])
    with pytest.raises(GeometryError, match=r"reaches 0\.0005 mm behind its largest side"):
        block_of_solid(flat, None, "")
