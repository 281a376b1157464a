"""Dry joints: Signorini with gap, Newton's restitution, static and dynamic friction."""

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.scene.laws.dry_joint import DryJoint, at_limit, slid
from mechanics.scene.laws.law import REST, SLIDING, STATE, Terms
from tests.mechanics.scene.laws.one_contact import Block, approach


def test_the_bias_lets_a_closing_contact_land_and_keeps_an_overlap_from_growing():
    gaps = [2e-3, 0.0, -1e-3]
    terms = DryJoint(0.6).terms(approach(gaps, step=1e-2, theta=0.5))
    np.testing.assert_allclose(terms.bias, [0.2, 0.0, 0.0])  # g/h
    np.testing.assert_array_equal(terms.friction, [0.6, 0.6, 0.6])
    assert not terms.cohesion.any()
    assert not terms.adhesion.any()
    pushed = DryJoint(0.6).terms(approach(gaps, step=1e-2, theta=0.5, push_out=True))
    np.testing.assert_allclose(pushed.bias, [0.2, 0.0, -0.1])


def test_the_bias_is_measured_from_the_gap_that_counts_as_closed():
    state = np.zeros((2, STATE))
    state[:, REST] = 1e-3
    np.testing.assert_allclose(DryJoint().terms(approach([3e-3, 1e-3], 0.0, state)).bias, [2.0, 0.0])


def test_newton_reverses_the_approach_of_closed_contacts_only():
    contacts = approach([0.0, 1e-10, -1e-3, 1e-3], speed=-2.0)
    np.testing.assert_allclose(DryJoint(restitution=0.5).terms(contacts).bias, [-1.0, -1.0, -1.0, np.inf])
    assert not DryJoint(restitution=0.5).terms(approach([0.0], speed=2.0)).bias.any()


def test_friction_is_dynamic_where_the_contact_slid():
    state = np.zeros((2, STATE))
    state[1, SLIDING] = 1.0
    law = DryJoint(0.7, dynamic_friction=0.4)
    np.testing.assert_array_equal(law.terms(approach([0.0, 0.0], 0.0, state)).friction, [0.7, 0.4])
    np.testing.assert_array_equal(DryJoint(0.7).terms(approach([0.0, 0.0], 0.0, state)).friction, [0.7, 0.7])


def test_a_contact_slides_at_the_limit_of_its_cone_when_it_moves():
    terms = Terms(*np.array([[0.0] * 5, [0.5] * 5, [0.0, 0.0, 0.0, 3.0, 0.0], [0.0] * 5]))
    impulse = np.array([[2, 1, 0], [2, 0.6, -0.8], [2, 0.9, 0], [0, 0, 3], [0, 0, 0]], dtype=float)
    np.testing.assert_array_equal(at_limit(terms, impulse), [True, True, False, True, False])
    velocity = np.zeros((5, 3))
    contacts = approach(np.zeros(5))
    assert not slid(contacts, terms, impulse, velocity).any()  # a contact may rest at its limit
    velocity[:, 1] = 1e-4
    assert not slid(contacts, terms, impulse, velocity).any()  # slower than 1e-4 √(W ‖r̃‖ size/h) = 4.7e-3 m/s
    velocity[:, 1] = 1e-2
    np.testing.assert_array_equal(slid(contacts, terms, impulse, velocity), [True, True, False, True, False])


def test_without_friction_a_pressed_contact_that_moves_slides():
    contacts, impulse = approach([0.0, 0.0]), np.array([[1.0, 0.0], [0.0, 0.0]])
    after = DryJoint(0.0).after(contacts, impulse, np.full((2, 2), 0.1))
    np.testing.assert_array_equal(after[:, SLIDING], [1.0, 0.0])


def test_a_block_that_slides_is_braked_by_the_dynamic_friction():
    """F between the two limits holds a resting block; pushed once, it accelerates by (F - μ_d P)/m."""
    law = DryJoint(0.6, dynamic_friction=0.4)
    resting = Block(law, mass=2.0, force=(-10.0, 5.0)).advance(1000)
    assert resting.velocity[1] == 0.0
    pushed = Block(law, mass=2.0, force=(-10.0, 5.0), velocity=np.array([0.0, 1e-3])).advance(1)
    before = pushed.velocity[1]
    pushed.advance(1000)
    assert pushed.velocity[1] - before == pytest.approx((5.0 - 0.4 * 10.0) / 2.0, rel=1e-12)


@pytest.mark.parametrize("ratio", [0.0, 0.5, 1.0])
def test_a_falling_block_bounces_with_newtons_ratio(ratio):
    block = Block(DryJoint(restitution=ratio), step=1e-5, force=(-9.81, 0.0), place=np.array([0.01, 0.0]))
    fastest = 0.0
    while block.velocity[0] <= 0 and block.impulse[0] == 0:
        fastest = block.velocity[0]
        block.advance()
    if ratio == 0.0:
        # it lands with the gap, and rests from the next kick on
        assert block.place[0] > 0.0
        block.advance()
        assert block.place[0] == pytest.approx(0.0, abs=1e-15)
    assert block.velocity[0] == pytest.approx(-ratio * fastest, abs=1e-12)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"friction": -0.1}, "friction = -0.1; give a number of 0 or more"),
        ({"friction": float("nan")}, "friction = nan"),
        ({"friction": float("inf")}, "friction = inf"),
        ({"dynamic_friction": 0.7}, "dynamic_friction = 0.7; give from 0 up to the static friction, 0.6"),
        ({"restitution": 1.1}, "restitution = 1.1; give a number from 0 to 1"),
    ],
)
def test_impossible_parameters_are_refused_by_name(changed, said):
    with pytest.raises(SceneError, match="dry joint: ") as caught:
        DryJoint(**changed)
    assert said in str(caught.value)
