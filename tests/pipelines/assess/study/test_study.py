"""Studies of a block that slides at λ = μ or topples at λ = d/h, whichever is less."""

import csv
import json

import numpy as np
import pytest

from archmodel.database.session import open_database
from archmodel.query.api import find_rows
from ground.errors import SceneError, UsageError
from pipelines.assess.study.file import read_study
from pipelines.assess.study.sampling import Part
from pipelines.assess.study.study import run_study
from tests.pipelines.assess.study.surveys import BOUND, DEEP, FRICTIONAL, block_survey, study_file


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("block")
    return folder, block_survey(folder)


def test_the_block_has_two_ways_to_fail_and_first_order_is_flagged(place, tmp_path):
    """P(min(μ, d/h) < .30) with μ N(.35, .03), d/h N(.36, .02): 1 - Φ(1.6667) Φ(3) = 4.908e-2."""
    folder, url = place
    path = study_file(folder, "form", FRICTIONAL, DEEP, BOUND, samples=60)
    done = run_study(path, url, tmp_path / "out")
    failure, designs = done.summary["failure"], done.summary["designs"]
    assert [round(design["index"], 3) for design in designs] == [1.667, 3.0]
    assert failure["low"] < 4.908e-2 < failure["high"]
    assert any("first order is not good enough" in text for text in done.summary["cautions"])
    assert {"report.html", "study.json", "elevation.png", "tornado.png", "weighted.png", "fragility.png"} <= {
        file.name for file in (tmp_path / "out").iterdir()
    }
    # the samples about the design points, with what they stand for
    rows = list(csv.DictReader((tmp_path / "out" / "samples.csv").read_text().splitlines()))
    told = sum(float(row["weight"]) for row in rows if float(row["bound horizontal y"]) < 0.3) / len(rows)
    assert told == pytest.approx(failure["probability"], rel=1e-6)
    curve = done.summary["fragility"]
    assert [row["level"] for row in curve] == sorted(row["level"] for row in curve)
    assert curve[0]["probability"] < failure["probability"] < curve[-1]["probability"]
    # what is printed as 0.0 % is no measurement
    assert all(action["share"] >= 5e-4 for action in done.summary["actions"])
    assert json.loads((tmp_path / "out" / "study.json").read_text())["headline"].startswith("P(bound")


def test_parts_resumption_and_one_process_give_the_same_bits(place, tmp_path):
    folder, url = place
    path = study_file(folder, "monte_carlo", FRICTIONAL, DEEP, BOUND, samples=9)
    whole = run_study(path, url, tmp_path / "whole")
    for number in (2, 3):
        part = run_study(path, url, tmp_path / "parts", part=Part(number, 3))
        assert not part.complete
    gathered = run_study(path, url, tmp_path / "parts")
    assert gathered.summary["samples"]["digest"] == whole.summary["samples"]["digest"]
    # the third of the nine that no part has taken, and eleven of the prediction about the mean
    assert gathered.summary["samples"]["taken"] == 3 + 11
    again = run_study(path, url, tmp_path / "parts", resume=True)
    assert again.summary["samples"]["taken"] == 0
    assert again.summary["failure"] == whole.summary["failure"]


def test_methods_whose_samples_depend_on_one_another_have_no_parts(place, tmp_path):
    folder, url = place
    for method, why in (("subset", "each level begins"), ("first_order", "few samples")):
        path = study_file(folder, method, FRICTIONAL, BOUND, samples=9)
        with pytest.raises(UsageError, match=why):
            run_study(path, url, tmp_path / "parts", part=Part(1, 3))


def test_samples_that_fail_bound_the_probability_on_both_sides(place, tmp_path):
    """Friction of N(.35, .3) is negative in an eighth of all samples, which no law takes."""
    folder, url = place
    path = study_file(folder, "monte_carlo", FRICTIONAL.replace("0.03", "0.3"), BOUND, samples=24)
    done = run_study(path, url, tmp_path / "out")
    failure = done.summary["failure"]
    assert failure["unknown"] > 0
    assert failure["probability_upper"] - failure["probability"] == pytest.approx(failure["unknown"] / 24)
    # as friction below zero holds nothing, the truth is Φ(-.05/.3)
    assert failure["low"] < 0.4338 < failure["high"]
    (fault,) = done.summary["faults"]
    assert fault["count"] == failure["unknown"]
    assert "friction" in fault["reason"]


def test_a_bound_corrects_the_mean_of_runs(place, tmp_path):
    """U7: the mean of min(μ, d/h) is .34007; of twelve samples alone it is known to .013."""
    folder, url = place
    coulomb = BOUND.replace('"bound"', '"candidate"')
    plain = BOUND.replace("fails_below = 0.30\n", "")
    path = study_file(folder, "monte_carlo", FRICTIONAL, DEEP, coulomb, plain, samples=12)
    path.write_text(
        path.read_text().replace("samples = 12", "samples = 12\ncontrols = 150"), encoding="utf-8"
    )
    means = run_study(path, url, tmp_path / "out").summary["means"]
    runs, control = means["candidate horizontal y"], means["bound horizontal y"]
    assert control["count"] == 150
    assert runs["share"] < 0.05
    assert runs["low"] < 0.34007 < runs["high"]
    assert runs["high"] - runs["low"] < 0.6 * 2.2 * 2.0 * runs["sigma"] / np.sqrt(12.0)


def test_both_sides_of_a_derivative_stand_in_the_study(place, tmp_path):
    """At μ = d/h friction decides below its mean, and not above."""
    folder, url = place
    path = study_file(folder, "first_order", FRICTIONAL + "mean = 0.36\n", DEEP, BOUND)
    summary = run_study(path, url, tmp_path / "out").summary
    sides = {one["along"]: (one["below"], one["above"]) for one in summary["linear"]["sides"]}
    assert sides["friction"] == (pytest.approx(0.03, rel=1e-3), pytest.approx(0.0, abs=1e-4))
    assert any("several mechanisms meet" in text for text in summary["cautions"])


def test_another_study_in_the_folder_is_refused(place, tmp_path):
    folder, url = place
    run_study(study_file(folder, "first_order", FRICTIONAL, BOUND), url, tmp_path / "out")
    other = study_file(folder, "first_order", DEEP, BOUND)
    with pytest.raises(UsageError, match="another scene, other stones or other inputs"):
        run_study(other, url, tmp_path / "out")


def test_the_gradient_is_that_of_differences(place, tmp_path):
    """Friction decides at μ = .33 < d/h, and depth where friction is out of the way."""
    folder, url = place
    path = study_file(folder, "first_order", FRICTIONAL + "mean = 0.33\n", DEEP, BOUND)
    linear = run_study(path, url, tmp_path / "slides").summary
    assert linear["linear"]["sigma"] == pytest.approx(0.03, rel=1e-6)
    assert linear["actions"][0]["text"].startswith("sliding tests")
    path = study_file(folder, "first_order", FRICTIONAL + "mean = 0.6\n", DEEP, BOUND)
    tips = run_study(path, url, tmp_path / "tips").summary
    assert tips["linear"]["sigma"] == pytest.approx(0.02, rel=1e-5)
    assert tips["actions"][0]["text"] == "core through BLOCK: its depth"
    assert tips["shares"]["by_stone"] == pytest.approx({"GROUND": 0.0, "BLOCK": 1.0})


@pytest.mark.parametrize(
    ("tables", "what"),
    [
        ((FRICTIONAL.replace("0.03", "-0.03"), BOUND), "sigma = -0.03 is out of range"),
        ((FRICTIONAL, BOUND.replace("bound", "bond")), "type = 'bond' is unknown"),
        ((FRICTIONAL, BOUND.replace("horizontal y", "sideways")), "no such load: 'sideways'"),
        (
            (FRICTIONAL, DEEP, BOUND, '[[correlations]]\ninputs = ["friction", "depht"]\nvalue = 0.5\n'),
            "no such input",
        ),
        (
            (FRICTIONAL, DEEP, BOUND, '[[correlations]]\ninputs = ["friction", "depth"]\nvalue = 1.0\n'),
            "not positive",
        ),
        (
            (
                FRICTIONAL,
                DEEP,
                '[[inputs]]\ntype = "density"\ncov = 0.1\n',
                BOUND,
                '[[correlations]]\ninputs = ["friction", "depth", "density"]\n'
                "matrix = [1, 0.9, -0.9, 0.9, 1, 0.9, -0.9, 0.9, 1]\n",
            ),
            "not positive definite",
        ),
        ((BOUND,), "no input"),
        (('[[inputs]]\ntype = "friction"\n', BOUND), "friction is certain"),
        (('[[inputs]]\ntype = "cohesion"\nsigma = 1.0\n', BOUND), "no joint has the key 'shear'"),
        (
            ('[[inputs]]\ntype = "friction"\ndistribution = "uniform"\nlow = 0.5\nhigh = 0.3\n', BOUND),
            "low = 0.5",
        ),
    ],
)
def test_mistakes_are_refused_with_their_line_before_anything_runs(place, tables, what):
    folder, _ = place
    with pytest.raises(SceneError, match=what) as refused:
        read_study(study_file(folder, "monte_carlo", *tables))
    assert "study.toml:" in (refused.value.where or "")


def test_a_scene_that_does_not_stand_at_its_mean_is_refused(place, tmp_path):
    """Gravity that pulls sideways by more than friction holds."""
    folder, url = place
    scene = (folder / "block.toml").read_text() + "[gravity]\ndirection = [0.0, 1.0, -1.0]\n"
    (folder / "leaning.toml").write_text(scene, encoding="utf-8")
    path = study_file(folder, "monte_carlo", FRICTIONAL, BOUND)
    path.write_text(path.read_text().replace("block.toml", "leaning.toml"), encoding="utf-8")
    with pytest.raises(SceneError, match="does not stand at the mean"):
        run_study(path, url, tmp_path / "out")
    # the folder is as it was, so that the scene can be mended and asked for again
    assert list((tmp_path / "out").iterdir()) == []


def test_an_input_that_cannot_be_is_refused_at_its_line_and_leaves_no_study(place, tmp_path):
    """Planes have an unknown for each coordinate of each face, which one correlation cannot join to the friction."""
    folder, url = place
    correlated = '[[correlations]]\ninputs = ["friction", "plane"]\nvalue = 0.5\n'
    path = study_file(folder, "monte_carlo", FRICTIONAL, '[[inputs]]\ntype = "plane"\n', BOUND, correlated)
    with pytest.raises(SceneError, match="has 0 common unknowns") as refused:
        run_study(path, url, tmp_path / "out")
    line = path.read_text().splitlines().index("[[correlations]]") + 1
    assert refused.value.where == f"{path}:{line}"
    assert list((tmp_path / "out").iterdir()) == []


def test_a_refused_study_leaves_samples_of_one_that_was_begun(place, tmp_path):
    folder, url = place
    run_study(study_file(folder, "first_order", FRICTIONAL, BOUND), url, tmp_path / "out")
    before = sorted(tmp_path.glob("out/samples/*/*"))
    path = study_file(folder, "first_order", FRICTIONAL.replace("0.03", "0.03\nmean = -0.1"), BOUND)
    with pytest.raises(SceneError, match="no answer at the mean"):
        run_study(path, url, tmp_path / "out", overwrite=True)
    assert before
    assert set(before) <= set(tmp_path.glob("out/samples/*/*"))


def test_shares_of_stones_are_asked_for_in_the_database(place, tmp_path):
    folder, url = place
    path = study_file(folder, "first_order", FRICTIONAL + "mean = 0.6\n", DEEP, BOUND)
    done = run_study(path, url, tmp_path / "out")
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        rows = find_rows(session, "ashlar", [f"variance_share@study{done.run} > 0.5"], columns=("code",))
        assert [row["code"] for row in rows] == ["BLOCK"]
        # its motions are not those of a run
        (row,) = find_rows(session, "ashlar", ["code = 'BLOCK'"], columns=("code", "displacement_max"))
        assert row["displacement_max"] is None
