"""Contact patch test: a uniform pressure passes through non-matching meshes (Taylor & Papadopoulos 1991)."""

import numpy as np
import pytest
from scenes import G, box, ground

from mechanics.laws.dry_joint import DryJoint
from mechanics.materials import Material
from mechanics.result import Outcome
from mechanics.scene import ContactSettings, Fidelity, Method, Scene, SolverSettings, TimeSettings
from mechanics.simulate import simulate

# two elastic blocks under a plate a thousand times as heavy; with ν = 0 they do not widen, and friction is idle
SOFT = Material("soft", density=1e3, young=1e9, poisson=0.0)
HEAVY = Material("heavy", density=1e6, young=1e9, poisson=0.0)
PRESSURE = 1e6 * G * 0.1


@pytest.mark.parametrize(("lower", "upper"), [(0.25, 0.25), (0.25, 0.1), (0.1, 0.25)])
def test_a_uniform_pressure_passes_through_non_matching_meshes(lower, upper):
    blocks = (
        ground(half=1.0),
        box("lower", [-0.3, -0.25, 0.0], [0.3, 0.25, 0.3], SOFT, Fidelity.DEFORMABLE, lower),
        box("upper", [-0.3, -0.25, 0.3], [0.3, 0.25, 0.7], SOFT, Fidelity.DEFORMABLE, upper),
        box("plate", [-0.3, -0.25, 0.7], [0.3, 0.25, 0.8], HEAVY),
    )
    result = simulate(
        Scene(
            "patch",
            blocks,
            contact=ContactSettings(DryJoint(0.5)),
            time=TimeSettings(step=2e-3, duration=0.4, relaxation=True, balance_tolerance=1e-2),
            solver=SolverSettings(Method.ADMM, tolerance=1e-7),
        )
    )
    assert result.outcome is Outcome.EQUILIBRIUM
    # the blocks' own weight adds at most 0.7 % to the pressure
    own = SOFT.density * G * (0.7 - result.contacts.point[:, 2])
    pressure = np.abs(result.contacts.force[:, 2]) / result.contacts.area / (PRESSURE + own)
    assert np.abs(pressure - 1).max() < 0.005
    for body in result.bodies[1:3]:
        exact = PRESSURE + SOFT.density * G * (0.7 - body.reference[:, 2])
        assert np.abs(body.stress[:, 2] / exact + 1).max() < 0.01
        assert np.abs(np.delete(body.stress, 2, axis=1)).max() < 0.01 * PRESSURE
