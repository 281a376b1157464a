"""Stored runs of a study: written whole or not at all, read back the same, and of this scene only."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ground.errors import UsageError
from mechanics.scene.loads.gravity import TiltingTable
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import Fidelity, Method, Scene
from pipelines.tradeoff.store import Measured, Status, Store, study_key
from pipelines.tuning.overlay import Overlay
from tests.pipelines.tradeoff.test_grid import blocks
from tests.pipelines.tradeoff.test_pareto import quantities_of

DONE = Measured(
    name="rigid",
    overlay=Overlay(fidelity=Fidelity.RIGID, method=Method.NSGS, tolerance=1e-4),
    status=Status.DONE,
    elapsed=3.5,
    budget=600.0,
    cpu=1.25,
    wall=1.5,
    memory=2**28,
    steps=12,
    stages={"solve": 1.0},
    quantities=quantities_of(2e5),
)
FAILED = Measured("fine", Overlay(cells=9.0), Status.FAILED, 1.0, 600.0, "stone A: no mesh")


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path / "study", "this")
    store.prepare()
    return store


def test_runs_read_back_as_they_were(store):
    for run in (DONE, FAILED):
        store.keep(run)
    assert store.load() == {"rigid": DONE, "fine": FAILED}
    store.keep(replace(FAILED, status=Status.STOPPED))
    assert store.load()["fine"].status is Status.STOPPED  # the later one counts


def test_runs_of_another_scene_are_left_alone(store):
    other = Store(store.folder, "other")
    other.keep(DONE)
    store.keep(FAILED)
    assert set(store.load()) == {"fine"}
    assert set(other.load()) == {"rigid"}


@pytest.mark.parametrize(
    "content", ["", "{", "[]", "{}", '{"study": "this"}', '{"study": "this", "name": 3}']
)
def test_a_file_that_is_no_result_is_measured_again(store, content):
    store.keep(DONE)
    (store.folder / "runs/strange.json").write_text(content, encoding="utf-8")
    assert store.load() == {"rigid": DONE}


def test_a_file_that_cannot_be_finished_leaves_the_old_one(store, monkeypatch):
    store.write("trade.csv", b"old")

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(UsageError, match="No space left"):
        store.write("trade.csv", b"new")
    assert [one.name for one in store.folder.iterdir() if one.is_file()] == ["trade.csv"]
    assert (store.folder / "trade.csv").read_bytes() == b"old"


def test_what_is_kept_is_json_for_anyone(store):
    store.keep(DONE)
    (file,) = (store.folder / "runs").iterdir()
    record = json.loads(file.read_text(encoding="utf-8"))
    assert record["overlay"] == {"fidelity": "rigid", "method": "nsgs", "tolerance": 1e-4}
    assert record["quantities"]["von_mises_p99"] == 2e5


def key(text, scene):
    return study_key(SimpleNamespace(text=text), SimpleNamespace(scene=scene))


def test_the_key_is_of_scene_stones_and_loads():
    scene = Scene("wall", tuple(blocks(Fidelity.RIGID)))
    same = Scene("wall", tuple(blocks(Fidelity.RIGID)))
    assert key("text", scene) == key("text", same)
    moved = blocks(Fidelity.RIGID)
    moved[1] = replace(moved[1], vertices=moved[1].vertices + np.array([0.0, 0.0, 1e-9]))
    tilted = Loads(gravity=(TiltingTable.at_rate_degrees((0.0, 1.0, 0.0), rate=2.0, limit=35.0),))
    others = [
        key("another text", scene),
        key("text", replace(scene, blocks=tuple(moved))),
        key("text", replace(scene, blocks=scene.blocks[:2])),
        key("text", replace(scene, loads=tilted)),
        key("text", replace(scene, loads=Loads(gravity=(replace(tilted.gravity[0]),)))),
    ]
    assert key("text", scene) not in others
    assert others[3] == others[4]
    assert len(set(others)) == 4
