"""The contact problem of a step as the laws state it: shifts of u and r, and a cone."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.contact_problem import contact_problem, shifted, terms_of, unshifted
from mechanics.dynamics.handover import of_run
from mechanics.dynamics.stepping import free_kick
from mechanics.problem.problem import ContactStart
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.law import BOND, STATE
from mechanics.scene.laws.mortar import MortarJoint, held_tension
from mechanics.scene.laws.status import contact_status
from mechanics.scene.scene import ContactSettings, LawRule
from mechanics.solvers.first_order.nsgs import NSGS
from tests.mechanics.shapes import TURN, brick, ground, posed, scene, transformed

STEP = 2e-3


def stated(one, velocity=None):
    """The contact problem of the first step, its contacts as the laws see them, and the scene posed."""
    there = posed(one, STEP, one.time.theta)
    state = there.state if velocity is None else replace(there.state, velocity=velocity)
    free = free_kick(there.model, state, state, there.compliance, STEP, one.time.theta)
    internal = np.zeros((len(there.contacts), STATE))
    return *contact_problem(there.model, state, there.found, free, internal, of_run(state)), there


def column(law, lift=0.0, rules=(), turn=None):
    stones = ground(), brick("a", (0, 0, lift), (1, 1, 1)), brick("b", (0.1, 0, 1), (0.9, 0.8, 1.5))
    one = scene(*stones, step=STEP, theta=0.75)
    return transformed(replace(one, contact=ContactSettings(law, rules)), turn)


def test_what_the_laws_are_told_of_the_contacts():
    velocity = np.zeros((3, 6))
    velocity[1, 2], velocity[2, 2] = -0.3, -0.1
    _, approach, there = stated(column(DryJoint(0.5), lift=0.01), velocity=velocity)
    contacts = there.contacts
    lower = (contacts.bodies == 0).any(axis=1)
    np.testing.assert_allclose(approach.gap, np.where(lower, 0.01, 0.0), atol=1e-14)
    np.testing.assert_allclose(approach.speed, np.where(lower, -0.3, 0.2), atol=1e-14)
    np.testing.assert_allclose(approach.area, np.where(lower, 0.25, 0.16), rtol=1e-12)
    np.testing.assert_allclose(approach.size, np.where(lower, 0.99, 0.5), rtol=1e-12)
    np.testing.assert_array_equal(approach.compliance, there.operator.diagonal[:, 0, 0])
    assert (approach.step, approach.theta, approach.push_out) == (STEP, 0.75, False)
    assert approach.first.all()


def test_a_dry_joint_is_friction_and_a_bias_by_the_gap():
    problem, _, there = stated(column(DryJoint(0.5), lift=0.01))
    lower = (there.contacts.bodies == 0).any(axis=1)
    np.testing.assert_array_equal(problem.friction, 0.5)
    np.testing.assert_array_equal(problem.cohesion, 0.0)
    assert (problem.bias[lower] > 0).all()
    np.testing.assert_allclose(problem.bias[~lower], 0.0, atol=1e-11)
    # gravity alone: all stones fall alike, so only the ground sees them come
    np.testing.assert_allclose(problem.u_free[lower, 0], -9.81 * STEP, rtol=1e-12)
    np.testing.assert_allclose(problem.u_free[~lower], 0.0, atol=1e-15)
    impulse = np.ones((len(lower), 3))
    assert unshifted(problem, impulse) is impulse


@pytest.mark.parametrize("turn", [None, TURN], ids=["straight", "turned"])
def test_adhesion_is_taken_out_of_the_free_velocity_and_given_back_to_the_impulse(turn):
    """u = W r̃ + u_free - W s n = W r + u_free, whatever r is."""
    mortar, dry = MortarJoint(0.6, 1e5, 2e5), DryJoint(0.6)
    problem, _, there = stated(column(mortar, turn=turn))
    plain, *_ = stated(column(dry, turn=turn))
    adhesion = problem.adhesion
    held = held_tension(0.6, 1e5, 2e5)
    np.testing.assert_allclose(adhesion, STEP * held * there.contacts.area, rtol=1e-12)
    np.testing.assert_allclose(problem.cohesion, STEP * (2e5 - 0.6 * held) * there.contacts.area, rtol=1e-12)
    r = np.random.default_rng(0).normal(size=(8, 3))
    raised = r + adhesion[:, None] * [1.0, 0, 0]
    with_bonds = there.operator.apply(raised) + problem.u_free
    without = there.operator.apply(r) + plain.u_free
    np.testing.assert_allclose(with_bonds, without, atol=1e-12 * np.abs(there.operator.apply(raised)).max())
    np.testing.assert_allclose(unshifted(problem, raised), r, atol=1e-12 * adhesion.max())
    start = shifted(problem, ContactStart(r, 2 * r))
    np.testing.assert_allclose(start.impulse, raised, rtol=1e-15)
    np.testing.assert_array_equal(start.velocity, 2 * r)


def test_a_bond_that_bears_nothing_is_no_open_contact():
    """In weightless rest r = 0, so r̃ = s: bonded, not open; the solver finds it."""
    one = replace(column(MortarJoint(0.6, 1e5, 2e5)), gravity=(0.0, 0.0, 0.0))
    problem, approach, _ = stated(one)
    cold = ContactStart(np.zeros((8, 3)), np.zeros((8, 3)))
    solution = NSGS(1e-12, 1e-12, 10000)(problem, shifted(problem, cold))
    assert solution.converged
    np.testing.assert_allclose(solution.impulse[:, 0], problem.adhesion, rtol=1e-9)
    np.testing.assert_allclose(unshifted(problem, solution.impulse), 0.0, atol=1e-9 * problem.adhesion.max())
    after = approach.state.copy()
    after[:, BOND] = 1.0
    assert set(contact_status(after, terms_of(problem), solution.impulse)) == {"bonded"}


def test_a_contact_whose_law_does_not_act_cannot_close():
    """Newton's restitution waits for an open contact: an infinite bias, which no velocity of the step can reach."""
    problem, _, there = stated(column(DryJoint(0.5, restitution=0.5), lift=0.01))
    lower = (there.contacts.bodies == 0).any(axis=1)
    bias, fastest = problem.bias, np.abs(problem.u_free).max()
    assert np.isfinite(bias).all()
    assert (bias[lower] > 100 * fastest).all()
    np.testing.assert_array_equal(bias[~lower], 0.0)
    answer = NSGS(1e-12, 1e-12, 1000)(problem, ContactStart(np.zeros((8, 3)), np.zeros((8, 3))))
    np.testing.assert_array_equal(answer.impulse[lower], 0.0)


def test_each_joint_has_the_law_of_its_rule():
    rules = (LawRule(frozenset({"a"}), frozenset({"b"}), MortarJoint(0.6, 1e5, 2e5)),)
    problem, _, there = stated(column(DryJoint(0.5), rules=rules))
    upper = (there.contacts.bodies == 2).any(axis=1)
    np.testing.assert_array_equal(there.found.law, upper.astype(int))
    np.testing.assert_array_equal(problem.friction, np.where(upper, 0.6, 0.5))
    assert (problem.adhesion[upper] > 0).all()
    assert not problem.adhesion[~upper].any()
