"""docs/howto/moved.md is true: its commands run, and print what it shows."""

import json
import re
import shlex

import pytest

from pipelines.assess.diagnosis.file import read_diagnosis
from tests.moma.commands import prints
from tests.paths import ROOT

PAGE = (ROOT / "docs/howto/moved.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def ran(folder, commands):
    """What each command prints, by its first two words."""
    said = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.delenv("MOMA_DB", raising=False)
        for line in commands.splitlines():
            words = shlex.split(line)
            said[" ".join(words[:2])] = prints(*words[1:])
    return said


@pytest.mark.slow  # docs/howto/diagnose.md finds a settlement in each run of the tests
def test_the_thrust_of_a_vault_is_recovered_and_its_rival_named(tmp_path):
    said = ran(tmp_path, blocks("bash")[0])
    number = re.compile(
        r"^'(.*)' explains .* \(χ² ([\d.]+) of (\d+), ([\d.]+) of .* thrust = ([\d.]+) ± ([\d.]+) N .*'(.*)'"
    )
    shown, found = number.match(blocks("text")[0]), number.match(said["moma diagnose"])
    assert found[1] == shown[1] == "the thrust of a vault pushed the walls out"
    assert found[7] == shown[7] == "the base tilted"
    for k in (2, 3, 4, 5, 6):
        assert float(found[k]) == pytest.approx(float(shown[k]), rel=0.05)
    truth = json.loads((tmp_path / "out/pushed/truth.json").read_text(encoding="utf-8"))
    for force in truth["forces"].values():
        assert sum(part**2 for part in force) ** 0.5 == pytest.approx(900.0, abs=0.01)
    assert abs(float(found[5]) - 900.0) <= float(found[6])
    summary = json.loads((tmp_path / "out/pushed-diagnosis/diagnosis.json").read_text(encoding="utf-8"))
    settled = next(one for one in summary["hypotheses"] if one["name"] == "the left corner settled")
    assert settled["chi2"] > summary["hypotheses"][0]["chi2"] + 30.0
    compared = json.loads((tmp_path / "out/pushed-best/comparison.json").read_text(encoding="utf-8"))
    assert compared["chi2"] < compared["dof"]


def test_the_hypothesis_shown_is_that_of_the_sample(tmp_path):
    (example,) = blocks("toml")
    (tmp_path / "scene.toml").write_text("[[loads]]\n", encoding="utf-8")
    head = '[diagnosis]\nscene = "scene.toml"\nwithout = ["loads"]\n'
    (tmp_path / "diagnosis.toml").write_text(head + example, encoding="utf-8")
    file = read_diagnosis(tmp_path / "diagnosis.toml")
    (load,) = file.hypotheses[0].scene(file.base, (900.0,))["loads"]
    assert sum(part**2 for part in load["force"]) ** 0.5 == pytest.approx(900.0, rel=1e-5)


@pytest.mark.slow
def test_the_corner_that_sank_explains_how_the_storey_moved(tmp_path):
    said = ran(tmp_path, blocks("console")[0])
    number = re.compile(r": χ² ([\d.]+) of (\d+) \(([\d.]+)\)")
    shown, found = number.search(blocks("text")[1]), number.search(said["moma compare"])
    for k in (1, 2, 3):
        assert float(found[k]) == pytest.approx(float(shown[k]), rel=0.05)
    assert float(found[1]) < float(found[2]) + 3.0 * (2.0 * float(found[2])) ** 0.5
    assert float(found[3]) > 4.0 * float(found[2])
