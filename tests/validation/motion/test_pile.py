"""Hyperstatic piles at rest: single contact forces are not unique, but their sums and moments are."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Fidelity, Scene, SolverSettings, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from tests.validation.masonry import cuboid

COUNT, G = 100, 9.81
# a cube of side 1 m that weighs 1 N
UNIT = Material("unit", density=1.0 / G, young=1e10, poisson=0.2)


def pile(count):
    """Cubes of weight 1 on a fixed one."""
    blocks = [cuboid("base", (-0.5, -0.5, -1.0), (0.5, 0.5, 0.0), Fidelity.FIXED)]
    for k in range(count):
        cube = cuboid(f"cube {k + 1}", (-0.5, -0.5, k), (0.5, 0.5, k + 1.0))
        blocks.append(replace(cube, material=UNIT))
    return tuple(blocks)


def at_rest(count, duration):
    """Rest, solved to rounding: the topmost joint carries a hundredth of the lowest, and errors add up."""
    return simulate(
        Scene(
            "pile",
            pile(count),
            contact=ContactSettings(DryJoint(0.6)),
            time=TimeSettings(step=1e-2, theta=1.0, duration=duration, stop_at_equilibrium=False),
            solver=SolverSettings(tolerance=1e-12, velocity_tolerance=1e-10, max_iterations=200_000),
        )
    )


@pytest.fixture(scope="module")
def column():
    return at_rest(COUNT, 10.0)


def test_each_joint_of_a_hundred_cubes_carries_the_weight_above_it(column):
    """R15: the joint under cube k of n carries n - k + 1 weights, within 1e-6."""
    contacts = column.contacts
    joint = contacts.bodies.min(axis=1)
    upward = np.where(contacts.bodies[:, 0] > contacts.bodies[:, 1], 1.0, -1.0) * contacts.force[:, 2]
    carried = np.bincount(joint, weights=upward, minlength=COUNT)
    np.testing.assert_allclose(carried, COUNT - np.arange(COUNT), rtol=1e-6)
    assert column.errors.unconverged_steps == 0


def test_the_resultant_of_each_joint_passes_through_the_middle(column):
    """R15: moments 0 about the axis, within 1e-6 of the weight above times the side."""
    contacts = column.contacts
    joint = contacts.bodies.min(axis=1)
    for axis in (0, 1):
        moment = np.bincount(
            joint, weights=np.abs(contacts.force[:, 2]) * contacts.point[:, axis], minlength=COUNT
        )
        assert np.abs(moment / (COUNT - np.arange(COUNT))).max() < 1e-6


def test_a_hundred_cubes_do_not_drift_in_ten_seconds(column):
    """R15: zero drift over 10 s; a thousand steps of 10 ms move no corner by more than 1e-8 of a side."""
    assert column.time == pytest.approx(10.0)
    assert column.outcome is Outcome.EQUILIBRIUM
    assert max(np.abs(b.displacement).max() for b in column.bodies) < 1e-8


def test_a_table_of_four_legs_carries_its_weight_without_moment():
    """R15: one block on its four corners: their sum is its weight and their moment is zero, within 1e-6."""
    result = at_rest(1, 1.0)
    force, point = result.contacts.force[:, 2], result.contacts.point
    assert len(force) == 4
    assert force.sum() == pytest.approx(1.0, rel=1e-6)
    assert np.abs(force @ point[:, :2]).max() < 1e-6
    assert force.min() >= 0.0
