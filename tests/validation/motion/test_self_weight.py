"""An elastic block under its own weight on a rigid support. Closed form with ν = 0."""

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Fidelity, Scene, SolverSettings, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from tests.validation.scenes import G, box, ground

HEIGHT, DENSITY, YOUNG = 1.0, 2000.0, 1e9


@pytest.fixture(scope="module")
def column():
    material = Material("test", DENSITY, YOUNG, poisson=0.0)
    block = box("block", [-0.25, -0.25, 0.0], [0.25, 0.25, HEIGHT], material, Fidelity.DEFORMABLE, 0.0625)
    return simulate(
        Scene(
            "column",
            (ground(half=1.0), block),
            contact=ContactSettings(DryJoint(0.5)),
            time=TimeSettings(step=1e-2, theta=1.0, duration=1.0, relaxation=True),
            solver=SolverSettings(tolerance=1e-7),
        )
    )


def test_it_comes_to_rest_on_its_support(column):
    weight = DENSITY * G * HEIGHT * 0.5**2
    assert column.outcome is Outcome.EQUILIBRIUM
    assert column.weight == pytest.approx(weight, rel=1e-9)
    assert column.reaction == pytest.approx(weight, rel=1e-3)
    assert column.errors.balance < 1e-4
    assert column.errors.natural_map < 1e-7


def test_its_top_sinks_by_half_of_rho_g_h_squared_over_e(column):
    block = column.bodies[1]
    top = np.isclose(block.reference[:, 2], HEIGHT)
    sinking = -block.displacement[top, 2]
    exact = DENSITY * G * HEIGHT**2 / (2 * YOUNG)
    assert sinking.min() > 0.98 * exact
    assert sinking.max() < 1.02 * exact


def test_its_vertical_stress_grows_linearly_with_depth(column):
    block = column.bodies[1]
    x, y, z = block.reference.T
    exact = -DENSITY * G * (HEIGHT - z)
    inside = (np.abs(z - HEIGHT / 2) < 0.1) & (np.abs(x) < 0.2) & (np.abs(y) < 0.2)
    ratio = block.stress[:, 2] / np.where(exact < 0, exact, np.nan)
    # every node at mid-height inside the block within 2 %, the mean of the whole section much closer
    assert inside.sum() > 10
    assert np.abs(ratio[inside] - 1).max() < 0.02
    section = np.abs(z - HEIGHT / 2) < 0.1
    assert ratio[section].mean() == pytest.approx(1.0, abs=2e-3)
    # and the base carries the whole weight
    base = np.isclose(z, 0.0)
    assert block.stress[base, 2].mean() == pytest.approx(-DENSITY * G * HEIGHT, rel=0.05)
