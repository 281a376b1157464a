"""The generated tower: stones that fit, contacts that are all found, a record that repeats, a step that is timed."""

import json
import sys

import numpy as np
import pytest

from benchmarks import tower as benchmark
from benchmarks.tower import BASE, earthquake, expected_contacts, strongest, tower, tower_blocks
from mechanics.dynamics.contact_search import detector
from mechanics.model.model import build_model
from mechanics.scene.scene import Scene


@pytest.mark.parametrize("blocks", [300, 2000])
def test_the_stones_of_the_tower_fit_and_all_their_contacts_are_found(blocks):
    shape = tower(blocks)
    assert len(shape.low) == pytest.approx(blocks, rel=0.1)
    filled = np.zeros(shape.high.max(axis=0), dtype=int)
    for low, high in zip(shape.low, shape.high, strict=True):
        filled[low[0] : high[0], low[1] : high[1], low[2] : high[2]] += 1
    assert filled.max() == 1
    # hollow inside, open at the door
    middle = filled.shape[0] // 2
    assert not filled[middle, middle].any()
    assert not filled[middle, 0, 0]
    model, start = build_model(Scene("tower", tower_blocks(shape)))
    contacts = detector(model)(start, np.zeros(len(model.mass)))
    assert len(contacts) == expected_contacts(shape)


def test_the_earthquake_is_the_same_every_time_and_its_strongest_part_the_motion():
    first, again = earthquake(), earthquake()
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.acceleration, other.acceleration)
        assert one.duration == pytest.approx(30.0)
    assert [one.peak for one in first] == pytest.approx([3.5, 3.0, 1.5])
    assert not np.array_equal(earthquake(2)[0].acceleration, first[0].acceleration)
    motion = strongest(first, 0.5, rest=0.01)
    assert motion.stones == {BASE}
    assert not motion.pose(0.01).displacement.any()
    power = [float((part.record.acceleration**2).sum()) for part in motion.components]
    whole = [float((one.acceleration**2).sum()) for one in first]
    assert sum(power) > 3 * sum(whole) * 0.5 / 30.0


def test_the_benchmark_reports_every_step_of_motion(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["tower", "--blocks", "100", "--steps", "2", "--json"])
    benchmark.main()
    (row,) = json.loads(capsys.readouterr().out)
    assert row["contacts"] == row["expected"]
    assert (row["steps"], row["above"], row["unconverged"]) == (2, 0, 0)
    assert row["hours"] == pytest.approx(row["wall_s"] * 30.0 / 5e-3 / 3600)


def test_the_tower_may_stand_on_springs(monkeypatch, capsys):
    monkeypatch.setattr(
        sys, "argv", ["tower", "--blocks", "100", "--steps", "2", "--stiffness", "1e10", "--json"]
    )
    benchmark.main()
    (row,) = json.loads(capsys.readouterr().out)
    assert (row["steps"], row["above"], row["unconverged"]) == (2, 0, 0)


def test_the_benchmark_ends_a_motion_early_and_says_after_how_many_steps(monkeypatch, capsys):
    monkeypatch.setattr(
        sys, "argv", ["tower", "--blocks", "100", "300", "--steps", "5", "--seconds", "0", "--json"]
    )
    benchmark.main()
    rows = json.loads(capsys.readouterr().out)
    assert [row["steps"] for row in rows] == [1, 1]
    assert rows[0]["blocks"] < rows[1]["blocks"]
