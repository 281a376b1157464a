"""Disks at the limits: each has a stated outcome, and none gives NaN, an endless loop or silent nonsense."""

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.planar.simulate import simulate_planar
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Method, SolverSettings
from tests.mechanics.planar.shapes import G

FLOOR = Wall("floor", (-10.0, 0.0), (10.0, 0.0))


def run(disks, walls=(FLOOR,), friction=0.5, step=1e-3, duration=0.2, theta=1.0, sweeps=20000, **more):
    law = more.pop("law", DryJoint(friction))
    result = simulate_planar(
        PlanarScene(
            "extreme",
            tuple(disks),
            tuple(walls),
            law=law,
            time=PlanarTime(step, theta, duration, balance_tolerance=1e-3),
            solver=SolverSettings(Method.NSGS, 1e-9, 1e-4, sweeps),
            **more,
        )
    )
    assert np.isfinite(result.position).all()
    assert np.isfinite(result.contacts.force).all()
    assert np.isfinite(result.history.natural_map).all()
    return result


def column(count, radius=0.1, density=2400.0, top_density=None):
    return [
        Disk(
            f"d{i}",
            (0.0, radius * (1 + 2 * i)),
            radius,
            (top_density or density) if i == count - 1 else density,
        )
        for i in range(count)
    ]


def test_a_column_of_a_hundred_disks_stands():
    # plain Gauss–Seidel needs about (2n/π)² ln(1/ε) = 84,000 sweeps for it
    result = run(column(100), step=1e-3, duration=0.02, sweeps=200_000)
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.reaction == pytest.approx(result.weight, rel=1e-6)
    assert result.errors.unconverged_steps == 0


def test_a_solver_that_gets_nowhere_says_so():
    # 10⁶ times heavier on a light one: 10⁷ sweeps would be needed
    result = run(column(2, top_density=2.4e9), duration=5e-3, sweeps=2000)
    assert result.outcome is Outcome.MOVING
    assert result.errors.unconverged_steps == result.steps
    assert result.errors.natural_map > 1e-9


def test_light_on_heavy_rests():
    result = run(column(2, density=2.4e9, top_density=2.4e3))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.reaction == pytest.approx(result.weight, rel=1e-6)


@pytest.mark.parametrize("friction", [0.0, 10.0])
def test_friction_of_nothing_and_of_ten(friction):
    # on a slope of 45° the first slides with g sin, the second rolls with two thirds of it
    gravity = (G * np.sqrt(0.5), -G * np.sqrt(0.5))
    result = run([Disk("d", (0.0, 0.1), 0.1)], friction=friction, gravity=gravity, theta=0.5)
    share = 1.0 if friction == 0.0 else 2 / 3
    assert result.velocity[0, 0] == pytest.approx(share * gravity[0] * 0.2, rel=1e-9)


@pytest.mark.parametrize("step", [1e-5, 1e-4, 1e-3, 1e-2, 1e-1])
@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_any_step_lands_a_disk_on_the_floor(step, theta):
    # dropped by 1 mm: 14 ms
    result = run([Disk("d", (0.0, 0.101), 0.1)], step=step, duration=max(0.02, 12 * step), theta=theta)
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.position[0, 1] == pytest.approx(0.1, abs=1e-12)


def test_an_initial_overlap_stays_and_creates_no_energy():
    disks = [Disk("a", (0.0, 0.1), 0.1), Disk("b", (0.15, 0.1), 0.1)]
    result = run(disks, friction=0.0, start_overlap=0.5)
    assert result.outcome is Outcome.EQUILIBRIUM
    np.testing.assert_allclose(result.position[:2, 0], [0.0, 0.15], atol=1e-9)
    assert result.errors.penetration == pytest.approx(0.25, rel=1e-6)
    assert result.history.kinetic.max() < 1e-12


def test_two_disks_in_one_place_are_finite():
    result = run([Disk("a", (0.0, 0.1), 0.1), Disk("b", (0.0, 0.1), 0.1)], start_overlap=np.inf)
    assert result.errors.penetration == pytest.approx(1.0)


def test_a_disk_whose_centre_lies_on_a_wall_is_finite():
    result = run([Disk("a", (0.0, 0.0), 0.1)], start_overlap=np.inf)
    assert result.position[0, 1] == pytest.approx(0.0, abs=1e-12)


def test_without_gravity_what_rests_is_in_equilibrium():
    result = run(column(3), gravity=(0.0, 0.0))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert not result.contacts.force.any()
    assert result.errors.reaction == 0.0


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_a_disk_at_100_m_s_is_stopped_by_a_wall(theta):
    # 0.1 m in a step of 1 ms, as far as it is thick
    wall = Wall("wall", (1.0, -5.0), (1.0, 5.0))
    result = run(
        [Disk("d", (0.0, 0.0), 0.05, velocity=(100.0, 0.0, 0.0))], (wall,), theta=theta, gravity=(0.0, 0.0)
    )
    assert result.position[0, 0] == pytest.approx(0.95, abs=1e-12)
    assert result.outcome is Outcome.EQUILIBRIUM


def test_sizes_over_six_orders_of_magnitude_rest_together():
    small = [Disk(f"s{i}", (3e-6 * i, 1e-6), 1e-6) for i in range(5)]
    result = run([Disk("large", (5.0, 1.0), 1.0), *small], (FLOOR,), step=1e-4, duration=2e-3)
    assert result.outcome is Outcome.EQUILIBRIUM
    assert len(result.contacts.bodies) == 6
