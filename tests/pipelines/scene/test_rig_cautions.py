"""Cautions about dry joints that are too stiff, pressure on dry walls, and steps too long for bonds that soften."""

import pytest

from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.rig import Rig
from mechanics.scene.scene import ContactSettings, LawRule, Scene
from mechanics.scene.shapes import box
from mechanics.stones.materials import Material
from pipelines.scene.rig_cautions import rig_cautions

STONE = Material("stone", 2600.0, 20e9, 0.2)
AREA = 0.2  # m²
MORTAR = {"tension": 1e5, "shear": 1e5, "energy_tension": 5.0, "energy_shear": 20.0}


def cautions(stiffness=7.9e9, pressure=0.4e6, step=None, ruled=False, **mortar):
    blocks = tuple(box(f"B{k}", (0, 0, 0.5 * k), (1, AREA, 0.5 * (k + 1)), STONE) for k in (0, 1))
    law = ElasticJoint(0.65, stiffness, 0.4 * stiffness, **mortar)
    contact = ContactSettings(law)
    if ruled:
        contact = ContactSettings(rules=(LawRule(frozenset({"B0"}), frozenset({"B1"}), law),))
    return rig_cautions(Scene("wall", blocks, contact=contact), Rig((1, 0, 0), 1.1, pressure * AREA), step)


@pytest.mark.parametrize("ruled", [False, True])
def test_dry_joints_stiffer_than_any_in_first_loading_get_a_caution(ruled):
    (told,) = cautions(26.2e9, ruled=ruled)
    assert "dry joints of 26.2 GPa/m" in told
    assert cautions(12.9e9, ruled=ruled) == []
    assert cautions(26.2e9, ruled=ruled, **MORTAR) == []


def test_dry_walls_under_pressure_are_told_that_their_loss_of_force_is_not_modelled():
    assert cautions(pressure=0.5e6) == []
    (told,) = cautions(pressure=0.6e6)
    assert told.startswith(
        "dry joints under 0.6 MPa on average: loss of force after the peak is not modelled"
    )
    assert "25 to 45 % by 15 to 25 mm" in told
    assert cautions(pressure=1.25e6, **MORTAR) == []


def test_steps_too_long_for_the_softening_of_bonds_get_a_caution():
    (told,) = cautions(step=1e-4, **MORTAR)
    assert "give 0.05 mm at most" in told
    assert cautions(step=5e-5, **MORTAR) == []
    assert cautions(step=1e-3) == []
