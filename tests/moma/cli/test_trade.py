"""`moma trade`: what it runs, prints and keeps, that it goes on where it stopped, and that it leaves nothing behind."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

from mechanics.stones.meshing.elements import Element
from pipelines.assess.workers import pool
from pipelines.ingest.ingest import ingest
from pipelines.results.quantities import QUANTITIES
from pipelines.tradeoff import study as trade_module
from pipelines.tradeoff.grid import Variant, grid
from pipelines.tuning.overlay import Overlay
from tests.moma.commands import invoke
from tests.paths import ROOT

SCENE = """
[scene]
name = "Corner of two courses"
[select]
where = ["course <= 2 and x < 11.4"]
[materials.limestone]
density = 2350.0
young = 12e9
poisson = 0.2
[bodies]
default = "deformable"
fixed = ["course = 1"]
[mesh]
size = 0.3
element = "tet10"
[time]
start = "equilibrium"
step = 0.003
relaxation = true
[solver]
velocity_tolerance = 1e-4
"""
TRIED = ("rigid", "hex20, 1 cell")
TOO_FINE = "too fine"
PATIENCE = 120.0
JOBS = min(2, os.cpu_count() or 1)


def few_settings(scene, blocks, width, stress=False):
    """Two of the usual settings, and one that no memory holds."""
    chosen = [one for one in grid(scene, blocks, width, stress) if one.name in TRIED]
    finest = Overlay(element=Element.HEX8, cells=1e5)
    return (*chosen, Variant(TOO_FINE, finest, 100.0, Element.HEX8, 1e-5, 1e-5, 3e-3, 1e-6, 4))


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A database with the sample, and a scene."""
    folder = tmp_path_factory.mktemp("trade")
    ingest([ROOT / "data/samples/window/window.moma"], f"sqlite:///{folder / 'window.db'}")
    (folder / "corner.toml").write_text(SCENE, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def study(place):
    """The command line of a study that has been run, and what it said."""
    arguments = (place / "corner.toml", "--db", f"sqlite:///{place / 'window.db'}", "--out", place / "study")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trade_module, "grid", few_settings)
        done = invoke(
            "trade",
            *arguments,
            "--error",
            "0.5",
            "--budget",
            "20",
            "--of",
            "support_reactions",
            "--jobs",
            JOBS,
        )
    assert done.exit_code == 0, done.output
    return arguments, done


def settings_of(folder):
    record = json.loads((folder / "trade.json").read_text(encoding="utf-8"))
    return record, {row["setting"]: row for row in record["rows"]}


def test_every_setting_is_a_row_with_its_costs_and_errors(study, place):
    record, rows = settings_of(place / "study")
    assert set(rows) == {*TRIED, TOO_FINE}
    for name in TRIED:
        assert rows[name]["status"] == "done"
        assert rows[name]["cpu"] > 0.0
        assert rows[name]["memory"] > 50 * 2**20  # numpy alone takes as much
        assert set(rows[name]["errors"]) == set(QUANTITIES)
    assert rows["rigid"]["nodes"] == 0 < rows["hex20, 1 cell"]["nodes"]
    assert rows["rigid"]["errors"]["von_mises_p99"] is None
    assert rows["rigid"]["errors"]["support_reactions"] > 0.0
    assert record["reference"]["name"] == "hex20, 1 cell"
    assert record["spent"] <= record["budget"]


def test_a_run_that_fails_is_a_row_with_its_reason(study, place):
    _, rows = settings_of(place / "study")
    assert rows[TOO_FINE]["status"] == "failed"
    assert "mesh" in rows[TOO_FINE]["reason"] or "memory" in rows[TOO_FINE]["reason"]
    assert f"failed: {TOO_FINE}: " in study[1].stdout


def test_the_table_is_for_people_and_the_files_for_programs(study, place):
    text = study[1].stdout
    assert "hex20, 1 cell (reference)" in text
    assert "its own error is not known, only estimated" in text
    for name in ("trade.csv", "trade.json", "trade.png"):
        assert str(place / "study" / name) in text
    assert (place / "study/trade.png").read_bytes().startswith(b"\x89PNG")
    listed = list(csv.DictReader((place / "study/trade.csv").read_text(encoding="utf-8").splitlines()))
    _, rows = settings_of(place / "study")
    assert [one["setting"] for one in listed] == list(rows)
    assert float(listed[0]["cpu"]) == rows[listed[0]["setting"]]["cpu"]
    by_name = {one["setting"]: one for one in listed}
    assert by_name["rigid"]["error_support_reactions"] != ""


def test_a_study_that_is_done_is_printed_again_and_nothing_runs(study, monkeypatch):
    arguments, first = study
    monkeypatch.setattr(trade_module, "grid", few_settings)
    monkeypatch.setattr(pool.Worker, "_start", None)  # no process can be begun
    again = invoke(
        "trade", *arguments, "--error", "0.5", "--budget", "20", "--of", "support_reactions", "--jobs", JOBS
    )
    assert again.exit_code == 0, again.output
    assert again.stdout == first.stdout
    told = json.loads(
        invoke("trade", *arguments, "--budget", "20", "--of", "support_reactions", "--json").stdout
    )
    assert told["asked_error"] == 0.05
    assert {row["setting"] for row in told["rows"]} == {*TRIED, TOO_FINE}


def test_another_scene_in_the_same_folder_is_another_study(study, place, monkeypatch):
    arguments, _ = study
    other = place / "corner.toml"
    monkeypatch.setattr(trade_module, "grid", few_settings)
    other.write_text(SCENE.replace("young = 12e9", "young = 13e9"), encoding="utf-8")
    try:
        done = invoke("trade", *arguments, "--budget", "1e-6", "--json")
    finally:
        other.write_text(SCENE, encoding="utf-8")
    assert done.exit_code == 1  # nothing is known of it, and there was no time
    assert {row["status"] for row in json.loads(done.stdout)["rows"]} <= {"not begun", "stopped"}


def test_what_is_recommended_can_be_pasted(study, place):
    record, _ = settings_of(place / "study")
    if record["recommended"] is not None and record["recommended"]["lines"]:
        tomllib.loads(record["recommended"]["lines"])
    lines = study[1].stdout
    assert ("no recommendation" in lines) == (record["recommended"] is None)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--of", "von_mises_p98"), "did you mean 'von_mises_p99'"),
        (("--jobs", "0"), "--jobs: 0 runs at a time"),
        (("--jobs", "100000"), "--jobs: 100000 runs at a time"),
        (("--budget", "0"), "--budget: 0 is not above zero"),
        (("--budget", "nan"), "--budget: nan"),
        (("--error", "-1"), "--error: -1 is not above zero"),
    ],
)
def test_wrong_use_ends_in_2_before_anything_runs(place, arguments, said):
    done = invoke("trade", place / "corner.toml", *arguments)
    assert done.exit_code == 2, done.output
    assert said in done.stderr
    assert done.stdout == ""


def test_a_folder_with_other_things_is_left_alone(place, tmp_path):
    (tmp_path / "letter.txt").write_text("dear", encoding="utf-8")
    url = f"sqlite:///{place / 'window.db'}"
    done = invoke("trade", place / "corner.toml", "--db", url, "--out", tmp_path)
    assert done.exit_code == 2
    assert "holds what no study of MOMA wrote" in done.stderr
    done = invoke("trade", place / "corner.toml", "--db", url, "--out", tmp_path / "letter.txt")
    assert done.exit_code == 2
    assert [one.name for one in tmp_path.iterdir()] == ["letter.txt"]


def test_tradeoff_is_another_name_that_help_does_not_list(place):
    arguments = (str(place / "none.toml"), "--out", str(place / "none"))
    results = [invoke(name, *arguments) for name in ("trade", "tradeoff")]
    assert [one.exit_code for one in results] == [2, 2]
    assert results[0].output == results[1].output
    assert "tradeoff" not in invoke("--help").output


def test_a_scene_that_is_not_there_is_wrong_use(place):
    assert invoke("trade", place / "none.toml", "--db", f"sqlite:///{place / 'window.db'}").exit_code == 2


def children(pid):
    """Processes whose parent is this one, that run a setting."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            words = (entry / "cmdline").read_bytes()
        except OSError:
            continue
        if parent == pid and b"spawn_main" in words:
            found.append(int(entry.name))
    return found


def awaited(condition):
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        if found := condition():
            return found
        time.sleep(0.02)
    raise TimeoutError


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGKILL])
def test_whatever_ends_the_study_ends_its_runs(place, tmp_path, ending):
    process = subprocess.Popen(
        [sys.executable, "-m", "moma", "trade", str(place / "corner.toml"), "--out", str(tmp_path / "study")],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT), "MOMA_DB": f"sqlite:///{place / 'window.db'}"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        # whoever runs these tests may ignore interrupts, which processes inherit
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    (child,) = awaited(lambda: children(process.pid))
    process.send_signal(ending)
    _, complaint = process.communicate(timeout=PATIENCE)
    assert process.returncode == (1 if ending is signal.SIGINT else -ending)
    assert (b"the same command resumes from there" in complaint) == (ending is signal.SIGINT)
    awaited(lambda: not Path(f"/proc/{child}").exists() or "Z" in state_of(child))
    for file in (tmp_path / "study").rglob("*"):
        assert file.is_dir() or file.suffix == ".json"
        assert file.is_dir() or json.loads(file.read_text(encoding="utf-8"))


def state_of(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return "Z"
