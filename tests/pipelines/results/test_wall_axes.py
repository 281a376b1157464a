"""Axes of a wall from the faces of its survey."""

import numpy as np
import pytest

from mechanics.scene.scene import Fidelity
from pipelines.results.wall_axes import axes_of, wall_axes, wall_record
from tests.pipelines.results_by_hand import rigid_body

CORNERS = np.array([[10.0, 0.0, 5.0], [13.0, 0.4, 8.0]])


def axes(*normals):
    return wall_axes(np.array(normals, dtype=float), np.ones(len(normals)), CORNERS)


def test_a_wall_has_its_right_hand_where_its_viewer_has():
    found = axes((0, -1, 0), (0.1, -1, 0.1), (-0.1, -1, 0.1))
    assert found.along == pytest.approx([1, 0, 0])
    assert found.outwards == pytest.approx([0, -1, 0])
    assert found.place(np.array([11.0, 0.0, 7.5])) == pytest.approx((1.0, 2.5))
    assert found.components(np.array([1.0, 2.0, 3.0])) == pytest.approx([1, -2, 3])


@pytest.mark.parametrize(
    ("vector", "name"),
    [
        ((0, -2, 0), "outwards"),
        ((0.05, 3, 0), "inwards"),
        ((1, 0, 0), "to the right along the wall"),
        ((-1, 0, 0), "to the left along the wall"),
        ((0, 0, -1), "down"),
        ((1, -2, 0), "outwards, turned by 27° to the right along the wall"),
        ((0, 1, 0.5), "inwards, turned by 27° upwards"),
        ((0, 0, 0), "none"),
    ],
)
def test_directions_have_the_names_of_the_axes_nearest_to_them(vector, name):
    assert axes((0, -1, 0)).direction(np.array(vector, dtype=float)) == name


@pytest.mark.parametrize(
    "normals", [[(0, -1, 0), (1, 0, 0)], [(0, 0, 1)], [(0, -1, 0), (0, 1, 0)], [(0, -0.45, 0.89)]]
)
def test_corners_floors_and_rings_have_none(normals):
    assert axes(*normals) is None


def test_the_largest_displacement_is_told_in_them():
    bodies = [
        rigid_body("base", (10, 0, 5), (11, 0.4, 6), Fidelity.FIXED),
        rigid_body("top", (10, 0, 6), (11, 0.4, 7), shift=(0.001, 0.003, -0.002)),
    ]
    record = wall_record(axes((0, -1, 0)), bodies)
    told = record["displacement"]
    assert [told[key] for key in ("along", "outwards", "up")] == pytest.approx([0.001, -0.003, -0.002])
    assert told["stone"] == "top"
    assert 1.0 <= told["above_foot"] <= 2.0
    assert axes_of(record).outwards == pytest.approx([0, -1, 0])
    assert wall_record(None, bodies) is None
