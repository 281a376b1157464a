"""Free flight of rigid bodies: energy, momentum, and the attitude of a tumbling one."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from mechanics.dynamics.observers.energy import kinetic_energy
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.stepping import free_kick
from mechanics.model._kernels import fly
from mechanics.model.model import build_model
from mechanics.model.rigid import RigidInertia, free_flight, inverse_inertia_world
from tests.mechanics.shapes import TURN, brick, ground, moved, scene

component = st.floats(-1.0, 1.0)
# three different moments of inertia, in axes that are not the body's own
AXES = Rotation.from_rotvec([0.3, 0.2, -0.5]).as_matrix()
TRIAXIAL = AXES @ np.diag([1.0, 2.5, 3.2]) @ AXES.T
SPIN = np.array([0.4, 2.0, -0.3])


def flown(omega, duration, inertia=TRIAXIAL, rotation=TURN, moving=True):
    """Rotation and angular velocity of one body after a flight."""
    turned, spin = fly(
        rotation[None], np.array([omega], dtype=float), inertia[None], np.linalg.inv(inertia)[None],
        np.array([moving]), duration,
    )  # fmt: skip
    return turned[0], spin[0]


def energy_and_momentum(rotation, spin, inertia=TRIAXIAL):
    world = rotation @ inertia @ rotation.T
    return 0.5 * spin @ world @ spin, world @ spin


def midpoint_twin(omega, duration, substep, inertia=TRIAXIAL, rotation=TURN):
    """Π' = exp(-τΩ) Π with Ω = I⁻¹ (Π + Π')/2, by scipy's rotations and plain fixed points."""
    inverse, momentum = np.linalg.inv(inertia), inertia @ rotation.T @ omega
    steps = int(np.linalg.norm(omega) * duration / substep) + 1
    for _ in range(steps):
        new = momentum
        for _ in range(200):
            turn = Rotation.from_rotvec(duration / steps * inverse @ (momentum + new) / 2).as_matrix()
            new = turn.T @ momentum
        rotation, momentum = rotation @ turn, new
    return rotation, rotation @ inverse @ momentum


def euler_reference(omega, duration, inertia=TRIAXIAL, rotation=TURN):
    """Euler's equations and Ṙ = R [Ω]×, by a Runge–Kutta method of order 8."""

    def rate(_, x):
        r, o = x[:9].reshape(3, 3), x[9:]
        cross = np.array([[0, -o[2], o[1]], [o[2], 0, -o[0]], [-o[1], o[0], 0]])
        return np.concatenate([(r @ cross).ravel(), np.linalg.solve(inertia, -np.cross(o, inertia @ o))])

    start = np.concatenate([rotation.ravel(), rotation.T @ omega])
    end = solve_ivp(rate, (0, duration), start, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    return end[:9].reshape(3, 3), end[:9].reshape(3, 3) @ end[9:]


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(component, component, component),
    st.sampled_from([1e-300, 1e-160, 1e-9, 1e-4, 0.1, 3.2, 50.0, 500.0]),
)
@example((0.0, 0.0, 0.0), 1.0)
@example((np.pi, 0.0, 0.0), 1.0)
@example((0.0, -2 * np.pi, 0.0), 1.0)
def test_a_body_with_equal_moments_turns_by_the_exponential_map(direction, size):
    angle = size * np.array(direction)
    turn, spin = flown(10 * angle, 0.1, inertia=2 * np.eye(3), rotation=np.eye(3))
    np.testing.assert_allclose(turn, Rotation.from_rotvec(angle).as_matrix(), atol=1e-14 * max(10.0, size))
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-14 * max(10.0, size))
    np.testing.assert_allclose(spin, 10 * angle, atol=1e-14 * max(10.0, size) * 10 * size)


def test_a_tiny_turn_keeps_its_first_digits():
    turn, _ = flown([0, 0, 1e-12], 1.0, inertia=np.eye(3), rotation=np.eye(3))
    assert turn[1, 0] == pytest.approx(1e-12, rel=1e-14)


@settings(max_examples=20, deadline=None)
@given(st.tuples(component, component, component), st.sampled_from([1e-3, 0.05, 1.0]))
def test_a_tumbling_body_flies_as_its_slow_twin(direction, duration):
    omega = 3.0 * np.array(direction)
    for found, twin in zip(flown(omega, duration), midpoint_twin(omega, duration, 0.1), strict=True):
        np.testing.assert_allclose(found, twin, atol=1e-13)


def test_the_attitude_of_a_tumbling_body_follows_eulers_equations_to_second_order():
    exact = euler_reference(SPIN, 2.0)
    errors = []
    for count in (50, 100, 200):  # below 0.1 rad each, so that every flight is one substep
        rotation, spin = TURN, SPIN
        for _ in range(count):
            rotation, spin = flown(spin, 2.0 / count, rotation=rotation)
        errors.append([np.linalg.norm(rotation - exact[0]), np.linalg.norm(spin - exact[1])])
    errors = np.array(errors)
    assert errors[-1].max() < 1e-4
    np.testing.assert_allclose(errors[:-1] / errors[1:], 4.0, rtol=0.05)
    # one long flight cuts itself into substeps
    rotation, spin = flown(SPIN, 2.0)
    assert np.linalg.norm(rotation - exact[0]) < errors[0, 0] * 3


def test_tumbling_keeps_energy_and_momentum_in_space_over_ten_thousand_steps():
    rotation, spin = TURN, SPIN
    energy, momentum = energy_and_momentum(rotation, spin)
    turned = np.zeros(3)
    for _ in range(10_000):
        rotation, spin = flown(spin, 5e-3, rotation=rotation)
        turned = np.maximum(turned, np.abs(spin - SPIN))
    assert turned.max() > 0.5  # it tumbled
    last_energy, last_momentum = energy_and_momentum(rotation, spin)
    assert abs(last_energy / energy - 1) < 1e-13
    np.testing.assert_allclose(last_momentum, momentum, atol=1e-13 * np.linalg.norm(momentum))
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(
    st.tuples(component, component, component),
    st.sampled_from([1e-6, 1e-2, 1.0, 30.0]),
    st.sampled_from([1e-2, 1.0, 10.0]),
    st.floats(0.0, 1.0),
)
def test_one_flight_keeps_energy_and_momentum_however_long_it_is(direction, size, duration, slender):
    """Moments from a sphere's to those of a flat disc, I₃ = I₁ + I₂."""
    omega = size * np.array(direction)
    inertia = AXES @ np.diag([1.0, 1.0 + slender, 1.0 + slender + slender**2]) @ AXES.T
    energy, momentum = energy_and_momentum(TURN, omega, inertia)
    last_energy, last_momentum = energy_and_momentum(*flown(omega, duration, inertia), inertia)
    assert last_energy == pytest.approx(energy, rel=3e-13, abs=1e-300)
    np.testing.assert_allclose(last_momentum, momentum, atol=3e-13 * np.linalg.norm(momentum))


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_spin_about_a_principal_axis_goes_on_for_ever(axis, theta):
    velocity = np.zeros(6)
    velocity[3 + axis] = 5.0
    block = brick("a", (0, 0, 0), (0.3, 0.6, 1.0), velocity=tuple(velocity))
    model, start = build_model(scene(block, gravity=(0, 0, 0), step=1e-2, theta=theta))
    simulation = Simulation(model, start)
    for _ in range(100):
        simulation.step()
    np.testing.assert_allclose(simulation.state.velocity[0], velocity, atol=1e-12)
    angle = np.zeros(3)
    angle[axis] = 5.0
    expected = Rotation.from_rotvec(angle).as_matrix()
    np.testing.assert_allclose(simulation.state.rotation[0], expected, atol=1e-12)


@pytest.mark.parametrize("theta", [0.5, 1.0])
@pytest.mark.parametrize("step", [1e-3, 1e-1])
def test_a_stone_that_tumbles_freely_keeps_energy_and_momentum_whatever_the_step(theta, step):
    block = brick("a", (0, 0, 0), (0.3, 0.6, 1.0), velocity=(0.5, 0, 0.1, 2.0, 3.0, 1.0))
    model, start = build_model(scene(block, gravity=(0, 0, 0), step=step, theta=theta))
    simulation = Simulation(model, start)
    for _ in range(200):
        simulation.step()
    end, inertia = simulation.state, model.inertia.inertia[0]
    assert kinetic_energy(model, end) == pytest.approx(kinetic_energy(model, start), rel=1e-13)
    expected = energy_and_momentum(start.rotation[0], start.velocity[0, 3:], inertia)[1]
    found = energy_and_momentum(end.rotation[0], end.velocity[0, 3:], inertia)[1]
    np.testing.assert_allclose(found, expected, atol=1e-13 * np.linalg.norm(expected))
    # and on a straight line
    path = 200 * step * start.velocity[0, :3]
    np.testing.assert_allclose(end.centre[0] - start.centre[0], path, atol=1e-12 * 200 * step)


def test_what_does_not_move_stays_as_it_is_and_the_rest_goes_straight():
    inertia = RigidInertia(
        np.ones(2),
        np.array([0.0, 1.0]),
        np.stack([TRIAXIAL] * 2),
        np.stack([0 * TRIAXIAL, np.linalg.inv(TRIAXIAL)]),
    )
    velocity = np.array([[1.0, 2, 3, 4, 5, 6], [0.1, -0.2, 0.3, *SPIN]])
    centre, rotation = np.array([[1.0, 2, 3], [4, 5, 6]]), np.stack([TURN, TURN])
    moved_to, turned, after = free_flight(inertia, centre, rotation, velocity, 0.5)
    np.testing.assert_array_equal(moved_to[0], centre[0])
    np.testing.assert_array_equal(turned[0], TURN)
    np.testing.assert_array_equal(after[0], velocity[0])
    np.testing.assert_allclose(moved_to[1], [4.05, 4.9, 6.15], rtol=1e-15)
    np.testing.assert_array_equal(after[1, :3], velocity[1, :3])
    np.testing.assert_array_equal(turned[1], flown(SPIN, 0.5)[0])


def test_gravity_kicks_only_what_is_free():
    model, state = build_model(scene(ground(), brick("a", (0, 0, 1), (1, 1, 2))))
    free = free_kick(model, state, state, (), 0.01, 0.5)
    np.testing.assert_allclose(free.velocity, [[0] * 6, [0, 0, -0.0981, 0, 0, 0]], atol=1e-16)
    np.testing.assert_allclose(free.load, [[0] * 6, [0, 0, -9.81 * 2000, 0, 0, 0]], rtol=1e-14)


def test_inverse_inertia_turns_with_the_body():
    model, _ = build_model(scene(brick("a", (0, 0, 0), (0.3, 0.7, 1.1))))
    found = inverse_inertia_world(model.inertia, TURN[None])[0]
    turned, _ = build_model(scene(moved(brick("a", (0, 0, 0), (0.3, 0.7, 1.1)), TURN)))
    np.testing.assert_allclose(found, turned.inertia.inverse_inertia[0], rtol=1e-10)
