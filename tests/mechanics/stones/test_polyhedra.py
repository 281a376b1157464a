"""Mass properties against closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.spatial import ConvexHull

from ground.errors import GeometryError
from mechanics.scene.shapes import BOX_FACES
from mechanics.stones.polyhedra import (
    alike,
    face_plane,
    face_planes_alike,
    fan,
    mass_properties,
    mass_properties_alike,
    smallest_width,
    smallest_widths,
)
from tests.mechanics.shapes import TETRAHEDRON_FACES, TURN, hexahedra
from tests.pipelines.results_by_hand import box

SIDES = np.array([0.7, 0.4, 0.3])
CORNER = np.array([[0.0, 0, 0], [0.6, 0, 0], [0, 0.9, 0], [0, 0, 1.2]])


def box_inertia(a, b, c):
    """V/12 diag(b²+c², a²+c², a²+b²)."""
    return a * b * c / 12 * np.diag([b**2 + c**2, a**2 + c**2, a**2 + b**2])


def corner_inertia(a, b, c):
    """Corner tetrahedron: about its centroid ∫x² = 3 V a²/80, ∫xy = -V ab/80."""
    volume, sides = a * b * c / 6, np.array([a, b, c])
    second = volume / 80 * (4 * np.diag(sides**2) - np.outer(sides, sides))
    return np.trace(second) * np.eye(3) - second


@pytest.mark.parametrize("shift", [0.0, 1e3, 1e6])
@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["straight", "turned"])
def test_box_has_its_closed_form_mass_properties_wherever_it_stands(shift, turn):
    place = np.array([shift, -shift, 0.5 * shift])
    found = mass_properties(box(-SIDES / 2, SIDES / 2) @ turn.T + place, BOX_FACES)
    rounding = 1e-13 + 1e-15 * shift  # of the corners' coordinates themselves
    assert found.volume == pytest.approx(np.prod(SIDES), rel=20 * rounding)
    np.testing.assert_allclose(found.centroid, place, atol=10 * rounding)
    np.testing.assert_allclose(found.inertia, turn @ box_inertia(*SIDES) @ turn.T, atol=rounding)


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["straight", "turned"])
def test_corner_tetrahedron_has_its_closed_form_mass_properties(turn):
    found = mass_properties(CORNER @ turn.T + 3.0, TETRAHEDRON_FACES)
    assert found.volume == pytest.approx(0.6 * 0.9 * 1.2 / 6, rel=1e-13)
    np.testing.assert_allclose(found.centroid, turn @ [0.15, 0.225, 0.3] + 3.0, atol=1e-13)
    np.testing.assert_allclose(found.inertia, turn @ corner_inertia(0.6, 0.9, 1.2) @ turn.T, atol=1e-14)


@settings(max_examples=30, deadline=None)
@given(hexahedra())
def test_any_hexahedron_has_the_volume_of_its_hull_and_a_physical_inertia(corners):
    found = mass_properties(corners, BOX_FACES)
    assert found.volume == pytest.approx(ConvexHull(corners).volume, rel=1e-10)
    principal = np.linalg.eigvalsh(found.inertia)
    assert principal[0] > 0
    assert principal[0] + principal[1] > principal[2]  # the triangle inequality of real bodies


def test_open_faces_are_refused_with_the_stone_named():
    with pytest.raises(GeometryError, match="stone A1: the faces do not close"):
        mass_properties(box((0, 0, 0), (1, 1, 1)), BOX_FACES[:-1], "stone A1")


def test_one_face_inside_out_is_refused():
    with pytest.raises(GeometryError, match="do not close"):
        mass_properties(box((0, 0, 0), (1, 1, 1)), (BOX_FACES[0][::-1], *BOX_FACES[1:]))


def test_all_faces_inside_out_are_refused():
    with pytest.raises(GeometryError, match="counter-clockwise"):
        mass_properties(box((0, 0, 0), (1, 1, 1)), tuple(f[::-1] for f in BOX_FACES))


def test_a_face_given_twice_is_refused():
    with pytest.raises(GeometryError, match="do not close"):
        mass_properties(box((0, 0, 0), (1, 1, 1)), (*BOX_FACES, BOX_FACES[0]))


def test_a_flat_stone_is_refused():
    with pytest.raises(GeometryError):
        mass_properties(box((0, 0, 0), (1, 1, 0)), BOX_FACES)


def test_smallest_width_of_a_box_is_its_shortest_side():
    assert smallest_width(box((0, 0, 0), SIDES) @ TURN.T, BOX_FACES) == pytest.approx(0.3, rel=1e-12)
    assert smallest_width(box((0, 0, 0), SIDES) + 1e6, BOX_FACES) == pytest.approx(0.3, rel=1e-8)


def test_smallest_width_of_a_corner_tetrahedron_is_its_height_on_the_slanted_face():
    height = 1 / np.sqrt(sum(1 / np.array([0.6, 0.9, 1.2]) ** 2))
    assert smallest_width(CORNER, TETRAHEDRON_FACES) == pytest.approx(height, rel=1e-12)


def test_face_plane_looks_outwards_and_fan_cuts_each_face_into_n_minus_2():
    corners = box((0, 0, 0), (1, 2, 3))
    for face in BOX_FACES:
        normal, origin = face_plane(corners[list(face)])
        assert normal @ (origin - corners.mean(axis=0)) > 0.4
        assert np.linalg.norm(normal) == pytest.approx(1.0, rel=1e-14)
    assert fan(((0, 1, 2, 3, 4), (0, 2, 1))).tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 2, 1]]


def test_polyhedra_with_the_same_faces_are_computed_together_as_each_by_itself():
    rng = np.random.default_rng(7)
    boxes = [box((0, 0, 0), rng.uniform(0.1, 1.0, 3)) @ TURN.T + rng.uniform(-9, 9, 3) for _ in range(5)]
    corners = [*boxes[:2], CORNER, *boxes[2:], 2.0 * CORNER @ TURN.T]
    faces = [TETRAHEDRON_FACES if len(one) == 4 else BOX_FACES for one in corners]
    groups = alike(corners, faces)
    assert [rows.tolist() for _, rows in groups] == [[0, 1, 3, 4, 5], [2, 6]]
    for group, rows in groups:
        stack = np.stack([corners[row] for row in rows])
        volume, centroid, inertia = mass_properties_alike(stack, group, [None] * len(rows))
        normal, area = face_planes_alike(stack, group)
        width = smallest_widths(stack, normal)
        for n, row in enumerate(rows):
            one = mass_properties(corners[row], faces[row])
            assert (volume[n], width[n]) == (one.volume, smallest_width(corners[row], faces[row]))
            np.testing.assert_array_equal(centroid[n], one.centroid)
            np.testing.assert_array_equal(inertia[n], one.inertia)
            planes = [face_plane(corners[row][list(face)])[0] for face in group]
            np.testing.assert_allclose(normal[n], planes, atol=1e-15)
            # the areas of a closed surface, times their normals, cancel
            np.testing.assert_allclose(area[n] @ normal[n], 0.0, atol=1e-15 * area[n].sum())


def test_the_stone_that_is_inside_out_is_named_among_equal_ones():
    stones = np.stack([CORNER, CORNER[:, [1, 0, 2]], CORNER])
    with pytest.raises(GeometryError, match="b: the faces enclose -"):
        mass_properties_alike(stones, TETRAHEDRON_FACES, ["a", "b", "c"])
