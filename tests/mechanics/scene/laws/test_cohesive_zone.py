"""Mortar that softens: traction, damage, the energy that a break costs, and unloading."""

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.scene.laws.bonds import BROKEN, WHOLE
from mechanics.scene.laws.cohesive_zone import CohesiveZone
from mechanics.scene.laws.law import BOND, OPENING, SLIDING, SLIP, STATE
from tests.mechanics.scene.laws.one_contact import Block, approach

STRENGTH, ENERGY = 0.3e6, 50.0
FULL = 2 * ENERGY / STRENGTH  # opening at which the bond is broken [m]
ZONE = CohesiveZone(0.0, STRENGTH, STRENGTH, ENERGY, ENERGY)


def damaged(opening=0.0, slip=0.0):
    state = np.zeros((1, STATE))
    state[0, [BOND, OPENING, SLIP]] = 1 - (opening + slip) / FULL, opening, slip
    return state


def test_the_full_opening_follows_from_strength_and_energy():
    assert pytest.approx(3.3333e-4, rel=1e-4) == ZONE.reach
    assert CohesiveZone(0.5, 1e6, 1e5, 50.0, 50.0).reach == pytest.approx(
        2 * 50 / 2e5
    )  # tension cut at c_t/μ


def test_traction_falls_linearly_with_the_opening():
    for part in (0.0, 0.25, 0.5, 1.0, 2.0):
        contacts = approach([part * FULL], 0.0, damaged(), area=0.01, step=1e-3, compliance=1e-9)
        expected = 1e-3 * 0.01 * STRENGTH * max(1 - part, 0.0)
        terms = ZONE.terms(contacts)
        assert terms.adhesion[0] == pytest.approx(expected, rel=1e-12)
        assert terms.cohesion[0] == pytest.approx(expected, rel=1e-12)


def test_the_pull_of_a_step_is_that_in_its_middle():
    speed, step = 0.1, 1e-4
    at_start = approach([0.2 * FULL], speed, damaged(), step=step, theta=1.0, compliance=1e-9)
    in_flight = approach(
        [0.2 * FULL + step / 2 * speed], speed, damaged(), step=step, theta=0.5, compliance=1e-9
    )
    expected = step * STRENGTH * (1 - (0.2 * FULL + step / 2 * speed) / FULL)
    assert ZONE.terms(at_start).adhesion[0] == pytest.approx(expected, rel=1e-12)
    assert ZONE.terms(in_flight).adhesion[0] == pytest.approx(expected, rel=1e-12)


def test_a_bond_that_closes_again_pulls_in_proportion_to_its_opening():
    contacts = approach([0.1 * FULL], 0.0, damaged(0.4 * FULL), step=1e-3, compliance=1e-12)
    assert ZONE.terms(contacts).adhesion[0] == pytest.approx(1e-3 * STRENGTH * 0.6 * 0.25, rel=1e-6)


def test_shear_is_mohr_coulomb_scaled_by_what_is_intact():
    law = CohesiveZone(0.4, 2e5, 3e5, 50.0, 80.0)
    state = np.zeros((1, STATE))
    slip = 0.25 * 2 * 80.0 / 3e5
    state[0, [BOND, SLIP]] = 0.75, slip
    terms = law.terms(approach([0.0], 0.0, state, step=1.0))
    assert terms.adhesion[0] == pytest.approx(0.75 * 2e5)
    assert terms.cohesion[0] == pytest.approx(0.75 * (3e5 - 0.4 * 2e5))


def test_damage_grows_with_opening_and_sliding_and_never_heals():
    contacts = approach(
        np.zeros(4), 0.0, np.repeat(damaged(), 4, axis=0), step=1e-3, theta=1.0, compliance=1e-9
    )
    k = ZONE.terms(contacts).cohesion[0]
    impulse = np.array([[0, 0, 0], [1, k, 0], [0, k, 0], [1, 0.9 * k, 0]], dtype=float)
    velocity = np.array([[0.1, 0, 0], [0, 0, 0.06], [0.1, 0.06, 0], [0, 0.06, 0]], dtype=float)
    state = ZONE.after(contacts, impulse, velocity)
    np.testing.assert_allclose(state[:, OPENING], [1e-4, 0, 1e-4, 0], atol=1e-18)
    np.testing.assert_allclose(state[:, SLIP], [0, 6e-5, 6e-5, 0], atol=1e-18)
    np.testing.assert_allclose(state[:, BOND], [0.7, 0.82, 0.52, 1.0])
    np.testing.assert_array_equal(state[:, SLIDING], [0, 1, 1, 0])
    closed = ZONE.after(approach(np.zeros(4), 0.0, state), np.ones((4, 3)) * 1e-6, np.zeros((4, 3)))
    np.testing.assert_allclose(closed[:, BOND], state[:, BOND])


def test_a_broken_zone_is_a_dry_joint():
    state = damaged(FULL)
    state[0, BOND] = BROKEN
    terms = CohesiveZone(0.4, 2e5, 3e5, 50.0, 80.0).terms(approach([1e-3], 0.0, state, theta=1.0))
    assert (terms.adhesion[0], terms.cohesion[0], terms.friction[0], terms.bias[0]) == (0.0, 0.0, 0.4, 1.0)


@pytest.mark.parametrize("theta", [0.5, 0.7, 1.0])
@pytest.mark.parametrize("direction", [0, 1])
def test_a_block_torn_off_or_sheared_off_leaves_the_fracture_energy_behind(theta, direction):
    """½ m (v₀² - v²) = G A: 50 J/m² for σ₀ = 0.3 MPa, δ_f = 3.33e-4 m (closed form), within 1 %."""
    area, mass = 0.01, 1.0
    velocity = np.zeros(2)
    velocity[direction] = 2.0
    block = Block(ZONE, mass=mass, area=area, step=1e-6, theta=theta, velocity=velocity).advance(1000)
    assert block.state[0, BOND] == BROKEN
    lost = 0.5 * mass * (4.0 - block.velocity @ block.velocity)
    assert lost / area == pytest.approx(ENERGY, rel=0.01)
    assert -block.work / area == pytest.approx(ENERGY, rel=0.01)


@pytest.mark.parametrize("angle", [0.2, 0.8, 1.3])
def test_opening_and_sliding_together_spend_the_energy_by_their_parts(angle):
    """Without friction dD_I/G_I + dD_II/G_II = 2β dλ with λ = 1 - β, whose integral is 1 on every path."""
    law = CohesiveZone(0.0, 3e5, 2e5, 50.0, 80.0)
    block = Block(law, mass=1.0, area=0.01, step=2e-7, theta=0.5)
    block.velocity = 3.0 * np.array([np.cos(angle), np.sin(angle)])
    parts = np.zeros(2)
    while block.state[0, BOND] != BROKEN:
        before = block.velocity
        block.advance()
        parts -= block.impulse * (before + block.velocity) / 2 / 0.01
    assert parts @ [1 / 50.0, 1 / 80.0] == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize("theta", [0.5, 1.0])
@pytest.mark.parametrize(("part", "holds"), [(0.999, True), (1.001, False)])
def test_a_whole_bond_is_rigid_up_to_its_strength(theta, part, holds):
    force = part * STRENGTH * 0.01
    block = Block(ZONE, mass=100.0, area=0.01, theta=theta, force=(force, 0.0)).advance(2000)
    assert (block.state[0, BOND] == WHOLE) == holds
    assert (block.place[0] == 0.0) == holds


def test_a_damaged_bond_finds_its_balance_on_the_way_back_to_the_origin():
    """Half-damaged, δ_max = δ_f/2: F = β σ₀ A (δ + δ_u)/δ_max with δ_u = h² β σ₀ A/m, which a step cannot resolve."""
    area, mass, step, force = 0.01, 100.0, 5e-4, 1000.0
    block = Block(ZONE, mass, area, step=step, theta=1.0, force=(force, 0.0), first=False)
    block.state, block.place = damaged(FULL / 2), np.array([FULL / 2, 0.0])
    block.advance(4000)
    full = 0.5 * STRENGTH * area
    assert block.place[0] == pytest.approx(FULL / 2 * force / full - step**2 * full / mass, rel=1e-6)
    assert block.state[0, BOND] == 0.5


@pytest.mark.parametrize("theta", [0.5, 1.0])
@pytest.mark.parametrize("step", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("opening", [1e-12, 1e-8, 1e-6, 1e-5])
def test_no_step_makes_a_damaged_bond_swing_up(theta, step, opening):
    """However stiff the way back is against the step, energy does not grow and the damage stays."""
    block = Block(ZONE, 100.0, 0.01, step=step, theta=theta, first=False)
    block.state, block.place = damaged(opening), np.array([opening, 0.0])
    beta = block.state[0, BOND]
    released = beta * STRENGTH * 0.01 * opening  # the most that the bond can give back [J]
    for _ in range(300):
        block.advance()
        assert 0.5 * 100.0 * block.velocity[0] ** 2 <= released * (1 + 1e-9)
    assert block.state[0, BOND] == pytest.approx(beta, abs=1e-6)


@pytest.mark.parametrize("name", ["tension", "shear", "energy_tension", "energy_shear"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_impossible_parameters_are_refused_by_name(name, value):
    given = {"friction": 0.5, "tension": 1.0, "shear": 1.0, "energy_tension": 1.0, "energy_shear": 1.0}
    with pytest.raises(SceneError, match=f"cohesive zone: {name} = .*; give a number greater than 0"):
        CohesiveZone(**given | {name: value})
