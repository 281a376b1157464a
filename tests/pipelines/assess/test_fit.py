"""Searches for amplitudes by hand: steps within bounds, scans where the start says nothing, and uneven runs."""

import numpy as np
import pytest
from scipy.stats import t as student

from pipelines.assess.diagnosis import fit as fitting
from pipelines.assess.diagnosis.file import Unknown
from pipelines.assess.diagnosis.fit import Fit, fit
from pipelines.assess.diagnosis.ranking import Estimate, Ranked
from pipelines.assess.diagnosis.smoothness import probes, with_unevenness


def searched(residuals, *unknowns):
    """The fit of residuals that are a function of the amplitudes, and all places that were asked for."""
    search, asked = fit(unknowns), []
    places = next(search)
    while True:
        asked.append(places)
        try:
            places = search.send([residuals(np.array(place)) for place in places])
        except StopIteration as end:
            return end.value, asked


SETTLEMENT = Unknown("settlement", "m", 0.0, -1.0, 1.0, 0.1)
TILT = Unknown("tilt", "rad", 0.0, -2.0, 2.0, 0.2)


def test_two_amplitudes_of_linear_answers_are_those_of_least_squares():
    matrix = np.array([[10.0, 0.0], [0.0, 5.0], [10.0, 5.0]])
    measured = np.array([3.0, 2.0, 5.3])
    found, asked = searched(lambda x: matrix @ x - measured, SETTLEMENT, TILT)
    assert found.amplitudes == pytest.approx(np.linalg.lstsq(matrix, measured)[0])
    assert found.covariance == pytest.approx(np.linalg.inv(matrix.T @ matrix))
    assert found.chi2 == pytest.approx(0.03)
    assert found.undetermined == ()
    # the start and one beside it for each amplitude
    assert asked[0] == [(0.0, 0.0), (0.1, 0.0), (0.0, 0.2)]
    assert (found.turns, found.trouble) == (2, "")


def test_an_amplitude_ends_at_its_bound_and_derivatives_lie_within():
    found, asked = searched(lambda x: np.array([10.0 * x[0] - 30.0]), SETTLEMENT)
    assert found.amplitudes == pytest.approx((1.0,))
    every = np.concatenate([np.array(places) for places in asked])
    assert every.max() <= 1.0
    assert 0.9 in every


def test_a_step_that_makes_it_worse_is_halved():
    found, asked = searched(lambda x: np.array([20.0 * np.tanh(8.0 * (x[0] - 0.4))]), SETTLEMENT)
    first = [places[0][0] for places in asked]
    slope = (np.tanh(8.0 * -0.3) - np.tanh(8.0 * -0.4)) / 0.1
    whole = min(np.tanh(3.2) / slope, 1.0)
    assert first[1] == pytest.approx(whole)
    assert first[2] == pytest.approx(0.5 * whole)
    assert found.amplitudes[0] == pytest.approx(0.4, abs=0.02)


def test_a_range_is_scanned_where_the_start_says_nothing():
    """Below a threshold of 0.3 stones do not move."""
    found, asked = searched(lambda x: np.array([20.0 * max(x[0] - 0.3, 0.0) - 8.0]), SETTLEMENT)
    # the middles of eight parts of the range
    assert [place[0] for place in asked[1]] == pytest.approx(np.arange(-0.875, 1.0, 0.25))
    assert found.amplitudes[0] == pytest.approx(0.7)


def test_two_amplitudes_that_say_nothing_share_the_places_of_a_scan():
    _, asked = searched(lambda x: np.array([1.0]), SETTLEMENT, TILT)
    values = sorted({place[0] for place in asked[1]}), sorted({place[1] for place in asked[1]})
    assert len(asked[1]) == 16
    assert values[0] == pytest.approx([-0.75, -0.25, 0.25, 0.75])
    assert values[1] == pytest.approx([-1.5, -0.5, 0.5, 1.5])


def test_an_amplitude_that_answers_stays_at_its_start_while_another_is_scanned():
    _, asked = searched(lambda x: np.array([10.0 * x[0] - 3.0]), SETTLEMENT, TILT)
    assert {place[0] for place in asked[1]} == {0.0}
    assert len(asked[1]) == 8


def test_a_start_whose_run_fails_is_left_by_a_scan():
    found, _ = searched(lambda x: "fell" if x[0] < 0.3 else np.array([10.0 * x[0] - 6.0]), SETTLEMENT)
    assert found.amplitudes[0] == pytest.approx(0.6)
    never, _ = searched(lambda x: "fell", SETTLEMENT)
    assert (never.trouble, never.residuals.size, never.turns) == ("fell", 0, 1)


def test_a_run_beside_that_fails_ends_the_search_without_a_covariance():
    found, asked = searched(lambda x: "fell" if x[0] > 0.05 else np.array([10.0 * x[0] - 3.0]), SETTLEMENT)
    assert (found.amplitudes, found.trouble, len(asked)) == ((0.0,), "fell", 1)
    assert np.isnan(found.covariance).all()
    assert found.covariance.shape == (1, 1)


def test_a_place_of_a_scan_must_be_better_than_the_start():
    assert fitting._least([(1.0,), (2.0,)], [np.array([2.0]), np.array([3.0])], np.array([2.1])) == (1.0,)
    assert fitting._least([(1.0,)], [np.array([2.0])], np.array([2.001])) is None
    assert fitting._least([(1.0,)], ["fell"], None) is None
    assert fitting._least([(1.0,)], [np.array([9.0])], None) == (1.0,)


def test_directions_to_which_nothing_answers_are_told_and_have_no_covariance():
    found, _ = searched(lambda x: np.array([10.0 * (x[0] + 0.5 * x[1]) - 3.0] * 2), SETTLEMENT, TILT)
    (direction,) = found.undetermined
    # in units of the ranges of 2 and 4 both count the same
    assert abs(direction[0]) == pytest.approx(np.sqrt(0.5))
    assert direction[0] == pytest.approx(-direction[1])
    # along the direction that is determined: x + y/2 has the variance 1/200
    along = np.array([1.0, 0.5])
    assert along @ found.covariance @ along == pytest.approx(1.0 / 200.0)


def test_steps_turn_back_at_the_upper_bound():
    steps = fitting._steps(np.array([0.9, 0.95, -1.0]), np.full(3, 0.1), np.ones(3))
    assert steps.tolist() == [0.1, -0.1, 0.1]


def test_runs_are_tried_on_both_sides_within_the_bounds():
    found = probes([SETTLEMENT, TILT], (0.3, 1.95))
    assert found[0] == [pytest.approx((0.3 + 0.1 * share, 1.95)) for share in (-1.0, -0.5, 0.0, 0.5, 1.0)]
    assert [place[1] for place in found[1]] == pytest.approx([1.6, 1.7, 1.8, 1.9, 2.0])
    low = probes([SETTLEMENT], (-1.0,))
    assert [place[0] for place in low[0]] == pytest.approx([-1.0, -0.95, -0.9, -0.85, -0.8])


def ranked(half):
    estimate = Estimate("settlement", "m", 0.3, 0.3 - half, 0.3 + half, False)
    best = Fit((0.3,), np.zeros(2), np.zeros((1, 1)), (), 1)
    return Ranked("settled", (), best, 4, 0.5, 0.0, (estimate,), ())


@pytest.mark.parametrize(("shift", "uneven"), [(0.0, False), (0.02, True)])
def test_what_a_parabola_leaves_of_five_runs_widens_the_interval(shift, uneven):
    # answers of a slope of 10, of which the runs at both sides of the middle are shifted to and fro
    places = probes([SETTLEMENT], (0.3,))[0]
    off = np.array([0.0, shift, 0.0, -shift, 0.0])
    answers = {
        place: np.array([10.0 * (place[0] - 0.3 + k), 0.0]) for place, k in zip(places, off, strict=True)
    }
    half = 0.03
    found = with_unevenness(ranked(half), [SETTLEMENT], answers).estimates[0]
    # a line takes two fifths of the shift at the ends, and a fifth between: 2 (0.4² + 0.8²) are left to two degrees
    sigma = shift * np.sqrt(0.8)
    assert found.run_sigma == pytest.approx(sigma, abs=1e-9)
    wide = student.ppf(0.975, 4)
    assert found.high - found.value == pytest.approx(np.hypot(half, wide * sigma))
    assert found.value - found.low == pytest.approx(found.high - found.value)
    told = with_unevenness(ranked(half), [SETTLEMENT], answers).uneven
    assert bool(told) == uneven


def test_a_run_beside_that_fails_is_told():
    answers = dict.fromkeys(probes([SETTLEMENT], (0.3,))[0], "fell")
    found = with_unevenness(ranked(0.1), [SETTLEMENT], answers)
    assert found.remarks[-1].endswith("too narrow: fell")
    assert np.isnan(found.estimates[0].run_sigma)
