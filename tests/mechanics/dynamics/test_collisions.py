"""Collisions of rigid stones: conservation of momentum and angular momentum, and balance of energy."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mechanics.dynamics.energy_balance import EnergyBalance
from mechanics.dynamics.observers.energy import kinetic_energy
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Block, ContactSettings, Fidelity, SolverSettings
from mechanics.simulate import simulate
from tests.mechanics.shapes import LIMESTONE, brick, ground, pile, random_stone, scene

THETAS = pytest.mark.parametrize("theta", [0.5, 0.75, 1.0])
seeds = st.integers(0, 2**32 - 1)


def rolling(seed, stones=5):
    """Random stones in empty space that turn, and fly towards the middle."""
    rng = np.random.default_rng(seed)
    blocks = []
    for k in range(stones):
        corners, faces = random_stone(rng)
        direction = rng.normal(size=3)
        place = 1.5 * (1 + 0.2 * k) * direction / np.linalg.norm(direction)
        velocity = (*(-2.0 * place + 0.3 * rng.normal(size=3)), *rng.normal(size=3))
        blocks.append(Block(str(k), corners + place, faces, LIMESTONE, velocity=velocity))
    return blocks


def run(one, steps):
    model, start = build_model(one)
    simulation = Simulation(model, start)
    return model, start, [simulation.step() for _ in range(steps)]


def momenta(model, state):
    """Linear and angular momentum about the origin of all stones."""
    v, w = state.velocity[:, :3], state.velocity[:, 3:]
    inertia = state.rotation @ model.inertia.inertia @ state.rotation.transpose(0, 2, 1)
    own = np.einsum("bij,bj->bi", inertia, w)
    return model.mass @ v, (own + model.mass[:, None] * np.cross(state.centre, v)).sum(axis=0)


def scale_of_momenta(model, state):
    """Sum of the sizes of all terms: what rounding is measured against."""
    speed = np.linalg.norm(state.velocity[:, :3], axis=1)
    spin = np.linalg.norm(state.velocity[:, 3:], axis=1) * np.linalg.norm(model.inertia.inertia, axis=(1, 2))
    reach = np.linalg.norm(state.centre, axis=1)
    return model.mass @ speed, model.mass @ (speed * reach) + spin.sum()


@settings(max_examples=5, deadline=None)
@given(seeds, st.sampled_from([0.5, 1.0]), st.sampled_from([1e-2, 1e-3]), st.sampled_from([0.0, 0.6]))
def test_collisions_keep_momentum_and_angular_momentum(seed, theta, step, friction):
    one = scene(*rolling(seed), gravity=(0, 0, 0), step=step, theta=theta, friction=friction)
    model, start, steps = run(one, 80 if step > 5e-3 else 600)
    assert any(s.impulse.any() for s in steps)  # they met
    before, size = momenta(model, start), scale_of_momenta(model, start)
    for state in (steps[len(steps) // 2].after, steps[-1].after):
        for found, expected, scale in zip(momenta(model, state), before, size, strict=True):
            np.testing.assert_allclose(found, expected, atol=1e-12 * scale)


@settings(max_examples=5, deadline=None)
@given(seeds, st.sampled_from([0.5, 0.75, 1.0]), st.sampled_from([1e-2, 2e-3]))
def test_no_collision_makes_energy_and_the_balance_closes(seed, theta, step):
    one = scene(*rolling(seed), gravity=(0, 0, 0), step=step, theta=theta)
    one = replace(one, solver=SolverSettings(tolerance=1e-10, max_iterations=5000))
    model, start, steps = run(one, 80 if step > 5e-3 else 300)
    balance = EnergyBalance(model, start)
    kinetic = [kinetic_energy(model, start)]
    for s in steps:
        balance(s)
        kinetic.append(kinetic_energy(model, s.after))
    assert balance.error < 1e-12
    # inelastic: no step adds anything, to what solving to η = 1e-10 leaves
    assert np.diff(kinetic).max() < 1e-8 * kinetic[0]
    assert balance.contact <= 1e-8 * kinetic[0]
    assert balance.scheme >= 0
    if any(s.impulse.any() for s in steps):
        assert kinetic[-1] < kinetic[0]


@THETAS
def test_the_balance_closes_with_gravity_friction_and_the_ground(theta):
    """A heap falls on a plate: work of the weight, of the contacts and of the scheme add up."""
    heap = pile(3, stones=7, near=0.4)
    blocks = [
        replace(block, vertices=block.vertices + np.array([0, 0, 2.5]), fidelity=Fidelity.RIGID)
        for block in heap.blocks
    ]
    one = scene(ground((-6, -6, -1), (6, 6, 0)), *blocks, step=2e-3, theta=theta)
    model, start, steps = run(one, 400)
    balance = EnergyBalance(model, start)
    for s in steps:
        balance(s)
    assert balance.contact < -0.1 * balance.external  # they fell, and lost much
    assert balance.error < 1e-11


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_a_run_reports_that_its_balance_closes(theta):
    one = scene(
        *rolling(11), gravity=(0, 0, 0), step=5e-3, theta=theta, duration=0.6, stop_at_equilibrium=False
    )
    result = simulate(one)
    assert result.history.contacts.max() > 3
    assert result.errors.energy < 1e-12
    assert np.diff(result.history.kinetic).max() < 1e-6 * result.history.kinetic[0]


@pytest.mark.parametrize("e", [0.0, 0.3, 1.0])
@THETAS
def test_two_cubes_part_as_newton_says(e, theta):
    """Face on face: v' = v̄ ∓ e Δv/2; masses 1 : 3, so v̄ = (2 - 3·1)/4."""
    heavy = replace(LIMESTONE, name="heavy", density=6000.0)
    stones = (
        brick("a", (0, 0, 0), (1, 1, 1), velocity=(2.0, 0, 0, 0, 0, 0)),
        brick("b", (1.1005, 0, 0), (2.1005, 1, 1), material=heavy, velocity=(-1.0, 0, 0, 0, 0, 0)),
    )
    one = scene(*stones, gravity=(0, 0, 0), step=1e-3, theta=theta)
    one = replace(
        one, contact=ContactSettings(DryJoint(0.5, restitution=e)), solver=SolverSettings(tolerance=1e-13)
    )
    model, _, steps = run(one, 60)
    mean, parting = (2.0 - 3.0) / 4.0, 3.0 * e
    found = steps[-1].after.velocity
    np.testing.assert_allclose(found[:, 0], [mean - 0.75 * parting, mean + 0.25 * parting], atol=1e-9)
    np.testing.assert_allclose(found[:, 1:], 0.0, atol=1e-9)
    assert model.mass @ found[:, 0] == pytest.approx(2000 * (2 - 3), rel=1e-12)


@pytest.mark.parametrize("e", [0.2, 1.0])
def test_a_corner_that_hits_a_plate_rebounds_with_newtons_ratio(e):
    """One contact alone: u_N after is -e times u_N before; without friction the rest is what one impulse leaves."""
    tip = brick("tip", (-0.5, -0.5, -0.5), (0.5, 0.5, 0.5), velocity=(0, 0, -1.0, 0, 0, 0))
    turn = Rotation.from_rotvec([0.5, 0.3, 0.0]).as_matrix()
    corners = tip.vertices @ turn.T
    tip = replace(tip, vertices=corners - [0, 0, corners[:, 2].min() - 0.0105])
    one = scene(ground(), tip, gravity=(0, 0, 0), step=1e-3, theta=0.5)
    one = replace(
        one, contact=ContactSettings(DryJoint(0.0, restitution=e)), solver=SolverSettings(tolerance=1e-13)
    )
    model, start, steps = run(one, 14)
    hit = [s for s in steps if s.impulse.any()]
    assert len(hit) == 1
    pressed = np.flatnonzero(hit[0].impulse[:, 0])
    assert len(pressed) == 1
    # the arm from the centre of mass to the corner, and W_NN = 1/m + (r × n)·I⁻¹(r × n), I = m/6 for a cube
    arm = corners[corners[:, 2].argmin()]
    lever = np.cross(arm, [0, 0, 1.0])
    compliance = 1 / model.mass[1] + lever @ lever / (model.mass[1] / 6)
    impulse = (1 + e) * 1.0 / compliance
    after = steps[-1].after.velocity[1]
    np.testing.assert_allclose(after[:3], [0, 0, -1.0 + impulse / model.mass[1]], atol=1e-9)
    np.testing.assert_allclose(after[3:], impulse * lever / (model.mass[1] / 6), atol=1e-9)
    if e == 1.0:
        assert kinetic_energy(model, steps[-1].after) == pytest.approx(
            kinetic_energy(model, start), rel=1e-12
        )
