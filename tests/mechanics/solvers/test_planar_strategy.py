"""The automatic choice in the plane: sweeps where they suffice, and what they cannot solve."""

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.progress import Clock
from mechanics.planar.model import build_planar_model
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.planar.simulate import simulate_planar
from mechanics.planar.simulation import PlanarSimulation
from mechanics.scene.scene import Method, SolverSettings
from tests.mechanics.planar.shapes import box, grid_of_disks

FLOOR = Wall("floor", (-10.0, 0.0), (10.0, 0.0))


def column(count, top=2400.0):
    """Disks on top of each other, the last of its own density."""
    return tuple(
        Disk(f"d{n}", (0.0, 0.1 + 0.2 * n), 0.1, top if n == count - 1 else 2400.0) for n in range(count)
    )


@pytest.mark.parametrize(
    "disks",
    [column(100), column(2, 2.4e7), column(2, 2.4e9)],
    ids=["stack of 100", "10^4 on 1", "10^6 on 1"],
)
def test_tall_and_heavy_columns_rest_at_the_default_settings(disks):
    result = simulate_planar(PlanarScene("column", disks, (FLOOR,), time=PlanarTime(1e-3, 1.0, 0.02)))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.errors.unconverged_steps == 0
    assert result.reaction == pytest.approx(result.weight, rel=1e-4)


def first_steps(scene, count):
    model, start = build_planar_model(scene)
    simulation = PlanarSimulation(model, start, Clock())
    return [simulation.step() for _ in range(count)]


def test_a_small_heap_is_swept_alone():
    centres, radii = grid_of_disks(4, 3)
    steps = first_steps(box(centres, radii, time=PlanarTime(1e-3, 1.0), solver=SolverSettings()), 60)
    assert any(step.solution.iterations for step in steps)
    assert all(step.solution.converged for step in steps)
    assert {step.solution.why for step in steps} == {"sweeps: start"}


def test_few_iterations_are_sweeps_alone_with_the_same_bits():
    disks = column(40)
    runs = [
        first_steps(
            PlanarScene("column", disks, (FLOOR,), solver=SolverSettings(method, max_iterations=60)), 5
        )
        for method in (Method.AUTO, Method.NSGS)
    ]
    for one, other in zip(*runs, strict=True):
        assert not one.solution.converged
        np.testing.assert_array_equal(one.impulse, other.impulse)


def test_iterations_of_all_methods_together_are_at_most_those_allowed():
    scene = PlanarScene("column", column(100), (FLOOR,), solver=SolverSettings(max_iterations=550))
    solution = first_steps(scene, 1)[0].solution
    assert solution.iterations == 550
    assert not solution.converged
    assert solution.why.startswith(("admm of disks: sweeps stood", "sweeps: start"))
