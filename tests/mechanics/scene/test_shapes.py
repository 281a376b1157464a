"""Stones of simple shapes: they close, have the volume of the geometry, and stand where they should."""

import numpy as np
import pytest

from mechanics.scene import shapes
from mechanics.scene.scene import Fidelity
from mechanics.stones.materials import Material
from mechanics.stones.meshing.soundness import check_meshable
from mechanics.stones.polyhedra import mass_properties

CLAY = Material("clay", density=1800.0, young=1e9, poisson=0.2)
# area of a regular octagon in the unit circle
OCTAGON = 8 / 2 * np.sin(np.pi / 4)


def volume(stone):
    check_meshable(stone.vertices, stone.faces, stone.code)
    return mass_properties(stone.vertices, stone.faces).volume


@pytest.mark.parametrize(
    ("stone", "expected"),
    [
        (shapes.box("B", (1, 2, 3), (1.5, 2.4, 3.3)), 0.5 * 0.4 * 0.3),
        (shapes.prism("P", [(0, 0), (3, 0), (1, 2)], 0.5, at=4.0), 0.5 * 3 * 2 * 0.5),
        (shapes.wedge("W", 2.0, 0.5, 1.0), 0.5 * 2.0 * 0.5),
        # two triangles about the centre, the smaller cut off
        (shapes.voussoir("V", (2.0, 2.5), (0.3, 0.7), 0.4), 0.5 * (2.5**2 - 2.0**2) * np.sin(0.4) * 0.4),
        # a frustum: h/3 (A + B + √AB)
        (shapes.column(1, 2.0, 3.0, top=1.0)[1], OCTAGON * (1 + 0.25 + 0.5)),
    ],
    ids=lambda one: getattr(one, "code", ""),
)
def test_stones_have_the_volume_of_the_geometry(stone, expected):
    assert volume(stone) == pytest.approx(expected, rel=1e-12)


def test_an_arch_fills_its_ring_between_two_springers():
    right, left, *ring = shapes.semicircular_arch(9, 0.3, radius=2.0, depth=0.5, material=CLAY)
    assert {stone.fidelity for stone in (right, left)} == {Fidelity.FIXED}
    assert {stone.fidelity for stone in ring} == {Fidelity.RIGID}
    assert {stone.material for stone in (right, left, *ring)} == {CLAY}
    expected = 9 * 0.5 * (2.15**2 - 1.85**2) * np.sin(np.pi / 9) * 0.5
    assert sum(map(volume, ring)) == pytest.approx(expected, rel=1e-12)
    # the joints of springing are the tops of the springers
    for stone, foot in ((ring[0], right), (ring[-1], left)):
        assert stone.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-12)
        low = stone.vertices[stone.vertices[:, 2] < 1e-9]
        np.testing.assert_allclose(
            [low.min(axis=0)[:2], low.max(axis=0)[:2]],
            [foot.vertices.min(axis=0)[:2], foot.vertices.max(axis=0)[:2]],
            atol=1e-12,
        )


@pytest.mark.parametrize("slab", [True, False])
def test_a_wall_with_an_opening(slab):
    courses = [[1, 1, 1], [1, -1, 1], [0.5, 2, 0.5]]
    stones = shapes.wall(courses, 0.5, 0.2, 0.3, slab=slab, mesh_size=0.1)
    assert [stone.code for stone in stones if stone.code != "base"] == [
        "1-1",
        "1-2",
        "1-3",
        "2-1",
        "2-3",
        "3-1",
        "3-2",
        "3-3",
    ]
    fixed = {stone.code for stone in stones if stone.fidelity is Fidelity.FIXED}
    assert fixed == ({"base"} if slab else {"1-1", "1-2", "1-3"})
    laid = [stone for stone in stones if stone.code != "base"]
    assert sum(map(volume, laid)) == pytest.approx(8 * 0.5 * 0.2 * 0.3)
    assert {stone.mesh_size for stone in laid} == {0.1}


def test_a_column_tapers_from_its_foot_to_its_top():
    base, *drums = shapes.column(4, 0.8, 0.5, top=0.4, sides=6)
    assert base.fidelity is Fidelity.FIXED
    wide = [np.ptp(drum.vertices[k : k + 6, 0]) for drum in drums for k in (0, 6)]
    np.testing.assert_allclose(wide, [0.8, 0.7, 0.7, 0.6, 0.6, 0.5, 0.5, 0.4])
    assert drums[-1].vertices[:, 2].max() == 2.0
    assert base.vertices[:, 2].max() == 0.0


def test_a_stone_that_leans_in_is_filled_by_its_parts():
    outline = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    parts = [[(0, 0), (2, 0), (2, 1), (0, 1)], [(0, 1), (1, 1), (1, 2), (0, 2)]]
    stone = shapes.prism("L", outline, 0.5, CLAY, parts=parts, fidelity=Fidelity.FIXED)
    filled = sum(mass_properties(part.vertices, part.faces).volume for part in stone.parts)
    assert volume(stone) == pytest.approx(filled) == pytest.approx(1.5)
