"""Runs and assessments of the scenes of several states do not contradict each other, at any step and in any profile."""

import numpy as np
import pytest

from mechanics.limit.assembly import assembly
from mechanics.limit.dead_load import stands
from mechanics.limit.held import held_limit
from mechanics.limit.limit_load import Flow, LimitLoad, Mechanism
from mechanics.limit.live_loads import Acceleration
from mechanics.simulate import simulate
from pipelines.tuning.profiles import PROFILES
from tests.validation.one_answer.matrix import Setting, at
from tests.validation.one_answer.scenes import SCENES
from tests.validation.wild.scene_list import Truth

STEPS = (2e-3, 5e-3, 1e-2)
SETTINGS = [
    Setting(profile, "auto", relaxation=False, static=False, step=step)
    for profile in PROFILES
    for step in STEPS
]
FEW = (
    *("cube on a slope +2.5 %", "bar 0.5×0.5, μ 0.9", "shaft of 4, no floor"),
    *("tower, stone at its side", "hook, μ 0.6"),
)
ALONG = Acceleration((1.0, 0.0, 0.0))


def endless(on):
    """A bound that says nothing."""
    none = np.zeros(len(on.contacts), dtype=bool)
    still = Mechanism(np.zeros((len(on.model.mass), 6)), np.zeros(len(on.model.mass)), none, none)
    return LimitLoad(Flow.ASSOCIATIVE, "x", 1e-3, np.zeros((len(on.contacts), 3)), still, 0, True, 0.0)


def agree(name, setting):
    """Hold the outcome of a run beside that of the dead load of an assessment, and beside the limit at no load."""
    scene = at(SCENES[name], setting)
    run, on = simulate(scene), assembly(scene)
    standing = stands(on)
    told = name, str(setting), run.outcome, standing.outcome
    if run.outcome.decided and standing.outcome.decided:
        assert run.outcome.rests == standing.outcome.rests, told
    elif run.outcome.rests or standing.outcome.rests:
        assert SCENES[name].truth is Truth.STANDS, told
    lost = held_limit(on, ALONG, endless(on)).lost
    if run.outcome.decided and not run.outcome.rests:
        assert lost == 0.0, told
    if standing.outcome.rests and standing.rest is not None:
        assert held_limit(standing.rest, ALONG, endless(standing.rest)).lost > 0.0, told


@pytest.mark.parametrize("number", range(len(FEW)))
def test_a_run_and_an_assessment_agree(number):
    agree(FEW[number], SETTINGS[(2 + 4 * number) % len(SETTINGS)])


@pytest.mark.slow
@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("name", SCENES)
def test_all_runs_and_assessments_agree(name, setting):
    agree(name, setting)
