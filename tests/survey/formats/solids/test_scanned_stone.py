"""Plane faces of scanned stones: boxes come back, and what is no such stone keeps its facets, with the reason."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from survey.formats.solids.scanned_stone import is_scanned, plane_faces
from survey.geometry.solids import planes_of_solid, volume_of
from tests.survey.scanned_stones import scanned_box

SIZE = (0.5, 0.3, 0.24)


def polygons(triangles):
    return [tuple(one) for one in triangles.tolist()]


@pytest.mark.parametrize("seed", range(4))
def test_a_scanned_box_gets_its_six_faces_back_wherever_it_stands(seed):
    points, triangles = scanned_box(SIZE, seed=seed)
    turn = Rotation.random(random_state=seed).as_matrix()
    away = np.array([651234.5, 6861234.5, 41.0])
    placed = points @ turn.T + away
    assert is_scanned(placed, polygons(triangles))
    found = plane_faces("S", placed, polygons(triangles), 0.005)
    assert found.solid is not None
    assert len(found.solid.faces) == 6
    assert volume_of(found.solid) == pytest.approx(np.prod(SIZE), rel=0.005)
    # hundreds of points of 1 mm give a plane to 1 mm / √n: corners, where three meet, to less than the noise
    true = np.array(np.meshgrid(*((0.0, one) for one in SIZE))).reshape(3, -1).T @ turn.T + away
    nearest = np.linalg.norm(found.solid.vertices[:, None] - true, axis=2).min(axis=1)
    assert nearest.max() < 0.001
    assert "6 plane faces recognised among" in found.text
    assert "mm" in found.text
    assert "volume" in found.text


def test_an_oblique_side_is_a_face_of_its_own_direction():
    points, triangles = scanned_box(SIZE)
    points[:, 0] *= 1.0 + 0.3 * points[:, 2] / SIZE[2]  # a voussoir: the end leans by atan(0.15 / 0.24) = 32°
    found = plane_faces("V", points, polygons(triangles), 0.005)
    assert found.solid is not None
    assert len(found.solid.faces) == 6
    normals = planes_of_solid(found.solid)[:, :3]
    leaning = np.degrees(np.arctan2(0.3 * SIZE[0], SIZE[2]))
    assert np.degrees(np.arcsin(-normals[:, 2][np.argmax(normals[:, 0])])) == pytest.approx(leaning, abs=0.5)


def test_a_worn_corner_is_filled_and_its_depth_is_told():
    points, triangles = scanned_box(SIZE)
    corner = np.array(SIZE)
    reach = np.linalg.norm(points - corner, axis=1)
    points -= np.where(reach < 0.06, 0.5 * (0.06 - reach), 0.0)[:, None] / np.sqrt(3.0)
    found = plane_faces("W", points, polygons(triangles), 0.005)
    assert found.solid is not None
    assert np.abs(found.solid.vertices - corner).max(axis=1).min() < 0.002
    assert "points lie up to 1" in found.text  # 30 mm along the diagonal: 17 mm from the nearest plane


def test_a_boulder_and_a_stone_that_is_not_convex_keep_their_facets():
    points, triangles = scanned_box((0.3, 0.3, 0.3))
    middle = points - 0.15
    ball = 0.2 * middle / np.linalg.norm(middle, axis=1)[:, None]
    boulder = plane_faces("B", ball, polygons(triangles), 0.002)
    assert boulder.solid is None
    assert "keeps its" in boulder.text
    points, triangles = scanned_box(SIZE)
    points[:, 2] -= 0.05 * np.sin(np.pi * np.clip(points[:, 0] / SIZE[0], 0.0, 1.0)) * (points[:, 2] > 0.12)
    hollow = plane_faces("H", points, polygons(triangles), 0.005)
    assert hollow.solid is None
    assert "keeps its" in hollow.text


def test_modelled_stones_are_no_scans():
    exact, triangles = scanned_box(SIZE, noise=0.0)
    assert not is_scanned(exact, polygons(triangles))  # thousands of facets, but all in six planes
    few, triangles = scanned_box(SIZE, spacing=0.1)
    assert not is_scanned(few, polygons(triangles))
