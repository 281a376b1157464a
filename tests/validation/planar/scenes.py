"""Disks and walls of the planar validation cases."""

import numpy as np

from mechanics.dynamics.progress import Clock
from mechanics.planar.model import build_planar_model
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.planar.simulate import simulate_planar
from mechanics.planar.simulation import PlanarSimulation
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Method, SolverSettings

G = 9.81
FLOOR = Wall("floor", (-100.0, 0.0), (100.0, 0.0))


def ball(code="ball", centre=(0.0, 0.1), radius=0.1, mass=1.0, velocity=(0.0, 0.0, 0.0)):
    """A disk of a given mass in a slice of one metre."""
    return Disk(code, centre, radius, mass / (np.pi * radius**2), 0.0, velocity)


def scene(disks, walls, law, step, theta, duration, gravity=(0.0, -G), stop=False, **more):
    return PlanarScene(
        "validation",
        tuple(disks),
        tuple(walls),
        gravity,
        law,
        time=PlanarTime(step, theta, duration, stop_at_equilibrium=stop),
        solver=SolverSettings(Method.NSGS, tolerance=1e-13, velocity_tolerance=1e-10, max_iterations=20000),
        **more,
    )


def run(disks, walls=(FLOOR,), law=None, step=1e-3, theta=0.5, duration=1.0, **more):
    """Simulate to the end."""
    return simulate_planar(scene(disks, walls, law or DryJoint(), step, theta, duration, **more))


def start(disks, walls=(FLOOR,), law=None, step=1e-3, theta=0.5, **more):
    """A simulation that has not begun."""
    model, state = build_planar_model(scene(disks, walls, law or DryJoint(), step, theta, 1.0, **more))
    return PlanarSimulation(model, state, Clock())


def steps_of(simulation, count):
    """The next steps."""
    return [simulation.step() for _ in range(count)]
