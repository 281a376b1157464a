"""Joints with cohesion: pull-off, shear triplet, incline, fracture energy. Closed forms, with the engine."""

import numpy as np
import pytest

from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.scene.laws.cohesive_zone import CohesiveZone
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.law import BOND
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import (
    ContactSettings,
    Fidelity,
    LawRule,
    Placement,
    Scene,
    SolverSettings,
    TimeSettings,
)
from mechanics.stones.materials import Material
from tests.validation.scenes import G, box, ground, tilted_gravity

STEP = 1e-3
SLIDING_STEP = 2e-3


def started(blocks, contact, loads=None, gravity=(0.0, 0.0, -G), theta=0.5, step=STEP):
    scene = Scene(
        "cohesion",
        tuple(blocks),
        gravity=gravity,
        contact=contact,
        time=TimeSettings(step, theta),
        loads=loads or Loads(),
    )
    return Simulation(*build_model(scene))


def broken_at(simulation, steps):
    """The first step in which a bond breaks; None if all hold."""
    for _ in range(steps):
        step = simulation.step()
        if (step.internal[:, BOND] < 0).any():
            return step
    return None


@pytest.mark.parametrize("theta", [0.5, 1.0])
@pytest.mark.parametrize("placement", list(Placement))
@pytest.mark.parametrize(
    ("direction", "arm", "limit"),
    [((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 29620.0), ((1.0, 0.0, 0.0), (0.0, 0.0, -0.5), 14810.0)],
)
def test_a_block_on_mortar_is_pulled_off_and_sheared_off_at_its_strength(
    theta, placement, direction, arm, limit
):
    """W = 19620 N on 1 m², c_n = 10 kPa, c_t = 5 kPa, μ = 0.5: W + c_n A and μ (W + c_n A), within 1e-4.

    For half a second the load is 1e-4 below, then 1e-4 above, and slowly the block starts. Broken, μ W = 9810 N
    brakes it.
    """
    stone = Material("stone", density=2000.0, young=1e10, poisson=0.2)
    parts = limit * np.array([1 - 1e-4, 1 - 1e-4, 1 + 1e-4, 1 + 1e-4])
    force = History([0.0, 0.5, 0.501, 1.5], np.outer(parts, direction))
    simulation = started(
        [ground(), box("block", [0, 0, 0], [1, 1, 1], stone)],
        ContactSettings(MortarJoint(0.5, 1e4, 5e3), placement=placement, spacing=0.3),
        Loads(forces=(StoneForce(frozenset({"block"}), force, arm),)),
        theta=theta,
        step=SLIDING_STEP,
    )
    assert broken_at(simulation, 250) is None
    assert broken_at(simulation, 400) is not None
    # contact after contact: where the forces of the last step still solve a step to η ≤ 1e-6 they are kept, and with
    # them bonds that are just at their strength
    for _ in range(10):
        after = simulation.step()
    assert (after.internal[:, BOND] < 0).all()
    total = after.force.sum(axis=0)
    if direction[0]:
        # velocities are solved to a share of the fastest; ten times the force that stops so much of them in one step
        fastest = np.abs(simulation.state.velocity).max() + G * SLIDING_STEP
        solved = 2000.0 * SolverSettings().velocity_tolerance * fastest / SLIDING_STEP
        assert solved < 2e-4 * 9810
        np.testing.assert_allclose(total, [-9810.0, 0.0, 19620.0], atol=10 * solved)
    else:
        np.testing.assert_allclose(total, np.zeros(3), atol=1e-6)


BED = 0.25 * 0.12
STRENGTH, FRICTION = 0.2e6, 0.4


def triplet(pressure):
    """Three bricks; the middle one is pushed along x, a smooth stop holds the top one, which presses on the others.

    The stop ends 1 mm above the middle brick, which can pass below it.
    """
    bricks = [
        box("bottom", [0.0, 0.0, 0.0], [0.25, 0.12, 0.06], fidelity=Fidelity.FIXED),
        box("middle", [0.0, 0.0, 0.06], [0.25, 0.12, 0.12]),
        box("top", [0.0, 0.0, 0.12], [0.25, 0.12, 0.18]),
        box("stop", [0.25, 0.0, 0.121], [0.30, 0.12, 0.18], fidelity=Fidelity.FIXED),
    ]
    mortar = MortarJoint(FRICTION, tension=0.1e6, shear=STRENGTH)
    middle, rest = frozenset({"middle"}), frozenset({"bottom", "top"})
    contact = ContactSettings(DryJoint(0.0), rules=(LawRule(middle, rest, mortar),))
    limit = 2 * BED * (STRENGTH + FRICTION * pressure)
    push = History([0.0, 0.05], np.outer([0.975 * limit, 1.025 * limit], [1.0, 0.0, 0.0]))
    press = History.constant([0.0, 0.0, -pressure * BED])
    loads = Loads(forces=(StoneForce(middle, push), StoneForce(frozenset({"top"}), press)))
    return started(bricks, contact, loads, gravity=(0.0, 0.0, 0.0)), push, limit


@pytest.mark.parametrize(
    ("pressure", "peak", "residual"),
    [(0.2e6, 16.8e3, 4.8e3), (0.6e6, 26.4e3, 14.4e3), (1.0e6, 36.0e3, 24.0e3)],
)
def test_a_shear_triplet_breaks_and_slides_as_coulomb_says(pressure, peak, residual):
    """EN 1052-3: F_max = 2 A (f_v0 + μ σ), then 2 A μ σ; 16.8, 26.4, 36.0 kN and 4.8, 14.4, 24.0 kN, within 1 %."""
    simulation, push, limit = triplet(pressure)
    assert limit == pytest.approx(peak)
    step = broken_at(simulation, 50)
    assert step is not None
    assert push(step.predicted.time)[0] == pytest.approx(peak, rel=0.01)
    for _ in range(3):  # contact after contact, and both joints
        step = simulation.step()
    bonds = step.internal[:, BOND]
    assert (bonds[bonds != 0] < 0).all()
    body = step.contacts.bodies
    on_middle = step.force[body[:, 0] == 1].sum(axis=0) - step.force[body[:, 1] == 1].sum(axis=0)
    assert -on_middle[0] == pytest.approx(residual, rel=0.01)


@pytest.mark.parametrize(("part", "holds"), [(1 + 1e-3, True), (1 - 1e-3, False)])
def test_a_block_on_an_incline_needs_its_cohesion(part, holds):
    """W = 10 kN on 1 m², slope 45°, φ = 30°: c A = W (sin ψ - cos ψ tan φ) = 2988.58 N for a safety of one; 1 %."""
    friction = float(np.tan(np.radians(30.0)))
    cohesion = 1e4 * (np.sin(np.pi / 4) - np.cos(np.pi / 4) * friction)
    assert cohesion == pytest.approx(2988.58, abs=0.01)
    stone = Material("stone", density=1e4 / G / 0.05, young=1e10, poisson=0.2)
    simulation = started(
        [ground(), box("block", [0, 0, 0], [1, 1, 0.05], stone)],
        ContactSettings(MortarJoint(friction, 0.0, part * cohesion)),
        gravity=tilted_gravity(45.0),
    )
    step = broken_at(simulation, 200)
    assert (step is None) == holds
    speed = np.linalg.norm(simulation.state.velocity[1, :3])
    assert (speed < 1e-6) == holds


@pytest.mark.parametrize("theta", [0.5, 1.0])
@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (0.6, 0.8, 0.0)])
def test_tearing_a_block_off_costs_the_fracture_energy(theta, direction):
    """G A with G = 50 J/m², σ₀ = 0.3 MPa (δ_f = 0.333 mm): ½ m (v₀² - v²) within 1 %.

    A slab, so that it does not tip over when it is sheared off: it spins less than 1e-3 rad/s.
    """
    speed, area = 6.0, 0.04
    slab = box("slab", [0, 0, 0], [0.2, 0.2, 0.002], velocity=(*(speed * np.array(direction)), 0, 0, 0))
    law = CohesiveZone(0.0, 0.3e6, 0.3e6, 50.0, 50.0)
    simulation = started(
        [ground(0.5, 0.1), slab], ContactSettings(law), gravity=(0, 0, 0), theta=theta, step=5e-7
    )
    mass = simulation.model.mass[1]
    for _ in range(250):
        step = simulation.step()
    assert (step.internal[:, BOND] <= 0).all()
    velocity = simulation.state.velocity[1]
    lost = 0.5 * mass * (speed**2 - velocity[:3] @ velocity[:3])
    assert lost / area == pytest.approx(50.0, rel=0.01)
