"""Columns of elastic blocks under their weight: the stresses of one solid column, at rest and after sudden gravity."""

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from tests.validation.elastic.elastic_blocks import (
    base_force,
    elastic_box,
    inner,
    joint_force,
    mean_between,
    mean_stress,
    resting,
)
from tests.validation.scenes import G, ground

COUNT, SIDE, RISE = 10, 0.5, 0.3
HEIGHT = COUNT * RISE
MESH = {
    Element.TET4: 0.125,
    Element.TET10: 0.25,
    Element.HEX8: 0.1,
    Element.HEX20: 0.25,
    Element.HEX27: 0.25,
}
QUICK = [Element.HEX8, Element.TET10]
SLOW = [pytest.param(one, marks=pytest.mark.slow) for one in Element if one not in QUICK]


def stack(material, element, count=COUNT, size=None):
    """`count` blocks of together 3 m on the ground."""
    half, rise = SIDE / 2, HEIGHT / count
    return [ground(half=1.0)] + [
        elastic_box(
            f"block {k}",
            [-half, -half, k * rise],
            [half, half, (k + 1) * rise],
            material,
            size or MESH[element],
            element,
        )
        for k in range(count)
    ]


def check_at_rest(result, material):
    weight = material.density * G * HEIGHT * SIDE**2
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.errors.balance < 1e-4
    assert base_force(result) == pytest.approx([0, 0, weight], rel=1e-3, abs=1e-3 * weight)


@pytest.mark.parametrize("element", QUICK + SLOW)
def test_a_column_of_ten_blocks_bears_like_one_solid_column(element):
    """σ_zz = -ρg(H - z), all else zero, with ν = 0: means of blocks within 1 %, nodes 1 % of ρgH. Closed form."""
    material = Material("stone", density=2000.0, young=1e9, poisson=0.0)
    result = resting("stack", stack(material, element))
    check_at_rest(result, material)
    whole = material.density * G * HEIGHT
    for k, body in enumerate(result.bodies[1:]):
        exact = -material.density * G * (HEIGHT - (k + 0.5) * RISE)
        assert mean_stress(body) == pytest.approx([0, 0, exact, 0, 0, 0], rel=0.01, abs=0.01 * -exact)
        nodes = inner(body, 0.2 * SIDE)
        assert nodes.sum() >= 3
        error = body.stress[nodes] + np.outer(
            material.density * G * (HEIGHT - body.reference[nodes, 2]), [0, 0, 1, 0, 0, 0]
        )
        assert np.abs(error).max() < 0.01 * whole
    top = result.bodies[-1]
    sunk = -top.displacement[np.isclose(top.reference[:, 2], HEIGHT), 2]
    assert sunk == pytest.approx(whole * HEIGHT / (2 * material.young), rel=0.01)


@pytest.mark.parametrize(("element", "size"), [(Element.HEX8, 0.1), (Element.HEX20, 0.15)])
def test_joints_change_nothing_where_stones_widen(element, size):
    """ν = 0.25 on a base with friction: the stack against one block of the same height, within 1 % of ρgH.

    Means over each stone, and stresses at the nodes inside it that both meshes have, 0.1 m from the sides. At joints
    recovery looks to one side only; there the contacts tell the pressure, and carry what lies above.
    """
    material = Material("stone", density=2000.0, young=1e9, poisson=0.25)
    many, one = (resting("stack", stack(material, element, count, size)) for count in (COUNT, 1))
    check_at_rest(many, material)
    check_at_rest(one, material)
    whole, solid = material.density * G * HEIGHT, one.bodies[1]
    for k, body in enumerate(many.bodies[1:]):
        low, high = k * RISE, (k + 1) * RISE
        assert mean_stress(body) == pytest.approx(mean_between(solid, low, high), abs=0.01 * whole)
        nodes = np.flatnonzero(inner(body, 0.19 * SIDE))
        apart = np.linalg.norm(solid.reference[:, None] - body.reference[nodes], axis=2)
        assert apart.min(axis=0).max() < 1e-9
        error = np.abs(body.stress[nodes] - solid.stress[apart.argmin(axis=0)]).max(axis=1) / whole
        between = np.abs(body.reference[nodes, 2] - (low + high) / 2) < RISE / 2 - 1e-9
        assert between.any()
        assert error[between].max() < 0.01
        above = material.density * G * SIDE**2 * (HEIGHT - low)
        assert joint_force(many, k + 1, k)[2] == pytest.approx(above, rel=1e-4)
