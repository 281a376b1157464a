"""What `moma run` prints of results whose numbers are known, and the code with which it ends."""

from dataclasses import replace

import pytest

from mechanics.dynamics.outcome import Outcome
from moma.cli.text.runs_and_surveys import run_lines
from pipelines.results.summary import summarise
from pipelines.run.run import RunReport
from tests.moma.commands import invoke
from tests.pipelines.results_by_hand import deformable_body, result_of, rigid_body


@pytest.fixture
def result():
    """A stone of up to 2 MPa between two rigid ones, of which the upper one has moved by 5 mm."""
    bodies = [
        rigid_body("base", (0, 0, 0), (1, 1, 1)),
        deformable_body("D1", (0, 0, 1), (1, 1, 3), lambda points: 1e6 * (points[:, 2] - 1.0), size=0.5),
        rigid_body("top", (0, 0, 3), (1, 1, 4), shift=(0, 0.003, -0.004)),
    ]
    return result_of(bodies, pairs=((1, 0), (2, 1)), forces=((0.0, 0.0, 3000.0), (0.0, 600.0, 800.0)))


def report(folder, result, warnings=()):
    summary = summarise(result, version="1", seconds={"solve": 1.5}) | {"files": [], "warnings": [*warnings]}
    return RunReport(folder, summary, tuple(warnings), 7)


def test_every_number_has_its_unit(result, tmp_path):
    text = "\n".join(run_lines(report(tmp_path, result), verbose=True))
    for words in (
        "2 rigid, 1 deformable, 0 fixed stones, 2 contact points",
        "weight 20.00 kN, reaction 20.01 kN, largest displacement 5 mm",
        "mean 1.0000 MPa",
        "largest 2.0000 MPa",
        "2 joints: 1 of 2 compressed ones have their resultant outside the kern",
        "largest opening 0.1 mm, largest sliding 2 mm",
        "penetration 2.0e-06",
        "unconverged_steps 1",
        "solve 1.50 s",
    ):
        assert words in text
    assert "energy" not in text  # not known


def test_reason_and_cautions_come_first(result, tmp_path):
    told = replace(
        result, outcome=Outcome.MOVING, reason="it slides by 3 mm/s", cautions=("a moved", "b is unsound")
    )
    first, *lines = run_lines(report(tmp_path, told), verbose=False)
    assert first.startswith("by hand: moving after 0.1 s: it slides by 3 mm/s; but a moved")
    assert [line.strip() for line in lines[:2]] == ["caution: a moved", "caution: b is unsound"]


@pytest.mark.parametrize(
    ("outcome", "code"),
    [
        ("equilibrium", 0),
        ("settled", 0),
        ("moving", 1),
        ("collapsed", 0),
        ("undecided", 1),
        ("interrupted", 1),
    ],
)
@pytest.mark.parametrize("format", [(), ("--json",)])
def test_a_run_without_an_answer_ends_in_1(result, tmp_path, monkeypatch, outcome, code, format):
    found = report(tmp_path, replace(result, outcome=Outcome(outcome)), ["a weak joint", "no pictures"])
    monkeypatch.setattr("pipelines.run.run.run_scene", lambda *_, **__: found)
    done = invoke("run", tmp_path / "any.toml", *format)
    assert done.exit_code == code
    assert outcome in done.stdout
    said = [line for line in done.stderr.splitlines() if line.startswith("moma: warning: ")]
    assert said == ["moma: warning: a weak joint", "moma: warning: no pictures"]
