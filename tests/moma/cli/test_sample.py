"""`moma sample`: every sample it writes is taken to its results by the commands that it prints."""

import json
import shlex

import pytest

from moma.cli.surveys import SampleName
from survey.synthetic.samples import SAMPLES
from tests.moma.commands import answer, fails, invoke, prints

SLOWEST = {"tower-settled", "tower-settled-small"}  # whose diagnosis makes dozens of runs
LARGE = {name for name, recipe in SAMPLES.items() if recipe.cause is not None} | {"tower"}


def test_the_names_are_those_of_the_samples():
    assert [one.value for one in SampleName] == list(SAMPLES)
    refused = invoke("sample", "castle")
    assert refused.exit_code == 2
    assert all(f"'{name}'" in " ".join(refused.stderr.replace("│", " ").split()) for name in SAMPLES)


@pytest.mark.parametrize(
    "kind",
    [pytest.param(name, marks=[pytest.mark.slow] if name in LARGE else []) for name in SAMPLES],
)
def test_a_sample_runs_to_equilibrium(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written = answer("sample", kind)
    for command in written["commands"]:
        if kind in SLOWEST and command.startswith("moma diagnose"):
            continue
        prints(*shlex.split(command)[1:])
    summary = json.loads((tmp_path / kind / "results/summary.json").read_text(encoding="utf-8"))
    assert summary["outcome"] == "equilibrium"
    # of what has moved
    assert summary["cautions"] == [] or SAMPLES[kind].cause is not None
    assert summary["reaction"]["total_vertical"] == pytest.approx(summary["reaction"]["weight"], rel=1e-6)
    survey = (tmp_path / kind / f"{kind}.moma").read_text(encoding="utf-8")
    assert survey.splitlines()[1].endswith("(synthetic)")
    truth = json.loads((tmp_path / kind / "truth.json").read_text(encoding="utf-8"))
    solids = tmp_path / kind / "solids.obj"
    modelled = solids.read_text(encoding="utf-8").count("o ") if solids.exists() else 0
    assert len(truth["stones"]) == written["stones"] == survey.count("\nstone ") + modelled


def test_nothing_is_overwritten(tmp_path):
    place = tmp_path / "mine"
    said = prints("sample", "arch", "--out", place)
    assert "17 stones" in said
    assert f"moma run {place / 'arch.toml'}" in said
    (place / "arch.moma").unlink()
    line = fails(2, "sample", "arch", "--out", place)
    assert "truth.json exists" in line
    assert not (place / "arch.moma").exists()
