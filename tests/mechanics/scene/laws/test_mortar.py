"""Mortar that breaks at once: shift, cone, break, and what holds afterwards."""

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.scene.laws.bonds import BROKEN, WHOLE
from mechanics.scene.laws.law import BOND, REST, SLIDING, STATE
from mechanics.scene.laws.mortar import MortarJoint, held_tension
from tests.mechanics.scene.laws.one_contact import Block, approach

MORTAR = MortarJoint(friction=0.5, tension=1e4, shear=2e4, dynamic_friction=0.3)


def whole(count, **changed):
    state = np.zeros((count, STATE))
    state[:, BOND] = WHOLE
    for name, value in changed.items():
        state[:, {"rest": REST, "sliding": SLIDING, "bond": BOND}[name]] = value
    return state


def test_a_bond_is_a_shift_and_a_cone_on_its_area():
    contacts = approach([0.0, 0.0], 0.0, whole(2), area=[1.0, 0.25], step=1e-2)
    terms = MORTAR.terms(contacts)
    np.testing.assert_allclose(terms.adhesion, [100.0, 25.0])  # h c_n A
    np.testing.assert_allclose(terms.cohesion, [150.0, 37.5])  # h A (c_t - μ c_n)
    # so that without normal force, r_N = 0 or r̃_N = s, the cone is that of the shear strength h c_t A
    np.testing.assert_allclose(terms.cohesion + terms.friction * terms.adhesion, [200.0, 50.0])
    assert not terms.bias.any()


def test_tension_is_cut_at_the_apex_of_the_cone():
    assert held_tension(0.5, 1e4, 2e4) == 1e4
    assert held_tension(0.5, 1e5, 2e4) == 4e4
    assert held_tension(0.0, 1e5, 2e4) == 1e5
    terms = MortarJoint(0.5, 1e5, 2e4).terms(approach([0.0], 0.0, whole(1), step=1.0))
    assert terms.adhesion[0] == 4e4
    assert terms.cohesion[0] == 0.0


def test_bonds_are_made_in_the_first_step_where_a_joint_with_an_area_is_closed():
    gaps = [0.0, 2e-3, -2e-3, 3e-3, 0.0]
    contacts = approach(gaps, size=0.25, area=[1.0, 1.0, 1.0, 1.0, 0.0], first=True)
    state = MORTAR.after(contacts, np.tile([1e-9, 0.0, 0.0], (5, 1)), np.zeros((5, 3)))
    np.testing.assert_array_equal(state[:, BOND], [WHOLE, WHOLE, WHOLE, 0.0, 0.0])
    np.testing.assert_array_equal(state[:, REST], [0.0, 2e-3, -2e-3, 0.0, 0.0])
    terms = MORTAR.terms(contacts)
    np.testing.assert_array_equal(terms.adhesion > 0, [True, True, True, False, False])
    # a bond is at home in its own gap; the third contact, open without a bond, has still to close
    np.testing.assert_allclose(terms.bias, [0.0, 0.0, 0.0, 3e-3 / 1e-3, 0.0], atol=1e-15)
    later = approach(gaps, size=0.25, first=False)
    assert not MORTAR.after(later, np.zeros((5, 3)), np.zeros((5, 3)))[:, BOND].any()


def test_the_gap_of_a_bond_is_that_before_the_flight_to_the_predicted_configuration():
    contacts = approach([2e-3], speed=1.0, size=1.0, first=True, step=2e-3, theta=0.5)
    assert MORTAR.after(contacts, np.ones((1, 3)), np.zeros((1, 3)))[0, REST] == pytest.approx(1e-3)


def test_a_bond_breaks_once_and_for_all_when_it_opens_or_slides_at_its_limit():
    contacts = approach(np.zeros(6), 0.0, whole(6), step=1.0)
    k, mu = float(MORTAR.terms(contacts).cohesion[0]), 0.5
    impulse = np.array(
        [[0, 0, 0], [0, 0, 0], [10, k + mu * 10, 0], [10, 0, k + mu * 10], [10, k, 0], [1e-3, 0, 0]]
    )
    velocity = np.array([[1e-3, 0, 0], [0, 0, 0], [0, -1e-1, 0], [0, 0, 0], [0, 0, 0], [1e-3, 0, 0]])
    state = MORTAR.after(contacts, impulse.astype(float), velocity.astype(float))
    # opened; at rest at the tensile limit; slid; at rest at the shear limit; below it; still pressed
    np.testing.assert_array_equal(state[:, BOND], [BROKEN, WHOLE, BROKEN, WHOLE, WHOLE, WHOLE])
    again = approach(np.zeros(6), 0.0, state, step=1.0)
    terms = MORTAR.terms(again)
    np.testing.assert_array_equal(terms.adhesion > 0, state[:, BOND] > 0)
    np.testing.assert_array_equal(terms.cohesion > 0, state[:, BOND] > 0)
    np.testing.assert_array_equal(terms.friction, [0.5, 0.5, 0.3, 0.5, 0.5, 0.5])
    pressed = np.tile([5.0, 0.0, 0.0], (6, 1))
    np.testing.assert_array_equal(MORTAR.after(again, pressed, np.zeros((6, 3)))[:, BOND], state[:, BOND])


def test_a_bond_at_its_limit_drifts_without_breaking_but_does_not_creep_for_ever():
    """h = 1 s, W = 4 /kg and ‖r̃‖ = 1e4 N s: slower than 1e-4 √(4e4 · 1 m) = 0.02 m/s it drifts; until 1 mm."""
    strong = MortarJoint(0.0, 0.0, 1e4)
    contacts = approach(np.zeros(3), 0.0, whole(3), step=1.0, compliance=4.0)
    impulse = np.tile([0.0, 1e4, 0.0], (3, 1))
    velocity = np.array([[0.0, -2.1e-2, 0.0], [0.0, -0.9e-3, 0.0], [0.0, -0.3e-3, 0.0]])
    state = strong.after(contacts, impulse, velocity)
    np.testing.assert_array_equal(state[:, BOND], [BROKEN, WHOLE, WHOLE])
    np.testing.assert_array_equal(state[:, SLIDING], [1.0, 0.0, 0.0])
    for _ in range(2):
        state = strong.after(approach(np.zeros(3), 0.0, state, step=1.0, compliance=4.0), impulse, velocity)
    np.testing.assert_array_equal(state[:, BOND], [BROKEN, BROKEN, WHOLE])


@pytest.mark.parametrize("theta", [0.5, 1.0])
@pytest.mark.parametrize(("excess", "holds"), [(1 - 1e-4, True), (1 + 1e-4, False)])
def test_a_block_is_pulled_off_at_its_weight_and_the_tension(theta, excess, holds):
    """W = 19620 N on 1 m² with c_n = 10 kPa: pulled off at 29620 N (closed form), within 1e-4."""
    weight = 19620.0
    law = MortarJoint(friction=0.5, tension=1e4, shear=5e3)
    block = Block(law, mass=2000.0, theta=theta, force=(29620.0 * excess - weight, 0.0)).advance(1000)
    assert (block.state[0, BOND] == WHOLE) == holds
    assert (block.place[0] == 0.0) == holds
    if holds:
        assert block.impulse[0] == pytest.approx(-1e-3 * (29620.0 * excess - weight), rel=1e-12)


@pytest.mark.parametrize(("excess", "holds"), [(1 - 1e-4, True), (1 + 1e-4, False)])
def test_a_block_slides_at_the_cone_with_cohesion_and_then_at_plain_friction(excess, holds):
    """‖R_T‖ ≤ μ (R_N + C) = 14810 N; decohered, μ R_N = 9810 N brakes it."""
    weight = 19620.0
    law = MortarJoint(friction=0.5, tension=1e4, shear=5e3)
    block = Block(law, mass=2000.0, force=(-weight, 14810.0 * excess)).advance(1000)
    assert (block.state[0, BOND] == WHOLE) == holds
    if holds:
        assert block.velocity[1] == 0.0
        return
    for force, sense in ((9810.0 * (1 - 1e-4), -1), (9810.0 * (1 + 1e-4), 1)):
        block.force, before = (-weight, force), block.velocity[1]
        block.advance(10)
        assert np.sign(block.velocity[1] - before) == sense
        assert -block.impulse[1] == pytest.approx(1e-3 * 9810.0, rel=1e-12)


@pytest.mark.parametrize("name", ["tension", "shear"])
@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf")])
def test_impossible_strengths_are_refused_by_name(name, value):
    with pytest.raises(SceneError, match=f"mortar joint: {name} = .*; give a number of 0 or more"):
        MortarJoint(**{"friction": 0.5, "tension": 1.0, "shear": 1.0} | {name: value})


def test_the_friction_of_the_broken_joint_is_checked():
    with pytest.raises(SceneError, match="dynamic_friction"):
        MortarJoint(0.5, 1.0, 1.0, dynamic_friction=0.6)


def test_mortar_does_not_act_across_a_gap():
    assert MORTAR.reach == 0.0
