"""Diagnosis: its file, the search, the rank, and the date, on walls whose movement is a formula."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from ground.errors import SceneError
from ground.toml.lines import parse_toml
from ground.toml.writer import toml_text
from pipelines.assess.diagnosis.dating import date_movement
from pipelines.assess.diagnosis.file import Unknown, read_diagnosis
from pipelines.assess.diagnosis.fit import Fit, fit
from pipelines.assess.diagnosis.measurements import Measurements, measure
from pipelines.assess.diagnosis.ranking import STILL, Ranking, rank, verdict, with_others
from pipelines.assess.diagnosis.search import cases_of, fit_cases, kept_runner, runs_of
from pipelines.assess.diagnosis.smoothness import probes, with_unevenness
from pipelines.assess.diagnosis.trials import Trial, Tried, runner
from pipelines.assess.kept import kept_answers
from pipelines.assess.motions import Motions
from pipelines.scene.file import parse_scene
from survey.quality.deformation import Deformation
from survey.quality.facades import facades_of
from survey.quality.precision import appraise
from synthetic.buildings.walls import wall
from synthetic.frame import RigidMotion
from tests.paths import ROOT

SCENE = """
[scene]
name = "a wall, \\"old\\""
[materials.limestone]
density = 2350.0
young = 12e9
poisson = 0.2
[[loads]]
type = "gravity_ramp"
duration = 0.1
"""

HYPOTHESES = """
[diagnosis]
battered = true
[[hypotheses]]
name = "turned"
[[hypotheses.unknowns]]
name = "angle"
unit = "mm/m"
start = 0.0
low = -20.0
high = 20.0
[hypotheses.scene.time]
step = 0.02
[[hypotheses.scene.loads]]
type = "settlement"
stones = ["W01-01"]
displacement = [0.0, 0.0, "= -(angle + 1) / 2e3"]
duration = 1.0
[[hypotheses]]
name = "sheared"
[[hypotheses.unknowns]]
name = "slip"
unit = "mm/m"
start = 0.0
low = -20.0
high = 20.0
[hypotheses.scene.contact]
friction = "= 0.6 + slip * 0"
"""


def written(tmp_path, text):
    path = tmp_path / "wall.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_hypothesis_changes_a_scene(tmp_path):
    file = read_diagnosis(written(tmp_path, SCENE + HYPOTHESES))
    turned, sheared = file.hypotheses
    text = toml_text(turned.scene(file.base, (9.0,)))
    scene = parse_scene(text, "wall.toml")
    assert scene.name == 'a wall, "old"'
    assert scene.time.step == 0.02
    assert [one.type for one in scene.loads] == ["gravity_ramp", "settlement"]
    assert scene.loads[1].values["displacement"] == pytest.approx((0.0, 0.0, -0.005))
    assert parse_toml(text, "", SceneError, "")["materials"] == file.base["materials"]
    assert parse_scene(toml_text(sheared.scene(file.base, (3.0,))), "").contact.law.friction == 0.6
    # a scene with hypotheses is a scene all the same
    assert parse_scene(SCENE + HYPOTHESES, "wall.toml").name == scene.name


FORMULA = '"= -(angle + 1) / 2e3"'


@pytest.mark.parametrize(
    ("old", "new", "line", "said"),
    [
        (FORMULA, '"= -(angel + 1)"', "displacement", "'angel' is none of its unknowns"),
        (FORMULA, '"= angle ** 2"', "displacement", "not a formula"),
        (FORMULA, '"= angle /"', "displacement", "not a formula"),
        (FORMULA, "0.0", 'name = "angle"', "unknown 'angle' stands in no formula"),
        ("start = 0.0", "start = 30.0", "start", "is not between low = -20 and high = 20"),
        ('name = "sheared"', 'name = "turned"', 'second name = "turned"', "two hypotheses 'turned'"),
        ("battered = true", 'phases = ["1"]', "phases", "are not several"),
        ("battered = true", 'without = ["load"]', "without", "did you mean 'loads'?"),
        ("battered = true", "batered = true", "batered", "did you mean 'battered'?"),
        ('unit = "mm/m"', "", "[[hypotheses.unknowns]]", "has no 'unit'"),
    ],
)
def test_mistakes_are_named_with_their_line(tmp_path, old, new, line, said):
    text = SCENE + HYPOTHESES.replace(old, new, 1)
    path = written(tmp_path, text)
    with pytest.raises(SceneError) as raised:
        read_diagnosis(path)
    assert said in str(raised.value)
    there = [k for k, one in enumerate(text.splitlines(), 1) if one.startswith(line.removeprefix("second "))]
    assert raised.value.where == f"{path}:{there[line.startswith('second')]}"


def searched(unknowns, residuals):
    """The fit to residuals that are a function of the amplitudes, and the places it asked for."""
    search, places = fit(unknowns), []
    asked = next(search)
    while True:
        places += asked
        try:
            asked = search.send([residuals(*place) for place in asked])
        except StopIteration as end:
            return end.value, places


def unknown(name, start=0.0, low=-1.0, high=1.0, step=0.01):
    return Unknown(name, "m", start, low, high, step)


def test_amplitudes_that_act_together_nonlinearly_are_found():
    data = np.random.default_rng(1).normal(size=30)
    place = np.linspace(0.0, 1.0, 30)

    def residuals(a, b):
        return data + 50.0 * (np.sin(3.0 * (a - 0.4) * place) + (b + 0.2) * place**2)

    found, places = searched([unknown("a"), unknown("b")], residuals)
    # within 4 σ of the truth, and no better place beside it
    sigma = np.sqrt(np.diag(found.covariance))
    assert np.abs(np.array(found.amplitudes) - [0.4, -0.2]).max() < 4.0 * sigma.max()
    assert found.trouble == ""
    for shift in np.vstack([np.diag(sigma), -np.diag(sigma)]):
        beside = residuals(*(np.array(found.amplitudes) + shift))
        assert beside @ beside > found.chi2
    assert np.abs(np.array(places)).max() <= 1.0


def test_bounds_hold_and_what_moves_nothing_is_not_determined():
    place = np.arange(1.0, 21.0)

    def residuals(a, b):
        return 10.0 * (a - 3.0) * place

    found, places = searched([unknown("a"), unknown("b", start=0.5)], residuals)
    assert found.amplitudes == pytest.approx((1.0, 0.5))
    assert np.abs(np.array(places)).max() <= 1.0
    assert np.abs(found.undetermined) == pytest.approx(np.array([[0.0, 1.0]]))
    told = rank("x", (), [unknown("a"), unknown("b")], found, 20, 0)
    assert told.estimates[0].at_bound
    assert told.estimates[1].low == -np.inf
    assert any(remark.endswith("that was measured: b") for remark in told.remarks)


def test_amplitudes_that_do_the_same_cannot_be_told_apart():
    place = np.linspace(0.0, 1.0, 40)

    def residuals(a, b):
        return 20.0 * ((a - 0.3) + (b + 0.1) * (1.0 + 0.2 * place))

    unknowns = [unknown("a"), unknown("b")]
    told = rank("x", (), unknowns, searched(unknowns, residuals)[0], 40, 0)
    assert any("a and b cannot be told apart" in remark for remark in told.remarks)
    said = verdict(Ranking((told,), still_of(900.0, 40)))
    assert "CAUTION: a and b cannot be told apart: their correlation is -0.9" in said


def test_amounts_beyond_an_interval_that_explain_as_well_are_told():
    one = hypothesis("a", 45.0)
    half = one.estimates[0].high - 0.03
    near = with_others(one, {(0.03,): 45.0, (0.03 + 0.9 * half,): 48.0, (0.06,): 60.0})
    assert near == one
    told = with_others(one, {(0.03,): 45.0, (0.05,): 47.0})
    said = "settlement = 0.05 m explains as well, so that its intervals are too narrow"
    assert told.remarks[-1] == said
    assert said in verdict(Ranking((told,), still_of(900.0, 50)))


def test_runs_that_fail_are_told():
    failed, _ = searched([unknown("a")], lambda a: "the run ended in collapse")
    told = rank("x", (), [unknown("a")], failed, 20, 0)
    assert told.aicc == np.inf
    assert told.remarks == ("not run: the run ended in collapse",)
    # one that fails only far away costs a shorter step
    place = np.ones(10)
    found, _ = searched(
        [unknown("a", start=0.9)], lambda a: "collapse" if a < 0.3 else 10.0 * (a**3 - 0.1) * place
    )
    assert found.amplitudes[0] == pytest.approx(0.1 ** (1 / 3), abs=0.01)


def from_a_threshold(a):
    """Residuals of stones that slide by the square of what an amplitude is over 0.4, which is 0.3 in truth."""
    return 20.0 * (max(0.0, abs(a) - 0.4) ** 2 - 0.09) * np.ones(30)


def test_an_amplitude_that_acts_from_a_threshold_on_is_found():
    found, places = searched([unknown("a", start=0.1, low=0.0, high=1.0)], from_a_threshold)
    assert found.amplitudes[0] == pytest.approx(0.7, abs=0.01)
    assert found.undetermined == ()
    # the range is scanned as nothing moves at the start; not where it answers
    assert (0.0625,) in places
    _, places = searched([unknown("a", start=0.6, low=0.0, high=1.0)], from_a_threshold)
    assert (0.0625,) not in places


def test_a_scan_that_is_asked_for_leaves_a_minimum_beside_the_best():
    def residuals(a):
        # minima near -0.6 and at 0.6
        return np.array([20.0 * (a**2 - 0.36), 3.0 * (a - 0.6)])

    near, _ = searched([unknown("a", start=-0.7)], residuals)
    best, places = searched([replace(unknown("a", start=-0.7), scan=4)], residuals)
    assert near.amplitudes[0] < 0.0
    assert best.amplitudes[0] > 0.0
    assert best.chi2 < near.chi2
    assert {(-0.75,), (-0.25,), (0.25,), (0.75,)} < set(places)


def test_a_start_at_which_the_run_fails_is_left():
    def residuals(a):
        return "the run ended in collapse" if a > 0.5 else 10.0 * (a - 0.2) * np.ones(10)

    found, _ = searched([unknown("a", start=0.9)], residuals)
    assert found.amplitudes[0] == pytest.approx(0.2, abs=1e-6)


def test_two_amplitudes_that_answer_nowhere_are_not_determined():
    found, places = searched([unknown("a"), unknown("b")], lambda a, b: np.ones(10))
    assert len(found.undetermined) == 2
    assert found.amplitudes == (0.0, 0.0)
    assert len(set(places)) == 3 + 16


def uneven_line(jump, seed):
    """Rank of a hypothesis with residuals that are a line in its amplitude, but for a jump of their own in each run."""
    place = np.linspace(0.5, 1.0, 40)
    data = np.random.default_rng(seed).normal(size=40)

    def residuals(a):
        own = np.random.default_rng(abs(hash((seed, round(a, 12))))).normal()
        return data + 100.0 * (a - 0.3 + jump * own) * place

    unknowns = [unknown("a", step=0.1)]
    told = rank("x", (), unknowns, searched(unknowns, residuals)[0], 40, 0)
    asked = {x: residuals(*x) for own in probes(unknowns, told.fit.amplitudes) for x in own}
    return told, with_unevenness(told, unknowns, asked)


def test_runs_that_do_not_answer_smoothly_widen_the_interval_and_are_told():
    smooth, same = uneven_line(0.0, 1)
    assert same.estimates[0].low == pytest.approx(smooth.estimates[0].low)
    assert same.uneven == ()
    told = [uneven_line(0.02, seed) for seed in range(40)]
    # the survey alone knows the amount to 0.002 or so: with the runs' own jumps of 0.02 that is no interval
    covered = [
        sum(one.estimates[0].low <= 0.3 <= one.estimates[0].high for one in half)
        for half in zip(*told, strict=True)
    ]
    assert covered[0] <= 16
    assert covered[1] >= 32
    assert np.sqrt(np.mean([one.estimates[0].run_sigma ** 2 for _, one in told])) == pytest.approx(
        0.02, rel=0.3
    )
    (_, one), *_ = told
    assert one.uneven[0].startswith("a by 0.0")
    said = verdict(Ranking((one,), still_of(900.0, 40)))
    assert "CAUTION: runs do not answer smoothly: a by 0.0" in said


def test_runs_that_fail_beside_the_best_amount_are_told():
    told, _ = uneven_line(0.0, 1)
    unknowns = [unknown("a", step=0.1)]
    asked = {x: "the run ended in collapse" for own in probes(unknowns, told.fit.amplitudes) for x in own}
    found = with_unevenness(told, unknowns, asked)
    assert found.estimates == told.estimates
    assert found.remarks[-1].endswith("may be too narrow: the run ended in collapse")


def test_probes_keep_within_the_bounds():
    unknowns = [unknown("a", step=0.4), unknown("b")]
    first, second = probes(unknowns, (1.0, 0.2))
    assert [x for x, _ in first] == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
    assert {y for _, y in first} == {0.2}
    assert [y for _, y in second] == pytest.approx([0.19, 0.195, 0.2, 0.205, 0.21])


def still_of(chi2, dof):
    return rank(STILL, (), (), Fit((), np.full(1, chi2**0.5), np.zeros((0, 0)), (), 0), dof, 0)


def hypothesis(name, chi2, dof=50):
    found = Fit((0.03,), np.full(1, chi2**0.5), np.array([[1e-6]]), (), 3)
    return rank(name, (), [unknown("settlement")], found, dof, 0)


def test_the_first_line_gives_the_verdict_with_its_caution():
    ranking = Ranking(
        (hypothesis("a", 45.0), hypothesis("b", 49.0), hypothesis("c", 90.0)), still_of(900.0, 50)
    )
    assert verdict(ranking).startswith(
        "'a' explains what was measured (χ² 45 of 49, 900 of 50 if nothing had moved)"
    )
    assert "settlement = 0.0300 ± 0.0020 m (95 %)" in verdict(ranking)
    assert verdict(ranking).endswith("CAUTION: it cannot be told apart from 'b'")
    early = hypothesis("a", 45.0)
    early = replace(early, fit=replace(early.fit, trouble="not converged in 12 turns"))
    assert "CAUTION: not converged in 12 turns; " in verdict(replace(ranking, hypotheses=(early,)))
    alone = replace(ranking, hypotheses=(hypothesis("a", 45.0),))
    assert verdict(alone).endswith("CAUTION: a cause that is not in the list may move the stones alike")
    wrong = replace(ranking, hypotheses=(hypothesis("c", 90.0),))
    assert verdict(wrong).startswith("NONE OF THESE EXPLAINS what was measured; the best of them is 'c'")
    failed = rank(
        "d", (), (), Fit((), np.zeros(0), np.zeros((0, 0)), (), 1, "the run ended in collapse"), 50, 0
    )
    nothing = replace(ranking, hypotheses=(failed,))
    assert verdict(nothing).startswith("NONE OF THESE could be run; of 'd': the run ended in collapse")
    level = replace(ranking, still=still_of(46.0, 50))
    assert verdict(level).startswith("no movement is needed")


def test_still_stones_are_no_answer_where_a_movement_explains_far_better():
    """χ² 60 of 50 may be chance; but 30 with one amount is 28 less in AICc."""
    still = still_of(60.0, 50)
    assert still.explains
    assert verdict(Ranking((hypothesis("a", 30.0),), still)).startswith("'a' explains what was measured")
    assert verdict(Ranking((hypothesis("a", 57.0),), still)).startswith("no movement is needed")


def fitted(chi2, unknowns):
    return Fit((0.03,) * unknowns, np.full(1, chi2**0.5), 1e-6 * np.eye(unknowns), (), 3)


def test_few_values_make_each_amount_dearer():
    """AICc = χ² + 2k + 2k (k + 1)/(n - k - 1) (Hurvich & Tsai 1989), with n = 10."""
    for count, added in ((0, 0.0), (1, 2.0 + 4.0 / 8.0), (2, 4.0 + 12.0 / 7.0)):
        names = [unknown(f"{k}") for k in range(count)]
        assert rank("x", (), names, fitted(8.0, count), 10, 0).aicc == pytest.approx(8.0 + added)


def test_a_scatter_that_few_steps_tell_makes_a_large_misfit_likelier():
    """χ² over its degrees of freedom follows F(dof, steps), not χ² alone."""
    few, exact = (rank("x", (), [unknown("a")], fitted(80.0, 1), 51, steps) for steps in (12, 0))
    assert few.probability == pytest.approx(stats.f.sf(80.0 / 50.0, 50, 12), rel=1e-6)
    assert exact.probability == pytest.approx(stats.chi2.sf(80.0, 50), rel=1e-4)
    assert few.explains
    assert not exact.explains


def test_an_interval_is_as_wide_as_the_misfit_says():
    """Residuals of twice their standard deviation double it; smaller ones than expected do not narrow it."""
    student = stats.t.ppf(0.975, 50)
    for chi2, wider in ((20.0, 1.0), (50.0, 1.0), (200.0, 2.0)):
        (one,) = rank("x", (), [unknown("a")], fitted(chi2, 1), 51, 0).estimates
        assert one.high - one.value == pytest.approx(wider * student * 1e-3)
        assert one.value - one.low == pytest.approx(wider * student * 1e-3)


def test_a_date_is_as_certain_as_the_nearest_other_one(tmp_path):
    text = HYPOTHESES.replace("battered = true", 'phases = ["old", "later", "new"]')
    file = read_diagnosis(written(tmp_path, SCENE + text))
    dates = [
        replace(hypothesis("turned", chi2), stood=file.phases[:count])
        for chi2, count in ((40.0, 1), (55.0, 2), (90.0, 3))
    ]
    nothing = Measurements((), (), Deformation((), {}, 0), {}, frozenset())
    dating = date_movement(file, Ranking(tuple(dates), still_of(900.0, 50)), nothing, Motions({}, {}))
    assert dating.verdict == (
        "the movement is younger than phase old and older than phase later "
        "(AICc of other dates larger by 15 or more)"
    )


def turning(angle, slip, pivot, along, codes):
    """Motions of stones that turn in the plane of the wall and slip over each other [mm/m]."""
    up = np.array([0.0, 0.0, 1.0])
    gradient = 1e-3 * (angle * (np.outer(along, up) - np.outer(up, along)) + slip * np.outer(up, along))
    field = np.vstack([-pivot @ gradient, gradient])
    return Motions(dict.fromkeys(codes, np.zeros(3)), dict.fromkeys(codes, field))


def laid():
    return wall(60, seed=3)


def turned_wall(movement, seed):
    return wall(60, seed=3, movement=movement, measured=seed)


@pytest.fixture(scope="module")
def truth():
    """A wall of which courses 1 to 3, or all, have turned by 6 mm/m; its plane and the codes of its courses."""
    building = laid()
    first = building.solids[0].vertices
    along = (first[1] - first[0]) * [1.0, 1.0, 0.0]
    along /= np.linalg.norm(along)
    axis = np.cross([0.0, 0.0, 1.0], along)
    cross = np.array([(0, -axis[2], axis[1]), (axis[2], 0, -axis[0]), (-axis[1], axis[0], 0)])
    rotation = np.eye(3) - 6e-3 * cross
    motion = RigidMotion(rotation, first[0] - rotation @ first[0])
    course = {one.code: one.course for one in building.survey.blocks}
    return first[0], along, course, motion


def answers(truth):
    """Runs without a simulation: hypotheses act on the stones that stood."""
    pivot, along, course, _ = truth

    def runs(places):
        found = []
        for case, (x,) in places:
            codes = [code for code in course if code not in case.later]
            amounts = (x, 0.0) if case.hypothesis.name == "turned" else (0.0, x)
            found.append(Tried(turning(*amounts, pivot, along, codes), "", 0.0))
        return found

    return runs


def surveyed(file, building, phases=None):
    stones = [appraise(block) for block in building.blocks()]
    return measure(file, stones, facades_of(stones), phases or {})


def test_the_true_cause_is_ranked_first_and_its_amount_within_its_interval(truth, tmp_path):
    file = read_diagnosis(written(tmp_path, SCENE + HYPOTHESES))
    cases = cases_of(file, {})
    _, _, course, motion = truth
    covered = []
    for seed in range(12):
        found = surveyed(file, turned_wall(dict.fromkeys(course, motion), seed))
        done = fit_cases(cases, found.deformation, answers(truth))
        best, other = done.ranking.hypotheses
        assert best.name == "turned"
        assert best.explains
        assert not other.explains
        (amount,) = best.estimates
        covered.append(amount.low <= 6.0 <= amount.high)
        assert amount.high - amount.low < 2.0
        wrong = Ranking((other,), done.ranking.still)
        assert verdict(wrong).startswith("NONE OF THESE EXPLAINS")
    # of 12 at 95 % three or more fail in one of fifty
    assert sum(covered) >= 10
    unmoved = surveyed(file, laid())
    done = fit_cases(cases, unmoved.deformation, answers(truth))
    assert verdict(done.ranking).startswith("no movement is needed")


def test_what_cannot_be_told_apart_is_tried_beside_its_amounts_and_distrust_is_told(truth, tmp_path):
    """Both hypotheses turn the stones, but the other one of them by half; its runs do not come to rest."""
    file = read_diagnosis(written(tmp_path, SCENE + HYPOTHESES))
    pivot, along, course, motion = truth

    def runs(places):
        for case, (x,) in places:
            whole = case.hypothesis.name == "turned"
            fault = "" if whole else "its run did not come to rest: moving"
            motions = turning(x, 0.0, pivot, along, list(course))
            field = dict(motions.field) | {"W01-01": (1.0 if whole else 0.5) * motions.field["W01-01"]}
            yield Tried(replace(motions, field=field), fault, 0.0)

    found = surveyed(file, turned_wall(dict.fromkeys(course, motion), 3))
    done = fit_cases(cases_of(file, {}), found.deformation, runs)
    first, second = done.ranking.hypotheses
    assert 0.1 < second.aicc - first.aicc < 5.0
    for one in done.ranking.hypotheses:
        assert np.isfinite(one.estimates[0].run_sigma)
        assert ("its run did not come to rest: moving" in one.remarks) == (one.name == "sheared")


def test_stones_that_a_scene_leaves_out_stay_out_at_every_date(tmp_path):
    text = SCENE.replace("[materials", '[select]\nexclude = ["loose"]\n[materials') + HYPOTHESES
    file = read_diagnosis(written(tmp_path, text.replace("battered = true", 'phases = ["old", "new"]')))
    whole, early = cases_of(file, {"a": "old", "b": "new"})[:2]
    assert whole.scene(file, (1.0,))["select"]["exclude"] == ["loose"]
    assert early.scene(file, (1.0,))["select"]["exclude"] == ["loose", "b"]


@pytest.mark.parametrize("last", [3, 99])
def test_a_movement_is_dated_by_the_phase_that_was_laid_level_over_it(truth, tmp_path, last):
    text = HYPOTHESES.replace("battered = true", 'battered = true\nphases = ["old", "new"]')
    file = read_diagnosis(written(tmp_path, SCENE + text))
    pivot, along, course, motion = truth
    phases = {code: "old" if number <= 3 else "new" for code, number in course.items()}
    moved = {code: motion for code, number in course.items() if number <= last}
    found = surveyed(file, turned_wall(moved, 5), phases)
    assert {course[code] for code in found.resting} == {4}
    done = fit_cases(cases_of(file, phases), found.deformation, answers(truth))
    best = done.ranking.hypotheses[0]
    whole = turning(best.fit.amplitudes[0], 0.0, pivot, along, list(course))
    dating = date_movement(file, done.ranking, found, whole)
    old, new = dating.shares
    assert old.value == pytest.approx(1.0, abs=4.0 * old.sigma)
    if last == 3:
        assert dating.verdict.startswith("the movement is younger than phase old and older than phase new")
        assert new.value == pytest.approx(0.0, abs=4.0 * new.sigma)
    else:
        assert dating.verdict.startswith("the movement is younger than phase new (")
        assert new.value == pytest.approx(1.0, abs=4.0 * new.sigma)
    told = "\n".join(dating.evidence)
    assert "W04-01" in told
    assert "of phase new rest on stones of an earlier phase" in told
    assert "course 3: W03-" in told
    # beds on older work are not told
    assert not any("course 4:" in line for line in dating.evidence)


def test_one_interface_runs_scenes_here_or_elsewhere(truth, tmp_path):
    file = read_diagnosis(written(tmp_path, SCENE + HYPOTHESES))
    case = cases_of(file, {})[0]
    asked = []

    def elsewhere(trials):
        asked.extend(trials)
        return [Tried(None, "no cluster today", 0.0) for _ in trials]

    (answer,) = runs_of(file, "sqlite:///none.db", elsewhere)([(case, (1.0,))])
    assert answer.fault == "no cluster today"
    assert parse_scene(asked[0].text, "").loads[1].values["displacement"] == pytest.approx((0, 0, -1e-3))
    # a run that fails is an answer, not an end of all
    with runner(1) as here:
        (failed,) = here(asked)
    assert failed.motions is None
    assert "none.db" in failed.fault


@pytest.mark.slow
def test_runs_in_processes_of_their_own_answer_in_order():
    trials = [Trial(f"[scene]\nname = {k}\n", f"scene {k}", "sqlite:///none.db") for k in range(5)]
    with runner(2) as beside:
        faults = [one.fault for one in beside(trials)]
    assert [fault.split(":")[0] for fault in faults] == [f"scene {k}" for k in range(5)]


@pytest.mark.parametrize(
    ("formula", "words"),
    [
        ("-" * 20000 + "angle", "a formula of 20007 characters"),
        ("-" * 400 + "angle", ""),
        ("(" * 240 + "angle" + ")" * 240, "not a formula"),
        ("+".join(["angle"] * 80), ""),
        ("angle * 1e400", "it has no finite value at angle = 0.731059"),
        ("angle + " + "9" * 400, "it has no finite value"),
        ("angle / (1 - 1)", "it has no finite value"),
    ],
)
def test_a_formula_is_short_shallow_and_finite(tmp_path, formula, words):
    text = (SCENE + HYPOTHESES).replace("= -(angle + 1) / 2e3", f"= {formula}")
    if not words:
        assert len(read_diagnosis(written(tmp_path, text)).hypotheses) == 2
        return
    with pytest.raises(SceneError) as caught:
        read_diagnosis(written(tmp_path, text))
    assert words in str(caught.value)
    assert len(str(caught.value)) < 300
    assert caught.value.where


def test_a_formula_without_a_value_at_an_amount_is_a_run_that_fails(tmp_path):
    text = (SCENE + HYPOTHESES).replace("= -(angle + 1) / 2e3", "= 1 / (angle - 5)")
    file = read_diagnosis(written(tmp_path, text))
    case = cases_of(file, {})[0]

    def all_fall(trials):
        return [Tried(None, "the run ended in collapse", 0.0) for _ in trials]

    runs = runs_of(file, "sqlite:///none.db", all_fall)
    first, second, third = runs([(case, (x,)) for x in (4.0, 5.0, 6.0)])
    assert first.fault == third.fault == "the run ended in collapse"
    assert second.fault == "'= 1 / (angle - 5)': it has no finite value at angle = 5"


def test_hypotheses_that_look_alike_are_refused(tmp_path):
    text = (SCENE + HYPOTHESES).replace('name = "sheared"', 'name = "turn\N{CYRILLIC SMALL LETTER IE}d"')
    with pytest.raises(SceneError, match="looks like turned, but has CYRILLIC SMALL LETTER IE"):
        read_diagnosis(written(tmp_path, text))


def test_a_diagnosis_tells_its_total_and_each_fit_and_makes_no_run_twice(truth, tmp_path):
    file = read_diagnosis(written(tmp_path, SCENE + HYPOTHESES))
    cases = cases_of(file, {})
    _, _, course, motion = truth
    found = surveyed(file, turned_wall(dict.fromkeys(course, motion), 3))
    heard, asked = [], []

    def runs(places):
        for case, x in places:
            asked.append((case.hypothesis.name, x))
            yield from answers(truth)([(case, x)])

    done = fit_cases(cases, found.deformation, runs, heard.append)
    assert len(set(asked)) == len(asked) == done.runs
    counted = [one for one in heard if not one.found]
    assert all(one.stage == "run" and one.done <= one.total for one in heard)
    assert [one.done for one in counted] == sorted(one.done for one in counted)
    # every run is told as it is made, with a total that is never far off
    assert {one.done for one in counted} == set(range(done.runs + 1))
    assert all(one.total <= 2.5 * done.runs for one in counted)
    assert counted[-1].done == counted[-1].total == done.runs
    fits = [one.found for one in heard if one.found]
    assert sorted(fit.split(":")[0] for fit in fits) == ["'sheared'", "'turned'"]
    assert any(fit.startswith("'turned': χ²") and "angle = " in fit for fit in fits)


def test_a_stopped_diagnosis_goes_on_from_its_runs(tmp_path):
    file = read_diagnosis(written(tmp_path, SCENE + HYPOTHESES))
    table = Path(file.scene_path).parent / "table.csv"
    table.write_text("0, 1\n", encoding="utf-8")
    tables = '\n[[loads]]\ntype = "force"\nfile = "table.csv"\n'
    trials = [Trial(f"[scene]\nname = {k}{tables}", "", "") for k in range(4)]
    made = []

    def run(trials, most):
        for one in trials:
            if len(made) == most:
                raise KeyboardInterrupt
            made.append(one)
            yield Tried(None, one.text.split("\n")[1], 0.0)

    def all_answers(solids="", most=99):
        with kept_answers(tmp_path / "out", "unfinished", (Tried, Motions)) as kept:
            runner = kept_runner(file, solids, kept, lambda trials: run(trials, most))
            return [one.fault for one in runner(trials)]

    with pytest.raises(KeyboardInterrupt):
        all_answers(most=2)
    assert all_answers() == [f"name = {k}" for k in range(4)]
    assert made == trials
    assert all_answers() == [f"name = {k}" for k in range(4)]
    assert len(made) == 4
    # other stones, or another table beside the scene, are other runs
    all_answers("other stones")
    assert len(made) == 8
    table.write_text("0, 2\n", encoding="utf-8")
    all_answers()
    assert len(made) == 12


KILLED = """
import multiprocessing, signal, threading, time
from pipelines.assess.diagnosis.trials import Trial, runner

def soon(act):
    def waiting():
        while not multiprocessing.active_children():
            time.sleep(0.01)
        time.sleep(0.1)
        act()
    threading.Thread(target=waiting).start()

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)
    trial = Trial("[scene]\\nname = 1\\n", "scene 1", "sqlite:///none.db")
    with runner(2) as beside:
        soon(lambda: [one.kill() for one in multiprocessing.active_children()])
        killed = next(iter(beside([trial])))
        assert killed.motions is None
        assert "was killed by signal 9" in killed.fault, killed.fault
        # the next scene has a process of its own, which an interruption ends within its run
        soon(lambda: signal.raise_signal(signal.SIGINT))
        try:
            next(iter(beside([trial])))
        except KeyboardInterrupt:
            print("interrupted")
        (running,) = multiprocessing.active_children()
    assert not running.is_alive()
    assert multiprocessing.active_children() == []
"""


def test_a_run_whose_process_is_killed_has_failed_and_no_process_is_left(tmp_path):
    """In a process of its own, as an interruption that comes late would end that of the tests."""
    (tmp_path / "killed.py").write_text(KILLED, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, tmp_path / "killed.py"],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (done.returncode, done.stdout) == (0, "interrupted\n"), done.stderr
