"""Lines of minimum trace of bonds whose length is known."""

import numpy as np
import pytest

from survey.quality.masonry.trace import minimum_traces, section_trace
from tests.survey.quality.masonry.bonds import bond


def test_aligned_joints_are_passed_straight():
    traces = minimum_traces(bond(0.0))
    assert len(traces) > 20
    assert np.median(traces) == pytest.approx(1.0, abs=0.08)
    assert traces.min() > 0.999


def test_a_running_bond_costs_half_a_stone_in_every_course():
    """From a joint up 3, 4 or 5 courses of 0.3 m and back to its upright: 2, 4 and 4 shifts of 0.25 m."""
    mean = np.mean([(0.9 + 0.5) / 0.9, (1.2 + 1.0) / 1.2, (1.5 + 1.0) / 1.5])
    assert np.median(minimum_traces(bond(0.5))) == pytest.approx(mean, abs=0.08)


def test_the_more_a_bond_is_shifted_the_longer_the_line():
    medians = [float(np.median(minimum_traces(bond(shift)))) for shift in (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)]
    assert medians == sorted(medians)
    assert medians[-1] > medians[0] + 0.6


def test_the_line_is_the_same_for_a_wall_that_is_turned_over():
    mirrored = [face[::-1] * [-1.0, 1.0] for face in bond(0.3)]
    assert np.median(minimum_traces(mirrored)) == pytest.approx(
        np.median(minimum_traces(bond(0.3))), abs=0.08
    )


def test_no_line_runs_along_the_side_of_an_opening():
    """Two piers of one stone each, with a metre of air between them: nothing but the joints of each pier."""
    left = bond(0.0, length=2)
    right = [face + np.array([2.0, 0.0]) for face in left]
    alone = minimum_traces(left)
    assert minimum_traces([*left, *right]).min() == pytest.approx(alone.min(), abs=1e-6)
    # the joint in the middle of a pier is straight, its sides are no joints
    assert len(minimum_traces(bond(0.0, length=1))) == 0
    assert len(minimum_traces(bond(0.2, length=1, size=1.0))) == 0


def test_a_low_wall_has_no_line_and_one_of_three_courses_a_short_one():
    assert len(minimum_traces(bond(0.5, courses=1))) == 0
    assert len(minimum_traces(bond(0.5, courses=2))) == 0
    assert len(minimum_traces(bond(0.5, courses=3))) > 0
    assert len(minimum_traces(bond(0.5)[:2])) == 0


def rows(*pairs):
    """Return rows of 0.3 m of a section: where the front ends, and where the back begins."""
    front, back = (np.array(column) for column in zip(*pairs, strict=True))
    return np.full(len(pairs), 0.3), front, back


def test_a_section_with_a_core_is_passed_straight_and_headers_are_gone_around():
    assert section_trace(*rows((0.2, 0.4), (0.2, 0.4), (0.2, 0.4))) == 1.0
    # headers of either face overlap by 0.1 m: 0.1 m to the side and back, in each second row
    assert section_trace(*rows((0.2, 0.4), (0.5, 0.6), (0.2, 0.4), (0.5, 0.6))) == pytest.approx(
        1.0 + 0.3 / 1.2
    )
    # a stone through the wall of 0.6 m is passed at its end
    through = section_trace(*rows((0.3, 0.3), (0.6, 0.6), (0.3, 0.3)))
    assert through == pytest.approx(1.0 + 0.6 / 0.9)


def test_a_stone_of_the_back_through_the_wall_counts_as_one_of_the_front():
    front = section_trace(*rows((0.3, 0.3), (0.6, 0.6), (0.3, 0.3)))
    back = section_trace(*rows((0.3, 0.3), (0.0, 0.0), (0.3, 0.3)))
    assert front == pytest.approx(back)


def test_a_straight_joint_between_two_faces_bonds_nothing():
    assert section_trace(*rows(*[(0.3, 0.3)] * 4)) == pytest.approx(1.0)
    # depths that overlap by chance are one joint
    assert section_trace(*rows((0.3, 0.3), (0.32, 0.28), (0.3, 0.3))) == pytest.approx(1.0)
