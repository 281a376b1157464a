"""Answers of an assessment: cautions, which of two candidates a code checks, runs that decide nothing."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.limit.assembly import assembly
from mechanics.limit.confirm import Confirmation, ConfirmationRun
from mechanics.limit.held import HeldLimit
from mechanics.limit.limit_load import Flow, limit_load
from mechanics.limit.live_loads import Acceleration
from pipelines.assess import answers
from pipelines.assess.answers import _confirmed, answer
from pipelines.assess.assess import _title
from pipelines.assess.questions import LoadQuestion
from pipelines.scene.site import Site
from tests.mechanics.shapes import brick, ground, scene

SITE = Site(ag=0.25, f0=2.4, tc_star=0.3)


@pytest.fixture(scope="module")
def on():
    """A stone of 0.4 by 1.6 m: it tips at a quarter of its weight."""
    return assembly(scene(ground(), brick("a", (0, 0, 0), (0.4, 1.0, 1.6))))


def asked(on, monkeypatch, changed, held=0.2, lost=0.21, **question):
    """What is told of a push along x whose candidate is changed, and which runs hold and lose."""

    def found(on, live, flow=Flow.ASSOCIATIVE, bound=None):
        one = limit_load(on, live, flow, bound)
        return changed(one) if flow is Flow.COULOMB else one

    def runs(live, candidate, bound):
        trial = ConfirmationRun(lost, Outcome.MOVING, 10, 0, np.zeros((len(on.model.mass), 3)))
        return Confirmation(held, lost, (trial,))

    monkeypatch.setattr(answers, "limit_load", found)
    push = LoadQuestion("push", Acceleration((1.0, 0.0, 0.0)), **question)
    return answer(on, push, runs, lambda *_: pytest.fail("nothing is led"), SITE).told


def test_the_line_says_what_runs_hold_and_where_other_forces_hold_less(on, monkeypatch):
    told = asked(on, monkeypatch, lambda one: one)
    assert told["headline"] == "push: λ = 0.2495 (held; 0.25 is lost), bound 0.25, a tilt of 14°"
    assert told["limit"] < told["bound"] <= 1.003 * told["limit"]
    assert "confirmation" not in told
    told = asked(on, monkeypatch, lambda one: replace(one, multiplier=0.2, converged=False))
    assert "; other forces of the same friction hold no more than 0.2, NOT CONVERGED" in told["headline"]
    assert told["limit"] == pytest.approx(0.25, rel=3e-3)


def test_runs_confirm_the_limit_or_do_not(on, monkeypatch):
    told = asked(on, monkeypatch, lambda one: one, confirm=True)
    assert "by the dynamics NOT CONFIRMED: held at 0.2, lost at 0.21" in told["headline"]
    told = asked(on, monkeypatch, lambda one: one, held=0.2497, lost=0.25, confirm=True)
    assert "by the dynamics CONFIRMED: held at 0.2497, lost at 0.25" in told["headline"]


def test_a_limit_whose_step_is_not_solved_says_from_which_load_runs_may_fall(on, monkeypatch):
    nothing = np.zeros((len(on.contacts), 3))
    for sure, words in ((0.24, "0.25 is lost)"), (0.2, "NOT SOLVED, and runs may fall from 0.2 on)")):
        found = HeldLimit(0.24, 0.25, nothing, None, 1, sure)
        monkeypatch.setattr(answers, "held_limit", lambda *_, found=found: found)
        assert words in asked(on, monkeypatch, lambda one: one)["headline"]


def test_what_was_not_sought_is_said(on, monkeypatch):
    monkeypatch.setattr(answers, "_SOUGHT", 0)
    told = asked(on, monkeypatch, lambda one: one)
    assert told["candidate"] is None
    assert "was not sought among so many stones" in told["headline"]


def test_a_step_that_moves_what_a_run_brings_to_rest_leaves_the_limit_to_runs(on, monkeypatch):
    nothing = np.zeros((len(on.contacts), 3))
    monkeypatch.setattr(answers, "held_limit", lambda *_: HeldLimit(0.0, 0.0, nothing, None, 1, 0.0))
    told = asked(on, monkeypatch, lambda one: one)
    assert "λ = 0.25 (NOT SURE, candidate or bound), bound 0.25" in told["headline"]
    assert "held at 0.2, lost at 0.21" in told["headline"]


def test_a_code_checks_the_lower_of_two_candidates(on, monkeypatch):
    def two(one):
        return replace(one, lower=replace(one, multiplier=0.5 * one.multiplier))

    alone, both = (asked(on, monkeypatch, one, code="ntc2018") for one in (lambda one: one, two))
    assert both["candidate"] == pytest.approx(alone["candidate"])
    assert both["candidate_lowest"] == pytest.approx(0.5 * alone["candidate"])
    assert both["kinematics"]["acceleration"] == pytest.approx(0.5 * alone["kinematics"]["acceleration"])
    (first, second) = (one["code"]["checks"][0]["capacity"] for one in (alone, both))
    assert second == pytest.approx(0.5 * first)


def test_the_title_of_a_picture_is_not_cut():
    said = "horizontal y: λ = 0.125 (held; 0.1252 is lost), bound 0.13; other forces hold no more than 0.1; passed"
    assert _title("Bay; north", said) == (
        "Bay; north\nhorizontal y: multiplier 0.125 (held; 0.1252 is lost), bound 0.13; other forces hold no more than "
        "0.1; passed"
    )


@pytest.mark.parametrize(
    ("share", "expected"), [(0.9, 0.36), (float("nan"), 0.0), (0.999, None), (float("inf"), None)]
)
def test_what_slides_is_told_without_friction_across_its_way(monkeypatch, share, expected):
    """A flat block slides at its friction; limits within 1 % are one, and what does not stand without it holds zero."""
    flat = assembly(scene(ground(), brick("a", (0, 0, 0), (1.0, 1.0, 0.2)), friction=0.4))
    monkeypatch.setattr(
        answers, "without_friction_across", lambda on, live, found: replace(found, multiplier=0.4 * share)
    )
    told = asked(flat, monkeypatch, lambda one: one)
    words = "without friction across the line of sliding, as wedges are computed, λ = "
    assert told["without_friction_across"] == pytest.approx(expected)
    assert (words in told["headline"]) is (expected is not None)


def test_what_turns_is_not_asked_for_a_line_of_sliding(on, monkeypatch):
    monkeypatch.setattr(answers, "without_friction_across", lambda *_: pytest.fail("it tips"))
    assert asked(on, monkeypatch, lambda one: one)["without_friction_across"] is None


@pytest.mark.parametrize(
    ("outcomes", "count"),
    [
        ((), 0),
        ((Outcome.EQUILIBRIUM, Outcome.SETTLED), 0),
        ((Outcome.EQUILIBRIUM, Outcome.MOVING), 1),
        ((Outcome.MOVING, Outcome.INTERRUPTED, Outcome.EQUILIBRIUM), 2),
    ],
)
def test_runs_that_still_move_decide_nothing(outcomes, count):
    trials = tuple(ConfirmationRun(0.1, outcome, 10, 0, np.zeros((2, 3))) for outcome in outcomes)
    found = Confirmation(0.1, np.inf, trials)
    told = _confirmed(None, found, type("Candidate", (), {"multiplier": 0.1}))
    assert told["undecided"] == count
    assert [run["outcome"] for run in told["runs"]] == [str(outcome) for outcome in outcomes]
    assert (told["held"], told["lost"], told["likeness"]) == (0.1, None, None)
