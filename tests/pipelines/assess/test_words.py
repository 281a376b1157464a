"""What assessments and diagnoses say of numbers that a test gives: loads in words, headlines, ranks and verdicts."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import f as fisher
from scipy.stats import t as student

from ground.errors import UsageError
from mechanics.limit.live_loads import Acceleration, PointForce
from pipelines.assess import answers, questions
from pipelines.assess.diagnosis import dating, ranking
from pipelines.assess.diagnosis.file import Unknown
from pipelines.assess.diagnosis.fit import Fit
from pipelines.assess.diagnosis.ranking import (
    Estimate,
    Ranked,
    Ranking,
    estimates,
    rank,
    verdict,
    with_others,
)
from pipelines.assess.questions import parse_question


@pytest.mark.parametrize(
    ("words", "direction"),
    [
        ("horizontal x", (1, 0, 0)),
        ("horizontal -y", (0, -1, 0)),
        ("horizontal 30", (np.sqrt(0.75), 0.5, 0)),
        ("tilt y", (1, 0, 0)),  # about y, right-handed: x goes down
        ("tilt x", (0, -1, 0)),
        ("tilt 90", (1, 0, 0)),
        ("weight A,B", (0, 0, -1)),
    ],
)
def test_words_of_loads_are_their_directions(words, direction):
    live = parse_question(words).live
    assert isinstance(live, Acceleration)
    assert live.direction == pytest.approx(direction)
    assert live.stones == (frozenset({"A", "B"}) if "A" in words else frozenset())


def test_words_of_forces_and_supports_are_read():
    assert parse_question("force A 1 -2 3e3").live == PointForce("A", (1.0, -2.0, 3000.0))
    thrust = parse_question("settlement P,Q -z")
    assert (thrust.supports, thrust.direction, thrust.settles) == (("P", "Q"), (0.0, 0.0, -1.0), True)
    assert not parse_question("thrust P x").settles


@pytest.mark.parametrize(
    "words", ["horizontal z", "horizontal up", "force A 1 2", "thrust P w", "push x", ""]
)
def test_words_that_are_no_load_are_refused_with_those_that_are(words):
    with pytest.raises(UsageError, match="no such load"):
        parse_question(words)


def test_many_stones_are_named_by_two_and_their_number():
    assert questions._listed(frozenset("CBA")) == "A, B, C"
    assert questions._listed(frozenset("ABCDE")) == "A, B and 3 more"


def test_a_force_at_a_point_is_placed_in_the_scene():
    entry = SimpleNamespace(values={"point": [10.0, 20.0, 30.0], "force": (1.0, 0.0, 0.0)}, type="force")
    found = questions._force(entry, frozenset({"A"}), np.array([1.0, 2.0, 3.0]))
    assert found.live == PointForce("A", (1.0, 0.0, 0.0), (9.0, 18.0, 27.0))


BOUND = {"bound": 0.5, "candidate_sought": True, "candidate": 0.4, "limit": 0.45, "candidate_converged": True}


@pytest.mark.parametrize(
    ("facts", "text"),
    [
        ({"bound": None}, ""),
        ({"candidate_sought": False}, "; whether other forces hold less was not sought among so many stones"),
        ({"candidate": None}, "; whether other forces hold less was not found"),
        ({"candidate_lowest": 0.45}, ""),
        ({"candidate_lowest": 0.41236}, "; other forces of the same friction hold no more than 0.4124"),
        (
            {"candidate_lowest": 0.41, "candidate_converged": False},
            "; other forces of the same friction hold no more than 0.41, NOT CONVERGED",
        ),
    ],
)
def test_other_forces_that_hold_less_are_told(facts, text):
    assert answers._caution(BOUND | facts) == text


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (
            {"held": 0.39, "lost": 0.41, "agrees": True, "likeness": {"cosine": 0.95}},
            "; by the dynamics CONFIRMED: held at 0.39, lost at 0.41, falling as the mechanism (cosine 0.95)",
        ),
        (
            {"held": None, "lost": 0.2, "agrees": False, "likeness": {"cosine": 0.5}},
            "; by the dynamics NOT CONFIRMED: nothing held, lost at 0.2, falling NOT AS the mechanism (cosine 0.50)",
        ),
        (
            {"held": 0.39, "lost": None, "agrees": True, "likeness": None},
            "; by the dynamics CONFIRMED: held at 0.39, nothing lost",
        ),
    ],
)
def test_what_runs_say_of_a_limit_is_told(given, text):
    assert answers._dynamics({"confirmation": given, "limit": 0.4}) == text
    assert answers._dynamics({}) == ""


PUSHED = {"unsolved": 0, "steps": 90, "onset": 0.31, "peak": 0.33, "farthest": 0.05, "control": "A7"}


@pytest.mark.parametrize(
    ("facts", "text"),
    [
        (
            {"dropped": 0.012, "capacity": 0.08},
            "; led to collapse: moves at 0.31, then bears 0.33, a fifth lost after 12 mm, all lost after 80 mm of A7",
        ),
        (
            {"dropped": None, "capacity": None, "unsolved": 3},
            "; led to collapse: moves at 0.31, then bears 0.33, less than a fifth lost up to 50 mm of A7, "
            "3 of 90 steps NOT SOLVED",
        ),
        ({"peak": None}, "; led to collapse: moves at 0.31, then stones hit one another throughout"),
    ],
)
def test_a_way_to_collapse_is_told_in_millimetres(facts, text):
    assert answers._collapse({"pushover": PUSHED | facts}) == text


def test_a_check_by_a_code_is_told_with_its_caution():
    check = {"code": "NTC", "passed": False, "caution": "by hand"}
    assert answers._verdict({"code": check}) == "; NTC: NOT PASSED (by hand)"
    assert answers._verdict({"code": check | {"passed": True, "caution": ""}}) == "; NTC: passed"


@pytest.mark.parametrize(("lowest", "taken"), [(0.5, True), (0.59, True), (0.61, False)])
def test_a_code_checks_the_candidate_unless_runs_lose_it(lowest, taken):
    limit, low = SimpleNamespace(multiplier=0.6), SimpleNamespace(multiplier=lowest)
    assert answers._checked_limit(limit, 0.6, SimpleNamespace(lowest=low)) is (low if taken else limit)
    assert answers._checked_limit(limit, 0.6, None) is limit


UNKNOWNS = [Unknown("settlement", "m", 0.0, -1.0, 1.0), Unknown("tilt", "rad", 0.0, -2.0, 2.0)]


def fitted(amplitudes=(0.3, 0.5), residuals=(1.0, 2.0, 3.0), covariance=((4e-4, 0.0), (0.0, 9e-4)), blind=()):
    return Fit(tuple(amplitudes), np.array(residuals), np.array(covariance), tuple(blind), 3)


def test_ranks_have_the_probability_of_their_residuals_and_pay_for_amplitudes():
    """χ² 14 of 12 measurements by 2 amplitudes, the scatter of beds known with 20 degrees of freedom."""
    found = rank("settled", (), UNKNOWNS, fitted(), 12, 20.0)
    assert found.dof == 10
    assert found.probability == pytest.approx(fisher.sf(1.4, 10, 20))
    # 2 k + 2 k (k + 1)/(n - k - 1)
    assert found.aicc == pytest.approx(14.0 + 4.0 + 12.0 / 9.0)
    exact = rank("settled", (), UNKNOWNS, fitted(), 12, 0.0)
    assert exact.probability == pytest.approx(fisher.sf(1.4, 10, 1e9))
    lost = rank(
        "settled", (), UNKNOWNS, Fit((0.0, 0.0), np.zeros(0), np.zeros((2, 2)), (), 1, "it fell"), 12, 0.0
    )
    assert (lost.probability, lost.aicc, lost.remarks) == (0.0, np.inf, ("not run: it fell",))


@pytest.mark.parametrize(("residuals", "wider"), [((1.0, 2.0, 3.0), np.sqrt(1.4)), ((1.0, 0.0, 0.0), 1.0)])
def test_intervals_are_students_and_wider_where_residuals_are_larger_than_expected(residuals, wider):
    first, second = estimates(UNKNOWNS, fitted(residuals=residuals), 10)
    wide = student.ppf(0.975, 10) * wider
    assert (first.value, second.value) == (0.3, 0.5)
    assert first.high - 0.3 == pytest.approx(wide * 0.02)
    assert 0.5 - second.low == pytest.approx(wide * 0.03)
    assert not first.at_bound


def test_what_nothing_feels_has_no_interval_and_bounds_are_told():
    found = rank("settled", (), UNKNOWNS, fitted((1.0, -2.0), blind=[(0.05, 1.0)]), 12, 0.0)
    first, second = found.estimates
    assert np.isfinite(first.high)
    assert second.high == np.inf
    assert (first.at_bound, second.at_bound) == (True, True)
    assert found.remarks[:2] == (
        "settlement lies at a bound of its range",
        "tilt lies at a bound of its range",
    )
    assert found.remarks[2] == "not determined, as it moves nothing that was measured: tilt"
    both = rank("settled", (), UNKNOWNS, fitted(blind=[(0.6, -0.8)]), 12, 0.0)
    assert both.remarks[0].endswith("measured: +0.60 settlement -0.80 tilt")


@pytest.mark.parametrize(("correlation", "told"), [(0.9, False), (-0.999, True)])
def test_amplitudes_of_which_a_combination_alone_is_told_are_named(correlation, told):
    covariance = [[4e-4, correlation * 6e-4], [correlation * 6e-4, 9e-4]]
    found = rank("settled", (), UNKNOWNS, fitted(covariance=covariance), 12, 0.0)
    assert found.tied == (
        (f"settlement and tilt cannot be told apart: their correlation is {correlation:+.3f}",)
        if told
        else ()
    )


def ranked(name="settled", chi2=9.0, aicc=11.0, probability=0.5, stood=(), half=0.02):
    estimate = Estimate("settlement", "m", 0.3, 0.3 - half, 0.3 + half, False)
    return Ranked(
        name, stood, fitted((0.3,), (np.sqrt(chi2),), ((1e-4,),)), 10, probability, aicc, (estimate,), ()
    )


def test_amplitudes_beyond_the_interval_that_explain_as_well_are_told():
    # χ² may grow by t² of 10 degrees of freedom, 4.96
    limit = 9.0 + student.ppf(0.975, 10) ** 2
    near = with_others(ranked(), {(0.31,): 9.1, (0.9,): limit + 0.1})
    assert near == ranked()
    far = with_others(ranked(), {(0.33,): 9.5, (0.5,): limit - 0.1, (0.9,): limit + 0.1})
    assert far.tied == ("settlement = 0.5 m explains as well, so that its intervals are too narrow",)
    assert far.remarks == far.tied


def test_the_verdict_names_the_cause_its_amount_and_its_rivals():
    still = ranked("nothing", 60.0, 60.0, 0.0)
    clear = verdict(Ranking((ranked(), ranked("tilted", 30.0, 40.0)), still))
    assert clear.startswith(
        "'settled' explains what was measured (χ² 9 of 10, 60 of 10 if nothing had moved)"
    )
    assert "settlement = 0.300 ± 0.020 m (95 %)" in clear
    assert clear.endswith("CAUTION: a cause that is not in the list may move the stones alike")
    unclear = verdict(Ranking((ranked(), ranked("tilted", 9.0, 11.0 + ranking.APART - 0.1)), still))
    assert unclear.endswith("it cannot be told apart from 'tilted'")
    apart = verdict(Ranking((ranked(), ranked("tilted", 9.0, 11.0 + ranking.APART + 0.1)), still))
    assert "told apart" not in apart


def test_the_verdict_says_where_no_movement_or_none_of_the_causes_explains():
    calm = ranked("nothing", 10.0, 11.0 + ranking.APART - 0.1, 0.4)
    assert verdict(Ranking((ranked(),), calm)).startswith("no movement is needed")
    worse = ranked("nothing", 20.0, 11.0 + ranking.APART + 0.1, 0.4)
    assert "explains what was measured" in verdict(Ranking((ranked(),), worse))
    still = ranked("nothing", 60.0, 60.0, 0.0)
    assert verdict(Ranking((ranked(probability=0.0),), still)).startswith("NONE OF THESE EXPLAINS")


@pytest.mark.parametrize(
    ("half", "text"), [(0.02, "0.300 ± 0.020"), (0.5, "0.30 ± 0.50"), (3.0, "0.3 ± 3.0"), (25.0, "0 ± 25")]
)
def test_amounts_have_two_digits_of_their_interval(half, text):
    assert f"settlement = {text} m (95 %)" in verdict(
        Ranking((ranked(half=half),), ranked("x", 60.0, 60.0, 0.0))
    )


def told_date(*hypotheses):
    file = SimpleNamespace(phases=("I", "II", "III"))
    return dating._verdict(file, Ranking(hypotheses, ranked("x", 60.0, 60.0, 0.0)), hypotheses[0])


def test_a_movement_is_dated_between_the_last_phase_that_moved_and_the_first_that_did_not():
    best, other = ranked(stood=("I", "II")), ranked(aicc=40.0, stood=("I",))
    assert told_date(best, other) == (
        "the movement is younger than phase II and older than phase III (AICc of other dates larger by 29 or more)"
    )
    last = ranked(stood=("I", "II", "III"))
    assert "younger than phase III (AICc" in told_date(last, other)
    assert "one time only" in told_date(best, ranked("tilted", aicc=40.0, stood=("I",)))
    assert "about as well" in told_date(best, ranked(aicc=11.5, stood=("I",)))
    assert told_date(ranked(probability=0.0, stood=("I",)), other).startswith("not dated, as no hypothesis")


@pytest.mark.parametrize("scale", [1.0, 0.25])
def test_the_share_of_a_phase_is_the_regression_of_what_was_measured_on_what_was_simulated(scale):
    simulated, values = np.array([4.0, -3.0]), scale * np.array([4.0, -3.0])
    group = SimpleNamespace(
        codes=("A",), whitening=np.diag([2.0, 1.0]), values=values, simulated=lambda displacement: simulated
    )
    other = SimpleNamespace(codes=("B",))
    about = SimpleNamespace(deformation=SimpleNamespace(groups=[group, other]), phases={"A": "I", "B": "II"})
    found = dating._share(about, "I", SimpleNamespace(displacement=None))
    assert (found.value, found.sigma) == (pytest.approx(scale), pytest.approx(1.0 / np.sqrt(64.0 + 9.0)))
    assert dating._share(about, "III", SimpleNamespace(displacement=None)).value is None


def test_a_course_tells_of_its_two_stones_between_which_most_moved():
    stones = {
        "A": SimpleNamespace(measured=0.0, simulated=0.001, sigma=0.003),
        "B": SimpleNamespace(measured=-0.012, simulated=-0.009, sigma=0.004),
        "C": SimpleNamespace(measured=0.001, simulated=-0.002, sigma=0.001),
    }
    line = SimpleNamespace(stones=stones, line=SimpleNamespace(course=4))
    assert dating._course(line, frozenset()) == (
        "  course 4: B lies 12.0 ± 5.0 mm below A; the movement makes it 10.0 mm"
    )
    assert dating._course(line, frozenset({"A", "B"})) is None


@pytest.mark.parametrize(
    ("span", "off", "at_bound"),
    [(1.0, 1e-7, True), (1.0, 1e-4, False), (1e4, 1e-3, True), (1e-4, 1e-8, False)],
)
def test_an_amplitude_is_at_a_bound_within_a_millionth_of_its_range(span, off, at_bound):
    unknown = Unknown("settlement", "m", 0.0, -0.5 * span, 0.5 * span)
    made = fitted((0.5 * span - off,), covariance=((1e-12,),))
    (found,) = estimates([unknown], made, 10)
    assert found.at_bound == at_bound
