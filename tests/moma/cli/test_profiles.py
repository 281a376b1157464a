"""`moma run` and `moma check` with `--profile`: what they print, and what they write of it."""

import json

import pytest

from pipelines.ingest.ingest import ingest
from pipelines.tuning.measured_errors import ERRORS
from tests.moma.commands import answer, invoke, prints
from tests.paths import ROOT
from tests.pipelines.scenes import TWO_COURSES_MIXED

SURVEY = ROOT / "data/samples/window/window.moma"
SCENE = (
    TWO_COURSES_MIXED
    + """\
[time]
step = 0.05
start = "equilibrium"
[output]
pictures = []
"""
)


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with a scene, and the sample in a database."""
    folder = tmp_path_factory.mktemp("profiles")
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    ingest([SURVEY], f"sqlite:///{folder / 'moma.db'}")
    return folder


def scene_in(place):
    """The scene and the database of a folder, as words of a command."""
    return place / "scene.toml", "--db", f"sqlite:///{place / 'moma.db'}"


def test_a_run_at_a_profile_tells_what_error_to_expect_and_what_was_reached(place):
    lines = prints("run", *scene_in(place), "--profile", "fast", "--out", place / "fast").splitlines()
    said = [number for number, line in enumerate(lines) if line.startswith("  profile fast: does it stand")]
    assert len(said) == 1
    assert lines[said[0] + 1].startswith("  expected errors, as measured on other scenes: ")
    assert "joint_forces " in lines[said[0] + 1]
    assert "collapse up to " in lines[said[0] + 1]
    assert lines[said[0] + 2].startswith("  errors: natural_map ")
    assert "stress " in lines[said[0] + 2]  # one stone deforms, as a list says
    summary = json.loads((place / "fast/summary.json").read_text(encoding="utf-8"))
    profile = summary["profile"]
    assert profile["name"] == "fast"
    assert (profile["settings"]["step"], profile["settings"]["fidelity"]) == (0.01, "rigid")
    assert summary["bodies"]["deformable"] == 1
    assert summary["time"]["simulated"] == pytest.approx(0.01 * summary["steps"])
    assert 0.0 < summary["errors"]["stress"] < 1.0
    for one in profile["expected"].values():
        assert 0.0 < one["value"] <= 1.0
        assert one["of"]
    page = (place / "fast/report.html").read_text(encoding="utf-8")
    assert "<h2>Profile: fast</h2>" in page
    assert "step 0.01" in page
    assert "Error to expect" in page


def test_without_a_profile_a_scene_runs_as_it_is_written(place):
    summary = answer("run", *scene_in(place), "--out", place / "plain")
    assert summary["profile"] is None
    assert summary["time"]["simulated"] == pytest.approx(0.05 * summary["steps"])
    assert "Profile" not in (place / "plain/report.html").read_text(encoding="utf-8")


def test_check_counts_what_the_profile_needs(place):
    plain, accurate = (answer("check", *scene_in(place), *words) for words in ((), ("--profile", "accurate")))
    assert plain["bodies"]["deformable"] == 1
    assert accurate["bodies"]["rigid"] == 0
    assert accurate["cost"]["unknowns"] > 3 * plain["cost"]["unknowns"]
    assert (plain["cost"]["step"], accurate["cost"]["step"]) == (0.05, 0.002)


def test_check_says_how_a_profile_was_measured(place):
    text = prints("check", *scene_in(place), "--profile", "balanced")
    (line,) = (one for one in text.splitlines() if one.startswith("  its errors on the scenes"))
    _, low, high = ERRORS["balanced"]["stone_von_mises_p99"]
    assert f"stone_von_mises_p99 {100 * low:.1f} % to {100 * high:.0f} %" in line
    assert "profile" not in invoke("check", *scene_in(place)).stdout


def test_a_wrong_name_is_told_with_the_right_ones(place):
    for command in ("run", "check"):
        done = invoke(command, *scene_in(place), "--profile", "quick")
        assert done.exit_code == 2
        assert all(name in done.output for name in ("fast", "balanced", "accurate"))
