"""An assessment from its questions to what it tells: what governs, what is left out, and in which frame it is told."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.limit.dead_load import Standing
from mechanics.limit.limit_load import Mechanism
from moma import ingest
from pipelines.assess import assess as assess_module
from pipelines.assess.answers import FALLS, Answer
from pipelines.assess.assess import AssessOptions, assess
from pipelines.assess.compare import compare
from pipelines.assess.questions import scene_questions
from pipelines.scene.file import parse_scene
from tests.paths import ROOT
from tests.pipelines.scenes import TWO_COURSES

PUSH = '[[assess]]\ntype = "horizontal"\ndirection = [0.0, 1.0, 0.0]\n'


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    url = f"sqlite:///{tmp_path_factory.mktemp('assess') / 'moma.db'}"
    ingest([ROOT / "data/samples/window/window.moma"], url)
    return url


def written(tmp_path, text):
    path = tmp_path / "two.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def plain(monkeypatch):
    """Without pictures and pages, and without a run of the dead load."""
    monkeypatch.setattr(assess_module, "draw_mechanisms", lambda *_: [])
    monkeypatch.setattr(assess_module, "assessment_model", lambda *_: None)
    monkeypatch.setattr(assess_module, "write_assessment", lambda path, *_: path.write_text(""))
    monkeypatch.setattr(assess_module, "stands", lambda on, *_: stood(on))


def stood(on, outcome=Outcome.EQUILIBRIUM, moved=()):
    return Standing(outcome, "", moved, np.zeros((len(on.model.mass), 3)))


def told_by(numbers, asked=None):
    """Answers that are these numbers, in turn; the questions go to `asked`."""
    left = iter(numbers)

    def answer(on, question, *_):
        if asked is not None:
            asked.append(question)
        count, contacts = len(on.model.mass), len(on.contacts)
        still = Mechanism(np.zeros((count, 6)), np.zeros(count), *[np.zeros(contacts, dtype=bool)] * 2)
        told = {"name": question.name, "kind": "load", "headline": question.name, **next(left)}
        told["mechanism"] = {"stones": [], "opening_joints": 0, "sliding_joints": 0}
        return Answer(told, still, np.zeros((contacts, 3)))

    return answer


def limits(candidate, bound, **runs):
    return {"candidate": candidate, "bound": bound} | ({"confirmation": runs} if runs else {})


@pytest.mark.parametrize(
    ("first", "second", "governs"),
    [
        (limits(0.3, 0.32), limits(0.28, 0.4), 1),
        (limits(0.28, 0.4), limits(0.3, 0.32), 0),
        (limits(0.3, 0.32), limits(0.35, 0.4, held=0.29, lost=0.31), 1),  # runs hold less than statics
        (limits(0.3, 0.32), limits(None, None, held=None, lost=0.2), 1),
        (limits(0.3, 0.32), limits(None, None), 0),  # nothing limits it
    ],
)
def test_the_least_load_at_which_stones_may_fall_governs(
    url, plain, tmp_path, monkeypatch, first, second, governs
):
    monkeypatch.setattr(assess_module, "answer", told_by([first, second]))
    loads = ("horizontal x", "horizontal y")
    done = assess(written(tmp_path, TWO_COURSES), url, tmp_path / "out", loads)
    assert done.summary["headline"] == f"governs: {loads[governs]}"


def test_a_scene_asks_for_runs_by_itself_and_the_option_for_all(url, plain, tmp_path, monkeypatch):
    path = written(tmp_path, f"{TWO_COURSES}{PUSH}confirm = true\n{PUSH.replace('1.0', '-1.0')}")
    for option, expected in ((False, [True, False]), (True, [True, True])):
        asked = []
        monkeypatch.setattr(assess_module, "answer", told_by([limits(0.3, 0.32)] * 2, asked))
        assess(path, url, tmp_path / "out", options=AssessOptions(confirm=option))
        assert [one.confirm for one in asked] == expected


@pytest.mark.parametrize("outcome", [Outcome.MOVING, Outcome.UNDECIDED])
def test_what_has_not_rested_is_not_decided(url, plain, tmp_path, monkeypatch, outcome):
    still = Standing(outcome, "stone W02-02 moves at 2e-10 mm/s", (), np.zeros((18, 3)))
    monkeypatch.setattr(assess_module, "stands", lambda *_: still)
    done = assess(written(tmp_path, TWO_COURSES), url, tmp_path / "out", ("horizontal x", "thickness"))
    assert not done.decided
    assert done.summary["headline"].startswith(
        "not decided whether it stands under its own weight: stone W02-02"
    )
    assert [one["outcome"] for one in done.summary["loads"]] == ["not decided"] * 2
    assert "falls" not in json.dumps(done.summary["loads"])


def test_what_falls_is_decided_and_says_so(url, plain, tmp_path, monkeypatch):
    monkeypatch.setattr(assess_module, "stands", lambda on, *_: stood(on, Outcome.COLLAPSED, ("W02-02",)))
    done = assess(written(tmp_path, TWO_COURSES), url, tmp_path / "out", ("horizontal x",))
    assert done.decided
    assert done.summary["headline"].startswith("it falls under its own weight: W02-02")
    assert done.summary["loads"][0]["outcome"] == "falls under its own weight"


def test_a_load_under_which_nothing_balances_governs_with_zero(url, plain, tmp_path, monkeypatch):
    """Never "nothing limits its loads" beside a load that falls."""
    falls = limits(None, None) | {"outcome": FALLS, "headline": "horizontal x: λ = 0"}
    monkeypatch.setattr(assess_module, "answer", told_by([falls, limits(0.3, 0.32)]))
    moved = {"falls_as_drawn": True, "farthest": 1.2e-3}
    monkeypatch.setattr(assess_module, "stands", lambda on, *_: replace(stood(on), **moved))
    done = assess(written(tmp_path, TWO_COURSES), url, tmp_path / "out", ("horizontal x", "horizontal y"))
    expected = "rests only after moving by 1.2 mm; as drawn it falls; governs: horizontal x: λ = 0"
    assert done.summary["headline"] == expected
    assert any("joints are taken where stones rest" in one for one in done.summary["cautions"])


def test_mortar_that_has_broken_is_named(url, plain, tmp_path, monkeypatch):
    monkeypatch.setattr(assess_module, "answer", told_by([limits(0.3, 0.32)]))
    monkeypatch.setattr(
        assess_module, "stands", lambda on, *_: replace(stood(on), broken=(("W01-01", "W02-01"),))
    )
    done = assess(written(tmp_path, TWO_COURSES), url, tmp_path / "out", ("horizontal x",))
    assert (
        "the dead load breaks the mortar between W01-01 and W02-01: it holds nothing here"
        in done.summary["cautions"]
    )


def test_loose_stones_stay_out_while_others_are_found(url, plain, tmp_path, monkeypatch):
    """Without the first stone that falls another one does; without both the rest stands."""
    tried = []

    def falls(on, *_):
        codes = {block.code for block in on.model.scene.blocks}
        tried.append(codes)
        assert len(tried) < 6
        loose = next((code for code in ("W02-02", "W02-03") if code in codes), None)
        return stood(on) if loose is None else stood(on, Outcome.COLLAPSED, (loose,))

    monkeypatch.setattr(assess_module, "stands", falls)
    monkeypatch.setattr(assess_module, "answer", told_by([limits(0.3, 0.32)]))
    path, loads = written(tmp_path, TWO_COURSES), ("horizontal x",)
    done = assess(path, url, tmp_path / "out", loads, options=AssessOptions(leave_out_loose=True))
    assert done.summary["left_out"] == ["W02-02", "W02-03"]
    assert done.summary["headline"].startswith("without W02-02, W02-03, which fall under their own weight")
    assert len(tried) == 3


def test_gaps_that_count_as_closed_are_told(url, plain, tmp_path, monkeypatch):
    path, real = written(tmp_path, TWO_COURSES), assess_module.assembly
    for gap, words in ((0.0, []), (3e-4, ["gaps of up to 0.3 mm count as closed"])):
        monkeypatch.setattr(assess_module, "assembly", lambda dead, gap=gap: replace(real(dead), widest=gap))
        monkeypatch.setattr(assess_module, "answer", told_by([limits(0.3, 0.32)]))
        done = assess(path, url, tmp_path / "out", ("horizontal x",))
        assert [one for one in done.summary["cautions"] if one.startswith("gaps")] == words


def test_forces_are_told_where_their_joints_are_in_the_frame_of_the_site(url, plain, tmp_path, monkeypatch):
    origin, real = np.array([1000.0, 2000.0, 300.0]), assess_module.assemble_stones
    monkeypatch.setattr(assess_module, "assemble_stones", lambda *given: replace(real(*given), origin=origin))
    assess(written(tmp_path, TWO_COURSES), url, tmp_path / "out", ("horizontal y",))
    with (tmp_path / "out/forces-1.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["place_x"]]
    joint, place = (
        np.array([[float(row[name]) for name in names] for row in rows])
        for names in (("x", "y", "z"), ("place_x", "place_y", "place_z"))
    )
    assert np.abs(joint - origin).max() < 50.0
    assert np.linalg.norm(joint - place, axis=1).max() < 0.6


def test_the_point_of_a_force_is_given_in_the_frame_of_the_site():
    text = f'{TWO_COURSES}[[assess]]\ntype = "force"\nstones = ["a"]\nforce = [1.0, 0.0, 0.0]\n'
    scene = parse_scene(f"{text}point = [105.0, 203.0, 1.5]\n", "two.toml")
    groups = {entry.path: (frozenset({"a"}),) for entry in scene.assess}
    (question,) = scene_questions(scene, groups, np.array([100.0, 200.0, 1.0]))
    assert question.live.point == (5.0, 3.0, 0.5)


def test_a_comparison_is_the_sum_of_beds_and_faces(url, tmp_path):
    told = compare(written(tmp_path, TWO_COURSES), url, tmp_path / "compared").summary
    assert {one["quantity"] for one in told["walls"]} == {"beds", "plumb"}
    for name in ("chi2", "chi2_still", "dof"):
        assert told[name] == pytest.approx(sum(one[name] for one in told["walls"]))
