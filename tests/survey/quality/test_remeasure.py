"""Stones to be measured again, in the order of their urgency."""

import numpy as np
import pytest

from moma.errors import SurveyError
from survey.quality.contradictions import Contradiction
from survey.quality.precision import StoneQuality, judge_survey
from survey.quality.remeasure import Remeasure, Urgency, list_remeasures
from survey.records.survey import Reject
from tests.survey.quality.plain_stones import rectangle


def listed(
    *stones: StoneQuality, rejects: tuple[Reject, ...] = (), odd: tuple[Contradiction, ...] = ()
) -> tuple[Remeasure, ...]:
    sound = [rectangle(f"ok{k}", "header", k, 0, 0.4, 0.3) for k in range(20)]
    every = [*sound, *stones]
    return list_remeasures(every, rejects, odd, judge_survey(every))


def test_a_sound_survey_has_nothing_to_measure_again() -> None:
    assert listed() == ()


@pytest.mark.parametrize(
    ("changes", "urgency", "words"),
    [
        ({"redundancy": 0, "sigma0": None, "shape": "untested"}, Urgency.UNCHECKED, "three points"),
        (
            {"blunders": ("point 1",) * 4, "worn": ("corner 1", "corner 2")},
            Urgency.BLUNDERS,
            "6 of 20 points",
        ),
        ({"tilt_sigma": 0.71}, Urgency.TILT, "by 0.71°"),
        ({"shape": "curved", "shape_text": "bulges by 9 mm"}, Urgency.SHAPE, "bulges by 9 mm"),
        ({"shape": "bevelled", "shape_text": "two planes"}, Urgency.EDGE, "two planes"),
        ({"sigma0": 3.0, "shape": "rough", "rms": 0.006}, Urgency.SCATTER, "6.0 mm"),
        ({"sigma0": 0.2}, Urgency.SMOOTH, "only 0.2"),
    ],
)
def test_every_fault_has_its_reason(changes: dict[str, object], urgency: Urgency, words: str) -> None:
    (one,) = listed(rectangle("X", "header", 0, 0, 0.4, 0.3, **changes))
    assert (one.code, one.urgency) == ("X", urgency)
    assert words in one.reason
    assert one.action


@pytest.mark.parametrize(
    ("below", "above", "urgency"),
    [
        ({"tilt_sigma": 0.49}, {"tilt_sigma": 0.51}, Urgency.TILT),
        (
            {"points": 100, "blunders": ("point",) * 20, "worn": ("corner",) * 5},
            {"points": 100, "blunders": ("point",) * 20, "worn": ("corner",) * 6},
            Urgency.BLUNDERS,
        ),
        # with a redundancy of 100 among 340 of the others: 1.27 and 1.54 times the scatter of the survey
        ({"redundancy": 100, "sigma0": 1.4}, {"redundancy": 100, "sigma0": 2.0}, Urgency.SCATTER),
        ({"sigma0": 0.4}, {"sigma0": 0.3}, Urgency.SMOOTH),
        ({"redundancy": 7, "sigma0": 0.1}, {"redundancy": 8, "sigma0": 0.1}, Urgency.SMOOTH),
    ],
)
def test_the_limit_from_which_a_stone_is_measured_again(
    below: dict[str, object], above: dict[str, object], urgency: Urgency
) -> None:
    assert listed(rectangle("X", "header", 0, 0, 0.4, 0.3, **below)) == ()
    assert [one.urgency for one in listed(rectangle("X", "header", 0, 0, 0.4, 0.3, **above))] == [urgency]


def test_the_most_urgent_come_first_and_the_worst_of_a_sort_before_the_others() -> None:
    reject = Reject("R", SurveyError("it has 2 corners", where="file:7", remedy="measure 3"), (range(7, 9),))
    odd = Contradiction("ok3", "header", 12, "its face is 0.9 m long", 0.3, 8.0)
    weak = [rectangle(f"T{k}", "header", 0, 0, 0.4, 0.3, tilt_sigma=t) for k, t in enumerate((0.6, 0.9))]
    bare = rectangle("B", "header", 0, 0, 0.4, 0.3, redundancy=0, sigma0=None, tilt_sigma=2.0)
    found = listed(*weak, bare, rejects=(reject,), odd=(odd,))
    assert [one.code for one in found] == ["R", "B", "ok3", "B", "T1", "T0"]
    assert (found[0].line, found[0].reason, found[0].action) == (
        7, "could not be made: it has 2 corners (file:7)", "measure 3",
    )  # fmt: skip
    assert "8.0 σ" in found[2].reason


def test_a_wrong_sigma_is_no_fault_of_the_stones() -> None:
    """Where all stones scatter twice as far as stated, none is worse than the others."""
    stones = [
        rectangle(f"{k}", "header", k, 0, 0.4, 0.3, sigma0=2.0, shape="rough", rms=0.004) for k in range(30)
    ]
    assert list_remeasures(stones, (), (), judge_survey(stones)) == ()


def test_chance_is_no_fault() -> None:
    """Few points make sigma0 uncertain by itself: 1.8 from a redundancy of 3 is no fault."""
    assert listed(rectangle("few", "header", 0, 0, 0.4, 0.3, redundancy=3, sigma0=1.8, points=6)) == ()
    assert len(listed(rectangle("many", "header", 0, 0, 0.4, 0.3, redundancy=30, sigma0=1.8))) == 1
    assert np.isfinite(
        [one.severity for one in listed(rectangle("z", "header", 0, 0, 1, 1, sigma0=0.0))]
    ).all()
