"""The plan of a scene whose numbers are known."""

import pytest

from mechanics.results.forecast.plan import plan
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene
from mechanics.scene.shapes import BOX_FACES
from mechanics.stones.materials import Material
from tests.pipelines.results_by_hand import box

STONE = Material("stone", 2000.0, 1e10, 0.2)


def block(code, low, high, fidelity):
    size = 0.5 if fidelity is Fidelity.DEFORMABLE else None
    return Block(code, box(low, high), BOX_FACES, STONE, fidelity, size)


def test_two_cubes_on_the_ground_and_one_in_the_air():
    scene = Scene(
        "three",
        (
            block("ground", (-1, -1, -1), (4, 2, 0), Fidelity.FIXED),
            block("left", (0, 0, 0), (1, 1, 1), Fidelity.RIGID),
            block("right", (2, 0, 0), (3, 1, 1), Fidelity.RIGID),
            block("top", (0, 0, 1.002), (1, 1, 2.002), Fidelity.RIGID),
            block("air", (0, 0, 5), (1, 1, 6), Fidelity.RIGID),
        ),
        contact=ContactSettings(alert_distance=0.05),
    )
    needs = plan(scene)
    assert needs.bodies == {Fidelity.FIXED: 1, Fidelity.RIGID: 4, Fidelity.DEFORMABLE: 0}
    assert set(needs.pairs) == {("ground", "left"), ("ground", "right"), ("left", "top")}
    assert needs.contacts == 3 * 4  # a corner each
    assert needs.open_pairs == (1, pytest.approx(0.002))
    assert needs.unknowns == 4 * 6
    assert needs.loose == ("air",)


def test_a_deformable_block_has_three_unknowns_for_each_node():
    ground = block("ground", (-1, -1, -1), (2, 2, 0), Fidelity.FIXED)
    needs = plan(Scene("one", (ground, block("soft", (0, 0, 0), (1, 1, 1), Fidelity.DEFORMABLE))))
    assert needs.unknowns % 3 == 0
    assert needs.unknowns >= 3 * 8
    assert (
        needs.memory
        > plan(Scene("one", (ground, block("hard", (0, 0, 0), (1, 1, 1), Fidelity.RIGID)))).memory
    )


@pytest.mark.parametrize("fidelity", [Fidelity.RIGID, Fidelity.DEFORMABLE])
def test_without_support_everything_is_loose(fidelity):
    assert plan(Scene("one", (block("a", (0, 0, 0), (1, 1, 1), fidelity),))).loose == ("a",)
