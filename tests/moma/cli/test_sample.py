"""`moma sample`: every sample it writes is taken to its results by the commands that it prints."""

import json
import shlex
from typing import get_args

import pytest

from moma.cli.surveys import Moved
from pipelines.samples.copy import sample_names
from synthetic.samples import SAMPLES
from tests.moma.commands import answer, fails, invoke, prints

NAMES = [name for name in sample_names() if name in SAMPLES]
SLOWEST = "tower --moved settlement --small"  # whose diagnosis makes dozens of runs
FORMER = {
    "core-sunk": "facings --moved settlement",
    "pushed": "wall --moved thrust",
    "settled": "wall --moved settlement",
    "settled-phases": "wall --moved settlement --phases",
    "settled-small": "wall --moved settlement --small",
    "shaken": "wall --moved earthquake",
    "tower-settled-small": "tower --moved settlement --small",
    "tower-small": "tower --small",
}
LARGE = {name for name, recipe in SAMPLES.items() if recipe.cause is not None or recipe.scan} | {"tower"}


def test_the_help_names_the_samples_and_the_causes_of_movement():
    said = " ".join(invoke("sample", "--help").stdout.replace("│", " ").split())
    names = [name for name in sample_names() if " " not in name]
    assert f"{', '.join(names[:-1])} or {names[-1]}." in said
    causes = {name.split()[name.split().index("--moved") + 1] for name in sample_names() if "--moved" in name}
    assert causes == {*get_args(Moved)}


def test_samples_and_options_that_there_are_not_are_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert (
        "the samples are arch, block, corner, facings, ribvault, tower, vault, wall, window, rubble-wall"
        in fails(2, "sample", "castle")
    )
    said = fails(2, "sample", "facings", "--moved", "thrust")
    assert "no sample 'facings --moved thrust'; there is 'facings', 'facings --moved settlement'" in said
    assert "'wall --moved settlement --phases'" in fails(2, "sample", "wall", "--phases")
    assert not list(tmp_path.iterdir())


def test_former_names_are_refused_with_the_new_ones():
    for name, now in FORMER.items():
        assert f"no sample '{name}' any more; it is now: moma sample {now}" in fails(2, "sample", name)
    assert set(FORMER.values()) <= set(sample_names())


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow] if name in LARGE else []) for name in NAMES],
)
def test_a_sample_runs_to_equilibrium(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written = answer("sample", *name.split())
    kind = name.split()[0]
    for command in written["commands"]:
        if name == SLOWEST and command.startswith("moma diagnose"):
            continue
        prints(*shlex.split(command)[1:])
    summary = json.loads((tmp_path / kind / "results/summary.json").read_text(encoding="utf-8"))
    assert summary["outcome"] == "equilibrium"
    # of what has moved
    assert summary["cautions"] == [] or SAMPLES[name].cause is not None
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
