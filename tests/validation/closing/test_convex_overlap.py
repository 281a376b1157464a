"""The volume that two solids share, which judges closed joints, against closed forms and halves of space."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull, HalfspaceIntersection

from survey.geometry.solids import Solid
from tests.validation.closing.convex_overlap import common_volume, overlaps
from tests.validation.scenes import CORNERS, FACES, rotation


def box(code, low, high, turn=None):
    corners = np.asarray(low) + CORNERS * (np.asarray(high) - low)
    return Solid(code, corners if turn is None else corners @ turn.T, FACES)


def test_boxes_share_the_product_of_their_overlaps():
    one, two = box("a", (0.0, 0, 0), (1.0, 1, 1)), box("b", (0.7, 0.2, -1.0), (2.0, 0.6, 0.5))
    assert common_volume(one, two) == pytest.approx(0.3 * 0.4 * 0.5, rel=1e-12)
    assert overlaps([one, two])["a", "b"] == pytest.approx(0.06, rel=1e-12)


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-8])
def test_a_sliver_is_measured(depth):
    one, two = box("a", (0.0, 0, 0), (1.0, 1, 1)), box("b", (1.0 - depth, 0, 0), (2.0, 1, 1))
    assert overlaps([one, two])["a", "b"] == pytest.approx(depth, rel=1e-6)


def test_stones_that_touch_share_nothing():
    one, two = box("a", (0.0, 0, 0), (1.0, 1, 1)), box("b", (1.0, 0.2, 0.3), (2.0, 1.5, 1))
    assert overlaps([one, two]) == {}
    assert abs(common_volume(one, two)) < 1e-15
    assert common_volume(one, box("c", (3.0, 0, 0), (4.0, 1, 1))) == 0.0


def test_turned_boxes_share_what_another_program_finds():
    rng = np.random.default_rng(2)
    for _ in range(25):
        turn = rotation(rng.normal(size=3), rng.uniform(5, 80))
        one, two = (
            box("a", (0.0, 0, 0), (1.0, 0.7, 0.5)),
            box("b", rng.uniform(-0.6, 0.4, 3), (0.9, 0.6, 0.6), turn),
        )
        planes = np.vstack([ConvexHull(one.vertices).equations, ConvexHull(two.vertices).equations])
        inside = [
            p for p in rng.uniform(-0.5, 1.5, (3000, 3)) if (planes[:, :3] @ p + planes[:, 3] < -1e-3).all()
        ]
        if inside:
            expected = ConvexHull(HalfspaceIntersection(planes, inside[0]).intersections).volume
            assert common_volume(one, two) == pytest.approx(expected, rel=1e-9)
