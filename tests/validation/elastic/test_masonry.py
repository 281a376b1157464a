"""Infill and mortar as bodies of their own: how leaves share a load, how far a pier with mortar beds gives way."""

import numpy as np
import pytest

from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Fidelity
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from tests.validation.elastic.elastic_blocks import (
    ELEMENTS,
    base_force,
    elastic_box,
    joint_force,
    mean_stress,
    resting,
)
from tests.validation.scenes import G, box, ground

HEIGHT, WIDTH = 0.6, 0.4
LEAF, CORE = 0.15, 0.3
# the load outweighs the wall by far
PLATE = Material("plate", density=2e6, young=1e10, poisson=0.2)
PLATE_HEIGHT = 0.1


def three_leaves(leaf, core, element=Element.HEX8, size=0.1):
    """Two leaves with infill between them, side by side along x, under one rigid plate."""
    x = np.cumsum([0.0, LEAF, CORE, LEAF]) - (LEAF + CORE / 2)
    materials = (leaf, core, leaf)
    walls = [
        elastic_box(name, [x[k], -WIDTH / 2, 0.0], [x[k + 1], WIDTH / 2, HEIGHT], materials[k], size, element)
        for k, name in enumerate(("outer", "infill", "inner"))
    ]
    top = [x[0], -WIDTH / 2, HEIGHT], [x[3], WIDTH / 2, HEIGHT + PLATE_HEIGHT]
    return [ground(half=1.0), *walls, box("plate", *top, PLATE)]


@pytest.mark.parametrize(
    "element", [Element.HEX8, *(pytest.param(e, marks=pytest.mark.slow) for e in ELEMENTS if e != "hex8")]
)
@pytest.mark.parametrize("ratio", [10.0, pytest.param(100.0, marks=pytest.mark.slow)])
def test_leaves_and_infill_share_a_load_by_their_stiffness(element, ratio):
    """N_i = P E_i A_i/ΣEA within 1 %, own weights aside: the plate sinks by δ, N_i = E_i A_i δ/H - W_i/2.

    ν = 0 and no friction: leaves and infill slide along each other; the load is 2,000 times as dense as the wall.
    """
    leaf = Material("stone", density=1000.0, young=1e10, poisson=0.0)
    core = Material("infill", density=1000.0, young=1e10 / ratio, poisson=0.0)
    blocks = three_leaves(leaf, core, element)
    result = resting("three leaves", blocks, DryJoint(0.0), step=1e-3, duration=0.5, tolerance=1e-9)
    assert result.outcome.rests
    load = PLATE.density * G * (2 * LEAF + CORE) * WIDTH * PLATE_HEIGHT
    areas = WIDTH * np.array([LEAF, CORE, LEAF])
    youngs = np.array([leaf.young, core.young, leaf.young])
    weights = 1000.0 * G * HEIGHT * areas
    share = (load + weights.sum() / 2) * youngs * areas / (youngs @ areas) - weights / 2
    for k, own in enumerate(weights):
        foot, head = joint_force(result, 1 + k, 0)[2], -joint_force(result, 1 + k, 4)[2]
        assert head == pytest.approx(share[k], rel=0.01)
        assert foot == pytest.approx(head + own, rel=1e-3)
        body = result.bodies[1 + k]
        assert mean_stress(body)[2] == pytest.approx(-(share[k] + own / 2) / areas[k], rel=0.01)
    assert base_force(result)[2] == pytest.approx(result.weight, rel=1e-3)


@pytest.mark.slow
def test_infill_that_widens_presses_on_its_leaves():
    """Infill with ν = 0.3 between rigid leaves, free along y, no friction: σ_x = ν σ_z, σ_y = 0, within 2 %.

    Plane strain in x, plane stress in y. Closed form.
    """
    core = Material("infill", density=1000.0, young=1e9, poisson=0.3)
    half = CORE / 2
    blocks = [
        ground(half=1.0),
        box("left", [-half - 0.2, -0.3, 0.0], [-half, 0.3, HEIGHT], fidelity=Fidelity.FIXED),
        box("right", [half, -0.3, 0.0], [half + 0.2, 0.3, HEIGHT], fidelity=Fidelity.FIXED),
        elastic_box("infill", [-half, -WIDTH / 2, 0.0], [half, WIDTH / 2, HEIGHT], core, 0.1),
        box("plate", [-half, -WIDTH / 2, HEIGHT], [half, WIDTH / 2, HEIGHT + PLATE_HEIGHT], PLATE),
    ]
    result = resting("confined", blocks, DryJoint(0.0), step=1e-3, duration=0.5)
    xx, yy, zz, *shears = mean_stress(result.bodies[3])
    assert xx == pytest.approx(core.poisson * zz, rel=0.02)
    assert max(abs(yy), *np.abs(shears)) < 0.02 * abs(zz)


def pier(stone, mortar, bed=0.01, stones=4, element=Element.HEX8, size=0.1):
    """Stones 0.2 m square and 0.1 m high with mortar beds between them, a rigid plate on top."""
    half, z, blocks = 0.1, 0.0, [ground(half=1.0)]
    for k in range(stones):
        blocks.append(
            elastic_box(f"stone {k}", [-half, -half, z], [half, half, z + 0.1], stone, size, element)
        )
        z += 0.1
        if k + 1 < stones:
            blocks.append(
                elastic_box(f"bed {k}", [-half, -half, z], [half, half, z + bed], mortar, size, element)
            )
            z += bed
    return [*blocks, box("plate", [-half, -half, z], [half, half, z + 0.1], PLATE)], z


@pytest.mark.parametrize("element", [Element.HEX8, pytest.param(Element.HEX20, marks=pytest.mark.slow)])
def test_a_pier_with_mortar_beds_has_the_modulus_of_the_series(element):
    """H/E = Σ h_i/E_i: the plate sinks by p Σ h_i/E_i within 1 %; ν = 0, stones of 10, beds of 1 GPa. Closed form."""
    stone = Material("stone", density=1000.0, young=1e10, poisson=0.0)
    mortar = Material("mortar", density=1000.0, young=1e9, poisson=0.0)
    blocks, _ = pier(stone, mortar, element=element)
    result = resting("pier", blocks, step=1e-3, duration=0.5)
    assert result.outcome.rests
    pressure = PLATE.density * G * 0.1
    sunk = -result.bodies[-1].displacement[:, 2]
    assert sunk == pytest.approx(pressure * (0.4 / stone.young + 0.03 / mortar.young), rel=0.01)
    for body in result.bodies[1:-1]:
        assert mean_stress(body)[2] == pytest.approx(-pressure, rel=0.01)


@pytest.mark.slow
def test_mortar_that_widens_more_than_stone_is_confined_by_it():
    """Soft beds with ν = 0.3 under stiff stones with friction: stiffer than free to widen, softer than an oedometer.

    Bounds of the bed's modulus: E and E (1-ν)/((1+ν)(1-2ν)); the bed is squeezed sideways, the stones are stretched.
    """
    stone = Material("stone", density=1000.0, young=2e10, poisson=0.2)
    mortar = Material("mortar", density=1000.0, young=5e8, poisson=0.3)
    blocks, _ = pier(stone, mortar, bed=0.02, size=0.025)
    result = resting("pier", blocks, step=1e-3, duration=0.5, balance=1e-3)
    pressure = PLATE.density * G * 0.1
    sunk = float(-result.bodies[-1].displacement[:, 2].mean())
    confined = mortar.young * 0.7 / (1.3 * 0.4)
    least, most = (pressure * (0.4 / stone.young + 0.06 / e) for e in (confined, mortar.young))
    assert 0.98 * least < sunk < most
    for body in result.bodies[1:-1]:
        sideways = mean_stress(body)[:2]
        assert (sideways < 0).all() if body.code.startswith("bed") else True
    middle = [body for body in result.bodies if body.code in ("stone 1", "stone 2")]
    assert all((mean_stress(body)[:2] > 0).all() for body in middle)


def test_rigid_and_elastic_stones_stand_in_one_wall():
    """Rigid and elastic stones alternate in a stack of six: each joint carries what lies above it, 1e-4. Statics."""
    stone = Material("stone", density=2000.0, young=5e9, poisson=0.2)
    half, blocks = 0.2, [ground(half=1.0)]
    for k in range(6):
        low, high = [-half, -half, 0.2 * k], [half, half, 0.2 * (k + 1)]
        blocks.append(elastic_box(f"{k}", low, high, stone, 0.1) if k % 2 else box(f"{k}", low, high, stone))
    result = resting("mixed", blocks, balance=1e-5, tolerance=1e-8)
    assert result.outcome.rests
    for k in range(6):
        above = stone.density * G * (2 * half) ** 2 * 0.2 * (6 - k)
        assert joint_force(result, k + 1, k) == pytest.approx([0, 0, above], rel=1e-4, abs=1e-4 * above)
    for body in result.bodies[1:]:
        assert (body.stress is None) == (int(body.code) % 2 == 0)
