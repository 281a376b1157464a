"""Peaks of stones that rock: said to be one realisation, with those of a run at half the step beside them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion, settlement
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Fidelity
from mechanics.simulate import simulate
from pipelines.results.peaks import realisations, rocking_caution, rocking_stones
from pipelines.results.summary import headline, summarise
from tests.moma.commands import invoke, prints
from tests.paths import ROOT
from tests.pipelines.scenes import TWO_COURSES
from tests.validation.scenes import G, box, dynamic, ground


def shaken(acceleration, step=5e-3):
    """A block of 0.1 by 0.5 m on ground that jerks to and fro for 0.3 s, and stays for 0.3 s."""
    speed = 0.15 * acceleration
    motion = ImposedMotion(
        frozenset({"ground"}),
        History([0.0, 0.15, 0.3], np.outer([0.0, speed, 0.0], [1.0, 0.0, 0.0])),
    )
    blocks = (ground(), box("block", [0, 0, 0], [0.1, 0.1, 0.5]), box("low", [0.5, 0, 0], [1.0, 0.5, 0.2]))
    return dynamic("jerk", blocks, step=step, duration=0.6, loads=Loads(motions=(motion,)), friction=1.5)


@pytest.fixture(scope="module")
def rocked():
    return simulate(shaken(0.25 * G))


def test_a_block_that_rocks_under_a_motion_is_named_and_a_low_one_is_not(rocked):
    assert rocking_stones(rocked) == ["block"]
    said = rocking_caution(rocked)
    assert said.startswith("1 stones rock, e.g. block: their peaks are one realisation")
    assert said.endswith("moma run --repeat-half-step tells how far apart")
    told = summarise(rocked, version="0", seconds={})["rocking"]
    assert told["stones"] == ["block"]
    assert [one["step"] for one in told["realisations"]] == [5e-3]


def test_the_peaks_of_a_run_at_half_the_step_stand_beside_the_first(rocked):
    both = replace(rocked, repeated=simulate(shaken(0.25 * G, step=2.5e-3)))
    first, second = realisations(both)
    assert (first["step"], second["step"]) == (5e-3, 2.5e-3)
    said = rocking_caution(both)
    assert "with steps of 5 and 2.5 ms: " in said
    lifted = [1e3 * one["peaks"]["opening"] for one in (first, second)]
    assert f"opening of a joint {lifted[0]:.3g} and {lifted[1]:.3g} mm" in said
    assert "realisation" not in headline(both)


def test_no_word_where_nothing_rocks():
    still = simulate(shaken(0.1 * G))
    assert rocking_stones(still) == []
    assert rocking_caution(still) == ""
    # a support that sinks for good opens the joints of the beam on it
    low, high = [-0.5, 0, -0.5], [0.0, 0.4, 0.0]
    supports = [box("left", low, high, fidelity=Fidelity.FIXED)]
    supports.append(box("right", [0.6, 0, -0.5], [1.1, 0.4, 0.0], fidelity=Fidelity.FIXED))
    motion = settlement(frozenset({"right"}), (0.0, 0.0, -0.02), 0.3)
    scene = dynamic(
        "beam",
        (*supports, box("beam", [-0.3, 0, 0], [0.9, 0.4, 0.3])),
        step=1e-2,
        theta=1.0,
        duration=1.0,
        loads=Loads(motions=(motion,)),
    )
    sunk = simulate(replace(scene, time=replace(scene.time, stop_at_equilibrium=True)))
    assert sunk.outcome.rests
    assert sunk.peaks.opening.value.max() > 0.005
    assert rocking_stones(sunk) == []


@pytest.mark.slow
def test_a_run_is_repeated_at_half_the_step_where_asked(tmp_path):
    url = f"sqlite:///{tmp_path / 'window.db'}"
    prints("ingest", ROOT / "data/samples/window/window.moma", "--db", url)
    (tmp_path / "a.csv").write_text("0 0\n0.05 6\n0.1 6\n0.15 -6\n0.2 -6\n0.25 0\n")
    motion = '[[loads]]\ntype = "ground_motion"\nstones = ["course = 1"]\ny = "a.csv"\nunit = "m/s²"\n'
    times = "[time]\nduration = 0.3\nstep = 2e-3\n[output]\npictures = []\n"
    (tmp_path / "jerk.toml").write_text(TWO_COURSES + times + motion)
    invoke("run", tmp_path / "jerk.toml", "--out", tmp_path / "out", "--db", url, "--repeat-half-step")
    summary = json.loads((tmp_path / "out/summary.json").read_text())
    first, second = summary["rocking"]["realisations"]
    assert (first["step"], second["step"]) == (2e-3, 1e-3)
    assert any("with steps of 2 and 1 ms: " in one for one in summary["cautions"])
    assert "with steps of 2 and 1 ms: " in (tmp_path / "out/report.html").read_text()
