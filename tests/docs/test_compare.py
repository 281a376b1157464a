"""docs/howto/compare.md is true: its commands run, and print what it shows."""

import json
import re

import pytest

from tests.docs.pages import blocks, ran
from tests.moma.commands import answer

pytestmark = pytest.mark.slow  # tests/docs/test_diagnose.py compares the small wall
PAGE = "docs/howto/compare.md"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder in which the commands of the page have run, and what each has printed."""
    folder = tmp_path_factory.mktemp("compare")
    lines = "".join(blocks(PAGE, "bash")).splitlines()
    return folder, ran(folder, "\n".join(line for line in lines if not line.startswith("moma query")))


def test_the_true_cause_explains_the_survey_and_stillness_does_not(place):
    folder, said = place
    (headline,) = blocks(PAGE, "text")
    printed = next(text for line, text in said.items() if line.startswith("moma compare")).splitlines()[0]
    number = re.compile(r"χ² ([\d.]+) of (\d+) \((\d+)\)")
    shown, found = number.search(headline), number.search(printed)
    assert printed.split(":")[0] == headline.split(":")[0]
    # the last digits depend on the machine: a wall that cracks has many ways
    assert found[2] == shown[2]
    assert float(found[1]) == pytest.approx(float(shown[1]), rel=0.05)
    assert float(found[3]) == pytest.approx(float(shown[3]), rel=0.05)
    summary = json.loads((folder / "out/settled-compare/comparison.json").read_text(encoding="utf-8"))
    # 3 standard deviations of χ²
    assert summary["chi2"] < summary["dof"] + 3.0 * (2.0 * summary["dof"]) ** 0.5
    assert summary["chi2_still"] > 10.0 * summary["dof"]
    for course in summary["courses"]:
        assert abs(course["measured"] - course["simulated"]) < 3.0 * course["sigma"], course["course"]
        assert course["plumb"] is not None
    pictures = {path.name for path in (folder / "out/settled-compare").glob("*.png")}
    assert pictures == {"beds-1.png", "misfit-1.png"} <= set(summary["files"])


def test_the_stones_can_be_asked_for(place, monkeypatch):
    folder, _ = place
    database = f"sqlite:///{folder / 'settled.db'}"
    unexplained = "abs(sag_measured - sag_simulated) > {}*sag_sigma"
    counts = [
        len(answer("query", "entity", "--where", unexplained.format(factor), "--db", database))
        for factor in (0, 1, 2, 3)
    ]
    # of 86 normal residuals a third are beyond one σ, one in 400 beyond three
    assert counts[0] > 80
    assert 0.1 * counts[0] < counts[1] < 0.5 * counts[0]
    assert counts[3] <= 2
    truth = json.loads((folder / "out/settled/truth.json").read_text(encoding="utf-8"))
    assert truth["settlement"] == {"W01-01": -0.03, "W01-02": -0.02, "W01-03": -0.01}
    moved = {stone["code"]: stone["shift"] for stone in truth["stones"]}
    stones = answer("query", "entity", "--where", "course = 1", "--db", database)
    level = next(stone for stone in stones if stone["code"] == "W01-06")
    for code, settled in truth["settlement"].items():
        stone = next(stone for stone in stones if stone["code"] == code)
        # what the surveyor finds is what is true
        apart = stone["sag_measured"] - level["sag_measured"]
        assert moved[code][2] == pytest.approx(settled, abs=1e-6)
        assert apart == pytest.approx(settled, abs=4.0 * stone["sag_sigma"])
