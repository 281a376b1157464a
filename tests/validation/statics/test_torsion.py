"""How much a flat contact resists being turned about its normal: it depends on where its contact points are.

A block of side 1 m and weight 0.2 N with μ = 0.5. A uniform pressure resists with 0.0382598 N m; four corner points
with μ W √2/2 = 0.0707107 N m, 1.848 times as much. Points placed by inertia have the area's second moments: they
all lie at 1/√6 from the middle and resist with μ W/√6 = 0.0408248 N m, 6.7 % above the uniform pressure.
"""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import ContactSettings, Fidelity, Placement, Scene, SolverSettings, TimeSettings
from mechanics.simulate import simulate
from tests.validation.masonry import STONE, cuboid
from tests.validation.statics.verdict import G

SIDE, HEIGHT, WEIGHT, FRICTION = 1.0, 0.2, 0.2, 0.5
INERTIA = WEIGHT / G * SIDE**2 / 6
CORNERS, INSIDE, UNIFORM = 0.0707107, 0.0408248, 0.0382598
# placement, points, moment of resistance [N m]
PLACES = [
    (Placement.CORNERS, 4, CORNERS),
    (Placement.CORNERS, 8, CORNERS),
    (Placement.INERTIA, 3, INSIDE),
    (Placement.INERTIA, 4, INSIDE),
    (Placement.INERTIA, 8, INSIDE),
    (Placement.INERTIA, 1, 0.0),
]


def block(spin=0.0):
    stone = cuboid("block", (-SIDE / 2, -SIDE / 2, 0.0), (SIDE / 2, SIDE / 2, HEIGHT))
    light = replace(STONE, density=WEIGHT / G / (SIDE**2 * HEIGHT))
    return replace(stone, material=light, velocity=(0.0, 0.0, 0.0, 0.0, 0.0, spin))


def simulated(stone, placement, points, loads=None, **time):
    table = cuboid("table", (-2.0, -2.0, -1.0), (2.0, 2.0, 0.0), Fidelity.FIXED)
    return simulate(
        Scene(
            "torsion",
            (table, stone),
            contact=ContactSettings(DryJoint(FRICTION), points=points, placement=placement),
            time=TimeSettings(stop_at_equilibrium=False, **time),
            solver=SolverSettings(tolerance=1e-9, velocity_tolerance=1e-7, max_iterations=5000),
            loads=loads or Loads(),
        )
    )


def couple(moment):
    """A pair of forces of that moment about z [N m]."""
    arm = 0.4
    force = moment / (2 * arm)
    return Loads(
        forces=tuple(
            StoneForce(
                frozenset({"block"}), History.constant((0.0, sign * force, 0.0)), (sign * arm, 0.0, 0.0), True
            )
            for sign in (1.0, -1.0)
        )
    )


@pytest.mark.parametrize(("placement", "points", "moment"), PLACES)
def test_a_spinning_block_is_braked_by_the_moment_of_its_contact_points(placement, points, moment):
    """R18: within 1 % of the value that matches the discretisation; dω/dt = -M/I, I = m/6 of a square."""
    start, duration = 2.0, 0.02
    result = simulated(block(start), placement, points, step=5e-4, theta=0.5, duration=duration)
    assert result.errors.unconverged_steps == 0
    end = np.sqrt(2 * result.history.kinetic[-1] / INERTIA)
    assert (start - end) * INERTIA / duration == pytest.approx(moment, rel=1e-2, abs=1e-6)


@pytest.mark.parametrize(("placement", "points", "moment"), PLACES[:5])
@pytest.mark.parametrize("part", [0.99, 1.01])
def test_a_block_turns_when_the_moment_exceeds_that_of_its_contact_points(placement, points, moment, part):
    """R18: holds 0.99 of the moment and turns under 1.01 of it, with the acceleration of what is left."""
    duration = 0.5
    result = simulated(
        block(), placement, points, couple(part * moment), step=5e-3, theta=0.5, duration=duration
    )
    assert result.errors.unconverged_steps == 0
    spin = np.sqrt(2 * result.history.kinetic[-1] / INERTIA)
    if part < 1:
        assert result.outcome is Outcome.EQUILIBRIUM
        assert spin < 1e-6
    else:
        assert spin == pytest.approx(0.01 * moment / INERTIA * duration, rel=1e-2)


def test_four_corners_resist_almost_twice_as_much_as_a_uniform_pressure():
    """R18: 0.0707107/0.0382598 = 1.848; a uniform pressure resists by the mean distance from the middle."""
    mean_distance = (np.sqrt(2) + np.log(1 + np.sqrt(2))) / 6
    assert FRICTION * WEIGHT * mean_distance * SIDE == pytest.approx(UNIFORM, abs=1e-7)
    assert pytest.approx(1.848, abs=1e-3) == CORNERS / UNIFORM
    assert pytest.approx(1.067, abs=1e-3) == INSIDE / UNIFORM
