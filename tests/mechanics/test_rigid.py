"""Rigid bodies: the exponential map and the free motion."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mechanics.bodies.rigid import inverse_inertia_world, rigid_free_velocity, rotation_exp
from mechanics.model import build_model
from mechanics.observers.energy import kinetic_energy
from mechanics.simulation import Clock, Simulation
from tests.mechanics.shapes import TURN, brick, ground, moved, scene

component = st.floats(-1.0, 1.0)


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(component, component, component), st.sampled_from([1e-300, 1e-160, 1e-9, 1e-4, 1.0, 3.2, 50.0])
)
@example((0.0, 0.0, 0.0), 1.0)
@example((np.pi, 0.0, 0.0), 1.0)
@example((0.0, -2 * np.pi, 0.0), 1.0)
def test_rotation_exp_is_that_of_scipy_for_tiny_and_large_angles(direction, size):
    vector = size * np.array(direction)
    turn = rotation_exp(vector[None])[0]
    np.testing.assert_allclose(turn, Rotation.from_rotvec(vector).as_matrix(), atol=1e-14 * max(1.0, size))
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-14 * max(1.0, size))


def test_rotation_exp_of_a_tiny_angle_keeps_its_first_digits():
    turn = rotation_exp(np.array([[0.0, 0.0, 1e-12]]))[0]
    assert turn[1, 0] == pytest.approx(1e-12, rel=1e-14)


def test_rotations_about_one_axis_add_up():
    axis = np.array([0.6, 0.0, 0.8])
    first, second, both = rotation_exp(np.outer([0.3, 0.5, 0.8], axis))
    np.testing.assert_allclose(second @ first, both, atol=1e-15)


def test_gravity_moves_only_what_is_free():
    model, state = build_model(scene(ground(), brick("a", (0, 0, 1), (1, 1, 2))))
    free = rigid_free_velocity(model.inertia, state.rotation, state.velocity, model.gravity, 0.01)
    np.testing.assert_allclose(free, [[0] * 6, [0, 0, -0.0981, 0, 0, 0]], atol=1e-16)


def test_inverse_inertia_turns_with_the_body():
    model, _ = build_model(scene(brick("a", (0, 0, 0), (0.3, 0.7, 1.1))))
    found = inverse_inertia_world(model.inertia, TURN[None])[0]
    turned, _ = build_model(scene(moved(brick("a", (0, 0, 0), (0.3, 0.7, 1.1)), TURN)))
    np.testing.assert_allclose(found, turned.inertia.inverse_inertia[0], rtol=1e-10)


def spin(step, theta=0.5, duration=0.5):
    """Energy and angular momentum after a free, gravity-free tumble, against those at the start."""
    block = brick("a", (0, 0, 0), (0.3, 0.6, 1.0), velocity=(0, 0, 0, 2.0, 3.0, 1.0))
    model, start = build_model(scene(block, gravity=(0, 0, 0), step=step, theta=theta))
    simulation = Simulation(model, start, Clock())
    for _ in range(round(duration / step)):
        simulation.step()

    def momentum(state):
        turn, inertia = state.rotation[0], model.inertia.inertia[0]
        return turn @ inertia @ turn.T @ state.velocity[0, 3:]

    end = simulation.state
    energies = [kinetic_energy(model, state) for state in (start, end)]
    drift = np.linalg.norm(momentum(end) - momentum(start)) / np.linalg.norm(momentum(start))
    return abs(energies[1] / energies[0] - 1), drift


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_tumbling_keeps_energy_and_angular_momentum_to_first_order_in_the_step(theta):
    errors = np.array([spin(step, theta) for step in (4e-3, 2e-3, 1e-3)])
    assert errors[-1].max() < 5e-3
    ratio = errors[1] / errors[2]
    # the explicit gyroscopic moment is of first order; with θ = ½ the energy alone does better
    np.testing.assert_allclose(ratio, [4.0 if theta == 0.5 else 2.0, 2.0], rtol=0.1)


@pytest.mark.parametrize("axis", range(3))
def test_spin_about_a_principal_axis_goes_on_for_ever(axis):
    velocity = np.zeros(6)
    velocity[3 + axis] = 5.0
    block = brick("a", (0, 0, 0), (0.3, 0.6, 1.0), velocity=tuple(velocity))
    model, start = build_model(scene(block, gravity=(0, 0, 0), step=1e-2, theta=0.5))
    simulation = Simulation(model, start, Clock())
    for _ in range(100):
        simulation.step()
    np.testing.assert_allclose(simulation.state.velocity[0], velocity, atol=1e-12)
    angle = np.zeros(3)
    angle[axis] = 5.0
    expected = Rotation.from_rotvec(angle).as_matrix()
    np.testing.assert_allclose(simulation.state.rotation[0], expected, atol=1e-12)
