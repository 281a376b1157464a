"""Answers of an assessment: the caution beside a number, and which of two candidates a code checks."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.limit.assembly import assembly
from mechanics.limit.confirm import Confirmation, ConfirmationRun
from mechanics.limit.limit_load import Flow, limit_load
from mechanics.limit.live_loads import Acceleration
from pipelines.assess import answers
from pipelines.assess.answers import answer
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


def test_a_candidate_that_did_not_converge_is_tried_by_runs_and_says_so(on, monkeypatch):
    told = asked(on, monkeypatch, lambda one: replace(one, converged=False))
    assert ", 0.25 (candidate, NOT CONVERGED)" in told["headline"]
    assert "by the dynamics NOT CONFIRMED: held at 0.2, lost at 0.21" in told["headline"]
    told = asked(on, monkeypatch, lambda one: one)
    assert ", 0.25 (candidate)" in told["headline"]
    assert "confirmation" not in told


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
    said = "horizontal y: λ ≤ 0.13 (bound), 0.125 (candidate; other forces hold no more than 0.1); passed"
    assert _title("Bay; north", said) == (
        "Bay; north\nhorizontal y: multiplier at most 0.13 (bound), 0.125 (candidate; other forces hold no more than "
        "0.1); passed"
    )
