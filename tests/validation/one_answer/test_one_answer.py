"""Scenes that admit several states get one answer: of runs, whatever their settings, of assessments, and of statics."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.limit.assembly import assembly
from mechanics.limit.dead_load import stands
from mechanics.simulate import simulate
from tests.validation.one_answer.matrix import SETTINGS, Setting, answer, at, rotating
from tests.validation.one_answer.scenes import SCENES, WEDGE, wedge_on_two_planes
from tests.validation.wild.matrix import Mark
from tests.validation.wild.scene_list import Truth

HARMLESS = (Mark.RIGHT, Mark.OPEN)


@pytest.fixture(scope="module")
def marks():
    """Marks of the cells that have run."""
    return Counter()


@pytest.mark.parametrize(("name", "setting"), rotating(), ids=str)
def test_an_answer_is_true(name, setting, marks):
    mark, told = answer(SCENES[name], setting)
    marks[mark] += 1
    assert mark in HARMLESS, told


@pytest.mark.slow
@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("name", SCENES)
def test_an_answer_is_true_at_any_setting(name, setting, marks):
    mark, told = answer(SCENES[name], setting)
    marks[mark] += 1
    assert mark in HARMLESS, told


@pytest.mark.parametrize("name", SCENES)
def test_an_assessment_begins_with_the_same_answer(name):
    entry = SCENES[name]
    scene = entry.build()
    found = stands(assembly(replace(scene, time=replace(scene.time, step=5e-3, duration=1.0))))
    assert (found.outcome is Outcome.EQUILIBRIUM) == (entry.truth is Truth.STANDS), found.reason
    assert bool(found.moved) or entry.truth is Truth.STANDS or found.outcome is Outcome.MOVING


@pytest.mark.parametrize("tetrahedron", [False, True], ids=["trough", "tetrahedron"])
def test_the_wedge_slides_where_statics_says(tetrahedron):
    low, high = -0.05, 0.05
    while high - low > 0.002:
        middle = 0.5 * (low + high)
        one = wedge_on_two_planes(middle, tetrahedron)
        one = replace(one, time=replace(one.time, step=5e-3))
        rests = simulate(one).outcome is Outcome.EQUILIBRIUM
        low, high = (low, middle) if rests else (middle, high)
    assert np.isclose(WEDGE * (1 + 0.5 * (low + high)), 33.357, rtol=0.01)


@pytest.mark.parametrize(("name", "held"), [("lintel of 2, 3×0.3, μ 0.7", True), ("hook, μ 0.6", False)])
def test_a_rest_of_deformable_stones_that_rigid_ones_would_not_find_is_none(name, held):
    """A lintel of upright joints comes to rest: its stones keep the strain with which they were pressed together."""
    result = simulate(at(SCENES[name], Setting("accurate", "auto", relaxation=True, static=False, step=1e-2)))
    assert result.outcome is (Outcome.UNDECIDED if held else Outcome.EQUILIBRIUM)
    assert ("self-stress" in result.reason) is held


def test_nine_in_ten_are_decided(marks):
    """Of the cells above; it is the last test of this module."""
    assert marks[Mark.RIGHT] >= 0.9 * marks.total(), dict(marks)
