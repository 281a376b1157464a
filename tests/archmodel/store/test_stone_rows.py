import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from archmodel.store.stone_rows import solid_volume, solid_volumes
from tests.archmodel.stones import BOX_FACES, box_stone

sizes = st.tuples(*[st.floats(0.05, 5.0)] * 3)
places = st.tuples(*[st.floats(-1e3, 1e3)] * 3)


@given(size=sizes, at=places)
def test_a_box_has_the_volume_and_centroid_of_a_box(
    size: tuple[float, float, float], at: tuple[float, float, float]
) -> None:
    stone = box_stone("B", size=size, at=at)
    volume, centroid = solid_volume(stone.solid_vertices, stone.solid_faces)
    length, depth, height = size
    # Coordinates of 1e3 m leave about 1e-13 m of a size; divided by the smallest size 0.05 m.
    assert volume == pytest.approx(length * depth * height, rel=2e-11)
    np.testing.assert_allclose(centroid, np.add(at, np.array(size) / 2), atol=1e-11)


def test_faces_seen_from_inside_make_a_negative_volume() -> None:
    stone = box_stone("B", size=(1.0, 2.0, 3.0))
    inside_out = [face[::-1] for face in BOX_FACES]
    assert solid_volume(stone.solid_vertices, inside_out)[0] == pytest.approx(-6.0)


def test_a_tetrahedron_has_a_sixth_of_the_box_and_the_mean_of_its_corners() -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    volume, centroid = solid_volume(corners, [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    assert volume == pytest.approx(1 / 6)
    np.testing.assert_allclose(centroid, [0.25, 0.25, 0.25])


def test_many_solids_of_different_faces_are_as_each_alone() -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    wedge = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
    boxes = [box_stone(f"B{k}", size=(1.0 + k, 2.0, 3.0), at=(float(k), 7e6, 0.0)) for k in range(3)]
    solids = [(box.solid_vertices, BOX_FACES) for box in boxes]
    volumes, centroids = solid_volumes([solids[0], (corners, wedge), *solids[1:]])
    np.testing.assert_allclose(volumes, [6.0, 1 / 6, 12.0, 18.0], rtol=1e-8)
    np.testing.assert_allclose(centroids[1], [0.25, 0.25, 0.25])
    np.testing.assert_allclose(centroids[3], [2.0 + 1.5, 7e6 + 1.0, 1.5], rtol=1e-12)


def test_a_solid_without_thickness_has_no_volume() -> None:
    stone = box_stone("B", size=(1.0, 0.0, 3.0))
    volume, centroid = solid_volume(stone.solid_vertices, BOX_FACES)
    assert volume == 0.0
    assert np.isfinite(centroid).all()
