"""Parts of limit loads that single blocks do not tell: joints with a bond, forces at an instant, unequal stones."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.limit.assembly import assembly
from mechanics.limit.confirm import likeness
from mechanics.limit.dead_load import at_instant
from mechanics.limit.kinematic import kinematics
from mechanics.limit.limit_load import limit_load
from mechanics.limit.live_loads import Acceleration
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import ContactSettings, Scene
from mechanics.scene.shapes import prism
from tests.mechanics.shapes import brick, ground, scene
from tests.validation.masonry import semicircular_arch

ALONG = Acceleration((1.0, 0.0, 0.0))


def test_a_bonded_block_slides_at_its_shear_strength_and_tips_at_its_tension():
    """Squat: λ W = μ W + c A. Slender: λ W H/2 = W B/2 + σ A B/2, with points at the corners and c = μ σ."""
    low, high = brick("low", (0, 0, 0), (1.0, 1.0, 0.1)), brick("high", (0, 0, 0), (0.2, 1.0, 2.0))
    shear, tension, friction = 4e3, 5e3, 0.8
    one = replace(
        scene(ground(), low), contact=ContactSettings(MortarJoint(friction, tension=tension, shear=shear))
    )
    on = assembly(one)
    assert limit_load(on, ALONG).multiplier == pytest.approx(friction + shear / on.weight, rel=1e-6)
    tall = assembly(replace(one, blocks=(one.blocks[0], high)))
    assert limit_load(tall, ALONG).multiplier == pytest.approx(
        0.1 * (1.0 + tension * 0.2 / tall.weight), rel=1e-6
    )


def test_a_force_is_that_of_the_instant_and_stays():
    pull = StoneForce(frozenset({"a"}), History(np.array([0.0, 2.0]), np.array([[0.0, 0, 0], [80.0, 0, 0]])))
    one = replace(scene(ground(), brick("a", (0, 0, 0), (1, 1, 1))), loads=Loads(forces=(pull,)))
    assert assembly(at_instant(one)).dead[0] == pytest.approx(80.0)
    halfway = at_instant(one, 1.0)
    assert assembly(halfway).dead[0] == pytest.approx(40.0)
    assert halfway.loads.until == 0.0


def test_a_gap_counts_as_closed_by_the_smaller_stone():
    """A thousandth of a stone 0.2 m wide, whatever it stands on."""
    closed = assembly(scene(ground(), brick("a", (0, 0, 1e-4), (0.2, 0.3, 0.5))))
    assert closed.widest == pytest.approx(1e-4)
    with pytest.raises(SceneError, match="no joint is closed"):
        assembly(scene(ground(), brick("a", (0, 0, 5e-4), (0.2, 0.3, 0.5))))


def test_the_share_of_the_mass_is_that_of_the_code():
    """e* = g M* / ΣW (NTC 2018, C8.7.1.2.1); the parts of an arch move unlike each other."""
    on = assembly(Scene("arch", tuple(semicircular_arch(15, 0.15)), contact=ContactSettings()))
    found = kinematics(on, ALONG, limit_load(on, ALONG))
    assert 0.1 < found.share < 0.98
    assert found.share == pytest.approx(9.81 * found.mass / found.weight, rel=1e-6)


def test_a_mechanism_is_compared_at_the_middle_of_the_corners():
    """A run tells how the mean of a stone's corners moves; the centre of a wedge is another place."""
    wedge = prism("wedge", [(0.0, 0.0), (0.6, 0.0), (0.1, 2.0), (0.0, 2.0)], 1.0)
    on = assembly(Scene("wedge", (ground(), wedge), contact=ContactSettings()))
    mechanism = limit_load(on, ALONG).mechanism
    body = on.rows(["wedge"], "")[0]
    velocity = mechanism.velocity[body]
    arm = wedge.vertices.mean(axis=0) - on.state.centre[body]
    assert np.linalg.norm(arm) > 0.05
    moved = np.zeros((2, 3))
    moved[body] = velocity[:3] + np.cross(velocity[3:], arm)
    assert likeness(on, mechanism, moved).cosine == pytest.approx(1.0, abs=1e-9)
