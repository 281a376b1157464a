"""Outlines of others are doubted where they cross a sure joint, overlap, or share one stone."""

import numpy as np
import pytest

from survey.clouds.pictures.marks import mark_outlines
from survey.clouds.pictures.masonry import Named
from survey.clouds.pictures.proposal import Proposal, ProposedBorder, ProposedStone
from survey.clouds.pictures.suitability import Findings

pytest.importorskip("shapely")


def box(left, low, right, high):
    return np.array([[left, low], [right, low], [right, high], [left, high]], dtype=float)


def proposal(*rings, probability=0.9):
    stones = tuple(
        ProposedStone(Named(f"C01-{k:02d}", "stretcher", 1, k), ring, 0.9, 0.001, False)
        for k, ring in enumerate(rings, start=1)
    )
    borders = tuple(
        ProposedBorder((k, k + 1), probability, (float(k + 1), 0.5), 1.0) for k in range(len(rings) - 1)
    )
    return Proposal(stones, borders, (), "coursed", (3.0, 0.01), Findings(False, (), 1.0))


NONE = proposal()
ROW = (box(0, 0, 1, 1), box(1, 0, 2, 1), box(2, 0, 3, 1))


def marks(rings, found):
    return [(mark.reason, mark.outlines) for mark in mark_outlines(rings, found)]


def test_outlines_of_the_stones_themselves_are_not_doubted():
    assert marks(ROW, proposal(*ROW)) == []
    assert marks([*ROW, box(9, 9, 10, 10)], proposal(*ROW)) == []


@pytest.mark.parametrize(("probability", "found"), [(0.9, True), (0.7, True), (0.69, False)])
def test_an_outline_across_a_sure_joint_leaks(probability, found):
    (mark, *more) = mark_outlines([box(0, 0, 2, 1)], proposal(*ROW, probability=probability)) or [None]
    assert not more
    assert (mark is not None) == found
    if found:
        assert (mark.reason, mark.outlines, mark.place) == ("leak", (0,), (1.0, 0.5))
        assert f"({probability:.0%} sure)" in mark.text


def test_an_outline_over_three_stones_leaks_at_both_joints():
    found = mark_outlines([box(0, 0, 3, 1)], proposal(*ROW))
    assert [mark.place for mark in found if mark.reason == "leak"] == [(1.0, 0.5), (2.0, 0.5)]


@pytest.mark.parametrize(("reach", "leaks"), [(0.24, False), (0.26, True)])
@pytest.mark.parametrize("height", [0.3, 4.0])
def test_an_outline_holds_a_stone_from_a_quarter_of_it_on(reach, leaks, height):
    row = [ring * [1.0, height] for ring in ROW]
    assert bool(marks([box(0, 0, 1 + reach, height)], proposal(*row))) == leaks


@pytest.mark.parametrize(("spread", "split"), [(0.58, False), (0.62, True)])
def test_two_outlines_of_which_most_lies_in_one_stone_split_it(spread, split):
    # each has a part of its area within the middle stone
    rings = [box(spread, 0, 1 + spread, 0.4), box(spread, 0.5, 1 + spread, 0.9)]
    found = mark_outlines(rings, proposal(ROW[1]))
    assert [(mark.reason, mark.outlines) for mark in found] == ([("split", (0, 1))] if split else [])


def test_a_split_lies_between_the_middles_of_both_outlines():
    (mark,) = mark_outlines([box(0, 0, 0.5, 1), box(0.5, 0, 1, 1)], proposal(box(0, 0, 1, 1)))
    assert mark.place == (0.5, 0.5)
    (mark,) = mark_outlines([box(0, 0, 0.5, 1), box(0.6, 0.2, 1, 1)], proposal(box(0, 0, 1, 1)))
    assert mark.place == pytest.approx((0.5 * (0.25 + 0.8), 0.5 * (0.5 + 0.6)))


@pytest.mark.parametrize(("shared", "found"), [(0.04, False), (0.06, True)])
def test_outlines_overlap_from_a_twentieth_of_the_smaller_on(shared, found):
    small = box(4 - 0.2 * shared, 0, 4.2 - 0.2 * shared, 1)
    marked = mark_outlines([box(0, 0, 4, 1), small, box(9, 9, 10, 10)], NONE)
    assert [(mark.reason, mark.outlines) for mark in marked] == ([("overlap", (0, 1))] if found else [])
    if found:
        assert f"{shared:.0%} of the smaller" in marked[0].text
        assert marked[0].place == pytest.approx((4 - 0.1 * shared, 0.5))
