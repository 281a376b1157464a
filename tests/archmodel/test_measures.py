import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from archmodel.measures import face_area, face_extent, solid_volume
from tests.archmodel.stones import BOX_FACES, box_stone

sizes = st.tuples(*[st.floats(0.05, 5.0)] * 3)
places = st.tuples(*[st.floats(-1e3, 1e3)] * 3)


@given(size=sizes, at=places)
def test_a_box_has_the_volume_centroid_and_area_of_a_box(
    size: tuple[float, float, float], at: tuple[float, float, float]
) -> None:
    stone = box_stone("B", size=size, at=at)
    volume, centroid = solid_volume(stone.solid_vertices, stone.solid_faces)
    length, depth, height = size
    # Coordinates of 1e3 m leave about 1e-13 m of a size; divided by the smallest size 0.05 m.
    assert volume == pytest.approx(length * depth * height, rel=2e-11)
    np.testing.assert_allclose(centroid, np.add(at, np.array(size) / 2), atol=1e-11)
    assert face_area(stone.outline) == pytest.approx(length * height, rel=2e-11)
    assert face_extent(stone.outline, stone.normal) == pytest.approx((length, height), rel=2e-11)


def test_faces_seen_from_inside_make_a_negative_volume() -> None:
    stone = box_stone("B", size=(1.0, 2.0, 3.0))
    inside_out = [face[::-1] for face in BOX_FACES]
    assert solid_volume(stone.solid_vertices, inside_out)[0] == pytest.approx(-6.0)


def test_a_tetrahedron_has_a_sixth_of_the_box_and_the_mean_of_its_corners() -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    volume, centroid = solid_volume(corners, [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    assert volume == pytest.approx(1 / 6)
    np.testing.assert_allclose(centroid, [0.25, 0.25, 0.25])


def test_the_height_of_a_leaning_face_is_measured_along_the_face() -> None:
    # A face 2 m × 1 m that leans back by 30°.
    up = np.array([0.0, np.sin(np.pi / 6), np.cos(np.pi / 6)])
    outline = np.array([[0.0, 0, 0], [2, 0, 0], np.add(up, [2, 0, 0]), up])
    normal = np.cross([1.0, 0, 0], up)
    assert face_extent(outline, normal) == pytest.approx((2.0, 1.0))


def test_a_level_face_has_its_longer_side_as_length() -> None:
    outline = np.array([[0.0, 0, 0], [0, 2, 0], [-1, 2, 0], [-1, 0, 0]])
    assert face_extent(outline, np.array([0.0, 0.0, 1.0])) == pytest.approx((2.0, 1.0))


def test_a_concave_outline_counts_only_what_is_inside() -> None:
    outline = np.array([[0.0, 0, 0], [2, 0, 0], [2, 0, 2], [1, 0, 2], [1, 0, 1], [0, 0, 1]])
    assert face_area(outline) == pytest.approx(3.0)
