"""Loads with the engine: places, thresholds and forces against closed forms."""

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.accelerogram import Accelerogram
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.gravity import GravityRamp, TiltingTable
from mechanics.scene.loads.ground_motion import Component, GroundMotion
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion, settlement, spreading
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import ContactSettings, Fidelity, Scene, TimeSettings
from mechanics.simulate import simulate
from tests.validation.scenes import G, box, ground

GROUND = frozenset({"ground"})
BLOCK = frozenset({"block"})


def scene(*blocks, loads, friction=0.6, gravity=(0.0, 0.0, -G), step=2e-3, theta=0.5, duration=1.0, **time):
    return Scene(
        "loads",
        blocks,
        gravity=gravity,
        contact=ContactSettings(DryJoint(friction)),
        time=TimeSettings(step, theta, duration, **time),
        loads=loads,
    )


def started(*blocks, **settings):
    return Simulation(*build_model(scene(*blocks, **settings)))


def low_block():
    return box("block", [-0.5, -0.5, 0.0], [0.5, 0.5, 0.3])


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_supports_settle_exactly_and_stones_follow(theta):
    """20 mm within 2 s: the support to 1e-12 m at any time; the stone on it to 1e-6 of its height."""
    load = settlement(GROUND, (0.003, 0.0, -0.02), duration=2.0, start=0.1)
    simulation = started(ground(), low_block(), loads=Loads(motions=(load,)), theta=theta, step=0.01)
    for _ in range(230):
        step = simulation.step()
        expected = simulation.start.centre[0] + load.pose(step.after.time).displacement
        np.testing.assert_allclose(step.after.centre[0], expected, atol=1e-12)
    moved = step.after.centre - simulation.start.centre
    np.testing.assert_allclose(moved[0], [0.003, 0.0, -0.02], atol=1e-12)
    np.testing.assert_allclose(moved[1], moved[0], atol=3e-7)
    assert np.abs(step.after.velocity).max() < 1e-6


def test_an_equilibrium_is_found_only_after_the_loads():
    """A block that rests from the first step on is in equilibrium once its support has come to rest, at 0.5 s."""
    load = settlement(GROUND, (0.0, 0.0, -0.001), duration=0.3, start=0.2)
    result = simulate(scene(ground(), low_block(), loads=Loads(motions=(load,)), theta=1.0, step=0.01))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert 0.5 <= result.time < 0.6
    assert result.bodies[1].displacement[:, 2] == pytest.approx(-0.001, abs=1e-7)


def test_two_springers_part_by_the_distance():
    left = box("left", [-1.0, 0.0, -0.5], [-0.1, 1.0, 0.0], fidelity=Fidelity.FIXED)
    right = box("right", [0.1, 0.0, -0.5], [1.0, 1.0, 0.0], fidelity=Fidelity.FIXED)
    lintel = box("lintel", [-0.5, 0.0, 0.0], [0.5, 1.0, 0.3])
    motions = spreading({"left"}, {"right"}, (1.0, 0.0, 0.0), 0.02, duration=1.0)
    smooth = scene(left, right, lintel, loads=Loads(motions=motions), friction=0.0, step=0.01, duration=2.0)
    result = simulate(smooth)
    moved = [float(body.displacement[:, 0].mean()) for body in result.bodies]
    np.testing.assert_allclose(moved[:2], [-0.01, 0.01], atol=1e-12)
    # without friction nothing takes the lintel along
    assert abs(moved[2]) < 1e-9
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.errors.reaction < 1e-6


def test_supports_bear_the_weight_and_what_presses_on_it():
    down = StoneForce(BLOCK, History.constant((0.0, 0.0, -500.0)))
    result = simulate(scene(ground(), low_block(), loads=Loads(forces=(down,)), theta=1.0, step=0.01))
    assert result.reaction == pytest.approx(result.weight + 500.0, rel=1e-6)
    assert result.errors.reaction < 1e-6


def slides_at(simulation, angle, steps):
    """The angle [°] at which the block has moved by 0.1 mm along the table."""
    for _ in range(steps):
        step = simulation.step()
        # in the axes of the ground, above whose middle the block begins
        place = step.after.rotation[0].T @ (step.after.centre[1] - step.after.centre[0])
        if place[0] > 1e-4:
            return np.degrees(angle(step.after.time))
    return None


@pytest.mark.parametrize("friction", [0.3, 0.6])
@pytest.mark.parametrize("turned", ["gravity", "table"])
def test_a_block_on_a_tilting_table_slides_at_the_angle_of_friction(friction, turned):
    """tan α = μ, where gravity turns and where the table does; at 0.5 °/s within 0.1°.

    From α on a block slides by g (α̇ cos α + μ α̇ sin α) t³/6: 0.1 mm after 0.2 s, or 0.1°.
    """
    limit, rate = np.degrees(np.arctan(friction)), 0.5
    time = np.array([0.0, 2.0])
    angle = History(time, np.radians(limit - 0.4 + rate * time))
    axis = (0.0, 1.0, 0.0)
    if turned == "gravity":
        loads, gravity = Loads(gravity=(TiltingTable(axis, angle),)), (0.0, 0.0, -G)
    else:
        # the scene begins in the axes of a table that has been tilted nearly up to the limit
        start = float(angle(0.0))
        spin = History.constant(np.radians(rate))
        loads = Loads(motions=(ImposedMotion(GROUND, spin=spin, axis=axis),))
        gravity = (G * np.sin(start), 0.0, -G * np.cos(start))
    simulation = started(ground(2.0), low_block(), loads=loads, gravity=gravity, friction=friction)
    found = slides_at(simulation, angle, 1000)
    assert found is not None
    assert limit < found < limit + 0.13


def record(dt=0.01, peak=2.0):
    """A synthetic record: 2 Hz under an envelope, of 3 s."""
    time = np.arange(0, 3.0, dt)
    shape = np.sin(np.pi * time / 3.0) ** 2 * np.sin(2 * np.pi * 2 * time)
    return Accelerogram(dt, peak * shape, "synthetic", "synthetic")


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_the_ground_follows_its_record_and_a_stone_the_ground(theta):
    """Displacement at every sample to 1e-12 m; a stone that friction holds (μ g > PGA) stays on its place.

    That is to 1e-7 m, and the h² a/8 by which ground that accelerates bends away from its chord between two kicks.
    """
    shaking = record()
    motion = GroundMotion(GROUND, (Component((0.0, 1.0, 0.0), shaking),), start=0.1)
    simulation = started(ground(), low_block(), loads=Loads(motions=(motion,)), theta=theta, step=5e-3)
    begin, bend = simulation.start.centre, 5e-3**2 * np.abs(shaking.acceleration).max() / 8
    for count in range(1, 640):
        moved = simulation.step().after.centre - begin
        time = count * 5e-3 - 0.1
        if count % 2 == 0 and 0 <= time < 2.99:
            expected = shaking.displacement[round(time / shaking.dt)]
            np.testing.assert_allclose(moved[0], [0.0, expected, 0.0], atol=1e-12)
        np.testing.assert_allclose(moved[1], moved[0], atol=1e-7 + bend)


def test_a_block_on_shaken_ground_is_dragged_by_friction():
    """Newmark's block: ground with 6 m/s² for 0.5 s, μ = 0.3: the block gets μ g = 2.943 m/s², within 0.1 %."""
    push = Accelerogram(0.5, np.array([6.0, 6.0]), "step", "synthetic")
    motion = GroundMotion(GROUND, (Component((1.0, 0.0, 0.0), push),))
    simulation = started(ground(), low_block(), loads=Loads(motions=(motion,)), friction=0.3, step=1e-3)
    for _ in range(500):
        step = simulation.step()
    assert step.after.velocity[1, 0] == pytest.approx(0.3 * G * 0.5, rel=1e-3)
    moved = step.after.centre[:, 0] - simulation.start.centre[:, 0]
    np.testing.assert_allclose(moved, [0.5 * 6.0 * 0.25, 0.5 * 0.3 * G * 0.25], rtol=3e-3)


def test_supports_carry_weight_and_forces():
    """Vertical reaction, friction and moment of a stone that is pushed at a corner, to 1e-6 of the weight."""
    block = low_block()
    weight = 1.0 * 1.0 * 0.3 * block.material.density * G
    push = np.array([500.0, 0.0, -1000.0])
    load = StoneForce(BLOCK, History.constant(push), arm=(0.4, 0.4, 0.15))
    simulation = started(ground(), block, loads=Loads(forces=(load,)), theta=1.0)
    for _ in range(20):
        step = simulation.step()
    points = step.after.centre[1] + np.einsum("ij,cj->ci", step.after.rotation[1], step.contacts.arm[:, 0])
    force = step.force if (step.contacts.bodies[:, 0] == 1).all() else -step.force
    np.testing.assert_allclose(force.sum(axis=0), [-500.0, 0.0, weight + 1000.0], atol=1e-6 * weight)
    moment = np.cross(points - step.after.centre[1], force).sum(axis=0)
    np.testing.assert_allclose(moment, -np.cross([0.4, 0.4, 0.15], push), atol=1e-5 * weight)


def test_weight_grows_with_the_ramp():
    """Half-way, the support carries half of it."""
    simulation = started(ground(), low_block(), loads=Loads(gravity=(GravityRamp(1.0),)), step=0.01)
    weight = 0.3 * low_block().material.density * G
    for _ in range(50):
        step = simulation.step()
    time = step.predicted.time
    assert abs(step.force[:, 2].sum()) == pytest.approx(weight * time, rel=1e-6)


def test_a_force_that_follows_its_stone_spins_it_up():
    """A constant force at an arm a turns a free stone by ½ (a F/I) t²; one that keeps its direction lets it swing."""
    free = box("block", [0, 0, 0], [1, 1, 0.5])
    mass = 0.5 * free.material.density
    inertia = mass * (1 + 1) / 12
    load = StoneForce(BLOCK, History.constant([0.0, 800.0, 0.0]), arm=(0.5, 0.0, 0.0), follows=True)
    simulation = started(free, loads=Loads(forces=(load,)), gravity=(0.0, 0.0, 0.0), step=1e-3)
    for _ in range(1000):
        state = simulation.step().after
    assert state.velocity[0, 5] == pytest.approx(800.0 * 0.5 / inertia, rel=1e-9)
    angle = 0.5 * 800.0 * 0.5 / inertia
    assert state.rotation[0, 1, 0] == pytest.approx(np.sin(angle), abs=1e-5)
    kept = StoneForce(BLOCK, load.force, load.arm)
    simulation = started(free, loads=Loads(forces=(kept,)), gravity=(0.0, 0.0, 0.0), step=1e-3)
    for _ in range(1000):
        state = simulation.step().after
    # energy of a pendulum: ½ I ω² = F a sin φ
    turned = np.arctan2(state.rotation[0, 1, 0], state.rotation[0, 0, 0])
    assert 0.5 * inertia * state.velocity[0, 5] ** 2 == pytest.approx(400.0 * np.sin(turned), rel=1e-4)


def test_a_thrown_block_flies_a_parabola():
    """x = v t, z = w t - g t²/2, exact with θ = 1/2."""
    block = box("block", [0, 0, 1], [0.2, 0.2, 1.2], velocity=(3.0, 0.0, 2.0, 0.0, 0.0, 4.0))
    simulation = started(ground(), block, loads=Loads())
    for _ in range(200):
        state = simulation.step().after
    moved = state.centre[1] - simulation.start.centre[1]
    np.testing.assert_allclose(moved, [3 * 0.4, 0.0, 2 * 0.4 - G * 0.16 / 2], atol=1e-9)
    assert state.rotation[1, 1, 0] == pytest.approx(np.sin(4 * 0.4), abs=1e-9)
