import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from moma.errors import GeometryError
from survey.blocky import BlockShape, BlockyStone, simplify
from survey.depth import Depth
from survey.extrusion import extrude
from survey.faces import outline_face
from survey.records import BlockRecord
from survey.watertight import check_watertight

DEPTH = Depth(0.4, None, "test", "kind", 1)
TRAPEZIUM = np.array([[0, 0], [0.2, 0], [0.35, 0.6], [-0.1, 0.55]])  # a voussoir


def blocky(flat: np.ndarray) -> BlockyStone:
    vertices = np.column_stack([flat, np.zeros(len(flat))])
    record = BlockRecord("A", "voussoir", None, vertices, np.empty((0, 3)), 0.002)
    return simplify(extrude(outline_face(record, np.array([0, 0, 9.0])), DEPTH))


def cut_corner(quad: np.ndarray, corner: int, back: float, on: float) -> np.ndarray:
    here = quad[corner]
    before, after = quad[corner - 1] - here, quad[(corner + 1) % 4] - here
    two = [here + back * before / np.linalg.norm(before), here + on * after / np.linalg.norm(after)]
    return np.vstack([quad[:corner], two, quad[corner + 1 :]])


def test_four_corners_stay_as_they_were_measured() -> None:
    stone = blocky(TRAPEZIUM)
    np.testing.assert_allclose(stone.corners[:, :2], TRAPEZIUM, atol=1e-12)
    assert stone.report.displacement.max() < 1e-12
    assert stone.report.volume_change == pytest.approx(0.0, abs=1e-12)
    assert stone.sound.tolist() == [True] * 4


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 3), st.floats(0.01, 0.06), st.floats(0.01, 0.06), st.integers(0, 4))
def test_a_bevelled_corner_is_restored_and_the_wedge_kept(
    corner: int, back: float, on: float, first: int
) -> None:
    stone = blocky(np.roll(cut_corner(TRAPEZIUM, corner, back, on), first, axis=0))
    distances = np.linalg.norm(stone.corners[:, None, :2] - TRAPEZIUM, axis=2)
    assert distances.min(axis=1).max() < 1e-9
    assert distances.min(axis=0).max() < 1e-9
    assert stone.report.volume_change > 0
    check_watertight(stone.solid, convex=True)


def test_two_bevels_and_a_corner_half_way_along_a_side_go() -> None:
    outline = cut_corner(cut_corner(TRAPEZIUM, 3, 0.05, 0.03), 1, 0.02, 0.04)
    outline = np.insert(
        outline, 1, [0.1, -0.0005], axis=0
    )  # half-way along the bottom, half a millimetre off
    assert len(outline) == 7
    stone = blocky(outline)
    assert np.linalg.norm(stone.corners[:, None, :2] - TRAPEZIUM, axis=2).min(axis=1).max() < 0.002
    assert stone.report.displacement.max() < 0.05


def test_a_triangle_becomes_a_wedge() -> None:
    stone = blocky(TRAPEZIUM[:3])
    assert stone.shape is BlockShape.WEDGE
    assert len(stone.solid.vertices) == 6
    check_watertight(stone.solid, convex=True)
    with pytest.raises(GeometryError, match="stone A: it is no hexahedron"):
        _ = stone.corners
