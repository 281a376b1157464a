"""Area and centroid of plane polygons in space."""

import numpy as np
import pytest

from ground.polygons import area_and_centroid

ANGLE = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)])


@pytest.mark.parametrize("turn", [0.0, 0.7])
@pytest.mark.parametrize("corner", range(6))
def test_an_angle_has_the_centroid_of_its_two_rectangles_from_whichever_corner(turn, corner):
    axes = np.array([[np.cos(turn), 0.0, np.sin(turn)], [0.0, 1.0, 0.0]])
    origin = np.array([100.0, -20.0, 3.0])
    area, centroid = area_and_centroid(origin + np.roll(ANGLE, corner, axis=0) @ axes)
    assert area == pytest.approx(6.0, rel=1e-9)
    # 4 m² about (2, 0.5) and 2 m² about (0.5, 2)
    np.testing.assert_allclose(centroid, origin + np.array([1.5, 1.0]) @ axes, rtol=1e-9)


def test_a_polygon_that_runs_against_its_normal_has_a_negative_area_and_the_same_centroid():
    corners = np.column_stack([ANGLE, np.zeros(6)])
    area, centroid = area_and_centroid(corners, np.array([0.0, 0.0, -1.0]))
    assert area == pytest.approx(-6.0)
    np.testing.assert_allclose(centroid, [1.5, 1.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("normal", [None, np.array([0.0, 0.0, 1.0])])
def test_corners_in_a_line_have_their_mean(normal):
    area, centroid = area_and_centroid(np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (5.0, 0.0, 0.0)]), normal)
    assert area == 0.0
    np.testing.assert_allclose(centroid, [2.0, 0.0, 0.0])
