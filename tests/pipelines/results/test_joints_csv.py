"""joints.csv and the joints in summary.json."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from mechanics.results.joints import SLIVER
from mechanics.stones.materials import Material
from pipelines.results.run_csv import JOINT_COLUMNS, write_joints
from pipelines.results.stone_values import stone_results
from pipelines.results.summary import summarise
from tests.pipelines.results_by_hand import deformable_body, result_of, rigid_body

STRONG = Material("marble", 2000.0, 1e10, 0.2, tensile_strength=1e6, compressive_strength=8e6)


@pytest.fixture
def column():
    """Two stones on a base; the resultant is within the kern of the lower joint, and outside that of the upper one."""
    return result_of(
        [
            rigid_body("base", (0, 0, 0), (1, 1, 1)),
            deformable_body(
                "D1", (0, 0, 1), (1, 1, 3), lambda points: 2e6 * (points[:, 2] - 1.0), 0.5, material=STRONG
            ),
            rigid_body("top", (0, 0, 3), (1, 1, 4)),
        ],
        pairs=((1, 0), (2, 1)),
        forces=((0.0, 0.0, 3000.0), (0.0, 600.0, 800.0)),
        material=STRONG,
    )


def test_every_joint_has_its_line(column, tmp_path):
    write_joints(tmp_path / "joints.csv", column, np.zeros(3))
    with (tmp_path / "joints.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == list(JOINT_COLUMNS)
    lower, upper = rows
    assert (lower["first"], lower["second"]) == ("base", "D1")
    assert (upper["first"], upper["second"]) == ("D1", "top")
    numbers = {name: float(value) for name, value in upper.items() if name not in ("first", "second")}
    assert numbers["z"] == pytest.approx(3.0)
    assert numbers["force_normal"] == pytest.approx(800.0)
    assert numbers["force_shear"] == pytest.approx(600.0)
    assert numbers["eccentricity"] == pytest.approx(0.2)
    assert numbers["kern"] == pytest.approx(1.2)
    assert numbers["sliding"] == pytest.approx(2e-3)
    assert numbers["parted"] == 0.0


def test_places_are_those_of_the_site_to_the_millimetre_and_eccentricities_are_distances(column, tmp_path):
    """In national coordinates; a resultant 0.3 m beside the middle along one axis, 0.4 m along the other."""
    origin = np.array([652_345.678, 6_862_789.123, 1_040.5])
    eccentricity = np.array([[0.3, 0.4], [0.0, -0.2]])
    joints = replace(column.joints, eccentricity=eccentricity)
    write_joints(tmp_path / "joints.csv", replace(column, joints=joints), origin)
    with (tmp_path / "joints.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["eccentricity"]) for row in rows] == pytest.approx([0.5, 0.2])
    for row, centroid in zip(rows, column.joints.centroid + origin, strict=True):
        assert [float(row[axis]) for axis in "xyz"] == pytest.approx(centroid, rel=0, abs=1e-3)


def test_the_summary_tells_the_worst_joint_and_the_worst_stone(column):
    summary = summarise(column, version="1", seconds={})
    assert summary["joints"] == {
        "count": 2,
        "pressed": 2,
        "parted": 0,
        "out_of_kern": 1,
        "largest_opening": pytest.approx(1e-4),
        "largest_sliding": pytest.approx(2e-3),
        "largest_pressure": pytest.approx(4500.0),
        "slivers": dict.fromkeys(("count", "pressed", "force", "largest_force", "largest_pressure"), 0)
        | {"limit": SLIVER},
    }
    stress = summary["stress"]
    assert stress["compression"]["value"] == pytest.approx(-4e6)
    assert stress["compression"]["point"][2] == pytest.approx(3.0)
    assert abs(stress["compression"]["direction"][2]) == pytest.approx(1.0)
    assert stress["tension"]["value"] == pytest.approx(0.0, abs=1e-6)
    assert stress["utilisation"] == {"value": pytest.approx(0.5), "stone": "D1", "governing": "compression"}
    assert stress["error"] == {"value": pytest.approx(0.1), "stone": "D1"}


def test_a_stone_takes_the_worst_of_its_joints_and_its_stresses_to_the_database(column):
    base, elastic, top = stone_results(column)
    assert base.values["joint_kern"] == pytest.approx(0.6)
    assert elastic.values["joint_kern"] == pytest.approx(1.2)
    assert elastic.values["joint_pressure"] == pytest.approx(4500.0)
    assert top.values["joint_sliding"] == pytest.approx(2e-3)
    assert (base.values["joint_opening"], elastic.values["joint_opening"]) == pytest.approx((0.0, 1e-4))
    assert top.values["joint_friction_use"] == pytest.approx(0.5)
    assert elastic.values["stress_error"] == pytest.approx(0.1)
    assert elastic.values["utilisation"] == pytest.approx(0.5)
    assert elastic.values["utilisation_tension"] == pytest.approx(0.0, abs=1e-9)
    assert elastic.values["mean_pressure"] == pytest.approx(2e6 / 3)
    assert "utilisation" not in top.values
