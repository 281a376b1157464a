"""Walls with a mass: what pushes them, and what they push."""

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.planar.simulate import simulate_planar
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History

FLOOR = Wall("floor", (-5.0, 0.0), (5.0, 0.0))
ROW = tuple(Disk(f"d{i}", (2.0 * i - 2.0, 1.0), 1.0, density=100.0 / np.pi) for i in range(3))
TOP = Wall("top", (-4.0, 2.0), (4.0, 2.0), mass=50.0)


def run(walls, loads, gravity=(0.0, 0.0), friction=0.0, **time):
    settings = PlanarTime(
        **{"step": 1e-3, "theta": 0.5, "duration": 0.1, "stop_at_equilibrium": False} | time
    )
    return simulate_planar(
        PlanarScene("platen", ROW, walls, gravity, DryJoint(friction=friction), time=settings, loads=loads)
    )


def push(code, x, y):
    return Loads(forces=(StoneForce(frozenset({code}), History.constant([x, y, 0.0])),))


def test_a_platen_hands_its_force_to_what_it_presses_on():
    found = run((FLOOR, TOP), push("top", 0.0, -600.0), stop_at_equilibrium=True)
    assert found.outcome.value == "equilibrium"
    assert found.reaction == pytest.approx(600.0)
    under = found.contacts.bodies[:, 1] == 4
    # three contacts of a platen that does not turn: only their sum is determined
    assert found.contacts.force[under][:, 1].sum() == pytest.approx(-600.0)


def test_its_weight_acts():
    found = run((FLOOR, TOP), Loads(), gravity=(0.0, -10.0), stop_at_equilibrium=True)
    assert found.reaction == pytest.approx(3 * 100.0 * 10 + 500.0)
    assert found.weight == pytest.approx(3500.0)


def test_a_piston_and_the_disks_it_pushes_accelerate_as_one():
    side = Wall("side", (-3.0, 0.0), (-3.0, 2.0), mass=50.0)
    found = run((side,), push("side", 700.0, 0.0))
    assert found.velocity[:, 0] == pytest.approx(700.0 / 350.0 * 0.1)
    assert found.velocity[:, 1:] == pytest.approx(0.0, abs=1e-12)
    assert found.errors.energy < 1e-9


def test_a_moving_platen_is_no_equilibrium():
    found = run(
        (FLOOR, Wall("side", (9.0, 0.0), (9.0, 2.0), mass=1.0)),
        push("side", 1e-2, 0.0),
        stop_at_equilibrium=True,
    )
    assert found.outcome.value == "moving"


def test_walls_are_either_driven_or_have_a_mass():
    with pytest.raises(SceneError, match="give it no mass"):
        run(
            (FLOOR, TOP),
            Loads(motions=(ImposedMotion(frozenset({"top"}), History.constant([0.0, -1.0, 0.0])),)),
        )
    with pytest.raises(SceneError, match="mass = -1"):
        Wall("top", (0.0, 0.0), (1.0, 0.0), mass=-1.0)
