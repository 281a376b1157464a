"""Wedges that a wall pushes over their base: stable (case G4), and at their critical taper (case G6)."""

import numpy as np
import pytest

from pipelines.geology.run import run_geology

pytestmark = pytest.mark.slow

BASAL = 16.0  # friction angle of base and wall, as of foil under sand [°]
SCENE = f"""
[sample]
smallest = 0.0006
largest = 0.0008
density = 2600.0

[contact]
friction = 0.5
wall_friction = {np.tan(np.radians(BASAL)):.4f}
rolling = false

[solver]
min_iterations = 100
max_iterations = 200

[output]
fields_every = 250
figures = false
"""


def measures(folder, kind, tables):
    scene = folder / f"{kind}.toml"
    scene.write_text(SCENE + tables, encoding="utf-8")
    return run_geology(scene, kind, folder / kind).summary["measures"]


def test_a_stable_wedge_keeps_its_slope(tmp_path):
    """Case G4: a wedge of 20°, pushed by 4 cm, keeps its slope within 1°, and does not deform within.

    Its slope is above the critical one for thrusting, 5.7° for φ = 30°, and it is not as steep as to spread. Sliding as
    one body it presses on the wall with tan φ_b of its weight, and the wall's friction bears some of that weight.
    """
    wedge = "[time]\nstep = 0.0005\nsteps = 4000\n[wedge]\nheight = 0.03\nslope = 20.0\npush = 0.04\n"
    found = measures(tmp_path, "wedge", wedge)
    assert found["slope at the start [°]"] == pytest.approx(20.0, abs=1.0)
    assert found["slope [°]"] == pytest.approx(found["slope at the start [°]"], abs=1.0)
    assert found["local shear, median [-]"] < 0.01
    assert found["local shear, 95 % [-]"] < 0.05
    area = 0.5 * 0.03**2 / np.tan(np.radians(20.0))
    weight = 0.8 * 2600.0 * 9.81 * area
    assert found["force on the wall [N/m]"] == pytest.approx(np.tan(np.radians(BASAL)) * weight, rel=0.15)
