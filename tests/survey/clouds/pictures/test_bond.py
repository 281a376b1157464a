"""Regions are one stone where both together are a rectangle and no joint shows, and joining loses no border."""

import numpy as np
import pytest
from scipy.special import expit, logit

from survey.clouds.pictures.bond import (
    FEATURES,
    LIKELY,
    WEIGHTS,
    Bond,
    Border,
    bond_of,
    join_weak,
    renumbered,
)
from survey.clouds.pictures.joints import WIDTH, Strength

SHAPE = (30, 60)


def regions_of(*boxes, shape=SHAPE):
    """Regions from 1 on in boxes (rows and columns)."""
    out = np.zeros(shape, np.int64)
    for number, (top, bottom, left, right) in enumerate(boxes, start=1):
        out[top:bottom, left:right] = number
    return out


def gathered(regions, evidence=0.0, *, colours=None, hidden=None, kind="coursed"):
    """The bond of regions, with the same evidence of joints everywhere or at every pixel."""
    field = np.broadcast_to(np.float32(evidence), regions.shape).astype(np.float32)
    shown = np.zeros((1, *regions.shape), np.float32) if colours is None else colours
    veil = np.zeros(regions.shape, bool) if hidden is None else hidden
    return bond_of(regions, Strength(field, field, field, field), shown, veil, kind)


def features(bond, a=1, b=2):
    return dict(zip(FEATURES, bond.features(a, b).tolist(), strict=True))


HALVES = regions_of((0, 30, 0, 30), (0, 30, 30, 60))


def test_two_halves_of_a_rectangle_are_no_fuller_than_each():
    found = features(gathered(HALVES))
    assert found["constant"] == 1.0
    assert found["fuller"] == pytest.approx(0.0)
    assert found["size"] == pytest.approx(np.log(30.0 / WIDTH))
    assert gathered(HALVES).areas == {1: 900.0, 2: 900.0}


@pytest.mark.parametrize("swapped", [False, True])
def test_steps_that_interlock_are_fuller_together(swapped):
    # an L and what it lacks: the L fills 1200 of its box of 1800 pixels, the square its own, both together the whole
    regions = regions_of((0, 30, 0, 60), (0, 20, 30, 60))
    regions = 3 - regions if swapped else regions
    shares = (1200.0 / 1800.0, 1.0)
    alone = (1200.0 * shares[0] + 600.0 * shares[1]) / 1800.0
    found = features(gathered(regions))
    assert found["fuller"] == pytest.approx(1.0 - alone)
    assert found["size"] == pytest.approx(np.log(np.sqrt(600.0) / WIDTH))


def test_halves_that_lie_askew_are_less_full_together():
    # each fills its box; the box of both is four times as large as one
    assert features(gathered(regions_of((0, 15, 0, 30), (15, 30, 30, 60), (15, 30, 0, 30))), 1, 3)[
        "fuller"
    ] == pytest.approx(0.0)
    stepped = regions_of((0, 15, 0, 40), (15, 30, 20, 60))
    assert features(gathered(stepped))["fuller"] == pytest.approx(1200.0 / 1800.0 - 1.0)


def test_an_upright_or_level_border_is_square_and_a_stair_is_not():
    assert features(gathered(HALVES))["askew"] == pytest.approx(0.0)
    assert features(gathered(HALVES.T.copy()))["askew"] == pytest.approx(0.0)
    stair = (np.add.outer(np.arange(30), np.arange(60)) >= 45).astype(np.int64) + 1
    assert features(gathered(stair))["askew"] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("joined", [30, 20, 0])
def test_a_joint_over_part_of_a_border_leaves_gaps_on_the_rest(joined):
    evidence = np.zeros(SHAPE, np.float32)
    evidence[:joined, 29:31] = 0.8
    found = features(gathered(HALVES, evidence))
    assert found["strength"] == pytest.approx(0.8 * joined / 30.0)
    assert found["gaps"] == pytest.approx(1.0 - joined / 30.0)


def test_a_hidden_border_is_as_likely_a_joint_as_none():
    found = features(gathered(HALVES, 1.4, hidden=np.ones(SHAPE, bool)))
    assert (found["strength"], found["gaps"]) == pytest.approx((0.5, 0.5))


@pytest.mark.parametrize("step", [0.0, 4.0])
def test_the_step_of_colours_is_the_length_of_their_mean_difference(step):
    colours = np.zeros((2, *SHAPE), np.float32)
    colours[0, :, 30:], colours[1, :, 30:] = 0.6 * step, -0.8 * step
    assert features(gathered(HALVES, colours=colours))["step"] == pytest.approx(np.log1p(step), abs=1e-6)


def test_the_probability_is_the_logistic_function_of_the_weighted_features():
    bond = gathered(HALVES, 0.4)
    bond.weights = np.zeros(len(FEATURES))
    bond.weights[0] = logit(0.3)
    assert bond.probability(1, 2) == pytest.approx(0.3)
    constant, slope = WEIGHTS["stayed"]
    assert bond.certainty(1, 2) == pytest.approx(expit(constant + slope * logit(0.3)))


def bordered():
    """Three regions by hand, each with a border to the others, and colours that rise with the number."""
    borders = {
        (1, 2): Border(2.0, np.full(5, 2.0), np.array([2.0, 4.0])),
        (1, 3): Border(3.0, np.full(5, 3.0), np.array([3.0, 15.0])),
        (2, 3): Border(5.0, np.full(5, 5.0), np.array([5.0, 15.0])),
    }
    both: dict[int, dict[int, Border]] = {1: {}, 2: {}, 3: {}}
    for (a, b), border in borders.items():
        both[a][b] = both[b][a] = border
    boxes = {1: (0, 4, 0, 10), 2: (4, 8, 0, 5), 3: (4, 8, 5, 10)}
    return Bond(np.zeros(7), {1: 40.0, 2: 20.0, 3: 20.0}, boxes, both)


def test_joining_two_regions_adds_their_areas_boxes_and_borders_to_a_third():
    bond = bordered()
    bond.join(2, 3)
    assert bond.areas == {1: 40.0, 2: 40.0}
    assert bond.boxes == {1: (0, 4, 0, 10), 2: (4, 8, 0, 10)}
    assert set(bond.borders) == {1, 2}
    border = bond.borders[1][2]
    assert border is bond.borders[2][1]
    assert border.length == 5.0
    assert border.sums.tolist() == [5.0] * 5
    # from the region of the lower number to the other, on both of its parts
    assert border.steps.tolist() == [5.0, 19.0]


def test_a_border_turns_where_the_order_of_its_regions_does():
    bond = bordered()
    bond.join(3, 1)  # what led from 1 up to 2 now leads from 2 to 3, and so down
    assert bond.borders[2][3].steps.tolist() == [7.0, 15.0 - 4.0]
    assert bond.borders[2][3].length == 7.0


def test_weak_borders_go_and_strong_ones_stay_whatever_their_order():
    # four quarters; only the level border in the middle has a joint
    quarters = regions_of((0, 15, 0, 30), (0, 15, 30, 60), (15, 30, 0, 30), (15, 30, 30, 60))
    evidence = np.zeros(SHAPE, np.float32)
    evidence[14:16] = 1.2
    bond = gathered(quarters, evidence)
    join_weak(bond)
    found = renumbered(quarters, bond)
    assert [set(np.unique(rows).tolist()) for rows in (found[:15], found[15:])] == [{1}, {3}]


def test_regions_that_were_joined_one_after_another_get_the_last_number():
    bond = Bond(np.zeros(7), {}, {}, {}, joined={3: 2, 2: 1, 5: 4})
    assert renumbered(np.array([[0, 1, 2, 3, 4, 5]]), bond).tolist() == [[0, 1, 1, 1, 4, 4]]


@pytest.mark.parametrize(("chance", "joined"), [(LIKELY + 0.01, False), (LIKELY - 0.01, True)])
def test_a_border_that_is_likely_enough_stays(chance, joined):
    bond = gathered(HALVES)
    bond.weights = np.zeros(len(FEATURES))
    bond.weights[0] = logit(chance)
    join_weak(bond)
    assert set(bond.borders) == ({1} if joined else {1, 2})
