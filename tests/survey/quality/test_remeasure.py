"""Stones to be measured again, in the order of their urgency."""

import numpy as np
import pytest
from scipy.stats import chi2

from ground.errors import SurveyError
from survey.quality.contradictions import Contradiction
from survey.quality.corners import SeenFace, Sign, misplaced_corners
from survey.quality.departures.depths import DoubtfulDepth
from survey.quality.precision import StoneQuality, judge_survey
from survey.quality.remeasure import Remeasure, Urgency, list_remeasures, short_list
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
        # two of seven points by chance, 1 in 300,000 each among 21 stones, and not by chance
        (
            {"points": 7, "redundancy": 2, "blunders": ("point",) * 2, "astray": 4.3},
            {"points": 7, "redundancy": 2, "blunders": ("point",) * 2, "astray": 5.2},
            Urgency.BLUNDERS,
        ),
        (
            {"points": 13, "redundancy": 7, "blunders": ("point",) * 3, "astray": 9.0},
            {"points": 11, "redundancy": 5, "blunders": ("point",) * 3, "astray": 4.0},
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


# --- the short list ---


def reason(code: str | None, urgency: Urgency, severity: float = 1.0, line: int = 1) -> Remeasure:
    return Remeasure(code, line, urgency, severity, f"{urgency.name} of {code}", f"mend {urgency.name}")


def test_every_class_of_reason_has_its_place() -> None:
    """What decides whether the wall stands, what cannot be right, what is weak: in this order."""
    assert [one.name for one in sorted(Urgency)] == [
        "MISSING", "DEPTH", "OVERLAP", "UNCHECKED", "BLUNDERS", "ANGLE", "SIZE", "KIND", "TWICE", "TILT",
        "SHAPE", "SCATTER", "SMOOTH", "EDGE",
    ]  # fmt: skip


def test_what_changes_a_verdict_comes_before_what_cannot_be_right_and_weakness_is_counted() -> None:
    found = [
        reason("A", Urgency.UNCHECKED),
        reason("B", Urgency.BLUNDERS),
        reason("C", Urgency.TILT),
        reason("D", Urgency.TILT),
        reason("E", Urgency.DEPTH),
        reason("F", Urgency.EDGE),
        reason(None, Urgency.MISSING, line=4),
    ]
    chosen = short_list(found, 100, {"B": "the settlement of facade 1", "D": "the lean of facade 1"}.get)
    assert [one.code for one in chosen.rows] == [None, "E", "B", "D", "A"]
    assert [one.changes is not None for one in chosen.rows] == [True, True, True, True, False]
    assert chosen.rows[2].changes == "the settlement of facade 1"
    assert chosen.rows[0].changes == "whether the wall stands, which has a hole there"
    assert chosen.more == 0
    assert chosen.left == (
        "1 stone: a tilt of the face uncertain by more than 0.5°; no verdict depends on it",
        "1 stone: broken or cut edges; no verdict depends on it",
    )


def test_within_a_class_the_worst_comes_first() -> None:
    found = [
        reason(code, Urgency.BLUNDERS, severity) for code, severity in (("A", 0.3), ("B", 0.9), ("C", 0.5))
    ]
    assert [one.code for one in short_list(found, 100).rows] == ["B", "C", "A"]


def test_a_stone_has_one_row_with_all_its_reasons() -> None:
    found = [reason("A", Urgency.OVERLAP), reason("A", Urgency.BLUNDERS), reason("A", Urgency.KIND)]
    (row,) = short_list(found, 100).rows
    assert row.reason == "OVERLAP of A; BLUNDERS of A; KIND of A"
    assert row.action == "mend OVERLAP; mend BLUNDERS; mend KIND"
    assert row.urgency is Urgency.OVERLAP
    assert row.changes == "whether the wall stands, whose joints are cut to fit"
    twice = [reason("A", Urgency.KIND), reason("A", Urgency.KIND)]
    assert short_list(twice, 100).rows[0].action == "mend KIND"
    # stones that could not be made and have no code stay apart
    nameless = [reason(None, Urgency.MISSING, line=k) for k in (4, 5)]
    assert [one.line for one in short_list(nameless, 100).rows] == [4, 5]


@pytest.mark.parametrize(
    ("count", "stones", "common"), [(77, 88, True), (20, 100, False), (21, 100, True), (4, 10, False)]
)
def test_a_weakness_of_a_fifth_of_the_stones_is_that_of_the_survey(
    count: int, stones: int, common: bool
) -> None:
    found = [reason(f"{k}", Urgency.UNCHECKED) for k in range(count)]
    chosen = short_list(found, stones)
    if common:
        assert chosen.rows == ()
        (text,) = chosen.left
        assert text.startswith(
            f"{count} of {stones} stones: faces of three points, which nothing checks; so many that"
        )
        assert text.endswith("measure five points or more on a face")
    else:
        assert chosen.left == ()
        assert len(chosen.rows) + chosen.more == count


def test_the_list_is_short_and_says_what_follows() -> None:
    found = [reason(f"{k}", Urgency.SIZE, -k) for k in range(15)]
    chosen = short_list(found, 1000)
    assert [one.code for one in chosen.rows] == [f"{k}" for k in range(12)]
    assert chosen.more == 3


def test_few_stones_are_asked_what_depends_on_them() -> None:
    asked: list[str] = []

    def verdict(code: str) -> str | None:
        asked.append(code)
        return None

    short_list([reason(f"{k}", Urgency.TILT) for k in range(60)], 1000, verdict)
    assert asked == [f"{k}" for k in range(40)]
    asked.clear()
    short_list([reason("A", Urgency.TILT), reason("A", Urgency.EDGE)], 1000, verdict)
    assert asked == ["A"]
    # an edge that is left out as it should be decides nothing
    asked.clear()
    assert short_list([reason("A", Urgency.EDGE)], 1000, verdict).rows == ()
    assert asked == []


def test_a_doubtful_depth_is_listed_after_what_is_missing_and_before_what_overlaps() -> None:
    stones = [rectangle(f"{k}", "header", k, 0, 0.4, 0.3) for k in range(20)]
    doubt = DoubtfulDepth("3", 17, "kind", 5.0, 0.4, 9.0, "it is 5.00 m deep")
    (one,) = list_remeasures(stones, (), (), judge_survey(stones), (), (doubt,))
    assert (one.code, one.line, one.urgency, one.severity) == ("3", 17, Urgency.DEPTH, 9.0)
    assert one.reason == "it is 5.00 m deep (9.0 σ)"
    assert one.action == "measure its depth again, or correct the rule that gives it"


def test_one_of_a_thousand_sound_surveys_has_a_stone_listed_for_its_scatter() -> None:
    """σ₀² times the redundancy follows χ²: of n stones the limit is that of 0.1 % / n."""
    few, many = (20, 2000)
    for count in (few, many):
        limit = float(chi2.isf(0.001 / count, 17) / 17) ** 0.5
        sound = [rectangle(f"{k}", "header", k, 0, 0.4, 0.3) for k in range(count - 1)]
        quality = judge_survey([*sound, rectangle("X", "header", 0, 0, 0.4, 0.3)])
        for factor, listed_ in ((0.99, 0), (1.01, 1)):
            one = rectangle("X", "header", 0, 0, 0.4, 0.3, sigma0=factor * max(limit, 1.5))
            assert len(list_remeasures([*sound, one], (), (), quality)) == listed_


def test_a_reject_whose_code_was_taken_is_no_hole_in_the_wall() -> None:
    stone = rectangle("A", "ashlar", 0.0, 0.0, 0.5, 0.3)
    error = SurveyError("code 'A' is given twice", where="wall.gpkg, outline 7", remedy="keep one")
    twice, missing = Reject("A", error), Reject("B", error)
    found = list_remeasures([stone], [twice, missing], (), judge_survey([stone]))
    assert [(one.code, one.urgency) for one in found if one.urgency in (Urgency.TWICE, Urgency.MISSING)] == [
        ("B", Urgency.MISSING),
        ("A", Urgency.TWICE),
    ]
    changes = {one.code: one.changes for one in short_list(found, 3).rows}
    assert "hole" in str(changes["B"])
    assert changes["A"] is None


def test_two_stones_without_a_joint_are_questioned() -> None:
    stones = [
        rectangle(f"{c}-{k}", "ashlar", 0.5 * k, 0.3 * c, 0.5 if (c, k) == (1, 3) else 0.49, 0.29)
        for c in range(3)
        for k in range(8)
    ]
    seen = [SeenFace(s.code, s.kind, 1, s.normal, s.outline, (), s.area, s.length, s.height) for s in stones]
    (one,) = (found for found in misplaced_corners(seen) if found.sign is Sign.SEAM)
    assert one.code == "1-3"
    assert "no joint parts it from 1-4 (0 mm; others are 10 mm wide)" in one.text
    (row,) = list_remeasures(stones, (), (), judge_survey(stones), [one])[:1]
    assert row.urgency is Urgency.TWICE
