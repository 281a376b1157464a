"""No wrong verdict on any wild scene, in any profile, with and without relaxation and static start, at three steps."""

from collections import Counter

import pytest

from tests.validation.wild.matrix import SETTINGS, Mark, line, rotating, run
from tests.validation.wild.scene_list import SCENES

QUICK = rotating(SCENES)
HARMLESS = (Mark.RIGHT, Mark.OPEN, Mark.UNDECIDED)
OPEN = 0.1  # largest part of the cells that need not be decided [-]


@pytest.fixture(scope="module")
def marks():
    """Marks of the cells that have run."""
    return Counter()


@pytest.mark.parametrize(("name", "setting"), QUICK, ids=lambda value: str(value))
def test_a_verdict_is_not_wrong(name, setting, marks):
    cell = run(name, setting)
    marks[cell.mark] += 1
    assert cell.mark in HARMLESS, line(cell)


@pytest.mark.slow
@pytest.mark.parametrize("setting", SETTINGS, ids=str)
@pytest.mark.parametrize("name", SCENES)
def test_a_verdict_is_not_wrong_at_any_setting(name, setting, marks):
    cell = run(name, setting)
    marks[cell.mark] += 1
    assert cell.mark in HARMLESS, line(cell)


def test_nine_in_ten_are_decided(marks):
    """Of the cells above; it is the last test of this module."""
    assert marks[Mark.RIGHT] >= (1 - OPEN) * marks.total(), dict(marks)
