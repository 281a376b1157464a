"""Wedges that a wall pushes over their base: stable (case G4), and at their critical taper (case G6)."""

import numpy as np
import pytest

from benchmarks.taper import critical_slope
from pipelines.geology.run import run_geology
from tests.paths import ROOT

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


def test_a_wedge_that_is_pushed_takes_its_critical_taper(tmp_path):
    """Case G6: at β = 0 the slope is that of Dahlen (1984), within 1.5°.

    The internal friction is that of the same disks in biaxial compression at large strain, the basal one that of the
    forces on the base in the run. The wedge starts below its taper, deforms until it has it, and slides on from there.
    """
    shipped = {
        kind: (ROOT / f"data/samples/geology/{kind}.toml").read_text(encoding="utf-8")
        for kind in ("taper", "biaxial")
    }
    sizes = ("smallest = 0.42", "smallest = 0.3"), ("largest = 0.56", "largest = 0.66")
    for old, new in (*sizes, ("falling_friction = 0.05", "falling_friction = 0.4")):
        assert old in shipped["biaxial"]
        shipped["biaxial"] = shipped["biaxial"].replace(old, new)
    found = {}
    for name, kind in (("taper", "wedge"), ("biaxial", "biaxial")):
        scene = tmp_path / f"{name}.toml"
        scene.write_text(shipped[name] + "figures = false\n", encoding="utf-8")
        found[name] = run_geology(scene, kind, tmp_path / name).summary["measures"]
    internal = np.radians(found["biaxial"]["friction angle [°]"])
    basal = np.radians(found["taper"]["friction angle of the base [°]"])
    # the base slides at Coulomb's limit, or disks roll over it at less
    assert 0.9 * np.arctan(0.2) < basal < 1.02 * np.arctan(0.2)
    slope = found["taper"]["slope [°]"]
    assert slope > found["taper"]["slope at the start [°]"] + 1.5
    assert slope == pytest.approx(np.degrees(critical_slope(internal, basal)), abs=1.5)
