"""Regions fill what joints enclose, their borders lie where they meet, and texture is no joint."""

import numpy as np
import pytest

from survey.clouds.pictures.joints import Strength
from survey.clouds.pictures.regions import borders_of, closed_regions, over_texture


def test_each_cell_of_a_grid_of_joints_is_a_region_though_they_have_gaps():
    evidence = np.zeros((60, 90), np.float32)
    for line in (20, 40):
        evidence[line - 1 : line + 2] = 3.0
    for line in (30, 60):
        evidence[:, line - 1 : line + 2] = 3.0
    evidence[19:22, 12:15] = 0.0
    regions = closed_regions(evidence, np.zeros(evidence.shape, bool))
    cells = [regions[a : a + 20, b : b + 30] for a in (0, 20, 40) for b in (0, 30, 60)]
    usual = [int(np.bincount(cell.ravel()).argmax()) for cell in cells]
    assert sorted(usual) == list(range(1, 10))
    assert (regions > 0).all()
    for cell, number in zip(cells, usual, strict=True):
        assert (cell[3:-3, 3:-3] == number).all()
        assert (cell == number).mean() > 0.85


def test_there_is_no_region_where_there_is_no_wall():
    void = np.zeros((60, 60), bool)
    void[20:40] = True
    regions = closed_regions(np.zeros(void.shape, np.float32), void)
    assert (regions[void] == 0).all()
    assert (regions[~void] > 0).all()
    assert not set(np.unique(regions[:20])) & set(np.unique(regions[40:]))


def test_what_is_measured_along_a_border_is_the_larger_of_both_sides():
    regions = np.array([[1, 1, 2, 2], [1, 1, 2, 2], [3, 3, 3, 3]])
    measure = np.array([[[0, 5, 1, 0], [0, 2, 3, 0], [0, 7, 0, 0]]], np.float32)
    found = borders_of(regions, measure, np.zeros((1, 3, 4), np.float32), np.zeros(regions.shape, bool))
    assert found.pairs.tolist() == [[1, 2], [1, 3], [2, 3]]
    assert found.lengths.tolist() == [2.0, 2.0, 2.0]
    # upright between 1 and 2: the places beyond it are rows 0 and 1 of column 2
    assert found.sums[0].tolist() == [5.0 + 3.0, 0.0 + 1.0, 2.0 + 2.0, 2.0]
    # level below 1 and below 2: columns 0 and 1, and 2 and 3, of row 2; no part of them parts columns
    assert found.sums[1].tolist() == [7.0, 4.0, 0.0 + 1.0, 0.0]
    assert found.sums[2].tolist() == [3.0, 4.0, 2.0 + 3.0, 0.0]


def halves(turned=False, swapped=False):
    regions = np.ones((8, 12), np.int64)
    regions[:, 6:] = 2
    return (3 - regions if swapped else regions).T if turned else (3 - regions if swapped else regions)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("swapped", [False, True])
def test_steps_of_colour_lead_from_the_lower_number_to_the_other(turned, swapped):
    regions = halves(turned, swapped)
    colour = np.where(regions == 2, 5.0, 2.0).astype(np.float32)[None]
    # what lies in the joint itself says nothing
    joint = colour.copy()
    joint[0][(slice(5, 7),) if turned else (slice(None), slice(5, 7))] = 90.0
    found = borders_of(regions, joint, joint, np.zeros(regions.shape, bool))
    assert found.steps.tolist() == [[8.0, 8.0 * 3.0]]


def test_colours_that_are_hidden_on_one_side_count_for_nothing():
    regions = halves()
    hidden = np.zeros(regions.shape, bool)
    hidden[:3, 9] = True  # three pixels beyond the border, and three more from it
    colour = np.where(regions == 2, 5.0, 2.0).astype(np.float32)[None]
    assert borders_of(regions, colour, colour, hidden).steps.tolist() == [[5.0, 5.0 * 3.0]]


@pytest.mark.parametrize("turned", [False, True])
def test_texture_and_joints_are_parted_where_both_vary_least(turned):
    # crests in columns apart from each other: two classes that overlap in number, not in clear groups
    rng = np.random.default_rng(4)
    roots = np.sort(np.concatenate([rng.uniform(0.2, 0.6, 60), rng.uniform(0.5, 1.5, 20)]))
    field = np.zeros((5, 2 * len(roots) + 1), np.float32)
    field[2, 1::2] = roots**2
    values = np.sqrt(field[2, 1::2].astype(np.float64))
    within = [k * values[:k].var() + (80 - k) * values[k:].var() for k in range(1, 80)]
    parted = int(np.argmin(within)) + 1
    field = field.T.copy() if turned else field
    found = over_texture(Strength(field, field, 2.0 * field, field))
    texture = np.median(values[:parted]) ** 2
    # a usual joint is the median of those above, with the last of those below
    joint = np.median(values[parted - 1 :]) ** 2
    assert found.evidence == pytest.approx(
        np.maximum(field - texture, 0.0) / (joint - texture), rel=1e-4, abs=1e-6
    )
    assert found.upright == pytest.approx(field / joint, rel=1e-4)
    assert found.level == pytest.approx(2.0 * field / joint, rel=1e-4)


def test_a_crest_of_two_equal_pixels_counts_once():
    field = np.zeros((5, 61), np.float32)
    field[2, 1::3] = field[2, 2::3] = np.repeat([0.04, 1.0], 10)  # pairs of pixels, ten faint and ten strong
    found = over_texture(Strength(field, field, field, field))
    assert np.unique(found.evidence).tolist() == pytest.approx([0.0, 1.0])
