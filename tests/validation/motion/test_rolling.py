"""Balls that roll: closed forms in space."""

import numpy as np
import pytest

from mechanics.dynamics.simulation import Simulation
from mechanics.model.balls import ball
from mechanics.model.model import build_model
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Scene, TimeSettings
from tests.validation.scenes import STONE, G, ground, tilted_gravity


def rolled(friction, gravity, duration, velocity=(0.0,) * 6, step=1e-3):
    """Velocity (6,) of a ball of 0.1 m on the ground after a time."""
    scene = Scene(
        "ball",
        (ground(half=20.0), ball("ball", (0, 0, 0.1), 0.1, STONE, velocity=velocity)),
        gravity=gravity,
        contact=ContactSettings(DryJoint(friction)),
        time=TimeSettings(step, 0.5, duration),
    )
    model, state = build_model(scene)
    simulation = Simulation(model, state)
    for _ in range(round(duration / step)):
        simulation.step()
    return simulation.state.velocity[1]


@pytest.mark.parametrize(
    ("friction", "expected"),
    [
        (0.11, 2.396584),  # above μ = 2/7 tan 20° = 0.103991 it rolls: a = 5/7 g sin 20°
        (0.09, G * (np.sin(np.radians(20)) - 0.09 * np.cos(np.radians(20)))),  # below, it slides
    ],
)
def test_a_ball_rolls_down_a_slope_or_slides(friction, expected):
    """R06 (closed form 5/7 g sin α): v after 1 s on 20°, within 0.5 %."""
    velocity = rolled(friction, tilted_gravity(20), 1.0)
    assert velocity[0] == pytest.approx(expected, rel=5e-3)


def test_a_sliding_ball_begins_to_roll():
    """R07 (closed form): v₀ = 2 m/s, μ = 0.2: it rolls from 0.291248 s on at 5/7 v₀ = 1.428571 m/s; one step, 0.5 %."""
    at = 0.291248
    before = rolled(0.2, (0, 0, -G), at - 2e-3, (2.0, 0, 0, 0, 0, 0))
    after = rolled(0.2, (0, 0, -G), at + 2e-3, (2.0, 0, 0, 0, 0, 0))
    assert before[0] - 0.1 * before[4] > 5e-3  # its lowest point still slides
    assert after[0] - 0.1 * after[4] == pytest.approx(0.0, abs=1e-7)
    assert after[0] == pytest.approx(1.428571, rel=5e-3)
