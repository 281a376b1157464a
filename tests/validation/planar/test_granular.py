"""Packings of disks: reactions, coordination, crystals. Statics and isostaticity."""

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.planar.simulate import simulate_planar
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Method, SolverSettings
from tests.validation.planar.scenes import G

SOLVER = SolverSettings(Method.NSGS, tolerance=1e-7, velocity_tolerance=1e-4, max_iterations=5000)


def settled(columns, rows, friction, seed):
    """Disks of 7 to 13 mm fall from a loose lattice into a box, and come to rest."""
    rng = np.random.default_rng(seed)
    count, cell = columns * rows, 0.0267
    row, column = np.divmod(np.arange(count), columns)
    centres = (np.column_stack([column, row]) + 0.5) * cell + rng.uniform(-1e-4, 1e-4, (count, 2))
    radii = 0.01 * rng.uniform(0.7, 1.3, count)
    width, height = columns * cell, 2 * rows * cell
    walls = (
        Wall("bottom", (0.0, 0.0), (width, 0.0)),
        Wall("left", (0.0, 0.0), (0.0, height)),
        Wall("right", (width, 0.0), (width, height)),
    )
    disks = tuple(Disk(f"d{i}", tuple(centres[i]), float(radii[i])) for i in range(count))
    time = PlanarTime(2e-3, 1.0, 8.0, balance_tolerance=1e-4)
    result = simulate_planar(
        PlanarScene("box", disks, walls, law=DryJoint(friction), time=time, solver=SOLVER)
    )
    assert result.outcome is Outcome.EQUILIBRIUM
    return result


def wall_forces(result):
    """What the disks do to each wall (nw, 2) [N]."""
    count = len(result.scene.disks)
    force = np.zeros((len(result.scene.walls), 2))
    of_wall = result.contacts.bodies[:, 1] >= count
    np.add.at(force, result.contacts.bodies[of_wall, 1] - count, -result.contacts.force[of_wall])
    return force


@pytest.fixture(scope="module")
def frictionless():
    return [settled(8, 8, 0.0, seed) for seed in (1, 2, 3)]


def test_without_friction_the_bottom_of_a_box_bears_the_whole_weight(frictionless):
    """Case G13: bottom force = weight, to 1e-4; the sides bear nothing upwards and push against each other."""
    for result in frictionless:
        bottom, left, right = wall_forces(result)
        assert -bottom[1] == pytest.approx(result.weight, rel=1e-4)
        assert result.weight == pytest.approx(
            sum(2400.0 * np.pi * disk.radius**2 * G for disk in result.scene.disks), rel=1e-12
        )
        assert left[1] == right[1] == 0.0
        assert left[0] < 0
        assert left[0] + right[0] == pytest.approx(0.0, abs=1e-4 * result.weight)


def test_without_friction_a_packing_of_unequal_disks_is_isostatic(frictionless):
    """Case G03: z = 4 ± 0.1 without rattlers: as many contacts as there are ways to move, two for each disk."""
    for result in frictionless:
        pressed = np.hypot(*result.contacts.force.T) > 0
        count = len(result.scene.disks)
        touched = np.zeros(count + 3, dtype=np.int64)
        np.add.at(touched, result.contacts.bodies[pressed].ravel(), 1)
        held = int((touched[:count] > 0).sum())
        assert held > 0.9 * count
        assert 2.0 * pressed.sum() / held == pytest.approx(4.0, abs=0.1)


def test_with_friction_bottom_and_sides_bear_the_weight_and_fewer_contacts_do():
    """Statics: bottom and sides together bear the weight to 1e-4; and with friction three contacts in place of four
    can hold a disk (case G03: z from 3 to 4)."""
    result = settled(8, 8, 0.5, 1)
    bottom, left, right = wall_forces(result)
    assert -(bottom + left + right)[1] == pytest.approx(result.weight, rel=1e-4)
    assert (left + right)[1] != 0.0
    pressed = np.hypot(*result.contacts.force.T) > 0
    touched = np.unique(result.contacts.bodies[pressed])
    held = int((touched < len(result.scene.disks)).sum())
    assert 2.9 < 2.0 * pressed.sum() / held < 3.9


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_crystal_of_equal_disks_rests_as_it_was_laid(friction):
    """Case G03, hexagonal: six neighbours for each disk inside, density π/(2√3) = 0.9068997; it does not move."""
    columns, rows, radius = 10, 8, 0.05
    row, column = np.divmod(np.arange(columns * rows), columns)
    # every second row is shifted by a radius, and stands half a disk off the wall it leans from
    x = radius * (1 + 2 * column + row % 2)
    y = radius * (1 + np.sqrt(3.0) * row)
    width = radius * (2 * columns + 1)
    walls = (
        Wall("bottom", (0.0, 0.0), (width, 0.0)),
        Wall("left", (0.0, 0.0), (0.0, 2.0)),
        Wall("right", (width, 0.0), (width, 2.0)),
    )
    disks = tuple(Disk(f"d{i}", (float(x[i]), float(y[i])), radius) for i in range(len(x)))
    result = simulate_planar(
        PlanarScene(
            "crystal", disks, walls, law=DryJoint(friction), alert_distance=1e-6, solver=SOLVER,
            time=PlanarTime(1e-3, 1.0, 0.1, stop_at_equilibrium=False),
        )
    )  # fmt: skip
    moved = np.hypot(*(result.position[: len(x), :2] - np.column_stack([x, y])).T)
    assert moved.max() < 1e-6 * radius
    assert -sum(wall_forces(result))[1] == pytest.approx(result.weight, rel=1e-4)
    touched = np.zeros(len(x) + 3, dtype=np.int64)
    np.add.at(touched, result.contacts.bodies.ravel(), 1)
    inside = (column > 0) & (column < columns - 1) & (row > 0) & (row < rows - 1)
    np.testing.assert_array_equal(touched[: len(x)][inside], 6)
    # density between the centres of the first and the last row, and of two columns
    low, high = result.position[2], result.position[columns * 2 + 2]
    cell = 2 * radius * (high[1] - low[1])
    assert 2 * np.pi * radius**2 / cell == pytest.approx(0.9068997, rel=1e-6)
