"""Samples of buildings that have moved: the scene has the causes of the truth, the diagnosis is to find them."""

import json
import tomllib

import numpy as np
import pytest

from pipelines.assess.diagnosis.file import read_diagnosis
from pipelines.scene.file import read_scene
from synthetic import samples, write
from synthetic.buildings.tower import tower_storey
from synthetic.frame import RigidMotion
from synthetic.samples import SAMPLES

MOVED = [name for name, recipe in SAMPLES.items() if recipe.cause is not None]
SMALL = "tower --moved settlement --small"


@pytest.fixture
def written(tmp_path, monkeypatch):
    """A function that writes a sample whose stones stay where they were laid, which takes no simulation."""
    monkeypatch.setattr(samples, "true_movement", lambda cause, progress: {})

    def write_unmoved(name):
        kind, _, moved, *options = name.split()
        write.write_sample(
            kind, tmp_path, moved=moved, small="--small" in options, phases="--phases" in options
        )
        return tmp_path / f"{kind}.toml", tmp_path

    return write_unmoved


@pytest.mark.parametrize("name", MOVED)
def test_the_true_hypothesis_with_the_true_amount_is_the_cause_in_the_scene_and_in_the_truth(name, written):
    path, folder = written(name)
    scene = tomllib.loads(path.read_text(encoding="utf-8"))
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    file = read_diagnosis(folder / "diagnosis.toml")
    read_scene(path)
    assert "loads" not in file.base
    cause = SAMPLES[name].cause
    true = -1 if cause.thrust else 0
    loads = file.hypotheses[true].scene(file.base, (cause.amount,))["loads"]
    for said, tried in zip(scene["loads"], loads, strict=True):
        assert said["type"] == tried["type"]
        assert said["stones"] == tried["stones"]
        if cause.pulse:
            assert said["velocity"]["time"] == tried["velocity"]["time"]
            peak = said["velocity"]["value"][1]
            assert peak == pytest.approx(tried["velocity"]["value"][1], abs=1e-6)
            assert truth["jerk"] == peak
            assert np.linalg.norm(peak) == pytest.approx(cause.pulse, abs=1e-6)
            assert scene["time"]["relaxation"] is False
        elif cause.thrust:
            # directions of the formulas have six digits
            assert said["force"] == pytest.approx(tried["force"], abs=2e-3)
            assert truth["forces"][said["stones"][0]] == said["force"]
        else:
            assert said["duration"] == tried["duration"]
            # shares of the formulas have four digits
            assert said["displacement"] == pytest.approx(tried["displacement"], abs=2e-6)
            assert truth["settlement"][said["stones"][0]] == said["displacement"][2]
    if not cause.pulse:
        assert len(scene["loads"]) == len(truth["forces" if cause.thrust else "settlement"])
    assert len({one.name for one in file.hypotheses}) == len(file.hypotheses) >= 3


def test_the_ground_of_the_storey_sinks_about_its_left_corner():
    cause = SAMPLES[SMALL].cause
    site = cause.build({}, None)
    solids = {solid.code: solid for solid in site.building.solids}
    corner = np.append(tower_storey(12).corners[0][:2], 0.0)
    apart = {
        code: np.hypot(*(solids[code].vertices.mean(axis=0) - corner)[:2]) for code in site.building.base
    }
    assert {code for code, distance in apart.items() if distance < 2.5} == set(site.settled)
    for code, share in site.settled.items():
        assert share == pytest.approx(1.0 - apart[code] / 2.5, abs=1e-3)
    # under both facings of both walls that meet there
    assert {code[:2] for code in site.settled} == {"AO", "AI", "BO", "BI"}


def test_a_storey_that_has_moved_is_the_same_storey_measured_elsewhere():
    cause = SAMPLES[SMALL].cause
    laid = cause.build({}, None)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(0.01), -np.sin(0.01)], [0.0, np.sin(0.01), np.cos(0.01)]])
    motion = RigidMotion(turn, np.array([0.1, -0.2, 0.3]))
    moved = cause.build(dict.fromkeys((one.code for one in laid.building.solids), motion), None)
    assert moved.settled == laid.settled
    for before, after in zip(laid.building.survey.blocks, moved.building.survey.blocks, strict=True):
        # noise lies along the axes of the site, and is rounded with the points to a tenth of a millimetre
        assert np.abs(motion.place(before.vertices) - after.vertices).max() < 5e-4
    again = cause.build(dict.fromkeys((one.code for one in laid.building.solids), motion), 7)
    assert all(
        np.array_equal(one.vertices, other.vertices)
        for one, other in zip(moved.building.solids, again.building.solids, strict=True)
    )
    assert any(
        one.points.shape != other.points.shape or not np.allclose(one.points, other.points)
        for one, other in zip(moved.building.survey.blocks, again.building.survey.blocks, strict=True)
    )
