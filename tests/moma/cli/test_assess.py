"""`moma assess`: limit loads of two courses of the sample, the loads that a scene or an option names, and mistakes."""

import json

import pytest

from moma import ingest
from pipelines.assess import assess as assess_module
from tests.moma.commands import answer, fails, invoke, prints
from tests.paths import ROOT
from tests.pipelines.scenes import TWO_COURSES, TWO_COURSES_MIXED


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    url = f"sqlite:///{tmp_path_factory.mktemp('assess') / 'moma.db'}"
    ingest([ROOT / "data/samples/window/window.moma"], url)
    return url


@pytest.fixture
def plain(monkeypatch):
    """Without pictures, which take longest."""
    monkeypatch.setattr(assess_module, "draw_mechanisms", lambda *_: [])


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "two.toml"
    path.write_text(TWO_COURSES, encoding="utf-8")
    return path


def test_four_directions_have_limit_bound_and_mechanism(url, scene, tmp_path):
    out = tmp_path / "out"
    told = answer("assess", scene, "--db", url, "--out", out)
    # the facade is turned by 7°: along it, both ways, and square to it
    angles = [float(one["name"].split()[1]) for one in told["loads"]]
    assert [angle - angles[0] for angle in angles] == pytest.approx([0, 180, 90, 270], abs=1)
    assert angles[0] == pytest.approx(7, abs=0.5)
    for one in told["loads"]:
        assert one["limit"] < one["limit_lost"] <= one["bound"]
        # stones of one course on a fixed one slide, at their friction; beds are level to a hundredth
        assert one["bound"] <= 0.6 * 1.01
        assert one["mechanism"]["stones"]
    least = min(told["loads"], key=lambda one: one["limit"])
    assert told["headline"] == f"governs: {least['headline']}"
    assert (out / "scene.toml").read_text(encoding="utf-8") == TWO_COURSES
    assert json.loads((out / "assessment.json").read_text(encoding="utf-8")) == told
    assert sorted(told["files"]) == sorted(path.name for path in out.iterdir())


def test_the_first_line_says_what_decides_and_the_others_what_it_is(url, scene, tmp_path):
    text = prints("assess", scene, "--db", url, "--out", tmp_path / "out", "--load", "tilt y")
    first, *rest = text.splitlines()
    assert first.startswith("Two courses: tilt y: λ = 0.")
    assert "a tilt of" in first
    assert any("rigorous upper bound" in line for line in rest)
    assert any("moves: W02" in line for line in rest)


def test_what_is_not_decided_ends_with_the_exit_code_of_a_run(url, scene, plain, tmp_path, monkeypatch):
    """Two steps of 10 ms: too short for a rest, as for `moma run`."""
    scene.write_text(f"{TWO_COURSES}[time]\nstep = 0.01\nduration = 0.02\n[output]\npictures = []\n")
    codes = [
        invoke(name, scene, "--db", url, "--out", tmp_path / name, *more).exit_code
        for name, *more in (("assess", "--load", "horizontal x"), ("run",))
    ]
    assert codes == [1, 1]


def test_a_scene_names_its_loads(url, scene, tmp_path):
    scene.write_text(
        TWO_COURSES_MIXED
        + """
[[assess]]
type = "tilt"
axis = [0.0, 1.0, 0.0]
[[assess]]
type = "force"
stones = ["W02-02"]
force = [0.0, 0.0, -1000.0]
""",
        encoding="utf-8",
    )
    told = answer("assess", scene, "--db", url, "--out", tmp_path / "out")
    tilt, press = told["loads"]
    along = answer("assess", scene, "--db", url, "--out", tmp_path / "out", "--load", "horizontal x")
    assert tilt["bound"] == pytest.approx(along["loads"][0]["bound"], rel=1e-6)
    assert press["outcome"] == "nothing limits it"
    assert press["bound"] is None
    assert "1 deformable stones count as rigid" in told["cautions"]


@pytest.mark.parametrize(
    "words", ["", "sideways x", "horizontal", "horizontal up", "horizontal nan", "force W02-02 1 2"]
)
def test_words_that_are_no_load_are_refused(url, scene, tmp_path, words):
    said = fails(2, "assess", scene, "--db", url, "--out", tmp_path / "out", "--load", words)
    assert repr(words) in said
    assert "horizontal x" in said
    assert not (tmp_path / "out").exists()


def test_all_questions_are_looked_at_before_the_first_is_answered(url, scene, tmp_path, monkeypatch):
    monkeypatch.setattr("pipelines.assess.assess.answer", lambda *_: pytest.fail("a question was answered"))
    loads = ["--load", "horizontal y", "--load", "force W91-01 0 0 -1"]
    said = fails(2, "assess", scene, "--db", url, "--out", tmp_path / "out", *loads)
    assert "no such stone: 'W91-01'; give the codes of stones of the scene, as W01-01" in said
    assert not (tmp_path / "out").exists()


def test_forces_on_fixed_stones_and_unsound_scenes_are_refused(url, scene, tmp_path):
    said = fails(2, "assess", scene, "--db", url, "--out", tmp_path / "out", "--load", "force W01-01 1 0 0")
    assert "fixed" in said
    said = fails(2, "assess", scene, "--db", url, "--out", tmp_path / "out", "--load", "force K99 1 0 0")
    assert "no such stone" in said
    scene.write_text(TWO_COURSES.replace("2350.0", "2.35"), encoding="utf-8")
    said = fails(1, "assess", scene, "--db", url, "--out", tmp_path / "out")
    assert "moma check" in said
    assert "--accept-unsound" not in said


def test_a_stopped_assessment_goes_on_from_its_answers(url, scene, plain, tmp_path, monkeypatch):
    words = ["assess", scene, "--db", url, "--out", tmp_path / "out", "--load", "tilt x", "--load", "tilt y"]
    asked = []

    def stopped(on, question, *others):
        asked.append(question.name)
        if len(asked) == 2:
            raise KeyboardInterrupt
        return real(on, question, *others)

    real = assess_module.answer
    monkeypatch.setattr(assess_module, "answer", stopped)
    done = invoke(*words)
    assert done.exit_code == 130
    assert "the same command goes on from there" in done.stderr
    assert asked == ["tilt x", "tilt y"]
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["unfinished-assessment"]
    told = answer(*words)
    assert asked == ["tilt x", "tilt y", "tilt y"]
    assert not (tmp_path / "out/unfinished-assessment").exists()
    # a finished assessment keeps no answers: its questions are asked again, with the same result
    assert answer(*words)["loads"] == told["loads"]
    assert asked[3:] == ["tilt x", "tilt y"]


def test_another_scene_does_not_replace_results_without_being_told(url, scene, plain, tmp_path):
    other = tmp_path / "other.toml"
    other.write_text(TWO_COURSES, encoding="utf-8")
    words = ["--db", url, "--out", tmp_path / "out", "--load", "tilt x"]
    prints("assess", scene, *words)
    assert "holds the results of" in fails(2, "assess", other, *words)
    scene.write_text(TWO_COURSES + "# edited\n", encoding="utf-8")
    assert answer("assess", scene, *words)["source"] == ["../two.toml"]
    assert answer("assess", other, *words, "--overwrite")["source"] == ["../other.toml"]


def test_results_of_a_run_are_not_replaced(url, scene, tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "summary.json").write_text('{"files": ["summary.json"]}', encoding="utf-8")
    assert "results of a run" in fails(2, "assess", scene, "--db", url, "--out", folder)


@pytest.mark.draws
def test_every_kind_of_question_has_an_answer(url, scene, tmp_path):
    scene.write_text(
        TWO_COURSES
        + """
[[assess]]
type = "horizontal"
direction = [0.0, 1.0, 0.0]
stones = ["course = 2"]
[[assess]]
type = "weight"
stones = ["W02-02"]
[[assess]]
type = "force"
stones = ["W02-02", "W02-03"]
force = [0.0, 5000.0, 0.0]
[[assess]]
type = "thrust"
stones = ["course = 1"]
direction = [0.0, 0.0, -1.0]
[[assess]]
type = "settlement"
stones = ["W01-01"]
direction = [0.0, 0.0, -1.0]
[[assess]]
type = "thickness"
""",
        encoding="utf-8",
    )
    out = tmp_path / "out"
    push, weight, force, thrust, yields, thin = answer("assess", scene, "--db", url, "--out", out)["loads"]
    assert 0.3 < push["limit"] <= push["bound"] < 0.61
    assert weight["outcome"] == "nothing limits it"
    assert not weight["mechanism"]["stones"]
    assert force["limit"] * 5.0 > 0.3
    # all of the weight, and nothing else, rests on the base
    told = json.loads((out / "assessment.json").read_text(encoding="utf-8"))
    assert thrust["least"] == pytest.approx(told["weight"], rel=1e-6)
    assert thrust["greatest"] == pytest.approx(told["weight"], rel=1e-6)
    assert 0.0 <= yields["least"] < yields["greatest"] < told["weight"]
    assert yields["mechanism"]["stones"][0]["code"] == "W01-01"
    # courses that stand on points stand however small their joints are
    assert thin["outcome"] == "nothing limits it"
    assert thin["factor"] is None
    lines = (out / "forces-1.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith("first,second,x,y,z,force_normal")
    assert len(lines) > 10


def test_an_assessment_is_kept_and_asked_for(url, scene, tmp_path):
    prints("assess", scene, "--db", url, "--out", tmp_path / "out", "--load", "horizontal y")
    assert "assessed" in prints("runs", "--db", url)
    moving = answer("query", "stone", "--db", url, "--where", "in_mechanism()", "--format", "json")
    told = json.loads((tmp_path / "out" / "assessment.json").read_text(encoding="utf-8"))
    codes = {stone["code"] for stone in told["loads"][0]["mechanism"]["stones"]}
    assert {one["code"] for one in moving} == codes
    none = answer("query", "stone", "--db", url, "--where", 'in_mechanism("tilt x")', "--format", "json")
    assert none == []


def test_a_check_by_a_code_needs_a_site_and_names_article_and_formula(url, scene, tmp_path):
    said = fails(2, "assess", scene, "--db", url, "--out", tmp_path / "out", "--code", "ntc2008")
    assert "[site]" in said
    site = "\n[site]\nag = 0.25\nf0 = 2.4\ntc_star = 0.3\nheight = 1.0\nbuilding_height = 9.0\nperiod = 0.3\n"
    scene.write_text(TWO_COURSES + site, encoding="utf-8")
    said = fails(2, "assess", scene, "--db", url, "--out", tmp_path / "out", "--code", "ec9")
    assert "ntc2008, ntc2018" in said
    loads = ("--load", "horizontal y", "--load", "force W02-02 0 0 -1000")
    text = prints("assess", scene, "--db", url, "--out", tmp_path / "out", *loads, "--code", "ntc2018")
    first, *_ = text.splitlines()
    assert "not checked by the code, which takes pushes on all stones: force W02-02" in text
    assert "NTC 2018" in first
    assert "above the ground 1.1/√ξ1 of C7.2.6 takes ξ1 as a ratio" in first
    assert "a0* ≥ ag S / q, q = 2   [C8.7.1.2.1.7]" in text
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "a0* ≥ ag S / q" in page
    assert "ξ1 as a ratio" in page.split("<h2>")[0]


PUSH = '[[assess]]\ntype = "horizontal"\ndirection = [0.0, 1.0, 0.0]\n'
SITE = "[site]\nag = 0.25\nf0 = 2.4\ntc_star = 0.3\n"


def test_questions_of_a_scene_ask_for_runs_and_codes_each_for_itself(url, scene, tmp_path):
    asked = f'{PUSH}code = "ntc2018"\n{PUSH}stones = ["W02-02", "W02-03"]\n'
    scene.write_text(TWO_COURSES + SITE + asked, encoding="utf-8")
    told = answer("assess", scene, "--db", url, "--out", tmp_path / "out")
    assert [one.get("code", {}).get("code", "") for one in told["loads"]] == ["NTC 2018, circular 7/2019", ""]
    told = answer("assess", scene, "--db", url, "--out", tmp_path / "out", "--code", "ntc2008")
    assert told["loads"][0]["code"]["code"].startswith("NTC 2018")
    assert "code" not in told["loads"][1]
    assert not any(key in one for one in told["loads"] for key in ("confirmation", "pushover"))


@pytest.mark.parametrize(
    ("site", "given", "said"),
    [
        (SITE, 'code = "ec9"\n', "no such code: 'ec9'; give one of ntc2008, ntc2018"),
        ("", 'code = "ntc2018"\n', "needs the seismic action; add a table [site]"),
        (
            SITE,
            'stones = ["W02-02"]\ncode = "ntc2018"\n',
            "of a push on some stones; leave out code, or stones",
        ),
    ],
)
def test_checks_by_a_code_that_cannot_be_made_are_refused_with_their_line(
    url, scene, tmp_path, site, given, said
):
    text = TWO_COURSES + site + PUSH + given
    scene.write_text(text, encoding="utf-8")
    line = text[: text.index("code = ")].count("\n") + 1
    message = fails(2, "assess", scene, "--db", url, "--out", tmp_path / "out")
    assert f"two.toml:{line}: " in message
    assert said in message


def test_a_run_leads_a_mechanism_to_collapse(url, scene, tmp_path):
    out = tmp_path / "out"
    scene.write_text(f"{TWO_COURSES}{PUSH}pushover = true\n", encoding="utf-8")
    told = answer("assess", scene, "--db", url, "--out", out)
    (one,) = told["loads"]
    curve = one["pushover"]
    assert 0.95 * one["limit"] < curve["peak"] < 1.01 * one["bound"]
    assert f"moves at {curve['onset']:.4g}, then bears {curve['peak']:.4g}" in told["headline"]
    head, *rows = (out / "pushover-1.csv").read_text(encoding="utf-8").splitlines()
    assert head == "displacement,multiplier,inertia"
    assert len(rows) == len(curve["curve"]["multiplier"])
    assert {"pushover-1.csv", "pushover-1.png"} <= set(told["files"])
    assert "led to collapse" in (out / "report.html").read_text(encoding="utf-8")


def test_runs_confirm_a_limit(url, scene, tmp_path):
    (told,) = answer(
        "assess", scene, "--db", url, "--out", tmp_path / "out", "--load", "horizontal y", "--confirm"
    )["loads"]
    assert told["confirmation"]["agrees"]
    assert 0.97 * told["confirmation"]["lost"] <= told["confirmation"]["held"] <= told["bound"]
    assert "CONFIRMED" in told["headline"]
    alike = told["confirmation"]["likeness"]
    assert f"the mechanism (cosine {alike['cosine']:.2f})" in told["headline"]
    assert 0.0 < alike["common"] <= 1.0
