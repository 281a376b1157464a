"""Summary and results by stone of a run whose numbers are known."""

import json

import pytest

from pipelines.results.stone_values import stone_results, stress_statistics
from pipelines.results.summary import as_json, summarise
from tests.pipelines.results_by_hand import result_of, rigid_body


def test_the_volume_of_the_nodes_is_the_volume_of_the_stone(mixed):
    assert mixed.bodies[1].node_volume.sum() == pytest.approx(2.0)


def test_stress_statistics_are_weighted_by_volume(mixed):
    statistics = stress_statistics(mixed)
    assert statistics.max == pytest.approx(2e6)
    assert statistics.mean == pytest.approx(1e6)  # a linear field's volume mean is its middle value
    assert statistics.mean < statistics.p99 <= statistics.max


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
