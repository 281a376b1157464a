"""Summary and results by stone of a run whose numbers are known."""

import json
from dataclasses import replace

import numpy as np
import pytest

from archmodel.quantities import quantities_of
from pipelines.results.stone_values import stone_results, stress_statistics
from pipelines.results.summary import as_json, summarise
from tests.pipelines.results_by_hand import LIMESTONE, deformable_body, result_of, rigid_body

STILL = (0.0, 0.0, 0.0)


def test_the_volume_of_the_nodes_is_the_volume_of_the_stone(mixed):
    assert mixed.bodies[1].node_volume.sum() == pytest.approx(2.0)


def test_stress_statistics_are_weighted_by_volume(mixed):
    statistics = stress_statistics(mixed)
    assert statistics.max == pytest.approx(2e6)
    assert statistics.mean == pytest.approx(1e6)  # a linear field's volume mean is its middle value
    assert statistics.mean < statistics.p99 <= statistics.max


def test_stress_statistics_count_volume_not_nodes():
    """3 MPa in 1 m³ of a fine mesh and 1 MPa in 3 m³ of a coarse one: 1.5 MPa on average."""
    fine = deformable_body("fine", (0, 0, 0), (1, 1, 1), lambda p: np.full(len(p), 3e6), 0.25)
    coarse = deformable_body("coarse", (2, 0, 0), (5, 1, 1), lambda p: np.full(len(p), 1e6), 1.0)
    statistics = stress_statistics(result_of([fine, coarse], pairs=(), forces=()))
    assert (statistics.mean, statistics.p99, statistics.max) == pytest.approx((1.5e6, 3e6, 3e6))


def test_every_stone_has_its_result(mixed):
    base, elastic, top = stone_results(mixed)
    assert (base.code, base.fidelity, base.von_mises_max) == ("base", "fixed", None)
    assert elastic.von_mises_max == pytest.approx(2e6)
    assert elastic.von_mises_mean == pytest.approx(1e6)
    assert elastic.contact_force_max == pytest.approx(3000.0)
    assert top.displacement_max == pytest.approx(0.005)
    assert top.contact_force_max == pytest.approx(1000.0)


def test_a_stone_without_contact_has_no_contact_force():
    alone = result_of([rigid_body("a", (0, 0, 0), (1, 1, 1))], pairs=(), forces=())
    assert stone_results(alone)[0].contact_force_max is None


def test_the_summary_has_its_keys_and_says_nothing_that_json_cannot(mixed):
    summary = json.loads(as_json(summarise(mixed, version="1.2", seconds={"mesh": 0.5, "solve": 1.5})))
    assert summary["scene"] == "by hand"
    assert summary["outcome"] == "equilibrium"
    assert summary["bodies"] == {"rigid": 1, "deformable": 1, "fixed": 1}
    assert summary["contacts"] == 2
    assert summary["steps"] == 10
    stages = {"mesh": 0.5, "solve": 1.5}
    assert summary["time"] == {"simulated": 0.1, "rest": 0.06, "wall": 2.0, "by_stage": stages}
    assert summary["energies"] == {"external": 5.0, "contact": -4.0, "scheme": 1.0}
    assert summary["settlement"]["max"] == pytest.approx(1e-5)
    assert set(summary["errors"]) >= {"natural_map", "penetration", "balance", "reaction", "energy"}
    assert summary["errors"]["energy"] is None  # not a number
    assert summary["von_mises"]["max"] == pytest.approx(2e6)
    assert summary["displacement"]["max"] == pytest.approx(0.005)
    assert summary["reaction"] == {"total_vertical": 20010.0, "weight": 20000.0}


def test_without_deformable_stones_there_is_no_stress(rigid):
    assert summarise(rigid, version="1", seconds={})["von_mises"] is None


def test_the_summary_names_the_stone_of_each_extreme_stress():
    """Three stones between ±1, ±2 and ±3 MPa upright: the extremes of each kind are those of different stones."""
    strong = replace(LIMESTONE, tensile_strength=10e6, compressive_strength=10e6)
    weak = replace(LIMESTONE, tensile_strength=1e6, compressive_strength=10e6)
    bodies = [
        deformable_body(
            "pulled", (0, 0, 0), (1, 1, 1), lambda p: 1e6 - 4e6 * p[:, 2], 0.5, STILL, strong, 0.2
        ),
        deformable_body("pressed", (2, 0, 0), (3, 1, 1), lambda p: 4e6 * p[:, 2], 0.5, STILL, strong, 0.1),
        deformable_body("used", (4, 0, 0), (5, 1, 1), lambda p: -2e6 * p[:, 2], 0.5, STILL, weak, 0.3),
    ]
    summary = summarise(result_of(bodies, pairs=(), forces=()), version="1", seconds={})
    stress = summary["stress"]
    assert (stress["tension"]["stone"], stress["tension"]["value"]) == ("pulled", pytest.approx(3e6))
    assert (stress["compression"]["stone"], stress["compression"]["value"]) == (
        "pressed",
        pytest.approx(-4e6),
    )
    assert stress["utilisation"] == {"value": pytest.approx(2.0), "stone": "used", "governing": "tension"}
    assert stress["error"] == {"value": pytest.approx(0.3), "stone": "used"}


def test_the_summary_counts_compressed_joints_outside_the_kern():
    """Resultants at 0.6, 1.2, 1.8 and 2.4 of the kern; the last joint bears nothing."""
    stones = [rigid_body(f"S{k}", (0, 0, k), (1, 1, k + 1)) for k in range(5)]
    forces = np.tile([0.0, 0.0, 1000.0], (4, 1))
    result = result_of(stones, pairs=[(k + 1, k) for k in range(4)], forces=forces)
    kern = np.append(result.joints.kern[:3], np.nan)
    parted = np.array([False, False, False, True])
    joints = summarise(
        replace(result, joints=replace(result.joints, kern=kern, parted=parted)), version="1", seconds={}
    )["joints"]
    assert (joints["count"], joints["pressed"], joints["out_of_kern"], joints["parted"]) == (4, 3, 2, 1)


def test_the_largest_displacement_is_that_of_the_point_that_went_farthest():
    """A stone 2 m high that grows by 5 mm/m: its base stays, its top rises by 10 mm."""
    stone = rigid_body("a", (0, 0, 0), (1, 1, 2))
    lifted = stone.reference * [1.0, 1.0, 1.005]
    result = result_of([replace(stone, position=lifted)], pairs=(), forces=())
    assert summarise(result, version="1", seconds={})["displacement"]["max"] == pytest.approx(0.01)
    assert stone_results(result)[0].displacement_max == pytest.approx(0.01)


# counts by name, the seconds of the machine, what the user has set, and tables with keys of their own
_NOT_RESULTS = (
    *("bodies", "time.by_stage", "time.wall", "solver", "static", "profile", "version", "loads"),
    "admissible",
)
_TABLES = ("errors", "peaks", "structures", "stages", "rocking")


def numbers(value, path=""):
    """Paths of the numbers of a mapping, of lists too; a value that is not known counts."""
    if isinstance(value, dict):
        for key, entry in value.items():
            yield from numbers(entry, f"{path}.{key}" if path else key)
    elif value is None or (isinstance(value, int | float) and not isinstance(value, bool)):
        yield path


def test_every_number_of_the_summary_is_in_the_catalogue(mixed):
    summary = summarise(mixed, version="1.2", seconds={"solve": 1.5})
    results = {path for path in numbers(summary) if not path.startswith((*_NOT_RESULTS, *_TABLES))} - {
        "joints.slivers.limit",
        "stress.utilisation.stone",
        "stress.utilisation.governing",
    }
    assert results == set(quantities_of("summary"))
    # the errors have a bearer of their own
    assert set(summary["errors"]) == set(quantities_of("run"))
