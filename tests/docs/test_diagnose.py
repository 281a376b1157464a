"""docs/howto/diagnose.md is true: its commands run, print what it shows, and its tables list all keys."""

import json
import re

import pytest

from ground.toml.keys import keys_of
from ground.toml.writer import toml_text
from pipelines.assess.diagnosis.file import DiagnosisTable, HypothesisTable, Unknown, read_diagnosis
from pipelines.scene.file import parse_scene
from tests.docs.pages import blocks, ran
from tests.moma.commands import answer
from tests.paths import ROOT

PAGE = "docs/howto/diagnose.md"
SCENE = """
[materials.limestone]
density = 2350.0
young = 12e9
poisson = 0.2
[bodies]
fixed = ["course = 1"]
[[loads]]
type = "gravity_ramp"
duration = 0.1
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder in which the commands of the page have run, and what each has printed."""
    folder = tmp_path_factory.mktemp("diagnose")
    return folder, ran(folder, "".join(blocks(PAGE, "bash")))


@pytest.mark.slow
def test_the_true_cause_is_found_with_its_amount(place):
    folder, said = place
    (headline,) = blocks(PAGE, "text")
    printed = next(text for line, text in said.items() if line.startswith("moma diagnose"))
    number = re.compile(
        r"^'(.*)' explains .* \(χ² ([\d.]+) of (\d+), ([\d.]+) of .* settlement = ([\d.]+) ± ([\d.]+) m"
    )
    shown, found = number.match(headline), number.match(printed)
    assert found[1] == shown[1] == "the left corner settled"
    assert found[3] == shown[3]
    # the last digits depend on the machine: a wall that cracks has many ways
    for k in (2, 4, 5, 6):
        assert float(found[k]) == pytest.approx(float(shown[k]), rel=0.05)
    assert abs(float(found[5]) - 0.030) <= float(found[6])
    summary = json.loads((folder / "out/small-diagnosis/diagnosis.json").read_text(encoding="utf-8"))
    assert printed.startswith(summary["verdict"])
    assert summary["cpu"] < 60.0
    best, *others = summary["hypotheses"]
    assert best["explains"]
    assert not any(one["explains"] for one in others)
    assert [one["name"] for one in others][-1] in (
        "nothing has moved",
        "a load stood on the upper left corner",
    )
    load = next(one for one in others if one["name"].startswith("a load"))
    assert load["remarks"] == ["not determined, as it moves nothing that was measured: load"]
    assert set(summary["files"]) == {path.name for path in (folder / "out/small-diagnosis").iterdir()}
    assert {"beds-1.png", "best.toml", "hypotheses.csv", "stones.csv"} <= set(summary["files"])
    assert summary["not_told_apart"] == []
    chi2 = sum(group["chi2"] for group in summary["groups"])
    assert chi2 == pytest.approx(best["chi2"], rel=1e-6)


@pytest.mark.slow
def test_the_best_scene_goes_into_the_database(place):
    folder, _ = place
    compared = json.loads((folder / "out/small-best/comparison.json").read_text(encoding="utf-8"))
    assert compared["chi2"] < compared["dof"]
    stones = answer("query", "entity", "--where", "sag_sigma > 0", "--db", f"sqlite:///{folder / 'small.db'}")
    assert len(stones) == 28


@pytest.mark.slow
def test_what_the_best_scene_explains_stillness_does_not(place):
    folder, _ = place
    compared = json.loads((folder / "out/small-best/comparison.json").read_text(encoding="utf-8"))
    assert compared["chi2_still"] > 10.0 * compared["dof"]
    for course in compared["courses"]:
        assert abs(course["measured"] - course["simulated"]) < 3.0 * course["sigma"], course["course"]
    pictures = {path.name for path in (folder / "out/small-best").glob("*.png")}
    assert pictures == {"beds-1.png", "misfit-1.png"} <= set(compared["files"])


@pytest.mark.slow
def test_what_the_surveyor_finds_of_each_stone_is_what_is_true(place):
    folder, _ = place
    truth = json.loads((folder / "out/small/truth.json").read_text(encoding="utf-8"))
    assert truth["settlement"] == {"W01-01": -0.03, "W01-02": -0.015}
    database = f"sqlite:///{folder / 'small.db'}"
    stones = answer("query", "entity", "--where", "course = 1", "--db", database)
    sag = {stone["code"]: stone["sag_measured"] for stone in stones}
    for stone in stones:
        settled = truth["settlement"].get(stone["code"], 0.0)
        assert sag[stone["code"]] - sag["W01-04"] == pytest.approx(settled, abs=4.0 * stone["sag_sigma"])


def test_the_tables_list_all_keys_and_the_example_can_be_read(tmp_path):
    rows = [
        re.split(r" ?\| ?", line)[1:5]
        for line in (ROOT / PAGE).read_text(encoding="utf-8").splitlines()
        if line.startswith("| `")
    ]
    listed = [(row[0].strip("`"), row[1], row[3]) for row in rows if len(row) == 4 and row[3]]
    for key in (*keys_of(DiagnosisTable), *keys_of(HypothesisTable), *keys_of(Unknown)):
        assert (key.name, key.unit, key.doc) in listed
    example, _ = blocks(PAGE, "toml")
    (tmp_path / "wall.toml").write_text("[[loads]]\n", encoding="utf-8")
    (tmp_path / "diagnosis.toml").write_text(example, encoding="utf-8")
    file = read_diagnosis(tmp_path / "diagnosis.toml")
    (hypothesis,) = file.hypotheses
    (load,) = hypothesis.scene(file.base, (0.02,))["loads"]
    assert load["displacement"] == [0.0, 0.0, -0.02]


def test_each_cause_that_is_shown_makes_a_scene(tmp_path):
    _, others = blocks(PAGE, "toml")
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    (tmp_path / "diagnosis.toml").write_text('[diagnosis]\nscene = "scene.toml"\n' + others, encoding="utf-8")
    file = read_diagnosis(tmp_path / "diagnosis.toml")
    base = len(file.base["loads"])
    for one in file.hypotheses:
        start = tuple(unknown.start for unknown in one.unknowns)
        scene = parse_scene(toml_text(one.scene(file.base, start)), "scene.toml")
        assert len(scene.loads) == base + (2 if one.name.startswith("a tie") else 1)
    named = " ".join(one.name for one in file.hypotheses)
    assert all(word in named for word in ("tilted", "spread", "tie", "load", "pulse", "core"))


@pytest.mark.slow
def test_a_movement_is_dated(tmp_path):
    (commands,) = blocks(PAGE, "console")
    *_, printed = ran(tmp_path, commands).values()
    lines = printed.splitlines()
    assert lines[0].startswith("'the left corner settled, when phase 1 stood' explains what was measured")
    assert lines[1].startswith("  the movement is younger than phase 1 and older than phase 2")
    summary = json.loads((tmp_path / "out/phases-diagnosis/diagnosis.json").read_text(encoding="utf-8"))
    first, second = summary["dating"]["shares"]
    assert first["value"] == pytest.approx(1.0, abs=4.0 * first["sigma"])
    assert second["value"] == pytest.approx(0.0, abs=4.0 * second["sigma"])
    assert any("W04-01" in line for line in summary["dating"]["evidence"])
